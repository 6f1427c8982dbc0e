// fulcrum doctor: each check of the machine prints ✓ or ✗ with its finding, and for ✗ a fix.
#include <dlfcn.h>
#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <optional>
#include <sstream>
#include <thread>

#include "handle_bridge/serial/serial_port.h"
#include "services/apps/fulcrum/commands.h"
#include "services/apps/fulcrum/security_report.h"
#include "services/base/config/cart.h"
#include "services/base/core/error.h"
#include "services/base/runtime/child_process.h"
#include "services/base/runtime/file_descriptor.h"
#include "services/base/runtime/install_places.h"
#include "services/base/runtime/realtime.h"
#include "services/session/supervisor/domain_guard.h"
#include "services/session/supervisor/scene_cache.h"
#include "services/transport/bus/dds/participant.h"
#include "services/transport/bus/dds/shared_memory.h"

namespace fulcrum::supervisor::cli {
namespace {

namespace fs = std::filesystem;

struct Finding {
  bool good;
  std::string found;
  std::string fix;
};

/// Free bytes of the file system of `path`, or of its nearest parent that exists.
std::uint64_t FreeBytes(fs::path path) {
  path = fs::absolute(path);
  struct statvfs space {};
  while (::statvfs(path.c_str(), &space) != 0) {
    if (path == path.root_path()) {
      return 0;
    }
    path = path.parent_path();
  }
  return std::uint64_t{space.f_bavail} * space.f_frsize;
}

Finding SharedMemory(int domain) {
  const std::uint64_t free = FreeBytes("/dev/shm");
  const std::uint64_t needed = bus::kNeededSharedMemory_B;
  std::string found = std::to_string(free >> 20) + " MiB free of " + std::to_string(needed >> 20) + " MiB needed";
  if (free < needed) {
    return {false, found, "mount -o remount,size=1G /dev/shm (in a container: --shm-size=1g)"};
  }
  const fs::path folder = bus::SharedMemoryDirectory(domain);
  std::error_code error;
  if (fs::exists(folder, error) && !DomainGuard::IsTaken(domain)) {
    const bus::SweepResult swept = bus::SweepSharedMemory(folder);
    found += "; swept " + std::to_string(swept.files) + " files of dead processes in " + folder.string();
  }
  return {true, found, ""};
}

/// Reads the size back, because setsockopt reports no error when the kernel grants less.
Finding SocketBuffers() {
  const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const int wanted = static_cast<int>(bus::kSocketBuffer_B);
  int granted = 0;
  socklen_t size = sizeof(granted);
  ::setsockopt(socket, SOL_SOCKET, SO_RCVBUF, &wanted, sizeof(wanted));
  // As the bus does: CAP_NET_ADMIN passes the limit.
  ::setsockopt(socket, SOL_SOCKET, SO_RCVBUFFORCE, &wanted, sizeof(wanted));
  ::getsockopt(socket, SOL_SOCKET, SO_RCVBUF, &granted, &size);
  ::close(socket);
  granted /= 2;  // The kernel doubles the size for its own overhead.
  const std::string fix =
      "sysctl -w net.core.rmem_max=" + std::to_string(wanted) + " net.core.wmem_max=" + std::to_string(wanted) +
      ", and the same in /etc/sysctl.d for the next boot; with smaller buffers a delayed recorder loses samples";
  return {granted >= wanted,
          std::to_string(granted >> 10) + " KiB granted of " + std::to_string(wanted >> 10) + " KiB wanted", fix};
}

/// Fix for a missing limit of /etc/security.
std::string FixOfLimit(const std::string& entry, const std::string& capability) {
  const std::string how = runtime::MachineCart().empty()
                              ? "add \"@fulcrum - " + entry + "\" to /etc/security/limits.conf and join that group"
                              : "sudo adduser $USER fulcrum, then log in again";
  return how + ", or run the container with --cap-add=" + capability;
}

Finding RealTime() {
  std::string problem;
  std::thread([&] { problem = runtime::SetFifoPriority(80); }).join();
  return {problem.empty(), problem.empty() ? "SCHED_FIFO is permitted" : "SCHED_FIFO is not permitted",
          FixOfLimit("rtprio 90", "SYS_NICE") + "; without it cycles start late under load"};
}

Finding LockedMemory() {
  const std::string problem = runtime::LockMemory();
  return {problem.empty(), problem.empty() ? "memory may be locked" : "memory may not be locked",
          FixOfLimit("memlock unlimited", "IPC_LOCK")};
}

/// Reads from `file` until its end or `deadline`. Returns whether the end came.
bool ReadUntil(std::chrono::steady_clock::time_point deadline, int file, std::string* text) {
  for (;;) {
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
    pollfd waited{file, POLLIN, 0};
    const int ready = left.count() > 0 ? ::poll(&waited, 1, static_cast<int>(left.count())) : 0;
    if (ready < 0 && errno == EINTR) continue;
    if (ready <= 0) return false;
    char part[512];
    const ssize_t count = ::read(file, part, sizeof(part));
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return true;
    text->append(part, static_cast<std::size_t>(count));
  }
}

/// What draws pictures off screen, as render_node chooses it in a session. Asked in a process of its own, because this
/// program must also run on a machine without EGL.
Finding OffScreenGl() {
  const std::string fix = "apt-get install libegl1 libegl-mesa0 libgl1-mesa-dri";
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) {
    return {false, std::string("no pipe: ") + std::strerror(errno), fix};
  }
  const runtime::FileDescriptor said(ends[0]);
  runtime::FileDescriptor output(ends[1]);
  runtime::ChildProcess renderer;
  try {
    renderer = runtime::ChildProcess::StartOn(runtime::ProgramFolder() / "render_node", {"--graphics"},
                                              {.output = output.get()});
  } catch (const InputError& error) {
    return {false, error.what(), fix};
  }
  output.Close();  // Only the child writes, so reading ends with it.
  // A driver may wait for a device for good.
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(10);
  std::string text;
  bool answered = ReadUntil(deadline, said.get(), &text);
  std::optional<runtime::ProcessEnd> end;
  while (answered && !(end = renderer.Poll())) {
    answered = std::chrono::steady_clock::now() < deadline;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  if (!answered) return {false, "no answer within 10 s", fix};  // The child is killed with its owner.
  // The answer is the last line; a driver may have written warnings before it.
  text.erase(text.find_last_not_of('\n') + 1);
  text.erase(0, text.rfind('\n') + 1);
  if (end->signal != 0 || end->exit_code != 0) {
    return {false, text.empty() ? "render_node " + end->Describe() : text, fix};
  }
  return {true, "pictures are drawn by " + text, ""};
}

Finding Display() {
  // The window is one of X11; desktops on Wayland set DISPLAY where Xwayland serves it.
  if (const char* value = std::getenv("DISPLAY"); value != nullptr && *value != '\0') {
    return {true, std::string("DISPLAY=") + value, ""};
  }
  return {true, "none: pictures are drawn off screen; --window needs an X display (without a monitor: xvfb-run)", ""};
}

/// Adds what keeps a line of the cart from being opened; empty: nothing, or the cart simulates it.
void CheckLine(const std::string& key, config::LinkKind kind, const config::SerialLink& link, std::string* missing,
               std::string* closed) {
  if (kind != config::LinkKind::kSerial) return;
  const std::string named = key + (link.port.empty() ? ": the adapter of its USB identity" : ": " + link.port);
  const std::string port = handle_bridge::PortOf(link);
  if (port.empty()) {
    *missing += (missing->empty() ? "" : "; ") + named;
  } else if (::access(port.c_str(), R_OK | W_OK) != 0 && (*closed + ' ').find(' ' + port + ' ') == std::string::npos) {
    *closed += ' ' + port;
  }
}

/// The serial ports of this machine, and those that the cart names.
Finding SerialPorts(const config::CartConfig& cart) {
  std::string found, closed, missing;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator("/dev", error)) {
    const std::string name = entry.path().filename();
    if (!name.starts_with("ttyUSB") && !name.starts_with("ttyACM")) {
      continue;
    }
    found += ' ';
    found += entry.path().native();
    if (::access(entry.path().c_str(), R_OK | W_OK) != 0) {
      closed += ' ';
      closed += entry.path().native();
    }
  }
  bool real = cart.pedal.kind == config::LinkKind::kSerial;
  for (std::size_t tool = 0; tool < cart.handles.size(); ++tool) {
    const config::HandleConfig& handle = cart.handles[tool];
    real = real || handle.kind == config::LinkKind::kSerial;
    CheckLine("handles.tool" + std::to_string(tool), handle.kind, handle.link, &missing, &closed);
  }
  CheckLine("pedal", cart.pedal.kind, cart.pedal.link, &missing, &closed);
  if (!missing.empty()) {
    return {false, "not there: " + missing + (closed.empty() ? "" : "; no permission for" + closed),
            "plug it in, or correct the cart file (ports: ls -l /dev/serial/by-path)"};
  }
  if (!closed.empty()) {
    return {false, "no permission for" + closed, "sudo usermod -aG dialout $USER, then log in again"};
  }
  if (real) return {true, "those of the cart are usable" + (found.empty() ? "" : ":" + found), ""};
  return {true, found.empty() ? "none, and the cart names none" : "usable:" + found + "; the cart names none", ""};
}

// haptics_node loads the library by this name. A cart with simulated devices does not need it.
Finding TouchDriver(const config::CartConfig& cart) {
  if (::dlopen("libHD.so", RTLD_LAZY | RTLD_LOCAL) != nullptr) return {true, "libHD.so is installed", ""};
  const bool needed = std::ranges::any_of(
      cart.devices, [](const config::DeviceConfig& device) { return device.kind == config::DeviceKind::kTouch; });
  return {!needed,
          needed ? "libHD.so is missing, and the cart has a device of `kind: touch`"
                 : "none: a cart with `kind: touch` needs libHD.so",
          "install 3D Systems' Touch Device Driver and OpenHaptics"};
}

/// True when a UDP socket of this machine is bound to one of the ports that DDS derives from the domain.
bool PortsInUse(int domain) {
  // RTPS well-known ports: 7400 + 250 * domain, plus 0, 1 and 10 + 2 * participant.
  const unsigned first = 7400u + 250u * static_cast<unsigned>(domain);
  std::ifstream table("/proc/net/udp");
  std::string line;
  while (std::getline(table, line)) {
    std::istringstream words(line);
    std::string slot, address;
    words >> slot >> address;
    const std::size_t colon = address.find(':');
    if (colon == std::string::npos) {
      continue;
    }
    const unsigned long port = std::strtoul(address.c_str() + colon + 1, nullptr, 16);
    if (port >= first && port < first + 250u) {
      return true;
    }
  }
  return false;
}

Finding DomainInUse(int domain) {
  const std::string name = "domain " + std::to_string(domain);
  if (const std::string other = DomainGuard::OtherUsers(domain); !other.empty()) return {true, other, ""};
  if (DomainGuard::IsHeld(domain)) {
    return {true, name + ": a session is running (fulcrum status)", ""};
  }
  if (PortsInUse(domain)) {
    return {false, name + ": no session, but another program is bound to its ports",
            "end that program (ss -lunp lists it) or use another domain (--domain N)"};
  }
  return {true, name + " is free", ""};
}

Finding Disk(const fs::path& out) {
  constexpr std::uint64_t kNeeded = std::uint64_t{1} << 30;
  const std::uint64_t free = FreeBytes(out);
  return {free >= kNeeded, std::to_string(free >> 20) + " MiB free for " + fs::absolute(out).string(),
          "free at least 1 GiB, or give --out DIR on another disk"};
}

Finding NodePrograms() {
  const fs::path folder = runtime::ProgramFolder();
  std::string missing;
  for (const char* name : cli::Programs()) {
    if (::access((folder / name).c_str(), X_OK) != 0) {
      missing += std::string(" ") + name;
    }
  }
  return {missing.empty(),
          missing.empty() ? "all in " + folder.string() : "missing from " + folder.string() + ":" + missing,
          runtime::MachineCart().empty() ? "build them: cmake --build build/release"
                                         : "install the package again: apt-get install --reinstall fulcrum"};
}

Finding Scenes() {
  const fs::path folder = runtime::ShareFolder() / "scenes";
  std::string names;
  for (const std::string& name : ShippedScenes(folder)) {
    names += ' ' + name;
  }
  return {!names.empty(), names.empty() ? "none in " + folder.string() : folder.string() + ":" + names,
          "install the package again, or build from a whole source tree"};
}

/// @param read receives the cart, if the file has no fault.
Finding Cart(const fs::path& cart, config::CartConfig* read) {
  if (cart.empty()) {
    return {true, "no cart file of this machine: without --cart all hardware is simulated", ""};
  }
  try {
    *read = config::LoadCart(cart);
    return {true, cart.string() + ", \"" + read->name + "\"", ""};
  } catch (const InputError& error) {
    return {false, error.what(),
            "correct it, or replace it by a copy of a file in " + (runtime::ShareFolder() / "carts").string()};
  }
}

}  // namespace

ExitCode Doctor(const Words& words) {
  namespace po = boost::program_options;
  po::options_description options;
  options.add_options()("out", po::value<std::string>()->value_name("DIR")->default_value("out"),
                        "folder of the session folders; its disk is checked for 1 GiB of free space");
  options.add_options()("security",
                        "print what protects cart, session and machine, what does not, and what that means");
  AddCart(&options);
  AddDomain(&options);
  const Arguments arguments = Parse("doctor", words, options);
  if (arguments.help) {
    return ExitCode::kDone;
  }
  // A cart file with a fault is one of the findings.
  config::CartConfig hardware;
  const Finding cart = Cart(CartOf(arguments), &hardware);
  const int domain = cart.good ? DomainOf(arguments) : DomainOf(arguments, config::DefaultDomain());
  if (arguments.values.count("security") != 0) return ReportSecurity(domain, CartOf(arguments));
  const std::vector<std::pair<const char*, Finding>> findings{
      {"programs", NodePrograms()},
      {"scenes", Scenes()},
      {"cart", cart},
      {"shared memory", SharedMemory(domain)},
      {"socket buffers", SocketBuffers()},
      {"domain", DomainInUse(domain)},
      {"real-time priority", RealTime()},
      {"locked memory", LockedMemory()},
      {"off-screen GL", OffScreenGl()},
      {"display", Display()},
      {"serial ports", SerialPorts(hardware)},
      {"haptic driver", TouchDriver(hardware)},
      {"disk", Disk(arguments.values["out"].as<std::string>())},
  };
  for (const auto& [what, finding] : findings) {
    std::printf("%s %-19s %s\n", finding.good ? "✓" : "✗", what, finding.found.c_str());
    if (!finding.good) {
      std::printf("  %-19s fix: %s\n", "", finding.fix.c_str());
    }
  }
  const bool all_good = std::all_of(findings.begin(), findings.end(), [](const auto& f) { return f.second.good; });
  return all_good ? ExitCode::kDone : ExitCode::kFailure;
}

}  // namespace fulcrum::supervisor::cli
