#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "handle_bridge/protocol/jaw_line.h"
#include "handle_bridge/protocol/line_framer.h"
#include "handle_bridge/protocol/link_monitor.h"
#include "handle_bridge/protocol/pedal_line.h"
#include "handle_bridge/simulation/jaw_firmware.h"

namespace fulcrum::handle_bridge {
namespace {

constexpr double kStep_V = 5.0 / 1024;

struct Framed {
  std::vector<std::string> lines;
  int bad = 0;
};

Framed Frame(std::string_view bytes) {
  Framed framed;
  LineFramer framer;
  for (const char byte : bytes) {
    const LineFramer::Event event = framer.Add(byte);
    if (event == LineFramer::Event::kLine) {
      framed.lines.emplace_back(framer.line());
    }
    framed.bad += event == LineFramer::Event::kBad;
  }
  return framed;
}

std::string LineOf(int code) {
  const auto line = JawFirmware({}, 1).Format(code);
  return {line.data(), line.size() - 2};
}

TEST(LineFramer, CutsAtCarriageReturnLineFeed) {
  const Framed framed = Frame("2.4512\r\n2.3700\r\n\r\n2.5");
  EXPECT_EQ(framed.lines, (std::vector<std::string>{"2.4512", "2.3700", ""}));
  EXPECT_EQ(framed.bad, 0);
}

TEST(LineFramer, LineWithoutCarriageReturnIsBad) {
  const Framed framed = Frame("2.4512\n2.3700\r\n");
  EXPECT_EQ(framed.lines, (std::vector<std::string>{"2.3700"}));
  EXPECT_EQ(framed.bad, 1);
}

TEST(LineFramer, OverlongLineIsBadOnceAndTheNextLineIsWhole) {
  const Framed framed = Frame("2.45122.45122.4512\r\n2.3700\r\n");
  EXPECT_EQ(framed.lines, (std::vector<std::string>{"2.3700"}));
  EXPECT_EQ(framed.bad, 1);
}

TEST(LineFramer, EndlessGarbageCountsAsManyBadLines) {
  const Framed framed = Frame(std::string(1600, 'x'));
  EXPECT_TRUE(framed.lines.empty());
  EXPECT_NEAR(framed.bad, 100, 1);
}

TEST(ParseVoltage, AcceptsExactlyOneDigitPointFourDigits) {
  EXPECT_EQ(ParseVoltage("2.4512"), 24512);
  EXPECT_EQ(ParseVoltage("0.0000"), 0);
  EXPECT_EQ(ParseVoltage("9.9999"), 99999);
  for (const char* bad : {"", "2", "2.451", "2.45123", "24512.", "2,4512", "-.4512", "+2.451", " 2.451", "2.451 ",
                          "2.45a2", "2e4512", "0x4512", "2.4 12", "nan   ", "2.-512", "2.4512\r"}) {
    EXPECT_FALSE(ParseVoltage(bad)) << bad;
  }
}

TEST(JawFirmware, SendsThePapersVoltages) {
  JawFirmwareSettings quiet;
  quiet.noise_V = 0;
  JawFirmware firmware(quiet, 1);
  EXPECT_EQ(firmware.Convert(0), 485);   // 2.37 V
  EXPECT_EQ(firmware.Convert(60), 520);  // 2.54 V
  EXPECT_EQ(LineOf(502), "2.4512");
  const auto line = firmware.Line(30);
  EXPECT_EQ(line[6], '\r');
  EXPECT_EQ(line[7], '\n');
}

TEST(JawLineGate, EveryCodeRoundTripsThroughItsLine) {
  JawLineSettings all;
  all.min_code = 0;
  all.max_code = kMaxCode;
  for (int code = 0; code <= kMaxCode; ++code) {
    JawLineGate gate(all);
    const JawReading reading = gate.Check(LineOf(code));
    EXPECT_EQ(reading.verdict, LineVerdict::kGood) << code;
    EXPECT_EQ(reading.code, code);
  }
}

TEST(JawLineGate, NoSingleDamagedBitOrDigitGivesAWrongCode) {
  for (int code = 486; code <= 520; ++code) {
    const std::string line = LineOf(code);
    for (std::size_t place = 0; place < line.size(); ++place) {
      for (int byte = 0; byte < 256; ++byte) {
        std::string damaged = line;
        damaged[place] = static_cast<char>(byte);
        JawLineGate gate{JawLineSettings{}};
        const JawReading reading = gate.Check(damaged);
        if (reading.verdict == LineVerdict::kGood) {
          EXPECT_EQ(reading.code, code) << damaged;
        }
      }
    }
  }
}

TEST(JawLineGate, AnotherConvertersStepIsToldFromGarbage) {
  JawLineGate gate{JawLineSettings{}};
  // The paper's example line is count 502 of 5 V / 1024.
  const JawReading reading = gate.Check("2.4512");
  EXPECT_EQ(reading.verdict, LineVerdict::kGood);
  EXPECT_EQ(reading.code, 502);
  // The same count of a handle that computes with the rounded 0.00488 V.
  EXPECT_EQ(gate.Check("2.4498").verdict, LineVerdict::kOffGrid);
  JawLineSettings rounded;
  rounded.adc_step_V = 0.00488;
  JawLineGate rounded_gate(rounded);
  EXPECT_EQ(rounded_gate.Check("2.4498").code, 502);
}

TEST(JawLineGate, CodeBeyondCalibrationIsOutside) {
  JawLineGate gate{JawLineSettings{}};
  EXPECT_EQ(gate.Check(LineOf(0)).verdict, LineVerdict::kOutside);
  EXPECT_EQ(gate.Check(LineOf(481)).verdict, LineVerdict::kOutside);
  EXPECT_EQ(gate.Check(LineOf(482)).verdict, LineVerdict::kGood);
}

TEST(JawLineGate, JumpIsRefusedUntilThreeReadingsAgree) {
  JawLineGate gate{JawLineSettings{}};
  EXPECT_EQ(gate.Check(LineOf(490)).verdict, LineVerdict::kGood);
  EXPECT_EQ(gate.Check(LineOf(494)).verdict, LineVerdict::kGood);
  EXPECT_EQ(gate.Check(LineOf(515)).verdict, LineVerdict::kJump);
  EXPECT_EQ(gate.Check(LineOf(494)).verdict, LineVerdict::kGood);
  EXPECT_EQ(gate.Check(LineOf(515)).verdict, LineVerdict::kJump);
  EXPECT_EQ(gate.Check(LineOf(516)).verdict, LineVerdict::kJump);
  EXPECT_EQ(gate.Check(LineOf(516)).verdict, LineVerdict::kGood);
}

TEST(JawLineGate, AfterLostLinesTheJawMayHaveMovedFurther) {
  JawLineGate gate{JawLineSettings{}};
  EXPECT_EQ(gate.Check(LineOf(490)).verdict, LineVerdict::kGood);
  for (int i = 0; i < 6; ++i) {
    gate.Miss();
  }
  EXPECT_EQ(gate.Check(LineOf(500)).verdict, LineVerdict::kGood);
}

TEST(WiringMonitor, FourOfEightImplausibleReadingsAreAFault) {
  WiringMonitor monitor;
  for (int i = 0; i < 3; ++i) {
    monitor.Add(LineVerdict::kOutside);
    EXPECT_FALSE(monitor.faulty());
  }
  monitor.Add(LineVerdict::kJump);
  EXPECT_TRUE(monitor.faulty());
  for (int i = 0; i < 8; ++i) {
    monitor.Add(LineVerdict::kGood);
  }
  EXPECT_FALSE(monitor.faulty());
}

TEST(PedalLine, EveryCombinationRoundTrips) {
  for (std::uint8_t bits = 0; bits <= kAllPedals; ++bits) {
    const auto line = FormatPedals(bits);
    EXPECT_EQ(ParsePedals({line.data(), 3}), bits);
  }
  EXPECT_EQ(ParsePedals("P1E"), 1);
}

TEST(PedalLine, NoSingleDamagedByteChangesThePedals) {
  for (std::uint8_t bits = 0; bits <= kAllPedals; ++bits) {
    for (std::size_t place = 0; place < 3; ++place) {
      for (int byte = 0; byte < 256; ++byte) {
        auto line = FormatPedals(bits);
        line[place] = static_cast<char>(byte);
        const auto parsed = ParsePedals({line.data(), 3});
        EXPECT_TRUE(!parsed || *parsed == bits);
      }
    }
  }
}

/// Feeds `n` ticks of 2.5 ms.
void Feed(LinkMonitor* monitor, int n, const LinkCounts& counts) {
  for (int i = 0; i < n; ++i) {
    monitor->Add(counts, 0.0025);
  }
}

TEST(LinkMonitor, TellsGoodSilentGarbledAndWrongStep) {
  const LinkCounts good{8, 1, 0, 0, 0}, bad{8, 0, 1, 0, 0}, off{8, 0, 0, 1, 0}, silent{};
  LinkMonitor monitor;
  Feed(&monitor, 400, good);
  EXPECT_EQ(monitor.state(), LinkState::kOk);
  EXPECT_EQ(monitor.quality(), 1.0f);
  Feed(&monitor, 79, silent);
  EXPECT_EQ(monitor.state(), LinkState::kOk);
  Feed(&monitor, 2, silent);
  EXPECT_EQ(monitor.state(), LinkState::kNoData);
  EXPECT_EQ(monitor.quality(), 0.0f);
  Feed(&monitor, 400, bad);
  EXPECT_EQ(monitor.state(), LinkState::kGarbage);
  Feed(&monitor, 400, off);
  EXPECT_EQ(monitor.state(), LinkState::kWrongStep);
  Feed(&monitor, 220, good);
  EXPECT_EQ(monitor.state(), LinkState::kOk);
}

TEST(LinkMonitor, AlarmComesBelowHalfOfTheLinesAndWithinHalfASecond) {
  LinkMonitor monitor;
  Feed(&monitor, 400, {8, 1, 0, 0, 0});
  int ticks = 0;
  while (monitor.state() == LinkState::kOk && ticks < 1000) {
    monitor.Add({8, 0, 1, 0, 0}, 0.0025);
    ++ticks;
  }
  EXPECT_LE(ticks * 0.0025, 0.3);
  LinkMonitor sixty;
  for (int i = 0; i < 1000; ++i) {
    sixty.Add(i % 5 < 3 ? LinkCounts{8, 1, 0, 0, 0} : LinkCounts{8, 0, 1, 0, 0}, 0.0025);
  }
  EXPECT_EQ(sixty.state(), LinkState::kOk);
  EXPECT_NEAR(sixty.quality(), 0.6f, 0.02f);
}

TEST(LinkMonitor, StallOfTheProgramClearsTheWindow) {
  LinkMonitor monitor;
  Feed(&monitor, 400, {8, 0, 1, 0, 0});
  EXPECT_EQ(monitor.state(), LinkState::kGarbage);
  monitor.Add({8, 1, 0, 0, 0}, 5.0);
  Feed(&monitor, 10, {8, 1, 0, 0, 0});
  EXPECT_EQ(monitor.state(), LinkState::kOk);
}

/// Mutates valid lines and pure noise; the framer and the gates must keep their promises on every byte.
TEST(Protocol, HoldsItsPromisesOnAHundredThousandMutatedInputs) {
  std::mt19937_64 random(20);
  LineFramer framer;
  JawLineGate gate{JawLineSettings{}};
  int good = 0;
  for (int input = 0; input < 200000; ++input) {
    std::string bytes;
    const int code = 486 + static_cast<int>(random() % 35);
    if (random() % 8 != 0) {
      const auto line = JawFirmware({}, 1).Format(code);
      bytes.assign(line.data(), line.size());
    } else {
      bytes.resize(random() % 40);
      for (char& byte : bytes) {
        byte = static_cast<char>(random());
      }
    }
    for (std::uint64_t edits = random() % 4; edits > 0 && !bytes.empty(); --edits) {
      const std::size_t at = random() % bytes.size();
      switch (random() % 4) {
        case 0:
          bytes[at] = static_cast<char>(bytes[at] ^ (1 << random() % 8));
          break;
        case 1:
          bytes.erase(at, 1);
          break;
        case 2:
          bytes.insert(at, 1, static_cast<char>(random()));
          break;
        default:
          bytes.insert(at, bytes);
      }
    }
    for (const char byte : bytes) {
      if (framer.Add(byte) != LineFramer::Event::kLine) {
        continue;
      }
      ASSERT_LT(framer.line().size(), LineFramer::kMaxLineBytes);
      static_cast<void>(ParsePedals(framer.line()));
      const JawReading reading = gate.Check(framer.line());
      ASSERT_GE(reading.code, 0);
      ASSERT_LE(reading.code, kMaxCode);
      if (reading.verdict == LineVerdict::kGood) {
        ASSERT_EQ(framer.line().size(), 6u);
        ASSERT_LE(std::abs(std::stod(std::string(framer.line())) - reading.code * kStep_V), kStep_V * 0.0125 + 1e-9);
        ++good;
      }
    }
  }
  EXPECT_GT(good, 20000);
}

}  // namespace
}  // namespace fulcrum::handle_bridge
