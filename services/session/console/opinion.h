// The questionnaire for the page: questions, and what all sessions have answered.
#pragma once

#include <filesystem>
#include <string>

namespace fulcrum::console {

/// {"people":N,"questions":[{"text":...,"mean":...,"deviation":...,"paper_mean":...,"paper_deviation":...}, ...]};
/// without mean and deviation when no session in `out` has answers.
[[nodiscard]] std::string QuestionsJson(const std::filesystem::path& out);

}  // namespace fulcrum::console
