#include "tests/system/chaos/chaos_cart.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <new>
#include <thread>
#include <vector>

#include "services/base/core/sanitizers.h"
#include "services/base/runtime/cyclic_thread.h"
#include "tests/support/working_scene.h"

namespace fulcrum::testing {
namespace {

namespace fs = std::filesystem;

constexpr double kPatience_s = 20;  // On a busy machine.
constexpr double kFelt_N = 0.1;

#if FULCRUM_SANITIZED
constexpr bool kCanPreload = false;  // A sanitizer's library must come first.
#else
constexpr bool kCanPreload = true;
#endif

void Sleep(double seconds) { std::this_thread::sleep_for(std::chrono::duration<double>(seconds)); }

fs::path MakeFolder(int domain) {
  fs::path folder =
      fs::temp_directory_path() / ("fulcrum-chaos-" + std::to_string(::getpid()) + "-" + std::to_string(domain));
  fs::create_directories(folder);
  return folder;
}

fs::path WriteScene(const fs::path& folder, double duration_s) {
  std::ofstream(folder / "working.yaml") << WorkingScene("small", duration_s);
  return folder / "working.yaml";
}

ClockPage* MakeClock(const fs::path& file) {
  const int fd = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  const bool sized = fd >= 0 && ::ftruncate(fd, sizeof(ClockPage)) == 0;
  void* map = sized ? ::mmap(nullptr, sizeof(ClockPage), PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0) : MAP_FAILED;
  if (map == MAP_FAILED) throw std::runtime_error("no page for the clock: " + file.string());
  ::close(fd);
  if (kCanPreload) {
    ::setenv("FULCRUM_TEST_CLOCK", file.c_str(), 1);
    ::setenv("LD_PRELOAD", FULCRUM_CLOCK_SHIM, 1);
  }
  return new (map) ClockPage;
}

/// Removes the preload, so that only the cart gets the shifted clock.
int DomainAfterStart(int domain) {
  ::unsetenv("LD_PRELOAD");
  ::unsetenv("FULCRUM_TEST_CLOCK");
  return domain;
}

bool HearsTheHook(const CartState& state) {
  constexpr float kFresh_ms = 100;
  const auto thermal = state.healths.find(NodeId::kThermal);
  if (thermal == state.healths.end()) return false;
  const auto& inputs = thermal->second.inputs;
  return std::any_of(inputs.begin(), inputs.end(), [](const InputHealth& input) {
    return input.topic == TopicId::kCauteryContact && input.age_ms >= 0 && input.age_ms < kFresh_ms;
  });
}

void Spoil(const fs::path& checkpoint, Damage damage) {
  std::fstream file(checkpoint, std::ios::in | std::ios::out | std::ios::binary);
  const auto flip = [&file](std::size_t at) {
    file.seekg(static_cast<std::streamoff>(at));
    const int byte = file.get();
    file.seekp(static_cast<std::streamoff>(at));
    file.put(static_cast<char>(byte ^ 0x5a));
  };
  // The file begins with four numbers of eight bytes: magic, scene, layout, capacity. Two slots of the same size follow
  // after a page, each with its sequence first and its payload after a page.
  constexpr std::size_t kPage = 4096;
  const auto size = static_cast<std::size_t>(fs::file_size(checkpoint));
  const std::size_t slots[] = {kPage, kPage + (size - kPage) / 2};
  const auto sequence = [&file](std::size_t slot) {
    std::uint64_t value = 0;
    file.seekg(static_cast<std::streamoff>(slot));
    file.read(reinterpret_cast<char*>(&value), sizeof(value));
    return value;
  };
  const std::size_t newest = slots[sequence(slots[0]) > sequence(slots[1]) ? 0 : 1];
  switch (damage) {
    case Damage::kFlippedNewest:
      flip(newest + kPage + 100);
      break;
    case Damage::kFlippedAll:
      for (const std::size_t slot : slots) flip(slot + kPage + 100);
      break;
    case Damage::kCutShort:
      file.close();
      fs::resize_file(checkpoint, size / 2);
      break;
    case Damage::kOfTheFuture:
      flip(17);
      break;
    case Damage::kOfAnotherScene:
      flip(9);
      break;
  }
}

}  // namespace

ChaosCart::ChaosCart(double duration_s, int domain, std::uint32_t seed)
    : random_(seed),
      domain_(domain),
      folder_(MakeFolder(domain)),
      scene_(WriteScene(folder_, duration_s)),
      clock_(MakeClock(folder_ / "clock")),
      cart_(scene_, domain),
      watch_(DomainAfterStart(domain), scene_, cart_.session()) {}

ChaosCart::~ChaosCart() {
  ::munmap(clock_, sizeof(ClockPage));
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

pid_t ChaosCart::Process(NodeId node) const {
  const auto nodes = cart_.nodes();
  const auto it = nodes.find(NodeName(node));
  return it == nodes.end() ? -1 : it->second;
}

bool ChaosCart::GoesOn() {
  const std::int64_t since = runtime::MonotonicNs();
  const double drawn = watch_.See([](const CartState& state) { return state.Metric(NodeId::kRender, "frames_drawn"); });
  bool felt = false;
  return watch_.WaitUntil(kPatience_s, [&](const CartState& state) {
    missing_.clear();
    for (const NodeId node : kNodes) {
      const auto health = state.healths.find(node);
      const bool runs =
          health != state.healths.end() && health->second.stamp.stamp_ns > since &&
          (health->second.state == HealthState::kRunning || health->second.state == HealthState::kDegraded);
      if (!runs) missing_ += std::string(NodeName(node)) + " does not report that it runs; ";
    }
    for (const ForceJudge& judge : state.judges) felt = felt || judge.force_N() > kFelt_N;
    if (!felt) missing_ += "the hand feels nothing; ";
    if (state.frame.stamp.stamp_ns < since) missing_ += "the tissue stands still; ";
    if (!HearsTheHook(state)) missing_ += "heat does not know where the hook is; ";
    if (state.Metric(NodeId::kRender, "frames_drawn") == drawn) missing_ += "nothing is drawn; ";
    return missing_.empty();
  });
}

void ChaosCart::WaitAMoment(double most_s) { Sleep(std::uniform_real_distribution<double>(0, most_s)(random_)); }

void ChaosCart::Kill(NodeId node) {
  const pid_t victim = Process(node);
  if (victim > 0) ::kill(victim, SIGKILL);
}

void ChaosCart::Stop(NodeId node, double seconds) {
  const pid_t victim = Process(node);
  if (victim <= 0) return;
  ::kill(victim, SIGSTOP);
  Sleep(seconds);
  ::kill(victim, SIGCONT);
}

void ChaosCart::Starve(double seconds) {
  std::vector<pid_t> busy;
  for (unsigned i = 0; i < 4 * std::thread::hardware_concurrency(); ++i) {
    const pid_t child = ::fork();
    if (child == 0) {
      for (const std::int64_t end = runtime::MonotonicNs() + static_cast<std::int64_t>(1e9 * seconds);
           runtime::MonotonicNs() < end;) {
      }
      ::_exit(0);
    }
    busy.push_back(child);
  }
  for (const pid_t child : busy) ::waitpid(child, nullptr, 0);
}

void ChaosCart::SetWallClock(double offset_h) { clock_->offset_s = static_cast<std::int64_t>(3600 * offset_h); }

std::uint64_t ChaosCart::Pour(Flood what, double seconds) {
  Rogue rogue(domain_);
  watch_.Ignore(rogue.epoch());
  return rogue.Pour(what, seconds, random_());
}

std::uint64_t ChaosCart::PourBytes(int per_topic) { return Rogue(domain_).PourBytes(per_topic, random_()); }

void ChaosCart::KillAndSpoil(NodeId node, Damage damage) {
  const pid_t victim = Process(node);
  if (victim <= 0) return;
  cart_.Signal(SIGSTOP);  // Keeps the supervisor from restarting the node meanwhile.
  ::kill(victim, SIGKILL);
  if (WaitFor(kPatience_s, [&] { return Process(node) <= 0; })) {
    Spoil(cart_.session() / (std::string(NodeName(node)) + ".checkpoint"), damage);
  }
  cart_.Signal(SIGCONT);
}

std::string ChaosCart::Log(NodeId node) const {
  return ReadFile(cart_.session() / "logs" / (std::string(NodeName(node)) + ".log"));
}

}  // namespace fulcrum::testing
