#include "handle_bridge/node/calibrate_command.h"

#include <algorithm>
#include <atomic>
#include <boost/program_options.hpp>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "handle_bridge/estimator/jaw_calibration.h"
#include "handle_bridge/node/calibration_store.h"
#include "handle_bridge/node/cart_links.h"
#include "handle_bridge/protocol/jaw_line.h"
#include "handle_bridge/protocol/line_framer.h"
#include "services/base/core/error.h"
#include "services/base/core/exit_code.h"
#include "services/base/runtime/cyclic_thread.h"

namespace fulcrum::handle_bridge {
namespace {

namespace po = boost::program_options;

constexpr double kSettle_s = 0.3;   ///< Settling time after Enter: the hand moves while the other one presses the key.
constexpr double kHold_s = 1.0;     ///< Duration of the readings for a point.
constexpr double kSilence_s = 1.0;  ///< Timeout without enough readings: a fault of the link.
constexpr auto kPoll = std::chrono::milliseconds(2);

constexpr const char* kUsage =
    "usage: handle_bridge calibrate [--cart FILE] [--tool N] [--angles A,B,...]\n\n"
    "Calibrates a handle in the hand. Stop the session first: a port has one reader.\n"
    "For each angle, set the jaw to it with a gauge, hold the handle as in use, and\n"
    "press Enter. A point that cannot be used says why and is asked for again; Ctrl-D\n"
    "or Ctrl-C leaves everything as it was. The result is stored for the unit's\n"
    "serial number and used from the next start on, whatever the cart says.\n"
    "A simulated handle obeys: it opens its jaw to the angle by itself.\n\n";

struct Options {
  config::CartConfig cart;
  std::size_t tool = 0;
  std::vector<double> angles_deg;
};

std::vector<double> ParseAngles(const std::string& text) {
  std::vector<double> angles;
  std::size_t at = 0;
  while (at <= text.size()) {
    const std::size_t comma = std::min(text.find(',', at), text.size());
    const std::string word = text.substr(at, comma - at);
    std::size_t used = 0;
    double angle = NAN;
    try {
      angle = std::stod(word, &used);
    } catch (const std::exception&) {
      used = 0;
    }
    if (used == 0 || used != word.size() || !(angle >= -10 && angle <= 120)) {
      throw InputError("--angles: '" + word + "' is not an angle; valid: -10 to 120 deg, for example 0,15,30,45,60");
    }
    if (std::find(angles.begin(), angles.end(), angle) != angles.end()) {
      throw InputError("--angles: '" + word + "' is given twice; each angle is one point");
    }
    angles.push_back(angle);
    at = comma + 1;
  }
  if (angles.size() < 2 || angles.size() > JawCalibration::kMaxPoints) {
    throw InputError("--angles: " + std::to_string(angles.size()) + " given; valid: 2 to 9");
  }
  return angles;
}

/// The cart without links but that of one handle: no other port is opened.
config::CartConfig WithHandleAlone(config::CartConfig cart, std::size_t tool) {
  for (std::size_t other = 0; other < cart.handles.size(); ++other) {
    if (other != tool) cart.handles[other].kind = config::LinkKind::kNone;
  }
  cart.pedal.kind = config::LinkKind::kNone;
  return cart;
}

/// Parses the options; no value if help was requested and printed.
std::optional<Options> Parse(const std::vector<std::string>& words, std::ostream& out) {
  po::options_description known("Options");
  known.add_options()                                                                                           //
      ("cart", po::value<std::string>()->value_name("FILE"), "cart configuration; default: all simulated")      //
      ("tool", po::value<int>()->value_name("N")->default_value(0), "the handle of this tool, 0 to 3")          //
      ("angles", po::value<std::string>()->value_name("A,B,...")->default_value("0,15,30,45,60"), "jaw [deg]")  //
      ("help", "print this");
  po::variables_map values;
  try {
    po::store(po::command_line_parser(words).options(known).positional({}).run(), values);
  } catch (const po::error& error) {
    throw InputError(std::string(error.what()) + "; see handle_bridge calibrate --help");
  }
  if (values.count("help") != 0) {
    out << kUsage << known << "\nStored in " << CalibrationFolder().string() << "\n";
    return {};
  }
  Options options;
  if (values.count("cart") != 0) {
    options.cart = config::LoadCart(values["cart"].as<std::string>());
  }
  const int tool = values["tool"].as<int>();
  if (tool < 0 || tool >= kMaxTools) {
    throw InputError("--tool " + std::to_string(tool) + ": valid: 0 to " + std::to_string(kMaxTools - 1));
  }
  options.tool = static_cast<std::size_t>(tool);
  const config::LinkKind kind = options.cart.handles[options.tool].kind;
  if (kind == config::LinkKind::kNone) {
    throw InputError("--tool " + std::to_string(tool) + ": the cart has no handle there");
  }
  if (kind != config::LinkKind::kSerial && kind != config::LinkKind::kSimulated) {
    throw InputError("--tool " + std::to_string(tool) +
                     ": the cart's handle there is operated by buttons or an operator and has no jaw to measure; "
                     "valid kinds: serial, simulated");
  }
  options.cart = WithHandleAlone(std::move(options.cart), options.tool);
  options.angles_deg = ParseAngles(values["angles"].as<std::string>());
  return options;
}

/// Reads the link of one handle, without a node.
class Reader {
 public:
  Reader(const config::HandleConfig& handle, std::unique_ptr<WatchedLink> link)
      : link_(std::move(link)), gate_(AllCodes(handle)) {}

  /// Reads the link and appends the received codes.
  void Poll(std::vector<int>* codes) {
    const std::int64_t now_ns = runtime::MonotonicNs();
    const double dt_s = last_ns_ == 0 ? 0.0 : 1e-9 * static_cast<double>(now_ns - last_ns_);
    last_ns_ = now_ns;
    std::array<char, 512> buffer;
    const ByteLink::Result read = link_->Read(buffer);
    if (read.fresh) {
      framer_.Reset();
      gate_.Reconnected();
      monitor_.Reset();
      unit_ = link_->unit();
    }
    if (read.phase != LinkPhase::kOpen) {
      return;
    }
    LinkCounts counts;
    counts.bytes = static_cast<std::uint32_t>(read.bytes);
    for (std::size_t i = 0; i < read.bytes; ++i) {
      const LineFramer::Event event = framer_.Add(buffer[i]);
      if (event == LineFramer::Event::kNone) {
        continue;
      }
      const JawReading reading = event == LineFramer::Event::kLine ? gate_.Check(framer_.line()) : JawReading{};
      counts.good += reading.verdict == LineVerdict::kGood ? 1 : 0;
      counts.malformed += reading.verdict == LineVerdict::kMalformed ? 1 : 0;
      counts.off_grid += reading.verdict == LineVerdict::kOffGrid ? 1 : 0;
      counts.implausible += reading.verdict == LineVerdict::kJump ? 1 : 0;
      counts.other += reading.verdict == LineVerdict::kOther ? 1 : 0;
      if (reading.verdict == LineVerdict::kGood) {
        codes->push_back(reading.code);
      }
    }
    monitor_.Add(counts, dt_s);
    link_->Evaluate(counts, dt_s);
  }
  [[nodiscard]] LinkState state() const { return link_->state(monitor_.state()); }
  /// Serial number; empty before the first connection.
  [[nodiscard]] const std::string& unit() const { return unit_; }

 private:
  static JawLineSettings AllCodes(const config::HandleConfig& handle) {
    return {SenderOf(handle.hand), handle.calibration.adc_step_V, 0, kMaxCode};
  }

  std::unique_ptr<WatchedLink> link_;
  JawLineGate gate_;
  LineFramer framer_;
  LinkMonitor monitor_;
  std::string unit_;
  std::int64_t last_ns_ = 0;
};

/// Codes of the next `seconds` with readings; returns after kSilence_s more at the latest.
std::vector<int> ReadFor(Reader* reader, double seconds) {
  std::vector<int> codes;
  const auto enough = static_cast<std::size_t>(seconds * kLineRate_Hz);
  const std::int64_t end_ns = runtime::MonotonicNs() + static_cast<std::int64_t>(1e9 * (seconds + kSilence_s));
  while (codes.size() < enough && runtime::MonotonicNs() < end_ns) {
    reader->Poll(&codes);
    std::this_thread::sleep_for(kPoll);
  }
  return codes;
}

/// Waits for Enter and discards codes meanwhile. Returns false if the operator has ended the input.
bool WaitForEnter(Reader* reader, std::istream& in) {
  std::atomic<bool> answered{false};
  bool line = false;
  std::jthread waiting([&] {
    std::string ignored;
    line = static_cast<bool>(std::getline(in, ignored));
    answered.store(true, std::memory_order_release);  // Publishes line.
  });
  std::vector<int> old;
  while (!answered.load(std::memory_order_acquire)) {
    reader->Poll(&old);
    old.clear();
    std::this_thread::sleep_for(kPoll);
  }
  return line;
}

/// Measures a point. Returns why it was rejected (a fault of the link first), or an empty text.
std::string TakePoint(Reader* reader, double angle_deg, JawCalibrator* calibrator, std::size_t* readings) {
  static_cast<void>(ReadFor(reader, kSettle_s));
  const std::vector<int> codes = ReadFor(reader, kHold_s);
  *readings = codes.size();
  const LinkState state = reader->state();
  if (codes.size() < JawCalibrator::kMinCodes && state != LinkState::kOk) {
    return std::string(Code(state)) + ": " + Explain(state);
  }
  return calibrator->Add(angle_deg, codes);
}

ExitCode Calibrate(const Options& options, std::istream& in, std::ostream& out) {
  const config::HandleConfig& handle = options.cart.handles[options.tool];
  std::atomic<double> asked_deg{options.angles_deg.front()};
  const auto obey = [&](std::int64_t) {
    SimulatedInput input;
    input.jaw_deg.fill(asked_deg.load(std::memory_order_relaxed));
    input.faults[options.tool] = FaultsAt(handle.simulated, 0.0);
    return std::optional(input);
  };
  const auto firmware = handle.kind == config::LinkKind::kSimulated
                            ? std::make_unique<SimulatedFirmware>(obey, MakeSimulatedUnits(options.cart))
                            : nullptr;
  Reader reader(handle, std::move(MakeCartLinks(options.cart, firmware.get()).handles[options.tool]));

  JawCalibrator calibrator;
  for (const double angle_deg : options.angles_deg) {
    std::string refused;
    do {
      asked_deg.store(angle_deg, std::memory_order_relaxed);
      out << "Set the jaw to " << angle_deg << " deg, hold it still, press Enter: " << std::flush;
      if (!WaitForEnter(&reader, in)) {
        out << "\nnothing stored\n";
        return ExitCode::kFailure;
      }
      std::size_t readings = 0;
      refused = TakePoint(&reader, angle_deg, &calibrator, &readings);
      out << (refused.empty() ? "taken from " + std::to_string(readings) + " readings" : "refused: " + refused)
          << std::endl;
    } while (!refused.empty());
  }
  const CalibrationPoints points = calibrator.Solve();
  for (std::size_t i = 0; i < points.codes.size(); ++i) {
    char line[64];
    std::snprintf(line, sizeof(line), "  %6.1f deg  code %8.3f\n", points.angles_deg[i], points.codes[i]);
    out << line;
  }
  out << "stored for " << reader.unit() << " in "
      << CalibrationStore::Save(CalibrationFolder(), reader.unit(), points).string() << std::endl;
  return ExitCode::kDone;
}

}  // namespace

bool IsCalibrateCommand(int argc, const char* const* argv) {
  return argc > 1 && std::string_view(argv[1]) == "calibrate";
}

int CalibrateMain(int argc, const char* const* argv) {
  ExitCode code = ExitCode::kFailure;
  try {
    const std::optional<Options> options = Parse({argv + 2, argv + argc}, std::cout);
    code = options ? Calibrate(*options, std::cin, std::cout) : ExitCode::kDone;
  } catch (const InputError& error) {
    std::cerr << "handle_bridge calibrate: " << error.what() << "\n";
    code = ExitCode::kBadUsage;
  } catch (const std::exception& error) {
    std::cerr << "handle_bridge calibrate: " << error.what() << "\n";
  }
  return static_cast<int>(code);
}

}  // namespace fulcrum::handle_bridge
