// confined_node NODE SESSION DOMAIN: confines itself as that node does and attempts operations that are forbidden or
// required; prints a line "attempt: result" for each. The session folder has the folders frames and logs.
#include <arpa/inet.h>
#include <fcntl.h>
#include <sched.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/mount.h>
#include <sys/ptrace.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <string>
#include <string_view>
#include <thread>

#include "services/nodes/app/node_confinement.h"
#include "services/transport/bus/dds/shared_memory.h"

namespace {

namespace fs = std::filesystem;

void Tell(const std::string& attempt, bool done) {
  std::printf("%s: %s\n", attempt.c_str(), done ? "done" : std::strerror(errno));
}

void TellOfFile(const std::string& attempt, const fs::path& file) {
  const int fd = ::open(file.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
  Tell(attempt, fd >= 0);
  if (fd >= 0) ::close(fd);
}

void TellOfSocket(const std::string& attempt, int family, int type, int protocol) {
  const int fd = ::socket(family, type, protocol);
  Tell(attempt, fd >= 0);
  if (fd >= 0) ::close(fd);
}

void TryWriting(const fs::path& session, int domain) {
  const fs::path memory = fulcrum::bus::SharedMemoryDirectory(domain);
  TellOfFile("file of the home", fs::path(std::getenv("HOME")) / "confined_node.txt");
  TellOfFile("file beside the session", session.parent_path() / "beside");
  TellOfFile("file of the session", session / "file");
  TellOfFile("picture", session / "frames" / "picture");
  TellOfFile("shared memory", memory / "file");
  TellOfFile("shared memory of another cart", memory.parent_path() / "confined_node.other");
  TellOfFile("no device", "/dev/null");
  TellOfFile("terminal", "/dev/ptmx");
  Tell("file to read", ::access("/etc/passwd", R_OK) == 0);
  Tell("removal beside the session", ::unlink((session.parent_path() / "there").c_str()) == 0);
}

void TrySystemCalls() {
  char name[] = "true";
  char* const words[] = {name, nullptr};
  ::execv("/bin/true", words);
  Tell("program", false);
  TellOfSocket("packet socket", AF_PACKET, SOCK_DGRAM, 0);
  TellOfSocket("raw socket", AF_INET, SOCK_RAW, IPPROTO_ICMP);
  TellOfSocket("IPv6 socket", AF_INET6, SOCK_DGRAM, 0);
  TellOfSocket("bluetooth socket", AF_BLUETOOTH, SOCK_RAW, 0);
  TellOfSocket("kernel crypto socket", 38 /* AF_ALG */, SOCK_SEQPACKET, 0);
  TellOfSocket("datagram socket", AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  TellOfSocket("local socket", AF_UNIX, SOCK_STREAM, 0);
  TellOfSocket("netlink socket", AF_NETLINK, SOCK_RAW, 0);
  char byte = 0;
  iovec own{&byte, 1}, theirs{&byte, 1};
  Tell("memory of another process", ::process_vm_readv(::getppid(), &own, 1, &theirs, 1, 0) > 0);
  Tell("mount", ::mount("none", "/mnt", "tmpfs", 0, nullptr) == 0);
  Tell("user namespace", ::unshare(CLONE_NEWUSER) == 0);
  Tell("user namespace of a child",
       ::syscall(SYS_clone, CLONE_NEWUSER | SIGCHLD, nullptr, nullptr, nullptr, nullptr) > 0);
  Tell("own folder of a thread", ::unshare(CLONE_FS) == 0);
  Tell("key of the kernel", ::syscall(SYS_keyctl, 0, -3, 0) >= 0);
  Tell("io_uring", ::syscall(SYS_io_uring_setup, 1, nullptr) >= 0);
  Tell("another user", ::setuid(65534) == 0);
  timespec now{};
  ::clock_gettime(CLOCK_REALTIME, &now);
  Tell("clock", ::clock_settime(CLOCK_REALTIME, &now) == 0);
  bool ran = false;
  std::thread([&ran] {
    ran = true;
    errno = 0;
    TellOfSocket("packet socket of a thread", AF_PACKET, SOCK_DGRAM, 0);
  }).join();
  Tell("thread", ran);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) return 2;
  using namespace fulcrum;  // NOLINT: this main only uses names of other modules
  const std::string name = argv[1];
  app::NodeOptions options;
  options.session = argv[2];
  options.domain = std::atoi(argv[3]);
  config::CartConfig cart;
  for (auto& device : cart.devices) device.kind = config::DeviceKind::kSimulated;
  if (name == "touch") cart.devices[0].kind = config::DeviceKind::kTouch;
  NodeId node = NodeId::kHaptics;
  for (int i = 0; i < kNodeCount; ++i) {
    if (name == NodeName(static_cast<NodeId>(i))) node = static_cast<NodeId>(i);
  }
  app::ConfineNode(node, options, cart);
  TryWriting(options.session, options.domain);
  TrySystemCalls();
  return 0;
}
