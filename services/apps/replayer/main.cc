// replayer: replays recorded sessions.
#include <iostream>

#include "services/apps/replayer/live_run.h"
#include "services/apps/replayer/options.h"
#include "services/apps/replayer/replay_run.h"
#include "services/apps/replayer/test_run.h"
#include "services/base/core/error.h"
#include "services/base/core/exit_code.h"

namespace {

using namespace fulcrum;  // NOLINT: a main uses names of other modules only

int Run(int argc, char** argv) {
  const replay::Options options = replay::ParseOptions(argc, argv);
  if (!options.answer.empty()) {
    std::cout << options.answer;
    return static_cast<int>(ExitCode::kDone);
  }
  if (options.live) return replay::RunLive(options.live_settings);
  if (options.film) return replay::RunFilm(options);
  if (!options.video.empty()) return replay::RunVideo(options);
  if (!options.dataset.empty()) return replay::RunDataset(options);
  if (!options.lerobot.folder.empty()) return replay::RunLerobot(options);
  if (options.test) return replay::RunTest(options);
  return replay::RunReplay(options);
}

int Fail(const std::exception& error, ExitCode code) {
  std::cerr << "replayer: " << error.what() << '\n';
  return static_cast<int>(code);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return Run(argc, argv);
  } catch (const InputError& error) {
    return Fail(error, ExitCode::kBadUsage);
  } catch (const MismatchError& error) {
    return Fail(error, ExitCode::kMismatch);
  } catch (const std::exception& error) {
    return Fail(error, ExitCode::kFailure);
  }
}
