#include "services/transport/bus/dds/security.h"

#include <fastrtps/rtps/attributes/PropertyPolicy.h>
#include <sys/random.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <fastdds/dds/log/Log.hpp>
#include <fastdds/dds/log/StdoutConsumer.hpp>
#include <fastdds/rtps/flowcontrol/FlowControllerDescriptor.hpp>
#include <fstream>
#include <map>
#include <mutex>
#include <set>
#include <sstream>
#include <utility>

#include "services/base/core/error.h"
#include "services/transport/bus/access.h"
#include "services/transport/bus/dds/chained_transport.h"
#include "services/transport/bus/hex.h"
#include "services/transport/keys/authority.h"
#include "services/transport/keys/key_folder.h"

namespace fulcrum::bus {
namespace {

// Lines: number of the session (16 hexadecimal digits), "open", "sign" or "encrypt", folder of the keys.
constexpr const char* kAnnouncementFile = "session";

struct Announcement {
  std::uint64_t number = 0;
  std::string mode, keys;
};

Announcement ReadAnnouncement(const std::filesystem::path& shared_memory) {
  std::ifstream in(shared_memory / kAnnouncementFile);
  Announcement found;
  std::string number;
  if (std::getline(in, number) && std::getline(in, found.mode) && std::getline(in, found.keys)) {
    found.number = std::strtoull(number.c_str(), nullptr, 16);
  }
  return found;
}

}  // namespace

std::uint64_t AnnounceSession(const std::filesystem::path& shared_memory, const Security& security) {
  std::uint64_t number = 0;
  while (number == 0) {
    if (::getrandom(&number, sizeof number, 0) != sizeof number)
      throw InputError("no random numbers: getrandom failed");
  }
  // Renamed, so that a reader finds this announcement, the earlier one or none.
  const std::filesystem::path file = shared_memory / kAnnouncementFile, part = file.string() + ".part";
  std::ofstream out(part, std::ios::trunc);
  out << Hex(number) << '\n'
      << (!security.on()     ? "open"
          : security.encrypt ? "encrypt"
                             : "sign")
      << '\n'
      << security.keys.string() << '\n';
  out.close();
  std::error_code error;
  std::filesystem::permissions(part, std::filesystem::perms::owner_read | std::filesystem::perms::owner_write, error);
  if (out && !error) std::filesystem::rename(part, file, error);
  if (!out || error) throw InputError(file.string() + ": cannot be written");
  return number;
}

std::uint64_t AnnouncedSession(const std::filesystem::path& shared_memory) {
  return ReadAnnouncement(shared_memory).number;
}

void HandOverSession(const std::filesystem::path& shared_memory, const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::copy_file(shared_memory / kAnnouncementFile, folder / kAnnouncementFile,
                             std::filesystem::copy_options::overwrite_existing, error);
  if (error) throw InputError((folder / kAnnouncementFile).string() + ": cannot be written: " + error.message());
}

Security AnnouncedSecurity(const std::filesystem::path& shared_memory, std::string_view identity) {
  const Announcement found = ReadAnnouncement(shared_memory);
  if (found.number == 0 || found.keys.empty()) return {};
  return {found.keys, std::string(identity), found.mode == "encrypt"};
}

}  // namespace fulcrum::bus

namespace fulcrum::bus::dds {
namespace {

namespace fast = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;

/// Log texts about security, kept until they are read. Bounded, because unauthenticated participants cause them.
class SecurityNotes {
 public:
  void Certificate(std::string text) {
    const std::lock_guard lock(mutex_);
    certificate_ = std::move(text);
  }
  void Permissions(const std::string& prefix, std::string text) {
    const std::lock_guard lock(mutex_);
    constexpr std::size_t kMost = 256;
    if (permissions_.size() < kMost) permissions_[prefix] = std::move(text);
  }
  void Endpoint(const std::string& prefix, std::string text) {
    const std::lock_guard lock(mutex_);
    constexpr std::size_t kMost = 256;
    if (endpoints_.size() < kMost) endpoints_.emplace(prefix, std::move(text));
  }
  [[nodiscard]] std::set<std::string> EndpointsOf(const std::string& prefix) const {
    const std::lock_guard lock(mutex_);
    std::set<std::string> texts;
    for (auto it = endpoints_.lower_bound({prefix, ""}); it != endpoints_.end() && it->first == prefix; ++it) {
      texts.insert(it->second);
    }
    return texts;
  }
  [[nodiscard]] std::string TakeCertificate() {
    const std::lock_guard lock(mutex_);
    return std::exchange(certificate_, {});
  }
  [[nodiscard]] std::string PermissionsOf(const std::string& prefix) const {
    const std::lock_guard lock(mutex_);
    const auto found = permissions_.find(prefix);
    return found == permissions_.end() ? std::string() : found->second;
  }

 private:
  mutable std::mutex mutex_;
  std::string certificate_;
  std::map<std::string, std::string> permissions_;
  std::set<std::pair<std::string, std::string>> endpoints_;  ///< Address and fault.
};

/// One per process, as the library's log is; never destroyed, because that log is written until the process ends.
SecurityNotes& Notes() {
  static SecurityNotes& notes = *new SecurityNotes;
  return notes;
}

/// The text between the first "(" and the last ")".
std::string InBrackets(const std::string& text) {
  const std::size_t from = text.find('('), to = text.rfind(')');
  if (from == std::string::npos || to == std::string::npos || to <= from) return text;
  const std::string inner = text.substr(from + 1, to - from - 1);
  // Permissions that cannot be verified are quoted in full.
  return inner.substr(0, inner.find('\n'));
}

class SecurityLog final : public fast::StdoutConsumer {
 public:
  void Consume(const fast::Log::Entry& entry) override {
    const std::string_view category = entry.context.category;
    const bool told_elsewhere = (category.starts_with("SECURITY") && Note(entry.message)) ||
                                entry.message.starts_with("Problem creating associated ") ||
                                entry.message.starts_with("Security manager returns an error for ");
    if (!told_elsewhere && entry.kind == fast::Log::Kind::Error) {
      fast::StdoutConsumer::Consume(entry);
    }
  }

 private:
  /// @return whether this program reports the text itself, in its own words.
  static bool Note(const std::string& text) {
    constexpr std::string_view kRemote = "Error validating remote permissions for ";
    constexpr std::string_view kDomain = "Error checking remote participant  ";
    if (text.starts_with("Invalidation error of certificate")) {
      Notes().Certificate(InBrackets(text));
      return true;
    }
    for (const std::string_view head : {kRemote, kDomain}) {
      if (!text.starts_with(head)) continue;
      // Format: "…80.1f.….0c|0.0.1.c1 (reason)."
      const std::string prefix = text.substr(head.size(), text.find('|') - head.size());
      Notes().Permissions(prefix, InBrackets(text));
      return true;
    }
    for (const bool writes : {true, false}) {
      const std::string head = std::string("Error checking create remote ") + (writes ? "writer " : "reader ");
      if (!text.starts_with(head)) continue;
      // Format: "…80.1f.….0c|0.0.1.3 (fulcrum/ToolState topic not found in allow rule.)".
      const std::string inner = InBrackets(text);
      Notes().Endpoint(text.substr(head.size(), text.find('|') - head.size()),
                       (writes ? "may not write " : "may not read ") + inner.substr(0, inner.find(' ')));
      return true;
    }
    // An endpoint without a right to its topic: PeerWatch reports those of others, MakeInput and MakeOutput our own.
    return text.starts_with("Error checking creat") || text.find("topic not found in allow rule") != std::string::npos;
  }
};

std::string TextOf(const rtps::GuidPrefix_t& prefix) {
  std::ostringstream text;
  text << prefix;
  return text.str();
}

}  // namespace

std::shared_ptr<DiscoveryGate> ApplySecurity(const Security& security, fast::DomainParticipantQos* qos) {
  keys::CheckIdentity(security.keys, security.identity, security.encrypt, std::time(nullptr));
  const keys::KeyFiles files =
      keys::KeyFilesOf(std::filesystem::absolute(security.keys), security.identity, security.encrypt);
  const auto add = [qos](const char* name, const std::string& value) {
    qos->properties().properties().emplace_back(std::string("dds.sec.") + name, value);
  };
  const auto file = [](const std::filesystem::path& path) { return "file://" + path.string(); };
  add("auth.plugin", "builtin.PKI-DH");
  add("auth.builtin.PKI-DH.identity_ca", file(files.authority));
  add("auth.builtin.PKI-DH.identity_certificate", file(files.certificate));
  add("auth.builtin.PKI-DH.private_key", file(files.key));
  add("auth.builtin.PKI-DH.identity_crl", file(files.revocations));
  add("access.plugin", "builtin.Access-Permissions");
  add("access.builtin.Access-Permissions.permissions_ca", file(files.authority));
  add("access.builtin.Access-Permissions.governance", file(files.governance));
  add("access.builtin.Access-Permissions.permissions", file(files.permissions));
  if (security.encrypt) add("crypto.plugin", "builtin.AES-GCM-GMAC");
  auto gate = std::make_shared<DiscoveryGate>();
  for (auto& transport : qos->transport().user_transports) transport = OneDiscoveryAtATime(std::move(transport), gate);
  ListenToSecurityLog();
  return gate;
}

void BoundPacking(std::int32_t most_B, fast::DomainParticipantQos* qos) {
  auto packing = std::make_shared<eprosima::fastdds::rtps::FlowControllerDescriptor>();
  packing->name = kPacking;
  packing->max_bytes_per_period = most_B;
  packing->period_ms = 1;
  qos->flow_controllers().push_back(packing);
}

std::string IdentityBehind(const rtps::GuidPrefix_t& prefix, const std::string& claimed) {
  static const auto kHeads = [] {
    std::array<keys::AddressHead, kAccessRoles.size()> heads{};
    for (std::size_t i = 0; i < heads.size(); ++i)
      heads[i] = keys::AddressHeadOf(std::string(kAccessRoles[i].identity));
    return heads;
  }();
  for (std::size_t i = 0; i < kHeads.size(); ++i) {
    if (std::equal(kHeads[i].begin(), kHeads[i].end(), prefix.value)) return std::string(kAccessRoles[i].identity);
  }
  constexpr std::string_view kSubject = "/CN=";
  if (!claimed.starts_with(kSubject)) return "?";
  const std::string guest = claimed.substr(kSubject.size());
  if (!keys::IsGuestName(guest)) return "?";
  const keys::AddressHead head = keys::AddressHeadOf(guest);
  return std::equal(head.begin(), head.end(), prefix.value) ? guest : "?";
}

void ListenToSecurityLog() {
  static std::once_flag once;
  std::call_once(once, [] {
    fast::Log::ClearConsumers();
    fast::Log::RegisterConsumer(std::make_unique<SecurityLog>());
    // The library logs the reason for refusing a certificate as a warning only.
    fast::Log::SetVerbosity(fast::Log::Kind::Warning);
  });
}

std::string LastCertificateComplaint() {
  fast::Log::Flush();
  return Notes().TakeCertificate();
}

std::string PermissionsComplaint(const rtps::GuidPrefix_t& prefix) { return Notes().PermissionsOf(TextOf(prefix)); }

std::set<std::string> EndpointComplaints(const rtps::GuidPrefix_t& prefix) {
  return Notes().EndpointsOf(TextOf(prefix));
}

}  // namespace fulcrum::bus::dds
