#include <cstdio>

#include "services/apps/fulcrum/commands.h"
#include "services/base/core/error.h"
#include "services/session/supervisor/session_folder.h"
#include "services/session/supervisor/trainee_view.h"
#include "services/session/supervisor/training_log.h"

namespace fulcrum::supervisor::cli {
namespace po = boost::program_options;
namespace {

std::string ListOf(const TrainingLog& log) {
  std::string list;
  for (const auto& [name, sessions] : log.Trainees()) {
    list += name + ": " + std::to_string(sessions) + (sessions == 1 ? " session\n" : " sessions\n");
  }
  return list.empty() ? "no session is stored yet; fulcrum up SCENE --trainee NAME stores one\n" : list;
}

}  // namespace

ExitCode Trainee(const Words& words) {
  po::options_description options;
  options.add_options()                                                                                          //
      ("scene", po::value<std::string>()->value_name("NAME")->default_value(""), "only sessions of this scene")  //
      ("svg", po::value<std::string>()->value_name("FILE"), "also write plots to FILE");
  AddDatabase(&options);
  const Arguments arguments = Parse("trainee", words, options, {"name"});
  if (arguments.help) {
    return ExitCode::kDone;
  }
  const TrainingLog log(DatabaseOf(arguments), TrainingLog::Access::kRead);
  if (arguments.values.count("name") == 0) {
    std::fputs(ListOf(log).c_str(), stdout);
    return ExitCode::kDone;
  }
  const std::string name = arguments.values["name"].as<std::string>();
  const std::string scene = arguments.values["scene"].as<std::string>();
  const std::vector<TrainingRow> rows = log.SessionsOf(name, scene);
  if (rows.empty()) {
    throw InputError("no session of \"" + name + "\"" + (scene.empty() ? "" : " on \"" + scene + "\"") +
                     " is stored. Stored sessions:\n" + ListOf(log));
  }
  std::fputs(TraineeTable(rows).c_str(), stdout);
  if (arguments.values.count("svg") != 0) {
    const std::string file = arguments.values["svg"].as<std::string>();
    WriteFile(file, TraineeSvg(name, rows));
    std::printf("plots: %s\n", file.c_str());
  }
  return ExitCode::kDone;
}

}  // namespace fulcrum::supervisor::cli
