#include "services/transport/keys/files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iterator>

#include "services/base/core/error.h"

namespace fulcrum::keys {
namespace fs = std::filesystem;

std::string Read(const fs::path& file) {
  const int fd = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) {
    throw InputError(file.string() + ": cannot be read: " + std::strerror(errno) +
                     (errno == ENOENT ? kRemedy : "; it must belong to the user who runs the cart"));
  }
  ::close(fd);
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void CheckPrivate(const fs::path& path, bool folder) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) {
    throw InputError(path.string() + ": " + std::strerror(errno) + kRemedy);
  }
  if (folder && !S_ISDIR(status.st_mode)) throw InputError(path.string() + ": is no folder" + kRemedy);
  if ((status.st_mode & 077u) != 0) {
    std::array<char, 8> mode{};
    std::snprintf(mode.data(), mode.size(), "%04o", status.st_mode & 07777u);
    throw InputError(path.string() + ": is open to others (mode " + mode.data() + "); chmod " +
                     (folder ? "0700 " : "0600 ") + path.string() +
                     "; if another user may have read it, make new keys");
  }
}

namespace {

enum class Owner { kOfFolder, kThisUser };

void Make(const fs::path& file, const std::string& text, Owner owner) {
  const int fd = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  struct stat folder {};
  const bool give =
      fd >= 0 && owner == Owner::kOfFolder && ::geteuid() == 0 && ::stat(file.parent_path().c_str(), &folder) == 0;
  const bool given = !give || ::fchown(fd, folder.st_uid, folder.st_gid) == 0;
  const bool written = fd >= 0 && given && ::write(fd, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  const int error = errno;
  if (fd >= 0) ::close(fd);
  if (!written) throw InputError(file.string() + ": cannot be written: " + std::strerror(error));
}

void MakeAnew(const fs::path& file, const std::string& text, Owner owner) {
  fs::path fresh = file;
  fresh += ".new";
  std::error_code error;
  fs::remove(fresh, error);  // Of a process that was killed here.
  Make(fresh, text, owner);
  fs::rename(fresh, file, error);
  if (!error) return;
  fs::remove(fresh);
  throw InputError(file.string() + ": cannot be replaced: " + error.message());
}

}  // namespace

void Write(const fs::path& file, const std::string& text) { Make(file, text, Owner::kOfFolder); }
void Replace(const fs::path& file, const std::string& text) { MakeAnew(file, text, Owner::kOfFolder); }
void ReplaceOwn(const fs::path& file, const std::string& text) { MakeAnew(file, text, Owner::kThisUser); }

bool HasFile(const fs::path& file) {
  std::error_code ignored;
  return fs::exists(file, ignored);
}

void MakePrivateFolder(const fs::path& folder) {
  if (::mkdir(folder.c_str(), 0700) == 0) return;
  throw InputError(folder.string() + ": cannot be made: " + std::strerror(errno));
}

}  // namespace fulcrum::keys
