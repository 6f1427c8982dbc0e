// The questionnaire for the page: questions, and what all sessions have answered.
#pragma once

#include <filesystem>
#include <string>

namespace fulcrum::console {

/// {"session":S,"people":N,"questions":[{"text":...,"mean":...,"deviation":...,"paper_mean":...,"paper_deviation":...},
/// ...]}; without mean and deviation when no session in `out` has answers. `session` is the ended session that the page
/// asks about; empty: none.
[[nodiscard]] std::string QuestionsJson(const std::filesystem::path& out, const std::string& session);

/// Stores the answers for a session in `out`. `running` is the session that runs; empty: none. Throws InputError if the
/// session has not ended or has no folder of its own, or if the answers are malformed.
void StoreAnswers(const std::filesystem::path& out, const std::string& session, const std::string& running,
                  const std::string& answers);

}  // namespace fulcrum::console
