// fulcrum inputs: the gamepads and SpaceMice of this machine, and live what they report.
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <limits>
#include <thread>

#include "render_node/input/input_report.h"
#include "services/apps/fulcrum/commands.h"
#include "services/base/config/cart.h"
#include "services/base/core/error.h"
#include "services/base/runtime/realtime.h"

namespace fulcrum::supervisor::cli {
namespace {

constexpr auto kRead = std::chrono::milliseconds(10), kRefresh = std::chrono::milliseconds(100);

}  // namespace

ExitCode Inputs(const Words& words) {
  namespace po = boost::program_options;
  po::options_description options;
  options.add_options()("watch", "also show axes and buttons, refreshed until Ctrl-C")(
      "seconds", po::value<double>()->value_name("N"), "end --watch after this time [s], above 0")(
      "json", "print JSON: one object, with --watch one a line for each change");
  AddCart(&options);
  const Arguments arguments = Parse("inputs", words, options);
  if (arguments.help) return ExitCode::kDone;
  const bool watch = arguments.values.count("watch") != 0, json = arguments.values.count("json") != 0;
  double seconds = std::numeric_limits<double>::infinity();
  if (arguments.values.count("seconds") != 0) {
    seconds = arguments.values["seconds"].as<double>();
    if (!watch || !(seconds > 0)) throw InputError("--seconds: goes with --watch and must be above 0");
  }
  const auto cart = CartOf(arguments);
  const InputSettings settings = cart.empty() ? InputSettings() : config::LoadCart(cart).inputs;

  render::Gamepads gamepads;
  render::SpaceMice space_mice;
  const bool redraw = watch && !json && ::isatty(STDOUT_FILENO) == 1;
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  auto refresh = std::chrono::steady_clock::now();
  std::string printed;
  do {
    gamepads.Update();
    space_mice.Update();
    if (const auto now = std::chrono::steady_clock::now(); now >= refresh) {
      refresh = now + kRefresh;
      const render::PluggedIn inputs{gamepads.pads(), space_mice.mice(), gamepads.unknown(), render::LockedJoysticks()};
      std::string text = json ? render::InputsJson(inputs, watch) + "\n" : render::InputsText(inputs, settings, watch);
      if (text != printed) {
        std::printf("%s%s%s", redraw ? "\x1b[H\x1b[2J" : "", text.c_str(), redraw ? "Ctrl-C ends this view\n" : "");
        std::fflush(stdout);
        printed = std::move(text);
      }
    }
    if (watch) std::this_thread::sleep_for(kRead);
  } while (watch && !runtime::ShouldStop() && !OutputHasEnded() && std::chrono::steady_clock::now() < end);
  return ExitCode::kDone;
}

}  // namespace fulcrum::supervisor::cli
