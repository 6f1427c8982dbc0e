#include "haptics_node/calibrate_command.h"

#include <unistd.h>

#include <boost/program_options.hpp>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <string>

#include "haptics_node/node/calibrate_trocar.h"
#include "haptics_node/node/cart_devices.h"
#include "haptics_node/node/trocar_store.h"
#include "services/base/config/cart.h"
#include "services/base/core/error.h"
#include "services/base/core/exit_code.h"
#include "services/base/runtime/realtime.h"

namespace fulcrum::haptics {
namespace {

constexpr const char* kName = "calibrate-trocar";

struct Options {
  std::string cart, save;
  std::size_t tool = 0;
  double seconds = 10;
  bool help = false;
};

Options ParseOptions(int argc, const char* const* argv) {
  namespace po = boost::program_options;
  po::options_description known("Options");
  known.add_options()                                                                                                 //
      ("cart", po::value<std::string>()->value_name("FILE"), "cart configuration that names the device")              //
      ("tool", po::value<int>()->value_name("N")->default_value(0), "tool whose trocar is measured, 0 to 3")          //
      ("seconds", po::value<double>()->value_name("S")->default_value(10), "motion to record from a Touch")           //
      ("save", po::value<std::string>()->value_name("FILE"), "also save the motion, for a simulated device to play")  //
      ("help", "print this");
  Options options;
  try {
    po::variables_map values;
    const auto style = po::command_line_style::default_style & ~po::command_line_style::allow_guessing;
    po::store(po::command_line_parser(argc - 1, argv + 1).options(known).style(style).run(), values);
    if (values.count("help") != 0) {
      std::ostringstream text;
      text
          << "usage: haptics_node " << kName << " --cart FILE [--tool N] [options]\n\n"
          << "Measures the position of a trocar. Insert the tool, hold a button of the device down and swing the tool\n"
          << "about the trocar, widely and in all directions, also in and out. The result is stored for the cart and\n"
          << "loaded at each start of haptics_node.\n\n"
          << known;
      std::fputs(text.str().c_str(), stdout);
      options.help = true;
      return options;
    }
    if (values.count("cart") == 0) throw InputError("--cart is missing: it names the device");
    options.cart = values["cart"].as<std::string>();
    if (values.count("save") != 0) options.save = values["save"].as<std::string>();
    const int tool = values["tool"].as<int>();
    if (tool < 0 || tool >= kMaxTools)
      throw InputError("--tool " + std::to_string(tool) + ": valid: 0 to " + std::to_string(kMaxTools - 1));
    options.tool = static_cast<std::size_t>(tool);
    options.seconds = values["seconds"].as<double>();
    if (!(options.seconds >= 2 && options.seconds <= 600)) throw InputError("--seconds: valid: 2 to 600");
  } catch (const po::error& error) {
    throw InputError(std::string(error.what()) + "; see haptics_node " + kName + " --help");
  }
  return options;
}

/// Shows one line that each call overwrites, on a terminal only.
void ShowProgress(double seconds, const std::string& trouble) {
  if (::isatty(STDERR_FILENO) == 0) return;
  std::fprintf(stderr, "\r\033[K%s", trouble.empty() ? "" : (trouble + "  ").c_str());
  std::fprintf(stderr, "hold a button, swing the tool about the trocar: %.1f s", seconds);
}

ExitCode Calibrate(const Options& options) {
  const config::CartConfig cart = config::LoadCart(options.cart);
  const TrocarMotion motion = RecordTrocarMotion(cart, options.tool, options.seconds, kTouchLibrary, ShowProgress);
  if (runtime::ShouldStop()) return ExitCode::kFailure;
  if (!options.save.empty()) {
    std::ofstream stream(options.save);
    stream << ToText(motion.poses);
    if (!stream.flush()) throw InputError("cannot write " + options.save);
  }
  const PivotFit fit = FitPivot(motion.poses);
  if (!fit.refusal.empty()) throw InputError("nothing stored: " + fit.refusal);
  const auto file = TrocarFile(TrocarFolder(), cart.name, options.tool);
  SaveTrocar(file, motion.serial, fit);
  std::printf("\n%s\nstored in %s\n", Describe(fit).c_str(), file.c_str());
  return ExitCode::kDone;
}

}  // namespace

bool IsCalibrateCommand(int argc, const char* const* argv) { return argc > 1 && std::string(argv[1]) == kName; }

int CalibrateMain(int argc, const char* const* argv) {
  runtime::SetLogName("haptics_node");
  runtime::InstallStopSignals();
  try {
    const Options options = ParseOptions(argc, argv);
    return static_cast<int>(options.help ? ExitCode::kDone : Calibrate(options));
  } catch (const InputError& error) {
    Log(runtime::LogLevel::kError, error.what());
    return static_cast<int>(ExitCode::kBadUsage);
  } catch (const std::exception& error) {
    Log(runtime::LogLevel::kError, error.what());
    return static_cast<int>(ExitCode::kFailure);
  }
}

}  // namespace fulcrum::haptics
