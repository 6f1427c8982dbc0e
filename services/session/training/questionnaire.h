// The questionnaire of the paper's Table 5, for a surgeon after a session: twelve questions, answered from 0 to 5.
// Answers lie in the session's folder, without a name.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace fulcrum::training {

inline constexpr std::size_t kQuestionCount = 12;
inline constexpr int kBestAnswer = 5;  ///< "Very good"; 0 is "very poor".

struct Question {
  std::string_view text;
  double mean, deviation;  ///< Table 5: of 15 surgeons.
};
[[nodiscard]] std::span<const Question, kQuestionCount> Questions();

using Answers = std::array<int, kQuestionCount>;

/// One answer. Throws InputError unless it is a whole number from 0 to 5.
[[nodiscard]] int ParseAnswer(std::string_view text);
/// Twelve answers with commas between them. Throws InputError with the place and the valid range.
[[nodiscard]] Answers ParseAnswers(std::string_view text);
[[nodiscard]] std::string AnswersText(const Answers& answers);

/// Writes the file questionnaire.json of a session's folder; answers that are there are replaced. Throws InputError.
void WriteAnswers(const std::filesystem::path& session, const Answers& answers);
/// None when the session has none. Throws InputError for a file that WriteAnswers cannot have written.
[[nodiscard]] std::optional<Answers> ReadAnswers(const std::filesystem::path& session);
/// Of all sessions in a folder, by name. A file that cannot be read is named in `refused` and left out.
[[nodiscard]] std::vector<Answers> ReadAllAnswers(const std::filesystem::path& out, std::vector<std::string>* refused);

struct Opinion {
  double mean = 0, deviation = 0;  ///< Deviation of the sample, with n - 1; 0 of one person.
};
/// By question. @pre not empty
[[nodiscard]] std::array<Opinion, kQuestionCount> OpinionOf(std::span<const Answers> answers);

}  // namespace fulcrum::training
