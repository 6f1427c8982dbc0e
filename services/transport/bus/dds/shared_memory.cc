#include "services/transport/bus/dds/shared_memory.h"

#include <fcntl.h>
#include <sched.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <time.h>
#include <unistd.h>

#include <bitset>
#include <cctype>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "services/base/core/error.h"

namespace fulcrum::bus {
namespace fs = std::filesystem;
namespace {

/// Low 16 bits of a process id: a participant's GUID contains no more of it.
using ShortPid = std::uint16_t;

constexpr std::string_view kClaim = "owner_";

/// A participant without a session (`replayer --live`) makes the directory first and its files this much later at most
/// (assumed) [s]: a younger directory that is empty stays.
constexpr std::int64_t kLongestJoin_s = 10;

/// Addresses of secured participants, which do not contain the process id, with it: from files "owner_<address>_<pid>".
using Claims = std::vector<std::pair<std::string, ShortPid>>;

Claims ClaimsIn(const fs::path& directory) {
  Claims claims;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(directory, error)) {
    const std::string name = entry.path().filename();
    const std::size_t pid_at = name.rfind('_');
    if (!name.starts_with(kClaim) || pid_at <= kClaim.size()) continue;
    claims.emplace_back(name.substr(kClaim.size(), pid_at - kClaim.size()),
                        static_cast<ShortPid>(std::strtoul(name.c_str() + pid_at + 1, nullptr, 10) & 0xffffu));
  }
  return claims;
}

/// Process of a file. Files are named after the GUID of their endpoint, "..._01.0f.hh.hh.pp.pp.rr.rr.…", with the
/// process id in bytes 4 and 5, little endian; on a secured cart after a claimed address.
std::optional<ShortPid> OwnerOf(const std::string& name, const Claims& claims) {
  for (const auto& [address, pid] : claims) {
    if (name.find(address) != std::string::npos) return pid;
  }
  const std::size_t guid = name.find("01.0f.");
  if (guid == std::string::npos) return std::nullopt;
  unsigned bytes[6];
  if (std::sscanf(name.c_str() + guid, "%2x.%2x.%2x.%2x.%2x.%2x", &bytes[0], &bytes[1], &bytes[2], &bytes[3], &bytes[4],
                  &bytes[5]) != 6) {
    return std::nullopt;
  }
  return static_cast<ShortPid>(bytes[4] | bytes[5] << 8);
}

/// Short ids of all live processes. If a live process has the short id of a dead one, the dead one's files stay until
/// the end of the session; there is no other effect.
std::bitset<65536> LiveProcesses() {
  std::bitset<65536> live;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator("/proc", error)) {
    const std::string name = entry.path().filename();
    if (std::isdigit(static_cast<unsigned char>(name[0]))) live.set(std::stoul(name) & 0xffffu);
  }
  return live;
}

/// Removes the entries whose name meets `condition`: files, sockets and folders with their content.
template <class Condition>
SweepResult RemoveEntries(const fs::path& directory, const Condition& condition) {
  SweepResult result;
  std::error_code error;
  std::vector<fs::path> entries;
  for (const auto& entry : fs::directory_iterator(directory, error)) entries.push_back(entry.path());
  for (const fs::path& entry : entries) {
    struct stat status {};
    if (lstat(entry.c_str(), &status) != 0 || !condition(entry.filename().string())) continue;
    const auto removed = fs::remove_all(entry, error);
    if (error || removed == 0) continue;
    result.files += static_cast<int>(removed);
    result.bytes += static_cast<std::uint64_t>(status.st_blocks) * 512u;
  }
  return result;
}

}  // namespace

fs::path SharedMemoryDirectory(int domain) {
  return "/dev/shm/fulcrum-" + std::to_string(getuid()) + "-" + std::to_string(domain);
}

void PrepareSharedMemory(const fs::path& directory) {
  const std::string name = directory.string();
  if (mkdir(name.c_str(), 0700) != 0 && errno != EEXIST) {
    throw InputError("shared memory: cannot make " + name + ": " + std::strerror(errno));
  }
  struct stat status {};
  if (lstat(name.c_str(), &status) != 0 || !S_ISDIR(status.st_mode) || status.st_uid != getuid() ||
      (status.st_mode & 077) != 0) {
    throw InputError("shared memory: " + name +
                     " must be a directory of this user with mode 0700; remove it or use another domain");
  }
  struct statvfs space {};
  if (statvfs(name.c_str(), &space) != 0) {
    throw InputError("shared memory: cannot determine the free space of " + name + ": " + std::strerror(errno));
  }
  const std::uint64_t free = std::uint64_t{space.f_bavail} * space.f_frsize;
  if (free < kNeededSharedMemory_B) {
    throw InputError("shared memory: " + name + " has " + std::to_string(free >> 20) + " MiB free, at least " +
                     std::to_string(kNeededSharedMemory_B >> 20) +
                     " MiB are needed; free some or mount /dev/shm larger (mount -o remount,size=1G /dev/shm)");
  }
}

void ClaimSharedMemory(const fs::path& directory, const std::string& address) {
  const fs::path claim = directory / (std::string(kClaim) + address + "_" + std::to_string(getpid()));
  const int fd = open(claim.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600);
  if (fd < 0) throw InputError("shared memory: cannot make " + claim.string() + ": " + std::strerror(errno));
  close(fd);
}

void ReserveSharedMemory(const fs::path& directory) {
  const auto own = static_cast<ShortPid>(getpid() & 0xffff);
  const Claims claims = ClaimsIn(directory);
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(directory, error)) {
    if (OwnerOf(entry.path().filename(), claims) != own) continue;
    const int fd = open(entry.path().c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW);
    struct stat status {};
    const bool known = fd >= 0 && fstat(fd, &status) == 0 && S_ISREG(status.st_mode);
    const int failed = known && status.st_size > 0 ? posix_fallocate(fd, 0, status.st_size) : 0;
    if (fd >= 0) close(fd);
    if (failed != 0) {
      throw InputError("shared memory: no room for " + std::to_string(status.st_size >> 10) + " KiB in " +
                       directory.string() + ": " + std::strerror(failed));
    }
  }
}

WorkingIn::WorkingIn(const fs::path& directory) : before_(open(".", O_PATH | O_DIRECTORY | O_CLOEXEC)) {
  // Gives this thread a current directory of its own. Where that is not permitted, the directory of the whole process
  // changes for a moment.
  unshare(CLONE_FS);
  if (before_ >= 0 && chdir(directory.c_str()) != 0) {
    close(before_);
    before_ = -1;
  }
}

WorkingIn::~WorkingIn() {
  if (before_ < 0) return;
  [[maybe_unused]] const int ignored = fchdir(before_);  // All our paths are absolute by now.
  close(before_);
}

SweepResult SweepSharedMemory(const fs::path& directory) {
  const Claims claims = ClaimsIn(directory);
  // Looked up after the files: a process that begins in between would have files and count as dead.
  std::optional<std::bitset<65536>> live;
  return RemoveEntries(directory, [&](const std::string& name) {
    if (!live) live = LiveProcesses();
    const auto owner = OwnerOf(name, claims);
    return owner && !live->test(*owner);
  });
}

SweepResult ClearSharedMemory(const fs::path& directory) {
  struct stat status {};
  if (lstat(directory.c_str(), &status) != 0 || !S_ISDIR(status.st_mode) || status.st_uid != getuid()) return {};
  const auto live = LiveProcesses();
  const Claims claims = ClaimsIn(directory);
  // While a participant lives there (nodes without a supervisor, a host in another network namespace), what belongs to
  // no single process stays: announcement, keys and sockets may be its.
  std::error_code error;
  bool inhabited = false;
  for (const auto& entry : fs::directory_iterator(directory, error)) {
    const auto owner = OwnerOf(entry.path().filename(), claims);
    inhabited |= owner && live.test(*owner);
  }
  const SweepResult result = RemoveEntries(directory, [&](const std::string& name) {
    const auto owner = OwnerOf(name, claims);
    return owner ? !live.test(*owner) : !inhabited;
  });
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  if (result.files > 0 || now.tv_sec - status.st_mtim.tv_sec > kLongestJoin_s) rmdir(directory.c_str());
  return result;
}

fs::path OpenSharedMemory(int domain, const Security& security) {
  fs::path directory = SharedMemoryDirectory(domain);
  ClearSharedMemory(directory);
  PrepareSharedMemory(directory);
  AnnounceSession(directory, security);
  return directory;
}

SweepResult RemoveSharedMemory(const fs::path& directory) {
  const SweepResult result = RemoveEntries(directory, [](const std::string&) { return true; });
  rmdir(directory.c_str());
  return result;
}

}  // namespace fulcrum::bus
