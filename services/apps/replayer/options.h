// What replayer is asked to do: its command line, checked, as settings of one kind of replay.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "services/apps/replayer/live.h"
#include "services/apps/replayer/lock_step.h"
#include "services/apps/replayer/node_test.h"
#include "services/base/config/cart.h"

namespace fulcrum::replay {

struct Options {
  std::string answer;    ///< Help or version. Not empty: it is printed, and nothing else is set.
  bool live = false;     ///< --live: only `live_settings` counts.
  bool test = false;     ///< --test: one node against `demands`. Neither --live nor --test: --into.
  bool console = false;  ///< --console.
  LiveSettings live_settings;
  LockStepSettings lock_step;        ///< Without its folder, which a run makes.
  bool pictures = false;             ///< Render was named, which `lock_step.nodes` does not hold.
  std::filesystem::path frames;      ///< Folder for its pictures; empty: they are not kept.
  std::vector<std::string> changes;  ///< --set.
  Demands demands;
  std::filesystem::path scene;        ///< Compiled.
  std::filesystem::path cart;         ///< Empty: the simulated cart.
  std::filesystem::path json, junit;  ///< Results for programs; empty: none.
  bool quiet = false;                 ///< No progress.
};

/// Throws InputError that names the option and what is valid.
[[nodiscard]] Options ParseOptions(int argc, char** argv);

/// Of a replay other than live. Throws InputError.
[[nodiscard]] config::CartConfig LoadCart(const Options& options);

}  // namespace fulcrum::replay
