#include "services/base/runtime/confinement.h"

#include <fcntl.h>
#include <linux/landlock.h>
#include <sched.h>
#include <seccomp.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>

#include "services/base/core/sanitizers.h"

namespace fulcrum::runtime {
namespace {

// ------------------------------------------------------------------------------------------------- files (Landlock)

constexpr std::uint64_t kWriteFile = LANDLOCK_ACCESS_FS_WRITE_FILE;
constexpr std::uint64_t kChange =
    kWriteFile | LANDLOCK_ACCESS_FS_REMOVE_DIR | LANDLOCK_ACCESS_FS_REMOVE_FILE | LANDLOCK_ACCESS_FS_MAKE_CHAR |
    LANDLOCK_ACCESS_FS_MAKE_DIR | LANDLOCK_ACCESS_FS_MAKE_REG | LANDLOCK_ACCESS_FS_MAKE_SOCK |
    LANDLOCK_ACCESS_FS_MAKE_FIFO | LANDLOCK_ACCESS_FS_MAKE_BLOCK | LANDLOCK_ACCESS_FS_MAKE_SYM;
// Not in Debian 12's header: since version 3 of the interface (Linux 6.2).
constexpr int kTruncateVersion = 3;
constexpr std::uint64_t kTruncate = std::uint64_t{1} << 14;

/// Allows `access` to a path; what is no folder takes only the rights of a file. Returns an empty string or a problem.
std::string Allow(int ruleset, const std::filesystem::path& path, std::uint64_t access, std::uint64_t of_file) {
  const int fd = ::open(path.c_str(), O_PATH | O_CLOEXEC);
  struct stat status {};
  if (fd < 0) return errno == ENOENT ? std::string() : path.string() + ": " + std::strerror(errno);
  const bool folder = ::fstat(fd, &status) == 0 && S_ISDIR(status.st_mode);
  landlock_path_beneath_attr rule{};
  rule.allowed_access = folder ? access : access & of_file;
  rule.parent_fd = fd;
  const bool added = ::syscall(SYS_landlock_add_rule, ruleset, LANDLOCK_RULE_PATH_BENEATH, &rule, 0) == 0;
  const int error = errno;
  ::close(fd);
  return added ? std::string() : path.string() + ": " + std::strerror(error);
}

// ------------------------------------------------------------------------------------------- system calls (seccomp)

// By name: some exist on one architecture only.
constexpr std::array kRefused{
    // another program
    "execve", "execveat",
    // memory and files of other processes
    "process_vm_readv", "process_vm_writev", "process_madvise", "pidfd_getfd", "kcmp",
    // mounts, namespaces, files past permissions
    "mount", "umount", "umount2", "pivot_root", "chroot", "setns", "move_mount", "open_tree", "mount_setattr", "fsopen",
    "fsconfig", "fsmount", "fspick", "open_by_handle_at", "quotactl", "quotactl_fd", "swapon", "swapoff", "acct",
    // the kernel
    "bpf", "perf_event_open", "userfaultfd", "init_module", "finit_module", "delete_module", "kexec_load",
    "kexec_file_load", "reboot", "iopl", "ioperm", "personality", "lookup_dcookie", "nfsservctl", "syslog",
    // keys of the kernel
    "keyctl", "add_key", "request_key",
    // another user
    "setuid", "setgid", "setreuid", "setregid", "setresuid", "setresgid", "setgroups", "setfsuid", "setfsgid", "capset",
    // clock and name of the machine
    "clock_settime", "settimeofday", "stime", "sethostname", "setdomainname",
    // calls that no filter sees
    "io_uring_setup", "io_uring_enter", "io_uring_register"};

constexpr std::array kNamespaces{CLONE_NEWNS,   CLONE_NEWCGROUP, CLONE_NEWUTS, CLONE_NEWIPC,
                                 CLONE_NEWUSER, CLONE_NEWPID,    CLONE_NEWNET};

/// A filter in the making; remembers the first error.
class Filter {
 public:
  Filter() : context_(::seccomp_init(SCMP_ACT_ALLOW)), error_(context_ == nullptr ? ENOMEM : 0) {}
  ~Filter() {
    if (context_ != nullptr) ::seccomp_release(context_);
  }
  Filter(const Filter&) = delete;
  Filter& operator=(const Filter&) = delete;

  template <class... Conditions>
  void Refuse(const char* name, int error, const Conditions&... conditions) {
    const int call = ::seccomp_syscall_resolve_name(name);
    if (error_ != 0 || call < 0) return;  // Below 0: unknown to the library, or of another architecture.
    Note(::seccomp_rule_add(context_, SCMP_ACT_ERRNO(static_cast<std::uint16_t>(error)), call, sizeof...(conditions),
                            conditions...));
  }
  void Set(scmp_filter_attr attribute, std::uint32_t value) {
    if (error_ == 0) Note(::seccomp_attr_set(context_, attribute, value));
  }
  /// Returns 0 or the first error of all.
  int Load() {
    if (error_ == 0) Note(::seccomp_load(context_));
    return error_;
  }

 private:
  void Note(int result) { error_ = error_ == 0 && result < 0 ? -result : error_; }

  scmp_filter_ctx context_;
  int error_;
};

scmp_arg_cmp Equals(unsigned argument, std::uint64_t value) { return {argument, SCMP_CMP_EQ, value, 0}; }
scmp_arg_cmp Above(unsigned argument, std::uint64_t value) { return {argument, SCMP_CMP_GT, value, 0}; }
scmp_arg_cmp Has(unsigned argument, std::uint64_t bits, std::uint64_t mask) {
  return {argument, SCMP_CMP_MASKED_EQ, mask, bits};
}

void RefuseSockets(Filter* filter) {
  static_assert(AF_UNIX == 1 && AF_INET == 2 && AF_NETLINK == 16);
  for (std::uint64_t family = 0; family < AF_NETLINK; ++family) {
    if (family != AF_UNIX && family != AF_INET) filter->Refuse("socket", EPERM, Equals(0, family));
  }
  filter->Refuse("socket", EPERM, Above(0, AF_NETLINK));
  constexpr std::uint64_t kTypeMask = 0xf;  // The rest of the argument are flags.
  for (const std::uint64_t type : {SOCK_RAW, SOCK_PACKET}) {
    filter->Refuse("socket", EPERM, Equals(0, AF_INET), Has(1, type, kTypeMask));
  }
}

void RefuseNamespaces(Filter* filter) {
  // The C library falls back to clone, whose flags a filter can read.
  filter->Refuse("clone3", ENOSYS);
  for (const int kind : kNamespaces) {
    const auto bit = static_cast<std::uint64_t>(static_cast<unsigned>(kind));
    filter->Refuse("clone", EPERM, Has(0, bit, bit));
    filter->Refuse("unshare", EPERM, Has(0, bit, bit));
  }
}

}  // namespace

int LandlockVersion() noexcept {
  const long version = ::syscall(SYS_landlock_create_ruleset, nullptr, 0, LANDLOCK_CREATE_RULESET_VERSION);
  return version < 0 ? 0 : static_cast<int>(version);
}

std::string LimitWriting(const WritablePlaces& places) {
  const std::string off = "files may be written wherever the user may: ";
  const int version = LandlockVersion();
  if (version == 0)
    return off + "this kernel has no Landlock (it is in Linux since 5.13, and must be in the list lsm=)";
  const std::uint64_t handled = kChange | (version >= kTruncateVersion ? kTruncate : 0);
  const std::uint64_t of_file = kWriteFile | (handled & kTruncate);
  landlock_ruleset_attr attributes{};
  attributes.handled_access_fs = handled;
  const int ruleset = static_cast<int>(::syscall(SYS_landlock_create_ruleset, &attributes, sizeof(attributes), 0));
  if (ruleset < 0) return off + std::strerror(errno);
  std::string problem;
  for (const auto& folder : places.folders) {
    if (problem.empty()) problem = Allow(ruleset, folder, handled, of_file);
  }
  for (const auto& device : places.devices) {
    if (problem.empty()) problem = Allow(ruleset, device, of_file, of_file);
  }
  if (problem.empty() &&
      (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0 || ::syscall(SYS_landlock_restrict_self, ruleset, 0) != 0)) {
    problem = std::strerror(errno);
  }
  ::close(ruleset);
  return problem.empty() ? std::string() : off + problem;
}

std::string LimitSystemCalls() {
  Filter filter;
  for (const char* call : kRefused) filter.Refuse(call, EPERM);
#if !FULCRUM_SANITIZED
  filter.Refuse("ptrace", EPERM);  // The leak sanitizer traces its own process.
#endif
  RefuseSockets(&filter);
  RefuseNamespaces(&filter);
  filter.Set(SCMP_FLTATR_CTL_NNP, 1);
  filter.Set(SCMP_FLTATR_CTL_TSYNC, 1);
  filter.Set(SCMP_FLTATR_CTL_SSB, 1);       // Older kernels would slow down every thread that has a filter.
  filter.Set(SCMP_FLTATR_CTL_OPTIMIZE, 2);  // A tree instead of a list: calls that no rule names pass in a few steps.
  const int error = filter.Load();
  return error == 0
             ? std::string()
             : std::string("no system call is refused: the kernel took no filter (") + std::strerror(error) + ")";
}

}  // namespace fulcrum::runtime
