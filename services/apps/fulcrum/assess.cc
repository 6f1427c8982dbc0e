#include <cstdio>

#include "services/apps/fulcrum/commands.h"
#include "services/base/core/error.h"
#include "services/records/recording/recorded_scene.h"
#include "services/scene/format/scene_file.h"
#include "services/session/assessment/recorded_assessment.h"
#include "services/session/assessment/score.h"
#include "services/session/supervisor/score_sheet.h"
#include "services/session/supervisor/session_folder.h"

namespace fulcrum::supervisor::cli {
namespace po = boost::program_options;

ExitCode Assess(const Words& words) {
  po::options_description options;
  options.add_options()  //
      ("scene", po::value<std::string>()->value_name("FILE")->default_value(""),
       "compiled scene (default: scene.fulcrum beside the recording)")  //
      ("json", po::value<std::string>()->value_name("FILE"),
       "also write the score sheet to FILE, in the format of assessment.json");
  const Arguments arguments = Parse("assess", words, options, {"recording"});
  if (arguments.help) {
    return ExitCode::kDone;
  }
  if (arguments.values.count("recording") == 0) {
    throw InputError("RECORDING is missing, for example out/latest/recording.mcap; see fulcrum help assess");
  }
  const std::filesystem::path recording = arguments.values["recording"].as<std::string>();
  const std::filesystem::path file =
      recording::BesideRecording(arguments.values["scene"].as<std::string>(), recording, "scene.fulcrum");
  if (file.empty()) {
    throw InputError("no scene.fulcrum beside " + recording.string() +
                     ": give the compiled scene of that session with --scene");
  }
  const scene::SceneFile scene(file);
  const assessment::RecordedAssessment result = assessment::AssessRecording(recording, scene.view());
  const ScoreSheet sheet{result.figures, assessment::Evaluate(scene.view().assessment, result.figures)};
  std::printf("session %s of \"%s\", %s s\n\n%s", result.session_id.c_str(), scene.view().name,
              Fixed(result.end_s, 1).c_str(), SheetTable(sheet).c_str());
  if (arguments.values.count("json") != 0) {
    WriteFile(arguments.values["json"].as<std::string>(),
              SheetJson(sheet, {scene.view().name, result.session_id, {}, {}}));
  }
  return ExitCode::kDone;
}

}  // namespace fulcrum::supervisor::cli
