#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <vector>

#include "handle_bridge/protocol/baud_search.h"
#include "handle_bridge/protocol/frame.h"
#include "handle_bridge/protocol/jaw_line.h"
#include "handle_bridge/protocol/line_framer.h"
#include "handle_bridge/protocol/link_monitor.h"
#include "handle_bridge/protocol/pedal_line.h"
#include "handle_bridge/simulation/jaw_firmware.h"

namespace fulcrum::handle_bridge {
namespace {

struct Lines {
  std::vector<std::string> lines;
  int bad = 0;
};

Lines Cut(std::string_view bytes) {
  Lines cut;
  LineFramer framer;
  for (const char byte : bytes) {
    const LineFramer::Event event = framer.Add(byte);
    if (event == LineFramer::Event::kLine) {
      cut.lines.emplace_back(framer.line());
    }
    cut.bad += event == LineFramer::Event::kBad;
  }
  return cut;
}

std::string LineOf(int code) {
  const auto line = JawFirmware({}, 1).Format(code);
  return {line.data(), line.size() - 2};
}

TEST(LineFramer, CutsAtCarriageReturnLineFeed) {
  const Lines cut = Cut("2.4512\r\n2.3700\r\n\r\n2.5");
  EXPECT_EQ(cut.lines, (std::vector<std::string>{"2.4512", "2.3700", ""}));
  EXPECT_EQ(cut.bad, 0);
}

TEST(LineFramer, LineWithoutCarriageReturnIsBad) {
  const Lines cut = Cut("2.4512\n2.3700\r\n");
  EXPECT_EQ(cut.lines, (std::vector<std::string>{"2.3700"}));
  EXPECT_EQ(cut.bad, 1);
}

TEST(LineFramer, OverlongLineIsBadOnceAndTheNextLineIsWhole) {
  const Lines cut = Cut("2.45122.45122.4512\r\n2.3700\r\n");
  EXPECT_EQ(cut.lines, (std::vector<std::string>{"2.3700"}));
  EXPECT_EQ(cut.bad, 1);
}

TEST(LineFramer, EndlessGarbageCountsAsManyBadLines) {
  const Lines cut = Cut(std::string(1600, 'x'));
  EXPECT_TRUE(cut.lines.empty());
  EXPECT_NEAR(cut.bad, 100, 1);
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
  // The same count sent by a handle that computes with the rounded 0.00488 V.
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

constexpr LinkCounts kGoodLine{.bytes = 8, .good = 1};
constexpr LinkCounts kBadLine{.bytes = 8, .malformed = 1};

/// Feeds `n` ticks of 2.5 ms.
void Feed(LinkMonitor* monitor, int n, const LinkCounts& counts) {
  for (int i = 0; i < n; ++i) {
    monitor->Add(counts, 0.0025);
  }
}

TEST(LinkMonitor, TellsGoodSilentGarbledAndWrongStep) {
  const LinkCounts good{.bytes = 8, .good = 1}, bad{.bytes = 8, .malformed = 1}, off{.bytes = 8, .off_grid = 1},
      other{.bytes = 14, .other = 1}, silent{};
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
  Feed(&monitor, 400, other);
  EXPECT_EQ(monitor.state(), LinkState::kSwapped);
}

TEST(LinkMonitor, AlarmComesBelowHalfOfTheLinesAndWithinHalfASecond) {
  LinkMonitor monitor;
  Feed(&monitor, 400, kGoodLine);
  int ticks = 0;
  while (monitor.state() == LinkState::kOk && ticks < 1000) {
    monitor.Add(kBadLine, 0.0025);
    ++ticks;
  }
  EXPECT_LE(ticks * 0.0025, 0.3);
  LinkMonitor sixty;
  for (int i = 0; i < 1000; ++i) {
    sixty.Add(i % 5 < 3 ? kGoodLine : kBadLine, 0.0025);
  }
  EXPECT_EQ(sixty.state(), LinkState::kOk);
  EXPECT_NEAR(sixty.quality(), 0.6f, 0.02f);
}

TEST(LinkMonitor, StallOfTheProgramClearsTheWindow) {
  LinkMonitor monitor;
  Feed(&monitor, 400, kBadLine);
  EXPECT_EQ(monitor.state(), LinkState::kGarbage);
  monitor.Add(kGoodLine, 5.0);
  Feed(&monitor, 10, kGoodLine);
  EXPECT_EQ(monitor.state(), LinkState::kOk);
}

TEST(LinkMonitor, AStallIsNoSilenceOfTheLineUntilTheLineStaysSilent) {
  for (const double stall_s : {0.15, 0.3, 5.0}) {
    LinkMonitor monitor;
    Feed(&monitor, 400, kGoodLine);
    Feed(&monitor, 8, {});  // A pedal sends each 20 ms.
    monitor.Add({}, stall_s);
    EXPECT_EQ(monitor.state(), LinkState::kOk) << stall_s;
    LinkMonitor alive = monitor;
    Feed(&alive, 8, kGoodLine);
    EXPECT_EQ(alive.state(), LinkState::kOk) << stall_s;
    Feed(&monitor, 80, {});
    EXPECT_EQ(monitor.state(), LinkState::kNoData) << stall_s;
  }
}

std::string FrameLine(const Frame& frame) {
  const auto line = FormatFrame(frame);
  return {line.data(), line.size() - 2};
}

TEST(Frame, EveryCodeAndSequenceRoundTrips) {
  for (int value = 0; value <= 9999; ++value) {
    const Frame sent{value % 2 == 0 ? kLeftHandle : kRightHandle, static_cast<std::uint8_t>(value * 7), value};
    const std::optional<Frame> frame = ParseFrame(FrameLine(sent));
    ASSERT_TRUE(frame) << value;
    EXPECT_EQ(frame->sender, sent.sender);
    EXPECT_EQ(frame->sequence, sent.sequence);
    EXPECT_EQ(frame->value, value);
  }
}

TEST(Frame, IsWhatItsDescriptionSays) {
  // CRC-8/AUTOSAR of "123456789" is 0xDF; here the frame of the description.
  EXPECT_EQ(FrameLine({kLeftHandle, 0x1A, 503}), "$L1A,0503*29");
  EXPECT_TRUE(ParseFrame("$L1A,0503*29"));
  for (const char* bad : {"", "$", "$L1A,0503*2A", "$l1A,0503*29", "$L1a,0503*29", "$L1A,503*91", "$L1A,0503*29 ",
                          "$L1A,05O3*91", "L1A,0503*29", "2.4512"}) {
    EXPECT_FALSE(ParseFrame(bad)) << bad;
  }
}

TEST(Frame, NoDamageOfTwoBitsIsBelievedAndOfThreeHardlyAny) {
  const std::string line = FrameLine({kRightHandle, 0xC7, 498});
  const auto bits = static_cast<int>(8 * line.size());
  const auto flipped = [](std::string text, int bit) {
    text[static_cast<std::size_t>(bit / 8)] =
        static_cast<char>(text[static_cast<std::size_t>(bit / 8)] ^ (1 << bit % 8));
    return text;
  };
  int believed = 0;
  for (int a = 0; a < bits; ++a) {
    const std::string one = flipped(line, a);
    EXPECT_FALSE(ParseFrame(one)) << one;
    for (int b = a + 1; b < bits; ++b) {
      const std::string two = flipped(one, b);
      EXPECT_FALSE(ParseFrame(two)) << two;
      for (int c = b + 1; c < bits; ++c) {
        believed += ParseFrame(flipped(two, c)) ? 1 : 0;
      }
    }
  }
  // 142,880 cases. The CRC itself would detect all of them, but one flip can change three bits of a hexadecimal letter.
  EXPECT_LE(believed, 3);
}

TEST(SequenceCounter, CountsWhatIsMissingAcrossTheWrap) {
  SequenceCounter counter;
  EXPECT_EQ(counter.Lost(0xFE), 0u);
  EXPECT_EQ(counter.Lost(0xFF), 0u);
  EXPECT_EQ(counter.Lost(0x00), 0u);
  EXPECT_EQ(counter.Lost(0x04), 3u);
}

TEST(JawLineGate, TakesFramesOfItsHandAndPlainLines) {
  JawLineSettings settings;
  settings.sender = kRightHandle;
  JawLineGate gate(settings);
  EXPECT_EQ(gate.Check(FrameLine({kRightHandle, 5, 500})).verdict, LineVerdict::kGood);
  const JawReading later = gate.Check(FrameLine({kRightHandle, 8, 501}));
  EXPECT_EQ(later.code, 501);
  EXPECT_EQ(later.lost, 2u);
  EXPECT_EQ(gate.Check(FrameLine({kLeftHandle, 9, 501})).verdict, LineVerdict::kOther);
  EXPECT_EQ(gate.Check(FrameLine({kPedalSender, 9, 1})).verdict, LineVerdict::kOther);
  EXPECT_EQ(gate.Check(FrameLine({kRightHandle, 9, 700})).verdict, LineVerdict::kOutside);
  EXPECT_EQ(gate.Check(FrameLine({kRightHandle, 10, 1024})).verdict, LineVerdict::kMalformed);
  EXPECT_EQ(gate.Check(LineOf(501)).verdict, LineVerdict::kGood);
}

constexpr LinkCounts kNothing{};

/// Ticks until the search changes the speed, or 0 after 10 s.
int TicksUntilChange(BaudSearch* search, const LinkCounts& counts) {
  for (int tick = 1; tick <= 4000; ++tick) {
    if (search->Add(counts, 0.0025)) {
      return tick;
    }
  }
  return 0;
}

TEST(BaudSearch, TriesEveryUsualSpeedAndTheKnownOneInBetween) {
  BaudSearch search(115200);
  std::vector<int> tried;
  for (int i = 0; i < 14; ++i) {
    EXPECT_NEAR(TicksUntilChange(&search, kBadLine), 100, 2);
    EXPECT_TRUE(search.searching());
    tried.push_back(search.baud());
  }
  for (std::size_t i = 0; i < tried.size(); ++i) {
    EXPECT_EQ(tried[i], i % 2 == 1 ? 115200 : kUsualBauds[1 + i / 2]);
  }
}

TEST(BaudSearch, StaysWhereALineIsValidAndSaysSo) {
  BaudSearch search(115200);
  EXPECT_NE(TicksUntilChange(&search, kBadLine), 0);
  EXPECT_EQ(search.baud(), 57600);
  EXPECT_FALSE(search.Add(kGoodLine, 0.0025));
  EXPECT_FALSE(search.searching());
  EXPECT_TRUE(search.found_other());
  // A disturbance of less than a second changes nothing.
  for (int i = 0; i < 390; ++i) {
    EXPECT_FALSE(search.Add(kBadLine, 0.0025));
  }
  EXPECT_FALSE(search.Add(kGoodLine, 0.0025));
  EXPECT_EQ(search.baud(), 57600);
}

TEST(BaudSearch, SilenceAndHalfLinesChangeNothing) {
  BaudSearch search(115200);
  EXPECT_EQ(TicksUntilChange(&search, kNothing), 0);
  EXPECT_FALSE(search.Add({.bytes = 7}, 0.0025));
  EXPECT_EQ(TicksUntilChange(&search, kNothing), 0);
  EXPECT_FALSE(search.searching());
}

}  // namespace
}  // namespace fulcrum::handle_bridge
