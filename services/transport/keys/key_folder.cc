#include "services/transport/keys/key_folder.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>

#include "services/base/core/error.h"

namespace fulcrum::keys {
namespace fs = std::filesystem;
namespace {

constexpr const char* kRemedy = "; make new ones with fulcrum keys init";
// A certificate is valid from a little earlier, because the clocks of two hosts differ.
constexpr std::time_t kClockSlack_s = 300;

std::string Quoted(const fs::path& path) { return path.string(); }

std::string Read(const fs::path& file) {
  const int fd = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) {
    throw InputError(Quoted(file) + ": cannot be read: " + std::strerror(errno) +
                     (errno == ENOENT ? kRemedy : "; it must belong to the user who runs the cart"));
  }
  ::close(fd);
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Throws if users other than the owner can read or change the file or folder.
void CheckPrivate(const fs::path& path, bool folder) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) {
    throw InputError(Quoted(path) + ": " + std::strerror(errno) + kRemedy);
  }
  if (folder && !S_ISDIR(status.st_mode)) throw InputError(Quoted(path) + ": is no folder" + kRemedy);
  if ((status.st_mode & 077u) != 0) {
    std::array<char, 8> mode{};
    std::snprintf(mode.data(), mode.size(), "%04o", status.st_mode & 07777u);
    throw InputError(Quoted(path) + ": is open to others (mode " + mode.data() + "); chmod " +
                     (folder ? "0700 " : "0600 ") + Quoted(path) + "; if another user may have read it, make new keys");
  }
}

void Write(const fs::path& file, const std::string& text) {
  const int fd = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  const bool written = fd >= 0 && ::write(fd, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  const int error = errno;
  if (fd >= 0) ::close(fd);
  if (!written) throw InputError(Quoted(file) + ": cannot be written: " + std::strerror(error));
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

/// A folder is replaced only if it contains nothing but keys.
void RefuseForeignFiles(const fs::path& folder) {
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string extension = entry.path().extension();
    if (entry.is_regular_file() && (extension == ".pem" || extension == ".key" || extension == ".p7s")) continue;
    throw InputError(Quoted(entry.path()) + ": is no key; move it elsewhere, because the whole folder is replaced");
  }
}

bool HasFile(const fs::path& file) {
  std::error_code ignored;
  return fs::exists(file, ignored);
}

}  // namespace

fs::path DefaultKeyFolder() {
  const char* config = std::getenv("XDG_CONFIG_HOME");
  if (config != nullptr && *config != '\0') return fs::path(config) / "fulcrum" / "keys";
  const char* home = std::getenv("HOME");
  return home != nullptr ? fs::path(home) / ".config" / "fulcrum" / "keys" : fs::path("/etc/fulcrum/keys");
}

KeyFiles KeyFilesOf(const fs::path& folder, std::string_view identity, bool encrypt) {
  const std::string name(identity);
  return {folder / "authority.pem", GovernanceFile(folder, encrypt), folder / (name + ".pem"), folder / (name + ".key"),
          folder / (name + ".p7s")};
}

void FillKeyFolder(const fs::path& folder, const Authority& authority, const Validity& validity) {
  Write(folder / "authority.pem", authority.certificate());
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
  const fs::path parent = fs::absolute(folder).lexically_normal().parent_path();
  fs::create_directories(parent, error);
  // Filled under another name and renamed, so that the folder is complete or absent.
  std::string fresh = (parent / ".fulcrum-keys-XXXXXX").string();
  if (::mkdtemp(fresh.data()) == nullptr) {
    throw InputError(Quoted(parent) + ": cannot make a folder there: " + std::strerror(errno));
  }
  try {
    const Validity slack{validity.from - kClockSlack_s, validity.until};
    FillKeyFolder(fresh, Authority(slack), slack);
    if (HasFile(folder)) fs::remove_all(folder);
    fs::rename(fresh, folder);
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
  const bus::AccessRole* role = bus::AccessRoleOf(identity);
  if (role == nullptr) throw InputError("no keys are made for \"" + std::string(identity) + "\"");
  CheckPrivate(folder, true);
  const KeyFiles files = KeyFilesOf(folder, identity, encrypt);
  const std::string authority = Read(files.authority);
  const CertificateFacts issuer = FactsOf(authority, Quoted(files.authority));
  CheckGovernance(folder, encrypt, authority);
  const std::string certificate = Read(files.certificate);
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
  CheckPrivate(files.key, false);
  VerifyKey(Read(files.key), certificate, Quoted(files.key));
  const std::string document = VerifySigned(Read(files.permissions), authority, Quoted(files.permissions));
  if (document != PermissionsXml(*role, facts.validity)) {
    throw InputError(Quoted(files.permissions) + ": gives other rights than this version of Fulcrum needs" + kRemedy +
                     " --force");
  }
  return facts.validity;
}

std::vector<IdentityState> InspectKeyFolder(const fs::path& folder, std::time_t now) {
  CheckPrivate(folder, true);
  const fs::path file = folder / "authority.pem";
  const std::string authority = Read(file);
  VerifyCertificate(authority, authority, now, Quoted(file));
  for (const bool encrypt : {false, true}) CheckGovernance(folder, encrypt, authority);
  std::vector<IdentityState> states;
  for (const bus::AccessRole& role : bus::kAccessRoles) {
    IdentityState state{&role, false, {}, ""};
    const KeyFiles files = KeyFilesOf(folder, role.identity, false);
    state.present = HasFile(files.certificate) || HasFile(files.key) || HasFile(files.permissions);
    try {
      if (state.present) state.validity = CheckIdentity(folder, role.identity, false, now);
    } catch (const InputError& problem) {
      state.problem = problem.what();
    }
    states.push_back(std::move(state));
  }
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
