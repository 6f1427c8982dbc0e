#include "services/base/runtime/private_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "services/base/core/error.h"
#include "services/base/runtime/file_descriptor.h"

namespace fulcrum::runtime {
namespace {

constexpr mode_t kOthers = 077;

bool WriteAll(int fd, const std::string& text) {
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t n = ::write(fd, text.data() + done, text.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    done += static_cast<std::size_t>(n);
  }
  return ::fsync(fd) == 0;
}

}  // namespace

std::string ReadPrivateFile(const std::filesystem::path& file, std::size_t limit, const std::string& what) {
  const auto fail = [&](const std::string& why) { return InputError(what + " " + file.string() + ": " + why); };
  // O_NONBLOCK: a pipe in place of the file is refused instead of waited for.
  const FileDescriptor fd(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  if (fd.get() < 0) throw fail(::strerror(errno));
  struct stat status {};
  if (::fstat(fd.get(), &status) != 0 || !S_ISREG(status.st_mode)) throw fail("cannot be read; it is no plain file");
  if (status.st_uid != ::geteuid() || (status.st_mode & kOthers) != 0) {
    throw fail("must belong to the user of this program and be readable by that user only; chmod 600 or remove it");
  }
  if (static_cast<std::size_t>(status.st_size) > limit) {
    throw fail("has " + std::to_string(status.st_size) + " bytes; at most " + std::to_string(limit) + " are valid");
  }
  std::string text(static_cast<std::size_t>(status.st_size), '\0');
  const ssize_t size = ::read(fd.get(), text.data(), text.size());
  if (size < 0) throw fail(::strerror(errno));
  text.resize(static_cast<std::size_t>(size));
  return text;
}

void WritePrivateFile(const std::filesystem::path& file, const std::string& text, const std::string& what) {
  std::filesystem::path part = file;
  part += ".part";
  std::error_code ignored;
  if (file.has_parent_path()) MakePrivateFolder(file.parent_path());
  std::filesystem::remove(part, ignored);
  int error = 0;
  {
    // O_EXCL and O_NOFOLLOW: an existing file is never written, and no symbolic link is followed.
    const FileDescriptor fd(::open(part.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600));
    if (fd.get() < 0 || !WriteAll(fd.get(), text)) error = errno;
  }
  if (error == 0 && std::rename(part.c_str(), file.c_str()) != 0) error = errno;
  if (error == 0) return;
  std::filesystem::remove(part, ignored);
  throw InputError(what + " " + file.string() + ": cannot be written: " + ::strerror(error));
}

bool MakePrivateFolder(const std::filesystem::path& folder) {
  std::error_code error;
  if (folder.has_parent_path()) std::filesystem::create_directories(folder.parent_path(), error);
  // Made with its mode, so that no other user can open it in between.
  if (::mkdir(folder.c_str(), 0700) == 0) return true;
  const int reason = errno;
  if (reason == EEXIST && std::filesystem::is_directory(folder, error)) return false;
  throw InputError(folder.string() + ": cannot be made: " + ::strerror(reason) +
                   "; check the permissions of the folder above it");
}

bool NarrowToOwner(const std::filesystem::path& file) {
  struct stat status {};
  const FileDescriptor fd(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  const bool known = fd.get() >= 0 && ::fstat(fd.get(), &status) == 0;
  if (known && (status.st_mode & kOthers) == 0) return false;
  if (known && status.st_uid == ::geteuid() && ::fchmod(fd.get(), status.st_mode & 0700u) == 0) return true;
  throw InputError(file.string() +
                   ": other users can read it, and only its owner can change that; as its owner: chmod 600");
}

}  // namespace fulcrum::runtime
