#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <numbers>
#include <random>
#include <string>

#include "handle_bridge/node/handle_bridge_node.h"
#include "handle_bridge/protocol/pedal_line.h"
#include "handle_bridge/simulation/jaw_firmware.h"
#include "services/transport/bus/in_process.h"
#include "tests/unit/handle/memory_link.h"

namespace fulcrum::handle_bridge {
namespace {

constexpr double kDegPerRad = 180.0 / std::numbers::pi;

/// A node with two handles and a pedal in memory, ticked by hand.
class NodeTest : public ::testing::Test {
 protected:
  NodeTest() : input_(topic_.MakeInput()), output_(topic_.MakeOutput()) { Restart(1000); }

  static std::unique_ptr<WatchedLink> MakeLink(MemoryLink** memory) {
    auto link = std::make_unique<MemoryLink>();
    *memory = link.get();
    return std::make_unique<WatchedLink>(std::move(link), 115200);
  }

  void Restart(std::int64_t epoch_ns) {
    HandleBridgeNode::Links links;
    for (std::size_t tool = 0; tool < 2; ++tool) {
      links.handles[tool] = MakeLink(&handle_[tool]);
    }
    links.pedal = MakeLink(&pedal_);
    node_ = std::make_unique<HandleBridgeNode>(config::CartConfig(), calibrations_, std::move(links), output_.get(),
                                               epoch_ns);
    EXPECT_EQ(Error(), "");  // Nothing has been read yet.
    TickSilently();          // The first step discards old bytes.
  }

  /// One tick; handle 0 sends its angle, the pedal its bits.
  const HandleState& Tick(double jaw0_deg, std::uint8_t pedals = 0) {
    const auto line = firmware_.Line(jaw0_deg);
    handle_[0]->bytes.append(line.data(), line.size());
    const auto second = firmware_.Line(30);
    handle_[1]->bytes.append(second.data(), second.size());
    const auto pedal = FormatPedals(pedals);
    pedal_->bytes.append(pedal.data(), pedal.size());
    return TickSilently();
  }

  const HandleState& TickSilently(std::uint64_t skipped = 0) {
    index_ += skipped;
    node_->Step({index_, 0.0025 * static_cast<double>(index_), 0.0025, static_cast<std::int64_t>(2500000 * index_)});
    ++index_;
    // While nothing changes, most steps publish nothing.
    (void)input_->TakeLatest(&state_);
    return state_;
  }

  std::string Error() {
    Health health;
    node_->FillHealth(&health);
    return health.last_error;
  }

  double MetricOf(const std::string& name) {
    Health health;
    node_->FillHealth(&health);
    for (const Metric& metric : health.metrics) {
      if (metric.name == name) {
        return metric.value;
      }
    }
    ADD_FAILURE() << "no metric " << name;
    return -1;
  }

  double jaw0_deg() const { return state_.handles[0].jaw_angle_rad * kDegPerRad; }

  bus::InProcessTopic<HandleState> topic_;
  std::unique_ptr<bus::Input<HandleState>> input_;
  std::unique_ptr<bus::Output<HandleState>> output_;
  CalibrationStore calibrations_;
  std::unique_ptr<HandleBridgeNode> node_;
  std::array<MemoryLink*, kMaxTools> handle_{};
  MemoryLink* pedal_ = nullptr;
  JawFirmware firmware_{{}, 5};
  std::uint64_t index_ = 0;
  HandleState state_;
};

TEST_F(NodeTest, PublishesAngleRateQualityAndPedals) {
  for (int i = 0; i < 800; ++i) {
    Tick(10 + 40.0 * i / 800, kPedalCut);
  }
  EXPECT_TRUE(state_.handles[0].present);
  EXPECT_NEAR(jaw0_deg(), 50, 1.5);
  EXPECT_NEAR(state_.handles[0].jaw_rate_rad_s * kDegPerRad, 20, 10);
  EXPECT_NEAR(state_.handles[1].jaw_angle_rad * kDegPerRad, 30, 1);
  EXPECT_EQ(state_.handles[0].quality, 1.0f);
  EXPECT_EQ(state_.pedals, kPedalCut);
  EXPECT_GE(state_.stamp.sequence, 799u) << "each period with a pedal down";
  EXPECT_NEAR(state_.handles[0].raw_counts, 514, 2);
  EXPECT_EQ(Error(), "");
  EXPECT_EQ(MetricOf("bad_lines"), 0);
  EXPECT_EQ(MetricOf("reconnects"), 0);
}

TEST_F(NodeTest, IsNotPresentBeforeTheFirstLine) {
  TickSilently();
  EXPECT_FALSE(state_.handles[0].present);
  EXPECT_EQ(state_.handles[0].quality, 0.0f);
}

TEST_F(NodeTest, LinesFromBeforeTheFirstStepAreDropped) {
  HandleBridgeNode::Links links;
  links.handles[0] = MakeLink(&handle_[0]);
  node_ =
      std::make_unique<HandleBridgeNode>(config::CartConfig(), calibrations_, std::move(links), output_.get(), 3000);
  for (int i = 0; i < 400; ++i) {
    const auto line = firmware_.Line(50);
    handle_[0]->bytes.append(line.data(), line.size());
  }
  TickSilently();
  EXPECT_FALSE(state_.handles[0].present);
  const auto line = firmware_.Line(10);
  handle_[0]->bytes.append(line.data(), line.size());
  TickSilently();
  EXPECT_NEAR(jaw0_deg(), 10, 2);
}

TEST_F(NodeTest, SilenceHoldsTheAngleAndReleasesThePedal) {
  for (int i = 0; i < 400; ++i) {
    Tick(25, kPedalCoag);
  }
  const double held = jaw0_deg();
  for (int i = 0; i < 78; ++i) {
    TickSilently();
  }
  EXPECT_EQ(state_.pedals, kPedalCoag);
  for (int i = 0; i < 10; ++i) {
    TickSilently();
  }
  EXPECT_EQ(state_.pedals, kPedalNone);
  EXPECT_EQ(state_.handles[0].quality, 0.0f);
  EXPECT_EQ(state_.handles[0].jaw_rate_rad_s, 0.0f);
  EXPECT_NEAR(jaw0_deg(), held, 1.0);
  EXPECT_NE(Error().find("handle 0: no-data"), std::string::npos) << Error();
  Tick(25);
  EXPECT_NEAR(jaw0_deg(), held, 1.5);
}

TEST_F(NodeTest, GarbageRaisesTheBaudAlarmAndMovesNothing) {
  for (int i = 0; i < 400; ++i) {
    Tick(25);
  }
  const double before = jaw0_deg();
  std::mt19937_64 random(4);
  for (int i = 0; i < 400; ++i) {
    for (int k = 0; k < 8; ++k) {
      handle_[0]->bytes.push_back(static_cast<char>(random()));
    }
    TickSilently();
    ASSERT_NEAR(jaw0_deg(), before, 1.5);
  }
  EXPECT_NE(Error().find("handle 0: garbage"), std::string::npos) << Error();
  EXPECT_GT(MetricOf("bad_lines"), 100);
  EXPECT_LT(state_.handles[0].quality, 0.5f);
}

TEST_F(NodeTest, BrokenWireIsNamed) {
  for (int i = 0; i < 400; ++i) {
    Tick(25);
  }
  const double before = jaw0_deg();
  for (int i = 0; i < 300; ++i) {
    const auto line = firmware_.Format(i % 2 == 0 ? 0 : 1023);
    handle_[0]->bytes.append(line.data(), line.size());
    TickSilently();
  }
  EXPECT_NE(Error().find("check the potentiometer's wires"), std::string::npos) << Error();
  EXPECT_NEAR(jaw0_deg(), before, 1.5);
}

TEST_F(NodeTest, FloatingWireMovesNothing) {
  for (int i = 0; i < 400; ++i) {
    Tick(25);
  }
  std::mt19937_64 random(9);
  double worst = 0;
  for (int i = 0; i < 4000; ++i) {
    const auto line = firmware_.Format(static_cast<int>(random() % 1024));
    handle_[0]->bytes.append(line.data(), line.size());
    TickSilently();
    worst = std::max(worst, std::abs(jaw0_deg() - 25));
  }
  EXPECT_LT(worst, 3.0);
  for (int i = 0; i < 40; ++i) {
    Tick(45);
  }
  EXPECT_NEAR(jaw0_deg(), 45, 1.5);  // After the repair it follows again.
}

TEST_F(NodeTest, StillJawForManySecondsIsHealthy) {
  for (int i = 0; i < 400 * 10; ++i) {
    const auto line = firmware_.Format(500);
    handle_[0]->bytes.append(line.data(), line.size());
    handle_[1]->bytes.append(line.data(), line.size());
    const auto pedal = FormatPedals(0);
    pedal_->bytes.append(pedal.data(), pedal.size());
    TickSilently();
  }
  EXPECT_EQ(Error(), "");
}

TEST_F(NodeTest, HangUpHoldsAndTheReturnGoesOn) {
  for (int i = 0; i < 400; ++i) {
    Tick(25, kPedalCut);
  }
  const double held = jaw0_deg();
  handle_[0]->phase = pedal_->phase = LinkPhase::kLost;
  TickSilently();
  EXPECT_NE(Error().find("handle 0: hung-up"), std::string::npos) << Error();
  EXPECT_EQ(state_.pedals, kPedalNone);
  handle_[0]->phase = LinkPhase::kReconnecting;
  TickSilently();
  EXPECT_NE(Error().find("handle 0: no-port"), std::string::npos) << Error();
  EXPECT_NEAR(jaw0_deg(), held, 1e-6);
  EXPECT_EQ(state_.handles[0].quality, 0.0f);
  handle_[0]->phase = pedal_->phase = LinkPhase::kOpen;
  handle_[0]->fresh = pedal_->fresh = true;
  handle_[0]->bytes = "12\r\n";  // The end of a line whose beginning was discarded.
  for (int i = 0; i < 40; ++i) {
    Tick(45, kPedalCut);
  }
  EXPECT_NEAR(jaw0_deg(), 45, 2);
  EXPECT_EQ(state_.pedals, kPedalCut);
  EXPECT_EQ(Error(), "");
  EXPECT_EQ(MetricOf("reconnects"), 2);
}

TEST_F(NodeTest, SkippedPeriodsAndTheirBacklogAreTaken) {
  for (int i = 0; i < 400; ++i) {
    Tick(20);
  }
  for (int i = 0; i < 10; ++i) {
    const auto line = firmware_.Line(22);
    handle_[0]->bytes.append(line.data(), line.size());
  }
  TickSilently(9);
  EXPECT_EQ(state_.handles[0].quality, 1.0f);
  EXPECT_NEAR(jaw0_deg(), 22, 1.5);
}

TEST_F(NodeTest, RestartTakesTheAngleFromTheFirstLineUnderANewEpoch) {
  for (int i = 0; i < 400; ++i) {
    Tick(40);
  }
  const std::uint64_t epoch = state_.stamp.epoch;
  index_ = 0;
  Restart(2000);
  Tick(40);
  EXPECT_TRUE(state_.handles[0].present);
  EXPECT_NEAR(jaw0_deg(), 40, 2);
  EXPECT_GT(state_.stamp.epoch, epoch);
  EXPECT_LE(state_.stamp.sequence, 2u);
}

TEST_F(NodeTest, AStillHandleIsPublishedAHundredTimesASecondAndThenLessOften) {
  const auto sent_in = [this](int ticks) {
    const std::uint64_t begin = state_.stamp.sequence;
    for (int i = 0; i < ticks; ++i) TickSilently();
    return state_.stamp.sequence - begin;
  };
  for (int i = 0; i < 40; ++i) Tick(40, kPedalCoag);
  for (int i = 0; i < 4; ++i) Tick(40);
  EXPECT_GE(sent_in(40), 10u) << "after a change, in a tenth of a second";
  (void)sent_in(400);  // The lines are silent, too: quality changes.
  const std::uint64_t at_rest = sent_in(400);
  EXPECT_GE(at_rest, 25u);
  EXPECT_LE(at_rest, 27u);
  const std::uint64_t begin = state_.stamp.sequence;
  for (int i = 0; i < 40; ++i) Tick(40, kPedalCoag);
  EXPECT_GE(state_.stamp.sequence - begin, 39u) << "a pedal that is down is repeated each period";
}

TEST_F(NodeTest, AJawThatMovesSlowlyIsNotAtRest) {
  double jaw_deg = 10;
  for (int i = 0; i < 100; ++i) Tick(jaw_deg);
  const std::uint64_t begin = state_.stamp.sequence;
  for (int i = 0; i < 800; ++i) Tick(jaw_deg += 0.015);  // 6 degrees a second
  EXPECT_GE(state_.stamp.sequence - begin, 180u) << "a hundred times a second";
}

TEST_F(NodeTest, NoiseBetweenTwoCountsIsRestAndAChangeBeyondItIsPublishedInItsTick) {
  const auto published_at_ns = [this] { return state_.stamp.stamp_ns; };
  for (const double jaw_deg : {0.0, 20.0, 33.3}) {
    for (int i = 0; i < 800; ++i) Tick(jaw_deg);
    const std::uint64_t begin = state_.stamp.sequence;
    double sent_deg = jaw0_deg();
    for (int i = 0; i < 4000; ++i) {
      Tick(jaw_deg);
      const double change_deg = std::abs(MetricOf("jaw0_deg") - sent_deg);
      sent_deg = jaw0_deg();
      const auto now_ns = static_cast<std::int64_t>(2500000 * (index_ - 1));
      if (change_deg > 0.3) {
        ASSERT_EQ(published_at_ns(), now_ns) << "a change by " << change_deg << " degrees";
      }
    }
    EXPECT_LE(state_.stamp.sequence - begin, 450u) << "in 10 s at " << jaw_deg << " degrees";
  }
}

TEST_F(NodeTest, AbsentHandleIsNeitherPublishedNorMissed) {
  HandleBridgeNode::Links links;
  links.handles[0] = MakeLink(&handle_[0]);
  node_ =
      std::make_unique<HandleBridgeNode>(config::CartConfig(), calibrations_, std::move(links), output_.get(), 3000);
  TickSilently();
  for (int i = 0; i < 100; ++i) {
    const auto line = firmware_.Line(20);
    handle_[0]->bytes.append(line.data(), line.size());
    TickSilently();
  }
  EXPECT_TRUE(state_.handles[0].present);
  EXPECT_FALSE(state_.handles[1].present);
  EXPECT_EQ(state_.pedals, kPedalNone);
  EXPECT_EQ(Error(), "");
}

TEST_F(NodeTest, FramesAreTakenAndTheirLossCounted) {
  std::uint8_t sequence = 250;
  for (int i = 0; i < 400; ++i, ++sequence) {
    if (i % 10 == 9) {
      TickSilently();
      continue;
    }
    const auto line = FormatFrame({kLeftHandle, sequence, firmware_.Convert(25)});
    handle_[0]->bytes.append(line.data(), line.size());
    const auto pedal = FormatFrame({kPedalSender, static_cast<std::uint8_t>(i), kPedalCoag});
    pedal_->bytes.append(pedal.data(), pedal.size());
    const auto second = firmware_.Line(30);
    handle_[1]->bytes.append(second.data(), second.size());
    TickSilently();
  }
  EXPECT_NEAR(jaw0_deg(), 25, 1.5);
  EXPECT_EQ(state_.pedals, kPedalCoag);
  EXPECT_EQ(MetricOf("lost_frames"), 39 + 39);  // The last loss of each is not detected yet.
  EXPECT_EQ(Error(), "");
}

TEST_F(NodeTest, AnotherUnitsFramesAreRefusedAndNamed) {
  for (int i = 0; i < 400; ++i) {
    const auto line = FormatFrame({kRightHandle, static_cast<std::uint8_t>(i), 500});
    handle_[0]->bytes.append(line.data(), line.size());
    pedal_->bytes.append(line.data(), line.size());
    handle_[1]->bytes.append(line.data(), line.size());
    TickSilently();
  }
  EXPECT_FALSE(state_.handles[0].present);
  EXPECT_TRUE(state_.handles[1].present);
  EXPECT_EQ(Error(),
            "handle 0: swapped: another unit is plugged in here: swap the plugs, or correct `hand` in the cart; "
            "pedal: swapped");
}

TEST_F(NodeTest, WrongBaudIsToldFromGarbageAndMended) {
  std::mt19937_64 random(4);
  // Handle 0 sends at 38400: at any other speed its bytes are noise. The pedal's line is noise at every speed.
  for (int i = 0; i < 1200; ++i) {
    if (handle_[0]->baud == 38400) {
      const auto line = firmware_.Line(25);
      handle_[0]->bytes.append(line.data(), line.size());
    } else {
      handle_[0]->bytes.append({static_cast<char>(random()), static_cast<char>(random())});
    }
    pedal_->bytes.append({static_cast<char>(random()), static_cast<char>(random())});
    const auto second = firmware_.Line(30);
    handle_[1]->bytes.append(second.data(), second.size());
    TickSilently();
  }
  EXPECT_NEAR(jaw0_deg(), 25, 1.5);
  EXPECT_EQ(state_.handles[0].quality, 1.0f);
  EXPECT_EQ(Error().rfind("handle 0: wrong-baud: its baud rate differs", 0), 0u) << Error();
  EXPECT_NE(Error().find("; pedal: garbage"), std::string::npos) << Error();
  EXPECT_EQ(MetricOf("reconnects"), 0);
}

TEST_F(NodeTest, EachUnitHasItsOwnCalibration) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("handle_node_test." + std::to_string(::getpid()));
  // On unit B the same codes stand for half the angle.
  const CalibrationPoints half{{485.376, 520.192}, {0, 30}};
  EXPECT_EQ(CalibrationStore::Save(folder, "B", half), folder / "B.yaml");
  calibrations_ = CalibrationStore::Load(folder);
  std::filesystem::remove_all(folder);
  Restart(2000);
  for (int i = 0; i < 100; ++i) {
    Tick(40);
  }
  EXPECT_NEAR(jaw0_deg(), 40, 1.5);
  EXPECT_EQ(MetricOf("calibration0_points"), 0);
  handle_[0]->phase = LinkPhase::kReconnecting;
  TickSilently();
  handle_[0]->phase = LinkPhase::kOpen;
  handle_[0]->fresh = true;
  handle_[0]->serial_number = "B";
  for (int i = 0; i < 100; ++i) {
    Tick(40);
  }
  EXPECT_NEAR(jaw0_deg(), 20, 1.5);
  EXPECT_EQ(MetricOf("calibration0_points"), 2);
  EXPECT_EQ(MetricOf("calibration1_points"), 0);
}

}  // namespace
}  // namespace fulcrum::handle_bridge
