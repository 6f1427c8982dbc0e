#include "services/transport/keys/issuing.h"

#include <algorithm>
#include <ctime>
#include <string_view>

#include "services/base/core/error.h"
#include "services/transport/bus/topics.h"
#include "services/transport/keys/files.h"

namespace fulcrum::keys {
namespace fs = std::filesystem;
namespace {

std::string ValidTopics() {
  std::string text;
  for (const bus::TopicRole& role : bus::kTopicRoles) {
    text += text.empty() ? "" : ", ";
    text += bus::TopicLabel(role.id);
  }
  return text;
}

/// The topic's id by its name without "fulcrum/".
const bus::TopicRole* TopicLabelled(std::string_view label) {
  const auto* role = std::ranges::find_if(
      bus::kTopicRoles, [label](const bus::TopicRole& known) { return bus::TopicLabel(known.id) == label; });
  return role == bus::kTopicRoles.end() ? nullptr : role;
}

bool RevokedIn(const KeyFiles& files, const std::string& certificate) {
  return IsRevoked(certificate, Read(files.revocations), Read(files.authority), files.revocations.string());
}

void RefuseLivingIdentity(const KeyFiles& files, const std::string& name, std::time_t now) {
  if (!HasFile(files.certificate)) return;
  const std::string certificate = Read(files.certificate);
  const Validity validity = FactsOf(certificate, files.certificate.string()).validity;
  if (validity.until < now || RevokedIn(files, certificate)) return;
  throw InputError("\"" + name + "\" has an identity until " + DateOf(validity.until) + " (" +
                   files.certificate.string() + "); revoke it first: fulcrum keys revoke " + name);
}

/// Makes the folder that is handed over to a guest, without its identity.
void MakeGuestFolder(const fs::path& folder, const fs::path& out) {
  MakePrivateFolder(out);
  for (const char* name : {"authority.pem", "governance.p7s", "governance-encrypted.p7s", "revoked.pem"}) {
    Write(out / name, Read(folder / name));
  }
}

}  // namespace

void MakeSessionKeys(const fs::path& folder, const Validity& validity) {
  RemoveSessionKeys(folder);
  MakePrivateFolder(folder);
  const Validity slack{validity.from - kClockSlack_s, validity.until};
  const Authority authority(slack);
  FillKeyFolder(folder, authority, slack);
  Write(AuthorityKeyFile(folder), authority.private_key());
}

void RemoveSessionKeys(const fs::path& folder) noexcept {
  std::error_code ignored;
  fs::remove_all(folder, ignored);
  fs::remove(AuthorityKeyFile(folder), ignored);
}

Authority OpenAuthority(const fs::path& folder) {
  const fs::path file = AuthorityKeyFile(folder);
  const std::string certificate = Read(folder / "authority.pem");
  if (!HasFile(file)) {
    throw InputError(file.string() +
                     ": the private key of the authority is not here, so nothing can be issued or revoked; run this on "
                     "the machine that has it, or make new keys with fulcrum keys init --force");
  }
  CheckPrivate(file, false);
  return {certificate, Read(file), file.string()};
}

bus::TopicSet TopicsNamed(const std::string& list, const std::string& option) {
  bus::TopicSet set = 0;
  std::size_t from = 0;
  while (from <= list.size()) {
    const std::size_t to = std::min(list.find(',', from), list.size());
    const std::string label = list.substr(from, to - from);
    const bus::TopicRole* topic = TopicLabelled(label);
    if (topic == nullptr) {
      std::string message = option;
      message.append(" ").append(list).append(": no topic \"").append(label);
      throw InputError(message.append("\"; valid, separated by commas: ").append(ValidTopics()));
    }
    set |= bus::SetOf(topic->id);
    from = to + 1;
  }
  return set;
}

Validity IssueGuest(const fs::path& folder, const GuestOrder& order) {
  if (!IsGuestName(order.name)) {
    throw InputError("\"" + order.name +
                     "\": is no name for a guest; valid: 1 to 32 of a-z, 0-9, _ and -, but no participant of the cart "
                     "(fulcrum keys show lists them) and not authority, governance, governance-encrypted or revoked");
  }
  if (order.writes == 0 && order.reads == 0) {
    throw InputError("\"" + order.name + "\": may neither read nor write; give --read or --write");
  }
  CheckPrivate(folder, true);
  const Authority authority = OpenAuthority(folder);
  const KeyFiles files = KeyFilesOf(folder, order.name, false);
  RefuseLivingIdentity(files, order.name, order.validity.from);
  const Validity longest = FactsOf(authority.certificate(), files.authority.string()).validity;
  const Validity validity{std::max(order.validity.from - kClockSlack_s, longest.from),
                          std::min(order.validity.until, longest.until)};
  if (!order.out.empty()) MakeGuestFolder(folder, order.out);
  const Identity identity = authority.Issue(order.name, validity);
  const std::string permissions = authority.Sign(PermissionsXml({order.name, order.writes, order.reads}, validity));
  // The folder of the cart keeps certificate and permissions also of a key that is handed over: for revoke and show.
  Replace(files.certificate, identity.certificate);
  Replace(files.permissions, permissions);
  std::error_code ignored;
  fs::remove(files.key, ignored);  // Of a revoked or expired certificate.
  if (order.out.empty()) {
    Write(files.key, identity.key);
  } else {
    const KeyFiles theirs = KeyFilesOf(order.out, order.name, false);
    Write(theirs.certificate, identity.certificate);
    Write(theirs.permissions, permissions);
    Write(theirs.key, identity.key);
  }
  return validity;
}

void Revoke(const fs::path& folder, const std::string& identity) {
  if (bus::AccessRoleOf(identity) == nullptr && !IsGuestName(identity)) {
    throw InputError("\"" + identity + "\": is no identity; fulcrum keys show lists those of the folder");
  }
  CheckPrivate(folder, true);
  const Authority authority = OpenAuthority(folder);
  const KeyFiles files = KeyFilesOf(folder, identity, false);
  if (!HasFile(files.certificate)) {
    throw InputError(files.certificate.string() + ": is not there, so there is nothing to revoke; fulcrum keys show " +
                     folder.string() + " lists the identities");
  }
  const std::string certificate = Read(files.certificate);
  if (RevokedIn(files, certificate)) throw InputError(files.certificate.string() + ": is revoked already");
  Replace(files.revocations, authority.Revoke(Read(files.revocations), certificate, files.revocations.string()));
}

}  // namespace fulcrum::keys
