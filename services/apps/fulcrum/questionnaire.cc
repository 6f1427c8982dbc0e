#include "services/session/training/questionnaire.h"

#include <cstdio>
#include <iostream>

#include "services/apps/fulcrum/commands.h"
#include "services/base/core/error.h"

namespace fulcrum::supervisor::cli {
namespace fs = std::filesystem;
namespace po = boost::program_options;
namespace {

/// Asks at the terminal until each answer is valid. Throws InputError when the input ends before.
training::Answers AskAll() {
  std::printf("Answer each question from 0 (very poor) to %d (very good); Ctrl-C stores nothing.\n",
              training::kBestAnswer);
  training::Answers answers{};
  for (std::size_t i = 0; i < training::kQuestionCount; ++i) {
    for (bool valid = false; !valid;) {
      std::printf("%2zu of %zu. %s ", i + 1, training::kQuestionCount, training::Questions()[i].text.data());
      std::fflush(stdout);
      std::string line;
      if (!std::getline(std::cin, line)) {
        throw InputError("the input ended after " + std::to_string(i) + " of " +
                         std::to_string(training::kQuestionCount) + " answers; nothing was stored");
      }
      try {
        answers[i] = training::ParseAnswer(line);
        valid = true;
      } catch (const InputError& error) {
        std::printf("   %s\n", error.what());
      }
    }
  }
  return answers;
}

void PrintSummary(const fs::path& out) {
  std::vector<std::string> refused;
  const std::vector<training::Answers> all = training::ReadAllAnswers(out, &refused);
  for (const std::string& why : refused) std::fprintf(stderr, "left out: %s\n", why.c_str());
  if (all.empty()) {
    throw InputError("no session in " + out.string() +
                     " has answers; after a session: fulcrum questionnaire, or the page of fulcrum console");
  }
  const auto opinion = training::OpinionOf(all);
  std::printf(
      "%zu sessions; 0 very poor to %d very good; mean ± standard deviation, beside the paper's 15 surgeons\n\n",
      all.size(), training::kBestAnswer);
  for (std::size_t i = 0; i < training::kQuestionCount; ++i) {
    const training::Question& question = training::Questions()[i];
    std::printf("%2zu  %.1f ± %.2f  (%.1f ± %.2f)  %s\n", i + 1, opinion[i].mean, opinion[i].deviation, question.mean,
                question.deviation, question.text.data());
  }
}

}  // namespace

ExitCode Questionnaire(const Words& words) {
  po::options_description options;
  options.add_options()  //
      ("answers", po::value<std::string>()->value_name("LIST"),
       "the twelve answers with commas between them, instead of asking")  //
      ("summary", "print mean and deviation over all sessions in --out")  //
      ("out", po::value<std::string>()->value_name("DIR")->default_value("out"), "folder of the session folders");
  const Arguments arguments = Parse("questionnaire", words, options, {"session"});
  if (arguments.help) return ExitCode::kDone;
  const fs::path out = arguments.values["out"].as<std::string>();
  const bool answers = arguments.values.count("answers") != 0, named = arguments.values.count("session") != 0;
  if (arguments.values.count("summary") != 0) {
    if (answers || named) throw InputError("--summary is over all sessions; it goes without SESSION and --answers");
    PrintSummary(out);
    return ExitCode::kDone;
  }
  const fs::path session =
      fs::weakly_canonical(out / (named ? arguments.values["session"].as<std::string>() : std::string("latest")));
  if (!fs::is_directory(session)) {
    throw InputError(session.string() + ": no folder of a session; give SESSION, a folder in --out (" + out.string() +
                     ")");
  }
  training::WriteAnswers(session,
                         answers ? training::ParseAnswers(arguments.values["answers"].as<std::string>()) : AskAll());
  std::printf("stored in %s; over all sessions: fulcrum questionnaire --summary\n", session.c_str());
  return ExitCode::kDone;
}

}  // namespace fulcrum::supervisor::cli
