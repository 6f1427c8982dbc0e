#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iostream>

#include "services/apps/fulcrum/commands.h"
#include "services/base/core/error.h"
#include "services/session/supervisor/session_folder.h"
#include "services/session/supervisor/trainee_traces.h"
#include "services/session/supervisor/trainee_view.h"
#include "services/session/supervisor/training_log.h"

namespace fulcrum::supervisor::cli {
namespace fs = std::filesystem;
namespace po = boost::program_options;
namespace {

std::string ListOf(const TrainingLog& log) {
  std::string list;
  for (const auto& [name, sessions] : log.Trainees()) {
    list += name + ": " + std::to_string(sessions) + (sessions == 1 ? " session\n" : " sessions\n");
  }
  return list.empty() ? "no session is stored yet; fulcrum up SCENE --trainee NAME stores one\n" : list;
}

/// Sessions that the database has but that have no folder in `out`.
std::size_t Elsewhere(const std::vector<TrainingRow>& rows, const fs::path& out) {
  std::error_code error;
  return static_cast<std::size_t>(std::count_if(
      rows.begin(), rows.end(), [&](const TrainingRow& row) { return !fs::is_directory(out / row.session, error); }));
}

bool Confirmed() {
  if (::isatty(STDIN_FILENO) == 0) {
    throw InputError("--delete: nothing was changed; confirm with --yes where standard input is no terminal");
  }
  std::printf("Delete? [y/N] ");
  std::fflush(stdout);
  std::string answer;
  std::getline(std::cin, answer);
  return answer == "y" || answer == "Y" || answer == "yes";
}

ExitCode Delete(const std::string& name, const Arguments& arguments) {
  if (!arguments.values["scene"].as<std::string>().empty() || arguments.values.count("svg") != 0) {
    throw InputError("--delete deletes all sessions of a trainee; it goes without --scene and --svg");
  }
  const fs::path out = arguments.values["out"].as<std::string>();
  TrainingLog log(DatabaseOf(arguments), TrainingLog::Access::kDelete);
  const std::vector<TrainingRow> rows = log.SessionsOf(name, "");
  const std::vector<fs::path> traces = FindTraces(out, name);
  const bool account = log.FindPerson(name).has_value();
  if (rows.empty() && traces.empty() && !account) {
    throw InputError("no session and no account of \"" + name + "\" is stored, and no session folder in " +
                     out.string() + " names this trainee. Stored sessions:\n" + ListOf(log));
  }
  std::printf("%zu rows of \"%s\" in %s are deleted\n", rows.size(), name.c_str(), DatabaseOf(arguments).c_str());
  if (account) std::printf("the account of \"%s\" is deleted\n", name.c_str());
  for (const fs::path& file : traces) std::printf("the name is removed from %s\n", file.c_str());
  if (const std::size_t elsewhere = Elsewhere(rows, out); elsewhere > 0) {
    std::printf("%zu of these sessions have no folder in %s; if it is elsewhere, repeat with --out DIR\n", elsewhere,
                out.c_str());
  }
  if (arguments.values.count("yes") == 0 && !Confirmed()) {
    std::printf("nothing was changed\n");
    return ExitCode::kDone;
  }
  // The rows last: after a failure the same command finds what is left.
  for (const fs::path& file : traces) RemoveName(file, name);
  const int deleted = log.Delete(name);
  std::printf(
      "deleted %d rows; recordings and pictures carry no name and stay, but recordings of an earlier build may have it "
      "in the command lines of their channels; those, copies, plots (--svg) and backups are yours to delete\n",
      deleted);
  return ExitCode::kDone;
}

}  // namespace

ExitCode Trainee(const Words& words) {
  po::options_description options;
  options.add_options()                                                                                          //
      ("scene", po::value<std::string>()->value_name("NAME")->default_value(""), "only sessions of this scene")  //
      ("svg", po::value<std::string>()->value_name("FILE"), "also write plots to FILE")                          //
      ("delete",
       "delete the rows and the account of trainee NAME from the database, and the name from the session folders in "
       "--out")  //
      ("out", po::value<std::string>()->value_name("DIR")->default_value("out"),
       "with --delete: folder of the session folders")  //
      ("yes", "with --delete: do not ask");
  AddDatabase(&options);
  const Arguments arguments = Parse("trainee", words, options, {"name"});
  if (arguments.help) {
    return ExitCode::kDone;
  }
  const bool deletes = arguments.values.count("delete") != 0;
  if (deletes && arguments.values.count("name") == 0) throw InputError("--delete: give the NAME of the trainee");
  if (!deletes && (arguments.values.count("yes") != 0 || !arguments.values["out"].defaulted())) {
    throw InputError("--yes and --out go with --delete");
  }
  if (deletes) return Delete(arguments.values["name"].as<std::string>(), arguments);
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
