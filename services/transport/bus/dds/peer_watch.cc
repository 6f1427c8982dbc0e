#include "services/transport/bus/dds/peer_watch.h"

#include <openssl/evp.h>
#include <openssl/hmac.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <iterator>
#include <string_view>
#include <utility>

#include "services/transport/bus/dds/security.h"
#include "services/transport/bus/hex.h"
#include "services/transport/bus/topics.h"
#include "services/transport/keys/key_folder.h"

namespace fulcrum::bus::dds {
namespace {

namespace rtps = eprosima::fastrtps::rtps;
using DiscoveryStatus = rtps::ParticipantDiscoveryInfo::DISCOVERY_STATUS;

constexpr std::string_view kUserDataTag = "fulcrum ";
constexpr std::string_view kPidTag = " (pid ";
// A visible fault (no keys or other keys) is reported after this time: the true leader may appear a little later.
constexpr std::int64_t kLatecomer_ns = 3'000'000'000;
// A handshake takes milliseconds (0.3 s with thirty of them at once on two busy cores); one that lost a message is
// retried after 1 s.
constexpr std::int64_t kLongestHandshake_ns = 5'000'000'000;
// Bounds the memory that unauthenticated participants can cause to be used.
constexpr std::size_t kMostForbidden = 1024;
constexpr std::size_t kLongestName = 80;

std::int64_t NowNs() { return std::chrono::steady_clock::now().time_since_epoch().count(); }

/// Text of an unauthenticated participant, made printable for a log.
std::string Printable(std::string text) {
  text.resize(std::min(text.size(), kLongestName));
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c >= 0x7f; }, '?');
  return text;
}

std::string ProofOf(const std::string& text, std::uint64_t session) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> code{};
  unsigned int size = 0;
  HMAC(EVP_sha256(), &session, sizeof session, reinterpret_cast<const unsigned char*>(text.data()), text.size(),
       code.data(), &size);
  std::uint64_t head = 0;
  std::memcpy(&head, code.data(), sizeof head);
  return Hex(head);
}

/// USER_DATA without its proof.
std::string WithoutProof(const std::string& text) { return text.substr(0, text.rfind(' ')); }

bool HasProof(const std::string& text, std::uint64_t session) {
  const std::string announced = WithoutProof(text);
  return text.size() > announced.size() && text.substr(announced.size() + 1) == ProofOf(announced, session);
}

std::string ValueOf(const rtps::Token& token, std::string_view name) {
  for (const auto& property : token.properties()) {
    if (property.name() == name) return property.value();
  }
  return {};
}

}  // namespace

std::string UserDataOf(const std::string& name, std::uint64_t schema_hash, std::uint64_t session) {
  const std::string text = std::string(kUserDataTag) + Hex(schema_hash) + " " + name + std::string(kPidTag) +
                           std::to_string(getpid()) + ", uid " + std::to_string(getuid()) + ")";
  return text + " " + ProofOf(text, session);
}

PeerWatch::PeerWatch(std::string own_name, std::uint64_t own_hash, const Security& security, std::uint64_t session,
                     std::string leader)
    : own_name_(std::move(own_name)),
      own_hash_(Hex(own_hash)),
      leader_(std::move(leader)),
      security_(security),
      session_(session),
      authority_(security.on() ? "/CN=" + keys::AuthorityName(security.keys) : "") {}

void PeerWatch::on_participant_discovery(eprosima::fastdds::dds::DomainParticipant*,
                                         rtps::ParticipantDiscoveryInfo&& info) {
  const Prefix prefix = info.info.m_guid.guidPrefix;
  const std::lock_guard lock(mutex_);
  if (info.status == DiscoveryStatus::REMOVED_PARTICIPANT || info.status == DiscoveryStatus::DROPPED_PARTICIPANT) {
    Remove(prefix);
    return;
  }
  const auto& bytes = info.info.m_userData;
  const std::string text(bytes.begin(), bytes.end());
  const std::string name = info.info.m_participantName.c_str();
  const std::string authority = ValueOf(info.info.identity_token_, "dds.ca.sn");
  const bool secured = !info.info.identity_token_.class_id().empty();
  if (!security_.on() && !secured) {
    Admit(prefix, text, name);
    return;
  }
  if (peers_.contains(prefix)) return;
  Stranger& stranger = strangers_[prefix];
  if (stranger.since_ns != 0) return;
  stranger = {text, name,    IdentityBehind(prefix, ValueOf(info.info.identity_token_, "dds.cert.sn")),
              "",   NowNs(), text.starts_with(kUserDataTag),
              false};
  if (!security_.on()) return;
  const bool encrypts = (info.info.security_attributes_ & PARTICIPANT_SECURITY_ATTRIBUTES_FLAG_IS_RTPS_PROTECTED) != 0;
  if (!secured) {
    stranger.has = "has no keys";
  } else if (authority != authority_) {
    stranger.has = "has keys of another authority (" + Printable(authority) + ")";
  } else if (encrypts != security_.encrypt) {
    stranger.has = encrypts ? "encrypts, as this cart does not" : "does not encrypt, as this cart does";
  }
  if (!stranger.has.empty()) Refuse(&stranger, stranger.has);
}

void PeerWatch::onParticipantAuthentication(eprosima::fastdds::dds::DomainParticipant*,
                                            rtps::ParticipantAuthenticationInfo&& info) {
  const Prefix prefix = info.guid.guidPrefix;
  const bool authorized = info.status == rtps::ParticipantAuthenticationInfo::AUTHORIZED_PARTICIPANT;
  // This waits for the library's log, so no lock may be held that the log can need.
  const std::string complaint = authorized ? std::string() : LastCertificateComplaint();
  const std::lock_guard lock(mutex_);
  const auto found = strangers_.find(prefix);
  if (found == strangers_.end()) return;
  if (authorized) {
    const Stranger stranger = std::move(found->second);
    strangers_.erase(found);
    const bool guest = AccessRoleOf(stranger.identity) == nullptr;
    Admit(prefix, stranger.text, stranger.name, guest ? stranger.identity : std::string());
    return;
  }
  Refuse(&found->second, complaint.empty() ? "does not authenticate" : "has an unusable certificate: " + complaint);
}

void PeerWatch::on_publisher_discovery(eprosima::fastdds::dds::DomainParticipant*, rtps::WriterDiscoveryInfo&& info) {
  if (info.status != rtps::WriterDiscoveryInfo::DISCOVERED_WRITER) return;
  CheckEndpoint(info.info.guid().guidPrefix, info.info.topicName().c_str(), true);
}

void PeerWatch::on_subscriber_discovery(eprosima::fastdds::dds::DomainParticipant*, rtps::ReaderDiscoveryInfo&& info) {
  if (info.status != rtps::ReaderDiscoveryInfo::DISCOVERED_READER) return;
  CheckEndpoint(info.info.guid().guidPrefix, info.info.topicName().c_str(), false);
}

/// The library matches no endpoint without a right to it, and reports that in its log only.
void PeerWatch::CheckEndpoint(const Prefix& prefix, const std::string& topic, bool writes) {
  if (!security_.on()) return;
  const std::string identity = IdentityBehind(prefix);
  if (identity == kLinkIdentity && std::ranges::find(kLinkTopics, topic) != kLinkTopics.end()) return;
  const AccessRole* role = AccessRoleOf(identity);
  const TopicRole* known = RoleNamed(topic);
  if (role == nullptr) return;  // A guest, see LookAtGuests.
  if (known != nullptr && Contains(writes ? role->writes : role->reads, known->id)) return;
  const std::lock_guard lock(mutex_);
  Forbid(prefix, identity, (writes ? "may not write " : "may not read ") + Printable(topic));
}

void PeerWatch::LookAtGuests() {
  for (const auto& [prefix, guest] : guests_) {
    for (const std::string& what : EndpointComplaints(prefix)) Forbid(prefix, "the guest " + guest, what);
  }
}

void PeerWatch::Forbid(const Prefix& prefix, const std::string& identity, const std::string& what) {
  if (forbidden_.size() >= kMostForbidden || !forbidden_.emplace(prefix, what).second) return;
  ++refusals_.endpoints;
  const auto peer = peers_.find(prefix);
  const std::string pid = peer == peers_.end() ? "" : std::string(kPidTag) + std::to_string(peer->second.pid) + ")";
  Tell(identity + pid + " " + what);
}

void PeerWatch::Admit(const Prefix& prefix, const std::string& text, const std::string& name,
                      const std::string& guest) {
  if (!guest.empty()) guests_[prefix] = guest;
  if (text.size() < kUserDataTag.size() + own_hash_.size() || !text.starts_with(kUserDataTag)) {
    return;  // Another program on this domain.
  }
  const std::string hash = text.substr(kUserDataTag.size(), own_hash_.size());
  const std::size_t name_at = kUserDataTag.size() + hash.size();
  int pid = 0;
  const std::size_t pid_at = text.rfind(kPidTag);
  if (pid_at != std::string::npos) std::sscanf(text.c_str() + pid_at + kPidTag.size(), "%d", &pid);
  // A guest's folder may have no number, or an earlier one: its certificate admits it, and its samples are foreign.
  if (guest.empty() && !HasProof(text, session_)) {
    Stranger& stranger = strangers_[prefix];
    if (stranger.since_ns == 0) stranger = {text, name, "", "", NowNs(), true, false, true};
    Refuse(&stranger, "is of another session");
    return;
  }
  // A guest is known by the name in its keys: it must not pass for a node.
  peers_[prefix] = {guest.empty() ? name : guest, pid};
  living_.insert(prefix);
  if (hash == own_hash_) return;
  if (!guest.empty()) {  // It must not end a session.
    ++refusals_.participants;
    Tell("the guest " + guest + " uses schema " + hash + ", this " + own_name_ + " uses " + own_hash_ +
         ": they exchange nothing");
    return;
  }
  mismatches_[prefix] = "schema mismatch: peer" + WithoutProof(text).substr(name_at) + " uses schema " + hash +
                        ", this " + own_name_ + " uses " + own_hash_ +
                        "; rebuild and restart both from the same sources";
}

void PeerWatch::Remove(const Prefix& prefix) {
  mismatches_.erase(prefix);
  living_.erase(prefix);
  strangers_.erase(prefix);
}

void PeerWatch::Refuse(Stranger* stranger, const std::string& why) {
  if (stranger->counted) return;
  stranger->counted = true;
  stranger->has = why;
  ++refusals_.participants;
  const std::size_t name_at = std::min(stranger->text.size(), kUserDataTag.size() + own_hash_.size() + 1);
  const std::string name = stranger->is_ours ? WithoutProof(stranger->text).substr(name_at) : stranger->name;
  Tell("a participant that calls itself \"" + Printable(name) + "\" " + why);
}

void PeerWatch::Tell(std::string text) {
  if (refusals_.texts.size() < Refusals::kMostTexts) refusals_.texts.push_back(std::move(text));
}

void PeerWatch::LookAtStrangers(std::int64_t now_ns) {
  for (auto& [prefix, stranger] : strangers_) {
    if (stranger.counted || !security_.on()) continue;
    if (const std::string complaint = PermissionsComplaint(prefix); !complaint.empty()) {
      Refuse(&stranger, "has unusable permissions: " + complaint);
    } else if (now_ns - stranger.since_ns > kLongestHandshake_ns) {
      Refuse(&stranger, "does not authenticate");
    }
  }
}

std::string PeerWatch::mismatch() {
  const std::lock_guard lock(mutex_);
  if (!mismatches_.empty()) return mismatches_.begin()->second;
  const std::int64_t now_ns = NowNs();
  LookAtStrangers(now_ns);
  if (own_name_ == leader_) return {};
  // A participant that only claims to be the leader has no effect while the true leader is present.
  const auto is_leader = [&](const auto& entry) { return entry.second.name == leader_; };
  const bool has_leader = std::any_of(living_.begin(), living_.end(), [&](const Prefix& prefix) {
    const auto peer = peers_.find(prefix);
    return peer != peers_.end() && is_leader(*peer);
  });
  if (has_leader) return {};
  const auto found = std::find_if(strangers_.begin(), strangers_.end(),
                                  [&](const auto& entry) { return !entry.second.foreign && is_leader(entry); });
  if (found == strangers_.end()) return {};
  const bool shows = !security_.on() || !found->second.has.empty();
  if (now_ns - found->second.since_ns < (shows ? kLatecomer_ns : kLongestHandshake_ns)) return {};
  if (!security_.on()) {
    return "this cart admits nobody without keys, and this " + own_name_ +
           " has none: name them in the section `security` of its cart file, for fulcrum host with --keys (fulcrum "
           "keys show)";
  }
  return "refused: the " + leader_ + " of this session " + found->second.has + ", as this " + own_name_ +
         " sees it with the keys of " + security_.keys.string() +
         "; both need the same keys and settings, and no revoked identity";
}

Refusals PeerWatch::refusals() {
  const std::lock_guard lock(mutex_);
  LookAtStrangers(NowNs());
  LookAtGuests();
  return refusals_;
}

std::vector<rtps::GuidPrefix_t> PeerWatch::Named(const std::string& name) const {
  const std::lock_guard lock(mutex_);
  std::vector<rtps::GuidPrefix_t> named;
  std::ranges::copy_if(living_, std::back_inserter(named), [&](const Prefix& prefix) {
    const auto peer = peers_.find(prefix);
    return peer != peers_.end() && peer->second.name == name;
  });
  return named;
}

Peer PeerWatch::PeerOf(const Prefix& prefix) const {
  const std::lock_guard lock(mutex_);
  const auto found = peers_.find(prefix);
  return found == peers_.end() ? Peer() : found->second;
}

}  // namespace fulcrum::bus::dds
