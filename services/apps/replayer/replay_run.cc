#include "services/apps/replayer/replay_run.h"

#include <sys/resource.h>
#include <sys/stat.h>

#include <functional>
#include <iostream>

#include "services/apps/replayer/changed_scene.h"
#include "services/apps/replayer/console.h"
#include "services/apps/replayer/dataset.h"
#include "services/apps/replayer/film.h"
#include "services/apps/replayer/lock_step_report.h"
#include "services/apps/replayer/pictures.h"
#include "services/apps/replayer/progress_line.h"
#include "services/apps/replayer/report_format.h"
#include "services/apps/replayer/scratch_folder.h"
#include "services/apps/replayer/video.h"
#include "services/apps/replayer/what_if.h"
#include "services/apps/replayer/what_if_report.h"
#include "services/base/config/strict_yaml.h"
#include "services/base/core/error.h"
#include "services/base/core/exit_code.h"
#include "services/scene/format/scene_file.h"

namespace fulcrum::replay {
namespace {

/// Leaves out nodes that the scene does not have (for example thermal in a scene without heat) and prints their names.
void LeaveOutMissing(const SceneView& scene, bool pictures, std::vector<NodeId>* nodes) {
  const auto missing = [&](NodeId node) { return (scene.node_mask >> static_cast<unsigned>(node) & 1u) == 0; };
  std::string names;
  std::erase_if(*nodes, [&](NodeId node) {
    if (missing(node)) names += std::string(names.empty() ? "" : ", ") + NodeName(node);
    return missing(node);
  });
  if (names.empty()) return;
  if (nodes->empty() && !pictures) {
    throw InputError("--into: scene \"" + std::string(scene.name) + "\" has no " + names);
  }
  std::cout << names << ": not in scene \"" << scene.name << "\", left out\n";
}

/// Draws the pictures; returns how many were written.
std::uint64_t DrawPictures(const Options& options, const SceneView& scene, const ProgressLine& progress,
                           const std::function<void(double)>& told) {
  const PicturesSettings settings{options.lock_step.recording, options.frames, options.lock_step.until_s};
  const std::uint64_t written = ReplayPictures(settings, scene, told).written;
  progress.Clear();
  std::cout << written << " pictures in " << options.frames.string() << '\n';
  return written;
}

ExitCode CompareWithChanges(const Options& options, const LockStepSettings& settings, const scene::SceneFile& scene,
                            const config::CartConfig& cart, const ProgressLine& progress,
                            const std::function<void(double)>& told) {
  std::vector<Solid> solids;
  const SceneView changed = WithChanges(scene, options.changes, &solids);
  const WhatIfResult result = ReplayWhatIf(settings, scene.view(), changed, cart, told);
  progress.Clear();
  std::cout << ReportText(result, settings.nodes);
  if (!options.json.empty()) WriteReportJson(result, options.json);
  return result.missing.empty() ? ExitCode::kDone : ExitCode::kFailure;
}

ExitCode CompareWithRecording(const Options& options, const LockStepSettings& settings, const SceneView& scene,
                              const config::CartConfig& cart, const ProgressLine& progress,
                              const std::function<void(double)>& told) {
  const LockStepResult result = ReplayInLockStep(settings, scene, cart, told);
  progress.Clear();
  std::cout << ReportText(result);
  if (!options.json.empty()) WriteReportJson(result, options.json);
  return result.good() ? ExitCode::kDone : ExitCode::kFailure;
}

/// A session that runs meanwhile goes first.
void GoSecond() {
  constexpr int kNice = 10;
  (void)::setpriority(PRIO_PROCESS, 0, kNice);
}

/// For long work into files, which are as private as recordings. Returns UntilStopped().
std::function<void(double)> BeginFiles(const ProgressLine& progress) {
  GoSecond();
  ::umask(077);
  return UntilStopped(progress);
}

/// What the scene's description says of it, if the scene has one, otherwise its name.
std::string TaskOf(const std::filesystem::path& file) {
  const scene::SceneFile scene(file);
  const std::string yaml = scene.source_yaml();
  std::string task;
  if (!yaml.empty()) {
    task = config::StrictYaml::FromText(yaml, file.string()).root().TextOr("description", "");
  }
  return task.empty() ? std::string(scene.view().name) : task;
}

}  // namespace

int RunFilm(const Options& options) {
  GoSecond();
  const scene::SceneFile scene(options.scene);
  ShowFilm(options.lock_step.recording, scene.view(), std::cin, std::cout);
  return static_cast<int>(ExitCode::kDone);
}

int RunVideo(const Options& options) {
  const scene::SceneFile scene(options.scene);
  const ProgressLine progress(options.quiet);
  const VideoSettings settings{options.lock_step.recording, options.video, options.lock_step.until_s,
                               options.video_within_s};
  const VideoResult result = MakeVideo(settings, scene.view(), BeginFiles(progress));
  progress.Clear();
  std::cout << options.video.string() << ": " << result.pictures << " pictures, " << result.duration_s << " s\n";
  if (!options.json.empty()) WriteVideoJson(result, options.json);
  return static_cast<int>(ExitCode::kDone);
}

int RunDataset(const Options& options) {
  const scene::SceneFile scene(options.scene);
  const ProgressLine progress(options.quiet);
  const DatasetSettings settings{options.lock_step.recording, options.dataset,
                                 options.lock_step.until_s,   options.dataset_every_s,
                                 options.dataset_baseline_m,  options.dataset_variations,
                                 options.dataset_seed};
  const DatasetResult result = MakeDataset(settings, scene.view(), BeginFiles(progress));
  progress.Clear();
  const std::filesystem::path first = options.dataset_variations > 0 ? options.dataset / "000" : options.dataset;
  std::cout << options.dataset.string() << ": "
            << (options.dataset_variations > 0 ? std::to_string(options.dataset_variations) + " data sets, " : "")
            << result.frames << " frames, " << result.duration_s << " s; look at " << (first / "sheet.png").string()
            << '\n';
  if (!options.json.empty()) {
    WriteText(options.json, Format("{\n  \"frames\": %llu,\n  \"duration_s\": %.3f\n}\n",
                                   static_cast<unsigned long long>(result.frames), result.duration_s));
  }
  return static_cast<int>(ExitCode::kDone);
}

int RunLerobot(const Options& options) {
  const ProgressLine progress(options.quiet);
  LerobotSettings settings = options.lerobot;
  settings.until_s = options.lock_step.until_s;
  for (LerobotSettings::Session& session : settings.sessions) session.task = TaskOf(session.scene);
  const LerobotResult result = MakeLerobot(settings, BeginFiles(progress));
  progress.Clear();
  std::cout << settings.folder.string() << ": " << settings.sessions.size()
            << (settings.sessions.size() == 1 ? " episode, " : " episodes, ") << result.frames
            << (result.frames == 1 ? " frame, " : " frames, ") << result.duration_s << " s\n";
  if (!options.json.empty()) {
    WriteText(options.json,
              Format("{\n  \"episodes\": %zu,\n  \"frames\": %llu,\n  \"duration_s\": %.3f\n}\n",
                     settings.sessions.size(), static_cast<unsigned long long>(result.frames), result.duration_s));
  }
  return static_cast<int>(ExitCode::kDone);
}

int RunReplay(const Options& options) {
  const scene::SceneFile scene(options.scene);
  LockStepSettings settings = options.lock_step;
  LeaveOutMissing(scene.view(), options.pictures, &settings.nodes);
  const config::CartConfig cart = LoadCart(options);
  const ScratchFolder scratch;
  settings.folder = scratch.path();
  // The console must start before any other thread, because its keyframes fork the process, which copies one thread
  // only.
  if (options.console) return RunConsole(settings, scene.view(), cart);
  const ProgressLine progress(options.quiet);
  const std::function<void(double)> told = UntilStopped(progress);
  if (options.pictures) {
    const std::uint64_t written = DrawPictures(options, scene.view(), progress, told);
    if (settings.nodes.empty()) return static_cast<int>(written > 0 ? ExitCode::kDone : ExitCode::kFailure);
  }
  return static_cast<int>(options.changes.empty()
                              ? CompareWithRecording(options, settings, scene.view(), cart, progress, told)
                              : CompareWithChanges(options, settings, scene, cart, progress, told));
}

}  // namespace fulcrum::replay
