#include "services/session/console/opinion.h"

#include <vector>

#include "services/base/core/error.h"
#include "services/session/console/form.h"
#include "services/session/console/json.h"
#include "services/session/training/questionnaire.h"

namespace fulcrum::console {

std::string QuestionsJson(const std::filesystem::path& out, const std::string& session) {
  std::vector<std::string> refused;  // `fulcrum questionnaire --summary` names them.
  const std::vector<training::Answers> all = training::ReadAllAnswers(out, &refused);
  const auto opinion =
      all.empty() ? std::array<training::Opinion, training::kQuestionCount>{} : training::OpinionOf(all);
  Json questions('[');
  for (std::size_t i = 0; i < training::kQuestionCount; ++i) {
    const training::Question& question = training::Questions()[i];
    Json one('{');
    one.Text("text", question.text);
    if (!all.empty()) one.Number("mean", opinion[i].mean, 0.01).Number("deviation", opinion[i].deviation, 0.01);
    questions.Item(
        one.Number("paper_mean", question.mean, 0.01).Number("paper_deviation", question.deviation, 0.01).Done());
  }
  Json json('{');
  json.Text("session", session).Raw("people", std::to_string(all.size()));
  return json.Raw("questions", questions.Done()).Done();
}

void StoreAnswers(const std::filesystem::path& out, const std::string& session, const std::string& running,
                  const std::string& answers) {
  const std::filesystem::path folder = out / session;
  std::error_code error;
  // A link, such as "latest", may name another session by now.
  if (!IsPlainName(session) ||
      std::filesystem::symlink_status(folder, error).type() != std::filesystem::file_type::directory) {
    throw InputError("no session \"" + session + "\"; its folder may have been removed");
  }
  if (session == running) throw InputError("the questionnaire is for a session that has ended");
  training::WriteAnswers(folder, training::ParseAnswers(answers));
}

}  // namespace fulcrum::console
