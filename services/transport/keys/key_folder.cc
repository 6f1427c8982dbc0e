#include "services/transport/keys/key_folder.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "services/base/core/error.h"
#include "services/transport/keys/files.h"

namespace fulcrum::keys {
namespace fs = std::filesystem;
namespace {

// Names of files of the folder that belong to no identity.
constexpr std::array<std::string_view, 4> kOtherFiles{"authority", "governance", "governance-encrypted", "revoked"};
constexpr std::size_t kLongestGuestName = 32;

std::string Quoted(const fs::path& path) { return path.string(); }

/// The folder without "/" at its end.
fs::path Plain(const fs::path& folder) {
  const fs::path plain = fs::absolute(folder).lexically_normal();
  return plain.has_filename() ? plain : plain.parent_path();
}

fs::path GovernanceFile(const fs::path& folder, bool encrypt) {
  return folder / (encrypt ? "governance-encrypted.p7s" : "governance.p7s");
}

void CheckGovernance(const fs::path& folder, bool encrypt, const std::string& authority) {
  const fs::path file = GovernanceFile(folder, encrypt);
  if (VerifySigned(Read(file), authority, Quoted(file)) != GovernanceXml(encrypt)) {
    throw InputError(Quoted(file) + ": was made by another version of Fulcrum" + kRemedy + " --force");
  }
}

/// The role of an identity, with the rights that its permissions must give. For a guest they are what the authority has
/// signed.
bus::AccessRole RightsOf(std::string_view identity, const KeyFiles& files, const Validity& validity) {
  const std::string document = VerifySigned(Read(files.permissions), Read(files.authority), Quoted(files.permissions));
  if (const bus::AccessRole* role = bus::AccessRoleOf(identity)) {
    if (document == PermissionsXml(*role, validity)) return *role;
    throw InputError(Quoted(files.permissions) + ": gives other rights than this version of Fulcrum needs" + kRemedy +
                     " --force");
  }
  if (const auto rights = RightsIn(document, identity, validity)) return *rights;
  throw InputError(Quoted(files.permissions) +
                   ": gives rights that this version of Fulcrum does not know; revoke the guest and issue it again");
}

/// Checks all of an identity but its private key. @return its certificate.
std::string CheckCertificate(const KeyFiles& files, std::string_view identity, std::time_t now) {
  const std::string authority = Read(files.authority);
  const CertificateFacts issuer = FactsOf(authority, Quoted(files.authority));
  std::string certificate = Read(files.certificate);
  const std::string what = Quoted(files.certificate);
  const CertificateFacts facts = FactsOf(certificate, what);
  if (now < facts.validity.from || now > facts.validity.until) {
    throw InputError(what + ": is valid from " + DateOf(facts.validity.from) + " until " +
                     DateOf(facts.validity.until) + ", and today is " + DateOf(now) +
                     "; set the clock right, or make new keys with fulcrum keys "
                     "init --force");
  }
  if (facts.issuer != issuer.subject) {
    throw InputError(what + ": is of \"" + facts.issuer + "\", but " + Quoted(files.authority) + " is \"" +
                     issuer.subject + "\"; keys of two folders were mixed: copy one folder whole");
  }
  VerifyCertificate(certificate, authority, now, what);
  if (facts.subject != identity) {
    throw InputError(what + ": was issued to \"" + facts.subject + "\", not to \"" + std::string(identity) + "\"");
  }
  if (IsRevoked(certificate, Read(files.revocations), authority, Quoted(files.revocations))) {
    throw InputError(what + ": was revoked (" + Quoted(files.revocations) + "); " +
                     (bus::AccessRoleOf(identity) != nullptr ? "make new keys with fulcrum keys init --force"
                                                             : "issue it again with fulcrum keys issue"));
  }
  return certificate;
}

/// A folder is replaced only if it contains nothing but keys.
void RefuseForeignFiles(const fs::path& folder) {
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string extension = entry.path().extension();
    if (entry.is_regular_file() && (extension == ".pem" || extension == ".key" || extension == ".p7s")) continue;
    throw InputError(Quoted(entry.path()) + ": is no key; move it elsewhere, because the whole folder is replaced");
  }
}

}  // namespace

fs::path DefaultKeyFolder() {
  const char* config = std::getenv("XDG_CONFIG_HOME");
  if (config != nullptr && *config != '\0') return fs::path(config) / "fulcrum" / "keys";
  const char* home = std::getenv("HOME");
  return home != nullptr ? fs::path(home) / ".config" / "fulcrum" / "keys" : fs::path("/etc/fulcrum/keys");
}

fs::path AuthorityKeyFile(const fs::path& folder) { return Plain(folder) += ".authority"; }

bool IsGuestName(std::string_view name) {
  const auto is_allowed = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  };
  return !name.empty() && name.size() <= kLongestGuestName && std::ranges::all_of(name, is_allowed) &&
         bus::AccessRoleOf(name) == nullptr && std::ranges::find(kOtherFiles, name) == kOtherFiles.end();
}

KeyFiles KeyFilesOf(const fs::path& folder, std::string_view identity, bool encrypt) {
  const std::string name(identity);
  return {folder / "authority.pem", GovernanceFile(folder, encrypt), folder / (name + ".pem"),
          folder / (name + ".key"), folder / (name + ".p7s"),        folder / "revoked.pem"};
}

void FillKeyFolder(const fs::path& folder, const Authority& authority, const Validity& validity) {
  Write(folder / "authority.pem", authority.certificate());
  Write(folder / "revoked.pem", authority.NewRevocations());
  for (const bool encrypt : {false, true}) {
    Write(GovernanceFile(folder, encrypt), authority.Sign(GovernanceXml(encrypt)));
  }
  for (const bus::AccessRole& role : bus::kAccessRoles) {
    const KeyFiles files = KeyFilesOf(folder, role.identity, false);
    const Identity identity = authority.Issue(std::string(role.identity), validity);
    Write(files.certificate, identity.certificate);
    Write(files.key, identity.key);
    Write(files.permissions, authority.Sign(PermissionsXml(role, validity)));
  }
}

void MakeKeyFolder(const fs::path& folder, const Validity& validity, bool force) {
  std::error_code error;
  const bool known = HasFile(folder / "authority.pem");
  if (known && force) RefuseForeignFiles(folder);
  if (known && !force) {
    throw InputError(Quoted(folder) +
                     ": has keys already; see fulcrum keys show. --force replaces them all: every host of the cart "
                     "then needs the new ones");
  }
  if (!known && HasFile(folder) && !fs::is_empty(folder, error)) {
    throw InputError(Quoted(folder) + ": is not empty and holds no keys; give a new or empty folder");
  }
  const fs::path parent = Plain(folder).parent_path();
  fs::create_directories(parent, error);
  // Filled under another name and renamed, so that the folder is complete or absent.
  std::string fresh = (parent / ".fulcrum-keys-XXXXXX").string();
  if (::mkdtemp(fresh.data()) == nullptr) {
    throw InputError(Quoted(parent) + ": cannot make a folder there: " + std::strerror(errno));
  }
  try {
    const Validity slack{validity.from - kClockSlack_s, validity.until};
    const Authority authority(slack);
    FillKeyFolder(fresh, authority, slack);
    if (HasFile(folder)) fs::remove_all(folder);
    fs::rename(fresh, Plain(folder));
    ReplaceOwn(AuthorityKeyFile(folder), authority.private_key());
  } catch (const fs::filesystem_error& failed) {
    fs::remove_all(fresh, error);
    throw InputError(failed.what());
  } catch (...) {
    fs::remove_all(fresh, error);
    throw;
  }
}

std::string AuthorityName(const fs::path& folder) {
  const fs::path file = folder / "authority.pem";
  return FactsOf(Read(file), Quoted(file)).subject;
}

Validity CheckIdentity(const fs::path& folder, std::string_view identity, bool encrypt, std::time_t now) {
  if (bus::AccessRoleOf(identity) == nullptr && !IsGuestName(identity)) {
    throw InputError("no keys are made for \"" + std::string(identity) + "\"");
  }
  CheckPrivate(folder, true);
  const KeyFiles files = KeyFilesOf(folder, identity, encrypt);
  CheckGovernance(folder, encrypt, Read(files.authority));
  const std::string certificate = CheckCertificate(files, identity, now);
  CheckPrivate(files.key, false);
  VerifyKey(Read(files.key), certificate, Quoted(files.key));
  const Validity validity = FactsOf(certificate, Quoted(files.certificate)).validity;
  (void)RightsOf(identity, files, validity);
  return validity;
}

namespace {

/// Names of the guests whose certificates are in the folder, in order.
std::vector<std::string> GuestsIn(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().stem();
    if (entry.path().extension() == ".pem" && IsGuestName(name)) names.push_back(name);
  }
  std::ranges::sort(names);
  return names;
}

IdentityState StateOf(const fs::path& folder, const std::string& identity, std::time_t now) {
  IdentityState state;
  state.identity = identity;
  const KeyFiles files = KeyFilesOf(folder, identity, false);
  const bus::AccessRole* role = bus::AccessRoleOf(identity);
  state.guest = role == nullptr;
  state.has_key = HasFile(files.key);
  state.present = HasFile(files.certificate) || state.has_key || HasFile(files.permissions);
  if (role != nullptr) {
    state.writes = role->writes;
    state.reads = role->reads;
  }
  if (!state.present) return state;
  try {
    const std::string certificate = Read(files.certificate);
    state.validity = FactsOf(certificate, Quoted(files.certificate)).validity;
    state.revoked = IsRevoked(certificate, Read(files.revocations), Read(files.authority), Quoted(files.revocations));
    if (state.guest) {
      const bus::AccessRole rights = RightsOf(identity, files, state.validity);
      state.writes = rights.writes;
      state.reads = rights.reads;
    }
    // The key of a guest may have been handed over.
    if (state.guest && !state.has_key) {
      (void)CheckCertificate(files, identity, now);
    } else {
      (void)CheckIdentity(folder, identity, false, now);
    }
  } catch (const InputError& problem) {
    state.problem = problem.what();
  }
  return state;
}

}  // namespace

std::vector<IdentityState> InspectKeyFolder(const fs::path& folder, std::time_t now) {
  CheckPrivate(folder, true);
  const fs::path file = folder / "authority.pem";
  const std::string authority = Read(file);
  VerifyCertificate(authority, authority, now, Quoted(file));
  for (const bool encrypt : {false, true}) CheckGovernance(folder, encrypt, authority);
  std::vector<IdentityState> states;
  states.reserve(bus::kAccessRoles.size());
  for (const bus::AccessRole& role : bus::kAccessRoles) {
    states.push_back(StateOf(folder, std::string(role.identity), now));
  }
  for (const std::string& guest : GuestsIn(folder)) states.push_back(StateOf(folder, guest, now));
  return states;
}

std::string DateOf(std::time_t time) {
  std::tm parts{};
  ::gmtime_r(&time, &parts);
  std::array<char, 16> text{};
  std::strftime(text.data(), text.size(), "%Y-%m-%d", &parts);
  return text.data();
}

}  // namespace fulcrum::keys
