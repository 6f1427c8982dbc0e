#include "services/apps/replayer/test_run.h"

#include <iostream>

#include "services/apps/replayer/pictures.h"
#include "services/apps/replayer/progress_line.h"
#include "services/apps/replayer/scratch_folder.h"
#include "services/base/core/error.h"
#include "services/base/core/exit_code.h"
#include "services/base/runtime/cyclic_thread.h"
#include "services/scene/format/scene_file.h"

namespace fulcrum::replay {
namespace {

/// Test of render, which has no ticks to compare: the recording is drawn, and the figures are checked.
NodeTestResult TestRender(const PicturesSettings& settings, const Demands& demands, const SceneView& scene,
                          const std::function<void(double)>& progress) {
  if (demands.state_hash) {
    throw InputError("--expect: render_node has no state hash, because pictures depend on the machine; use --assert");
  }
  const std::int64_t begin = runtime::MonotonicNs();
  const PicturesResult pictures = ReplayPictures(settings, scene, progress);
  NodeTestResult result;
  result.node = NodeId::kRender;
  result.recording = settings.recording;
  result.wall_s = 1e-9 * static_cast<double>(runtime::MonotonicNs() - begin);
  for (const Metric& metric : pictures.health) result.figures[metric.name] = metric.value;
  result.cases.push_back({"draws the recording", Verdict::kPassed, {}});
  if (pictures.written == 0) {
    result.cases.back() = {"draws the recording", Verdict::kError, "the recording contains nothing to draw"};
  }
  Judge(demands, &result);
  return result;
}

NodeTestResult Test(const Options& options, const std::filesystem::path& scratch, const SceneView& scene,
                    const config::CartConfig& cart, const std::function<void(double)>& progress) {
  if (options.pictures) {
    const std::filesystem::path frames = options.frames.empty() ? scratch / "frames" : options.frames;
    return TestRender({options.lock_step.recording, frames, options.lock_step.until_s}, options.demands, scene,
                      progress);
  }
  LockStepSettings settings = options.lock_step;
  settings.folder = scratch;
  return TestNode(settings, options.demands, scene, cart, progress);
}

}  // namespace

int RunTest(const Options& options) {
  const NodeId node = options.pictures ? NodeId::kRender : options.lock_step.nodes[0];
  const auto report = [&](const NodeTestResult& result) {
    if (!options.junit.empty()) WriteJUnit(result, options.junit);
  };
  try {
    const scene::SceneFile scene(options.scene);
    const config::CartConfig cart = LoadCart(options);
    const ScratchFolder scratch;
    const ProgressLine progress(options.quiet);
    const NodeTestResult result = Test(options, scratch.path(), scene.view(), cart, UntilStopped(progress));
    progress.Clear();
    std::cout << ReportText(result);
    report(result);
    return static_cast<int>(result.passed() ? ExitCode::kDone : ExitCode::kFailure);
  } catch (const std::exception& error) {
    // A CI system reads the error from the file, not from the exit code.
    report(FailedTest(node, options.lock_step.recording, error.what()));
    throw;
  }
}

}  // namespace fulcrum::replay
