// The checked command line of replayer as settings of one kind of replay.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "services/apps/replayer/lerobot.h"
#include "services/apps/replayer/live.h"
#include "services/apps/replayer/lock_step.h"
#include "services/apps/replayer/node_test.h"
#include "services/base/config/cart.h"

namespace fulcrum::replay {

struct Options {
  std::string answer;           ///< Text of help or version. Not empty: it is to be printed, and nothing else is set.
  bool live = false;            ///< --live was given: only `live_settings` is used.
  bool test = false;            ///< --test was given: one node is checked against `demands`. None of these: --into.
  bool film = false;            ///< --film was given: only `recording` of `lock_step` and `scene` are used.
  std::filesystem::path video;  ///< File of --video; empty: it was not given. With `lock_step.until_s`.
  double video_within_s = 0;    ///< --within [s]; 0: without limit.
  /// --dataset, --every, --baseline, --vary, --seed; the folder is empty: it was not given. With `lock_step.until_s`.
  std::filesystem::path dataset;
  double dataset_every_s = 0, dataset_baseline_m = 0;
  std::uint32_t dataset_variations = 0, dataset_seed = 1;
  LerobotSettings lerobot;  ///< --lerobot; its folder is empty: it was not given. Without `until_s`.
  bool console = false;     ///< --console.
  LiveSettings live_settings;
  LockStepSettings lock_step;        ///< Without `folder`, which a run makes.
  bool pictures = false;             ///< Render was named; it is not in `lock_step.nodes`.
  std::filesystem::path frames;      ///< Folder for its pictures; empty: they are not written.
  std::vector<std::string> changes;  ///< Values of --set.
  Demands demands;
  std::filesystem::path scene;        ///< Compiled scene file.
  std::filesystem::path cart;         ///< Cart file; empty: the simulated cart.
  std::filesystem::path json, junit;  ///< Files for the result; empty: none.
  bool quiet = false;                 ///< Print no progress.
};

/// Checks the command line. Throws InputError that names the option and the valid values; a test's JUnit file contains
/// it then.
[[nodiscard]] Options ParseOptions(int argc, char** argv);

/// Loads the cart of a replay other than live. Throws InputError.
[[nodiscard]] config::CartConfig LoadCart(const Options& options);

}  // namespace fulcrum::replay
