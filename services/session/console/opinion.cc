#include "services/session/console/opinion.h"

#include <vector>

#include "services/session/console/json.h"
#include "services/session/training/questionnaire.h"

namespace fulcrum::console {

std::string QuestionsJson(const std::filesystem::path& out) {
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
  return Json('{').Raw("people", std::to_string(all.size())).Raw("questions", questions.Done()).Done();
}

}  // namespace fulcrum::console
