// The whole chain over real pseudo-terminals: simulated firmware → tty → parser → estimator → HandleState.
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <functional>
#include <mutex>
#include <numbers>
#include <string>
#include <thread>

#include "handle_bridge/node/cart_links.h"
#include "handle_bridge/node/handle_bridge_node.h"
#include "handle_bridge/serial/serial_port.h"
#include "handle_bridge/serial/simulated_firmware.h"
#include "services/base/runtime/cyclic_thread.h"
#include "services/transport/bus/in_process.h"

namespace fulcrum::handle_bridge {
namespace {

constexpr double kDegPerRad = 180.0 / std::numbers::pi;

/// A triangle of 6 deg/s: slow enough that a late thread on a busy machine causes no error.
double SlowJaw(std::int64_t now_ns) {
  const double t = std::fmod(static_cast<double>(now_ns) * 1e-9, 10.0);
  return 15 + 6 * (t < 5 ? t : 10 - t);
}

std::array<SimulatedUnit, kLinks> FramedUnits() {
  std::array<SimulatedUnit, kLinks> units = SimulatedFirmware::DefaultUnits();
  for (SimulatedUnit& unit : units) {
    unit.framed = true;
  }
  return units;
}

/// Node and firmware, running.
class Chain {
 public:
  explicit Chain(const config::CartConfig& cart = {},
                 const std::array<SimulatedUnit, kLinks>& units = SimulatedFirmware::DefaultUnits())
      : firmware_([this](std::int64_t now_ns) { return InputAt(now_ns); }, units),
        input_(topic_.MakeInput()),
        output_(topic_.MakeOutput()),
        node_(cart, {}, MakeCartLinks(cart, &firmware_), output_.get(), runtime::MonotonicNs()),
        thread_({.name = "handle", .period_ns = 2500000}, [this](const Tick& tick) { node_.Step(tick); }) {
    thread_.Start();
  }

  /// Waits until `condition` holds for a published state; false after a generous time.
  bool WaitFor(const std::function<bool(const HandleState&)>& condition) {
    for (int i = 0; i < 10000; ++i) {
      if (input_->TakeLatest(&state) && condition(state)) {
        return true;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return false;
  }
  bool WaitForError(const std::string& part) {
    return WaitFor([&](const HandleState&) { return health().last_error.find(part) != std::string::npos; });
  }
  bool WaitForHealthy() {
    return WaitFor([this](const HandleState& s) { return s.handles[0].quality > 0.9f && health().last_error.empty(); });
  }

  Health health() const {
    Health h;
    node_.FillHealth(&h);
    return h;
  }
  double metric(const std::string& name) const {
    for (const Metric& m : health().metrics) {
      if (m.name == name) {
        return m.value;
      }
    }
    return -1;
  }
  void SetPedals(std::uint8_t pedals) {
    const std::lock_guard lock(mutex_);
    pedals_ = pedals;
  }
  /// Sets the faults of a link from now on.
  void SetFaults(std::size_t link, const LinkFaults& faults) {
    const std::lock_guard lock(mutex_);
    faults_[link] = faults;
  }

  HandleState state;

 private:
  SimulatedInput InputAt(std::int64_t now_ns) {
    const std::lock_guard lock(mutex_);
    return {{SlowJaw(now_ns), 30}, pedals_, faults_};
  }

  std::mutex mutex_;
  std::uint8_t pedals_ = 0;                  // Guarded by mutex_.
  std::array<LinkFaults, kLinks> faults_{};  // Guarded by mutex_.
  SimulatedFirmware firmware_;
  bus::InProcessTopic<HandleState> topic_;
  std::unique_ptr<bus::Input<HandleState>> input_;
  std::unique_ptr<bus::Output<HandleState>> output_;
  HandleBridgeNode node_;
  runtime::CyclicThread thread_;
};

/// Largest error against the truth at the stamps over `n` samples [deg].
double WorstError(Chain* chain, int n) {
  double worst = 0;
  for (int seen = 0; seen < n; ++seen) {
    EXPECT_TRUE(chain->WaitFor([](const HandleState&) { return true; }));
    const HandleSample& sample = chain->state.handles[0];
    worst = std::max(worst, std::abs(sample.jaw_angle_rad * kDegPerRad - SlowJaw(chain->state.stamp.stamp_ns)));
  }
  return worst;
}

TEST(HandlePty, FollowsTheFirmwareThroughNoise) {
  Chain chain;
  ASSERT_TRUE(chain.WaitForHealthy());
  EXPECT_LT(WorstError(&chain, 300), 2.5);
  EXPECT_TRUE(chain.state.handles[1].present);
  EXPECT_NEAR(chain.state.handles[1].jaw_angle_rad * kDegPerRad, 30, 1.5);
  EXPECT_EQ(chain.metric("bad_lines"), 0);
  EXPECT_GT(chain.metric("lines"), 500);
}

TEST(HandlePty, LinesThatNobodyChangesComeInBurstsAndAreAllTaken) {
  const std::int64_t pressed_ns = runtime::MonotonicNs() + 2'500'000'000;
  runtime::Bell lines;
  const auto input = [&](std::int64_t now_ns) {
    return SimulatedInput{{20, 30}, now_ns >= pressed_ns ? std::uint8_t{kPedalCut} : std::uint8_t{kPedalNone}, {}};
  };
  const auto until = [&](std::int64_t now_ns) { return now_ns < pressed_ns ? pressed_ns : now_ns + 1'000'000'000; };
  SimulatedFirmware firmware(input, SimulatedFirmware::DefaultUnits(), {until, &lines});
  bus::InProcessTopic<HandleState> topic;
  const auto published = topic.MakeInput();
  const auto output = topic.MakeOutput();
  const config::CartConfig cart;
  HandleBridgeNode node(cart, {}, MakeCartLinks(cart, &firmware), output.get(), runtime::MonotonicNs());
  std::atomic<std::uint64_t> steps{0};
  runtime::CyclicThread thread(
      {.name = "handle", .period_ns = 2'500'000, .rests_until = [&] { return node.RestsUntil(); }, .bell = &lines},
      [&](const Tick& tick) {
        node.Step(tick);
        ++steps;
      });
  thread.Start();
  HandleState state;
  for (int i = 0; i < 10'000 && state.pedals != kPedalCut; ++i) {
    (void)published->TakeLatest(&state);
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  thread.Stop();
  EXPECT_EQ(state.pedals, kPedalCut);
  EXPECT_GE(state.stamp.stamp_ns, pressed_ns);
  EXPECT_GT(state.handles[0].quality, 0.99f);
  EXPECT_NEAR(state.handles[0].jaw_angle_rad * kDegPerRad, 20, 1.5);
  EXPECT_LT(steps, thread.stats().ticks / 2);
  Health health;
  node.FillHealth(&health);
  EXPECT_EQ(health.last_error, "");
  for (const Metric& metric : health.metrics) {
    // Two handles with a line a period; the terminal opens some periods after the first.
    if (metric.name == "lines") {
      EXPECT_GT(metric.value, 1.6 * static_cast<double>(thread.stats().ticks));
    } else if (metric.name == "bad_lines" || metric.name == "lost_frames") {
      EXPECT_EQ(metric.value, 0);
    }
  }
}

TEST(HandlePty, PedalsArriveAndAreReleased) {
  Chain chain;
  ASSERT_TRUE(chain.WaitForHealthy());
  chain.SetPedals(kPedalCut);
  EXPECT_TRUE(chain.WaitFor([](const HandleState& s) { return s.pedals == kPedalCut; }));
  chain.SetPedals(kPedalCoag);
  EXPECT_TRUE(chain.WaitFor([](const HandleState& s) { return s.pedals == kPedalCoag; }));
  chain.SetFaults(kPedalLink, {.unplugged = true});
  EXPECT_TRUE(chain.WaitFor([](const HandleState& s) { return s.pedals == kPedalNone; }));
  EXPECT_TRUE(chain.WaitForError("pedal: "));
}

TEST(HandlePty, DamagedBytesAreCountedAndNeverSeen) {
  Chain chain;
  ASSERT_TRUE(chain.WaitForHealthy());
  chain.SetFaults(0, {.cable = {0.02, 0.02}});
  EXPECT_LT(WorstError(&chain, 300), 4.0);
  EXPECT_GT(chain.metric("bad_lines"), 20);
  EXPECT_LT(chain.state.handles[0].quality, 0.95f);
  EXPECT_GT(chain.state.handles[0].quality, 0.4f);
}

TEST(HandlePty, FramesLoseNothingUnnoticed) {
  Chain chain({}, FramedUnits());
  ASSERT_TRUE(chain.WaitForHealthy());
  EXPECT_EQ(chain.metric("lost_frames"), 0);
  chain.SetPedals(kPedalCut);
  EXPECT_TRUE(chain.WaitFor([](const HandleState& s) { return s.pedals == kPedalCut; }));
  chain.SetFaults(0, {.cable = {0.005, 0.005}});
  EXPECT_LT(WorstError(&chain, 300), 3.0);
  EXPECT_GT(chain.metric("bad_lines"), 20);
  EXPECT_GE(chain.metric("lost_frames"), 0.8 * chain.metric("bad_lines"));
}

TEST(HandlePty, WrongBaudOfTheCartIsFoundOutNamedAndMended) {
  config::CartConfig cart;
  cart.handles[0].link.baud = 38400;
  Chain chain(cart);
  EXPECT_TRUE(chain.WaitForError("handle 0: wrong-baud: its baud rate differs"));
  EXPECT_TRUE(chain.WaitFor([](const HandleState& s) { return s.handles[0].quality > 0.9f; }));
  EXPECT_LT(WorstError(&chain, 100), 2.5);
}

TEST(HandlePty, HandleThatChangesItsBaudIsFollowedThereAndBack) {
  Chain chain;
  ASSERT_TRUE(chain.WaitForHealthy());
  chain.SetFaults(0, {.wrong_baud = true});
  EXPECT_TRUE(chain.WaitForError("handle 0: wrong-baud"));
  chain.SetFaults(0, {});
  EXPECT_TRUE(chain.WaitForHealthy());
}

TEST(HandlePty, GarbageIsNeitherWrongBaudNorMotion) {
  Chain chain;
  ASSERT_TRUE(chain.WaitForHealthy());
  LinkFaults noise;
  noise.cable.garbage = true;
  chain.SetFaults(1, noise);
  EXPECT_TRUE(chain.WaitForError("handle 1: garbage: under half of the lines are valid, at no usual speed"));
  // Longer than the search takes to change to another speed.
  for (int i = 0; i < 450; ++i) {
    ASSERT_TRUE(chain.WaitFor([](const HandleState&) { return true; }));
    ASSERT_NEAR(chain.state.handles[1].jaw_angle_rad * kDegPerRad, 30, 1.5);
    ASSERT_EQ(chain.health().last_error.find("wrong-baud"), std::string::npos);
  }
  chain.SetFaults(1, {});
  EXPECT_TRUE(chain.WaitForHealthy());
  EXPECT_EQ(chain.metric("reconnects"), 0);
}

TEST(HandlePty, GarbageOnTheFramedPedalPasses) {
  Chain chain({}, FramedUnits());
  ASSERT_TRUE(chain.WaitForHealthy());
  chain.SetPedals(kPedalCut);
  EXPECT_TRUE(chain.WaitFor([](const HandleState& s) { return s.pedals == kPedalCut; }));
  LinkFaults noise;
  noise.cable.garbage = true;
  chain.SetFaults(kPedalLink, noise);
  EXPECT_TRUE(chain.WaitFor([](const HandleState& s) { return s.pedals == kPedalNone; }));
  EXPECT_TRUE(chain.WaitForError("pedal: garbage"));
  chain.SetFaults(kPedalLink, {});
  EXPECT_TRUE(chain.WaitForHealthy());
  EXPECT_EQ(chain.state.pedals, kPedalCut);
}

TEST(HandlePty, BrokenWireIsNamedHeldAndForgottenOnceMended) {
  Chain chain;
  ASSERT_TRUE(chain.WaitForHealthy());
  chain.SetFaults(1, {.broken_wire = true});
  EXPECT_TRUE(chain.WaitForError("handle 1: wire: codes outside the calibration"));
  EXPECT_NEAR(chain.state.handles[1].jaw_angle_rad * kDegPerRad, 30, 3);
  chain.SetFaults(1, {});
  EXPECT_TRUE(chain.WaitForHealthy());
}

TEST(HandlePty, SeveralFaultsAtOnceAreToldApart) {
  Chain chain;
  ASSERT_TRUE(chain.WaitForHealthy());
  chain.SetFaults(0, {.silent = true});
  chain.SetFaults(1, {.broken_wire = true});
  chain.SetFaults(kPedalLink, {.unplugged = true});
  EXPECT_TRUE(
      chain.WaitForError("handle 0: no-data: no bytes: check that it is powered and its transmit wire connected; "
                         "handle 1: wire; pedal: no-port"));
  for (std::size_t link = 0; link < kLinks; ++link) {
    chain.SetFaults(link, {});
  }
  EXPECT_TRUE(chain.WaitForHealthy());
}

TEST(HandlePty, SwappedPlugsAreNamed) {
  std::array<SimulatedUnit, kLinks> units = FramedUnits();
  std::swap(units[0].sender, units[1].sender);
  Chain chain({}, units);
  EXPECT_TRUE(chain.WaitForError("handle 0: swapped: another unit is plugged in here"));
  EXPECT_FALSE(chain.state.handles[0].present);
}

TEST(HandlePty, SilentFirmwareIsNamedAndComesBack) {
  Chain chain;
  ASSERT_TRUE(chain.WaitForHealthy());
  chain.SetFaults(0, {.silent = true});
  EXPECT_TRUE(chain.WaitForError("handle 0: no-data"));
  chain.SetFaults(0, {});
  EXPECT_TRUE(chain.WaitForHealthy());
}

TEST(HandlePty, UnpluggedHandleHoldsAndIsFoundAgainUnderAnotherName) {
  Chain chain;
  ASSERT_TRUE(chain.WaitForHealthy());
  for (int round = 1; round <= 3; ++round) {
    chain.SetFaults(0, {.unplugged = true});
    EXPECT_TRUE(chain.WaitForError("handle 0: no-port"));
    // The error may be newer than the state that was taken with it.
    EXPECT_TRUE(chain.WaitFor([](const HandleState& s) { return s.handles[0].quality == 0.0f; }));
    const float held = chain.state.handles[0].jaw_angle_rad;
    EXPECT_TRUE(chain.WaitFor([](const HandleState&) { return true; }));
    EXPECT_EQ(chain.state.handles[0].jaw_angle_rad, held);
    EXPECT_EQ(chain.state.handles[0].quality, 0.0f);
    EXPECT_TRUE(chain.WaitFor([](const HandleState& s) {
      return std::abs(s.handles[1].jaw_angle_rad * kDegPerRad - 30) < 1.5;
    })) << "the other handle continues";
    chain.SetFaults(0, {});
    EXPECT_TRUE(chain.WaitForHealthy());
    EXPECT_EQ(chain.metric("reconnects"), round);
  }
  EXPECT_LT(WorstError(&chain, 50), 2.5);
}

TEST(HandlePty, RestartRejoins) {
  auto chain = std::make_unique<Chain>();
  ASSERT_TRUE(chain->WaitForHealthy());
  const std::uint64_t epoch = chain->state.stamp.epoch;
  chain = std::make_unique<Chain>();
  ASSERT_TRUE(chain->WaitForHealthy());
  EXPECT_GT(chain->state.stamp.epoch, epoch);
  EXPECT_LT(WorstError(chain.get(), 50), 2.5);
}

TEST(HandlePty, MissingRealPortIsReportedAndDisturbsNothing) {
  config::CartConfig cart;
  cart.handles[1].kind = config::LinkKind::kSerial;
  cart.handles[1].link.port = "/dev/serial/by-path/no-such-adapter";
  Chain chain(cart);
  EXPECT_TRUE(chain.WaitForError("handle 1: no-port"));
  EXPECT_TRUE(chain.WaitFor([](const HandleState& s) { return s.handles[0].present && !s.handles[1].present; }));
}

TEST(SerialPort, RefusesWhatIsNoSerialPort) {
  for (const char* name : {"", "/dev/null", "/nonexistent", "/"}) {
    config::SerialLink link;
    link.port = name;
    EXPECT_EQ(SerialPortOpener(link).Open(115200), nullptr) << name;
  }
  config::SerialLink by_identity;
  by_identity.usb_vendor_id = 0xfffe;
  by_identity.usb_product_id = 0xfffd;
  EXPECT_EQ(SerialPortOpener(by_identity).Open(115200), nullptr);
}

TEST(PseudoTerminal, CarriesBytesUnchangedAndReportsItsReadersSpeed) {
  PseudoTerminal terminal;
  std::unique_ptr<ByteSource> source = TerminalOpener([&] { return terminal.device(); }, "A").Open(57600);
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(terminal.ReaderBaud(), 57600);
  EXPECT_EQ(source->unit(), "A");
  std::string sent;
  for (int i = 0; i < 256; ++i) {
    sent.push_back(static_cast<char>(i));
  }
  EXPECT_EQ(terminal.Send(sent), 256u);
  std::string received;
  std::array<char, 512> buffer;
  for (int i = 0; i < 1000 && received.size() < sent.size(); ++i) {
    received.append(buffer.data(), source->Read(buffer).bytes);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_EQ(received, sent);
}

TEST(PseudoTerminal, HangUpIsSeenWithinFiniteReads) {
  auto terminal = std::make_unique<PseudoTerminal>();
  std::unique_ptr<ByteSource> source = TerminalOpener([&] { return terminal->device(); }, "A").Open(115200);
  ASSERT_NE(source, nullptr);
  std::array<char, 64> buffer;
  EXPECT_FALSE(source->Read(buffer).hung_up);
  terminal->Send("2.4498\r\n");
  terminal.reset();
  std::string received;
  bool hung_up = false;
  for (int i = 0; i < 1000 && !hung_up; ++i) {
    const ReadResult read = source->Read(buffer);
    received.append(buffer.data(), read.bytes);
    hung_up = read.hung_up;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_TRUE(hung_up);
  // The kernel may drop unread bytes, but adds none.
  EXPECT_TRUE(received.empty() || received == "2.4498\r\n") << received;
}

}  // namespace
}  // namespace fulcrum::handle_bridge
