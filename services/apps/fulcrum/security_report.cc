#include "services/apps/fulcrum/security_report.h"

#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <string>
#include <vector>

#include "services/apps/fulcrum/commands.h"
#include "services/apps/fulcrum/process_rights.h"
#include "services/base/config/cart.h"
#include "services/base/core/error.h"
#include "services/base/runtime/confinement.h"
#include "services/session/supervisor/domain_guard.h"
#include "services/transport/bus/dds/shared_memory.h"
#include "services/transport/bus/security.h"
#include "services/transport/keys/key_folder.h"

namespace fulcrum::supervisor::cli {
namespace {

namespace fs = std::filesystem;

enum class Mark { kOn, kOff, kLook };

struct Line {
  Mark mark;
  std::string what, found, meaning;
};

std::string Octal(unsigned mode) {
  char text[8];
  std::snprintf(text, sizeof(text), "%04o", mode);
  return text;
}

std::string FirstLine(const fs::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  return line;
}

/// Keys that the cart file names.
Line KeysOfCart(const fs::path& file) {
  const std::string what = "keys of the cart";
  const std::string none = "sessions use no lasting keys: tools of other machines and users cannot be admitted by name";
  if (file.empty() || !fs::exists(file)) return {Mark::kOff, what, "no cart file", none};
  try {
    const config::CartConfig cart = config::LoadCart(file);
    const fs::path keys = cart.security.keys;
    if (keys.empty()) return {Mark::kOff, what, file.string() + " names none", none};
    std::string problems;
    std::size_t usable = 0, revoked = 0;
    for (const keys::IdentityState& state : keys::InspectKeyFolder(keys, std::time(nullptr))) {
      if (!state.present) continue;
      if (state.guest && state.revoked) {  // As it was ordered; `fulcrum keys check` does not complain either.
        ++revoked;
      } else if (state.problem.empty()) {
        ++usable;
      } else {
        problems += (problems.empty() ? "" : "; ") + state.problem;
      }
    }
    struct stat status {};
    const unsigned mode = ::stat(keys.c_str(), &status) == 0 ? status.st_mode & 0777u : 0;
    if ((mode & 077u) != 0) problems += (problems.empty() ? "" : "; ") + ("mode " + Octal(mode));
    if (!problems.empty()) {
      return {Mark::kLook, what, keys.string() + ": " + problems,
              "participants with these keys cannot join, or other users can read them: fulcrum keys check"};
    }
    const std::string guests = revoked > 0 ? ", " + std::to_string(revoked) + " revoked" : "";
    return {Mark::kOn, what,
            keys.string() + ": " + std::to_string(usable) + " identities" + guests + ", mode " + Octal(mode),
            std::string("a participant without a certificate of this authority gets no topic") +
                (cart.security.encrypt ? "; datagrams are encrypted" : "")};
  } catch (const InputError& error) {
    return {Mark::kLook, what, error.what(), "no session starts with this cart file"};
  }
}

Line Bus(int domain) {
  const std::string what = "bus of the session";
  if (const std::string other = DomainGuard::OtherUsers(domain); !other.empty()) {
    return {Mark::kOff, what, other, "run this as its user: only that user can see what protects it"};
  }
  if (!DomainGuard::IsHeld(domain)) {
    return {Mark::kOff, what, "no session runs in domain " + std::to_string(domain), "nothing to protect now"};
  }
  const bus::Security security = bus::AnnouncedSecurity(bus::SharedMemoryDirectory(domain), "fulcrum");
  if (!security.on()) {
    return {Mark::kLook, what, "open: no keys",
            "every process on this machine, of any user, can read the small topics and write them"};
  }
  return {Mark::kOn, what, "keys in " + security.keys.string() + (security.encrypt ? ", encrypted" : ""),
          security.encrypt ? "strangers are refused, and cannot listen or forge datagrams"
                           : "strangers are refused; forged datagrams lack the number of the session and are dropped"};
}

Line Memory(int domain) {
  const std::string what = "shared memory";
  const fs::path folder = bus::SharedMemoryDirectory(domain);
  struct stat status {};
  if (::lstat(folder.c_str(), &status) != 0) {
    return {Mark::kOff, what, folder.string() + " does not exist", "it is made at the start of a session, mode 0700"};
  }
  const unsigned mode = status.st_mode & 0777u;
  if (!S_ISDIR(status.st_mode) || status.st_uid != ::getuid() || (mode & 077u) != 0) {
    return {Mark::kLook, what, folder.string() + ": mode " + Octal(mode) + ", user " + std::to_string(status.st_uid),
            "other users can read or replace tissue and heat; sessions refuse to start: remove it"};
  }
  if (!DomainGuard::IsHeld(domain)) {
    return {Mark::kLook, what, folder.string() + " was left by a killed session",
            "it may hold keys of that session; the next fulcrum up removes it"};
  }
  return {Mark::kOn, what, folder.string() + ", mode 0700", "only this user can open the large topics"};
}

std::vector<Line> Switches(const std::vector<ProcessRights>& processes) {
  struct Switch {
    const char* option;
    const char* meaning;
  };
  constexpr Switch kSwitches[] = {
      {"--open-bus", "every process on this machine can read and write the topics of that session"},
      {"--insecure-link", "whoever reaches the link's port on the network can read and write topics"},
      {"--allow-swap-command", "whoever may command that session can start any program as this user"}};
  std::vector<Line> lines;
  for (const ProcessRights& process : processes) {
    for (const Switch& one : kSwitches) {
      if (process.Has(one.option)) {
        lines.push_back({Mark::kLook, "option", "fulcrum (pid " + std::to_string(process.pid) + ") has " + one.option,
                         one.meaning});
      }
    }
  }
  return lines;
}

Line Console(const std::vector<ProcessRights>& processes) {
  const std::string what = "console";
  const auto console = std::find_if(processes.begin(), processes.end(),
                                    [](const ProcessRights& p) { return p.name == "fulcrum" && p.Has("console"); });
  if (console == processes.end()) return {Mark::kOff, what, "none runs", "nobody reaches a session by a browser"};
  const std::string address = console->ValueOf("--bind");
  const std::string pid = " (pid " + std::to_string(console->pid) + ")";
  if (address.empty() || address.starts_with("127.") || address == "::1") {
    return {Mark::kOn, what, "loopback only" + pid, "who logs in on this machine and has the token can operate it"};
  }
  return {Mark::kLook, what, "listens on " + address + pid,
          "everybody on that network can try; only the token in its address protects it"};
}

Line Kernel(bool on, const std::string& what, const std::string& version, const std::string& protects,
            const std::string& without) {
  return {on ? Mark::kOn : Mark::kLook, what, on ? version : "not offered by this kernel", on ? protects : without};
}

std::vector<Line> Nodes(const std::vector<ProcessRights>& processes, int domain) {
  std::vector<Line> lines;
  for (const ProcessRights& process : processes) {
    if (process.name == "fulcrum" || process.ValueOf("--domain") != std::to_string(domain)) continue;
    char rights[24];
    std::snprintf(rights, sizeof(rights), "%llx", static_cast<unsigned long long>(process.capabilities));
    const bool confined = process.filtered && process.no_new_privileges;
    std::string found = "pid " + std::to_string(process.pid) +
                        (process.filtered ? ": system calls filtered" : ": no filter of system calls") +
                        (process.no_new_privileges ? ", no new privileges" : "");
    if (process.capabilities != 0) found += std::string(", capabilities ") + rights;
    const Mark mark = confined && process.capabilities == 0 ? Mark::kOn : Mark::kLook;
    lines.push_back({mark, process.name, found,
                     mark == Mark::kOn ? "a fault in it starts no program and reaches no other process"
                     : !confined       ? "a fault in it may do what its user may, other programs included"
                                       : "a fault in it has rights of the administrator, within the filter"});
  }
  if (lines.empty()) {
    lines.push_back({Mark::kOff, "nodes", "none of this user runs in domain " + std::to_string(domain),
                     "their filters can be seen only while they run"});
  }
  return lines;
}

Line Units() {
  const std::string what = "services";
  const fs::path settings = "/lib/systemd/system/fulcrum-.service.d/10-fulcrum.conf";
  std::error_code error;
  if (!fs::exists(settings, error)) {
    return {Mark::kOff, what, "not installed", "nodes run with the rights of whoever starts fulcrum up"};
  }
  std::string changed;
  for (const auto& entry : fs::directory_iterator("/etc/systemd/system", error)) {
    const std::string name = entry.path().filename();
    if (name.starts_with("fulcrum-") && name.ends_with(".d")) changed += " " + entry.path().string();
  }
  if (changed.empty())
    return {Mark::kOn, what, "installed, unchanged", "units limit files, devices, addresses and calls"};
  return {Mark::kLook, what, "changed by" + changed, "a setting there may take a restriction away: read it"};
}

Line Umask() {
  const unsigned mask = ::umask(0);
  ::umask(mask);
  const std::string found = "umask " + Octal(mask);
  if ((mask & 022u) != 022u) {
    return {Mark::kLook, "new files", found, "other users can change session folders: umask 077"};
  }
  if ((mask & 077u) != 077u) {
    return {Mark::kOff, "new files", found, "other users can read logs and pictures of sessions: umask 077"};
  }
  return {Mark::kOn, "new files", found, "only this user reads sessions"};
}

Line CoreDumps() {
  rlimit limit{};
  ::getrlimit(RLIMIT_CORE, &limit);
  if (limit.rlim_cur == 0) return {Mark::kOn, "core dumps", "off", "no crash writes keys of the bus to the disk"};
  return {Mark::kOff, "core dumps", "on: " + FirstLine("/proc/sys/kernel/core_pattern"),
          "a crash writes the memory of a node, its private key included, there: ulimit -c 0"};
}

Line Tracing() {
  const std::string scope = FirstLine("/proc/sys/kernel/yama/ptrace_scope");
  if (!scope.empty() && scope != "0") {
    return {Mark::kOn, "tracing", "ptrace_scope " + scope, "a process cannot read the keys in a node of the same user"};
  }
  return {Mark::kOff, "tracing", scope.empty() ? "this kernel has no Yama" : "ptrace_scope 0",
          "every process of this user can read the keys in a node: sysctl -w kernel.yama.ptrace_scope=1"};
}

Line User() {
  if (::geteuid() != 0) return {Mark::kOn, "user", "not root", "a fault reaches what this user owns"};
  return {Mark::kLook, "user", "root", "sessions of this user run with all rights: start them as another user"};
}

}  // namespace

ExitCode ReportSecurity(int domain, const fs::path& cart) {
  const std::vector<ProcessRights> processes = FulcrumProcesses();
  const int landlock = runtime::LandlockVersion();
  std::vector<Line> lines{KeysOfCart(cart), Bus(domain), Memory(domain)};
  const auto add = [&lines](const std::vector<Line>& more) { lines.insert(lines.end(), more.begin(), more.end()); };
  add(Switches(processes));
  add({Console(processes),
       Kernel(fs::exists("/proc/sys/kernel/seccomp/actions_avail"), "seccomp", "offered by the kernel",
              "nodes give up system calls that they do not need", "nodes cannot give up system calls"),
       Kernel(landlock > 0, "Landlock", "version " + std::to_string(landlock), "nodes write only in their own places",
              "nodes can write wherever their user can")});
  add(Nodes(processes, domain));
  add({Units(), Umask(), CoreDumps(), Tracing(), User()});
  constexpr const char* kMarks[] = {"✓", "–", "!"};
  for (const Line& line : lines) {
    std::printf("%s %-19s %s\n  %-19s → %s\n", kMarks[static_cast<int>(line.mark)], line.what.c_str(),
                line.found.c_str(), "", line.meaning.c_str());
  }
  const bool calm = std::none_of(lines.begin(), lines.end(), [](const Line& line) { return line.mark == Mark::kLook; });
  return calm ? ExitCode::kDone : ExitCode::kFailure;
}

}  // namespace fulcrum::supervisor::cli
