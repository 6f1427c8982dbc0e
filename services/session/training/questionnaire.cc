#include "services/session/training/questionnaire.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>

#include "services/base/core/error.h"

namespace fulcrum::training {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFile = "questionnaire.json";
constexpr std::string_view kBegin = "{\"answers\": [", kEnd = "]}\n";
constexpr std::size_t kMostBytes = 4096;  ///< More than any answers need.

constexpr std::array<Question, kQuestionCount> kQuestions{{
    {"How realistic is the anatomy?", 3.9, 0.61},
    {"How realistic is the appearance of the picture?", 4.3, 0.65},
    {"How realistic is the handling of the instruments?", 3.9, 0.76},
    {"How realistic is the electrocautery?", 4.3, 0.53},
    {"How realistic is the tissue's deformation under traction?", 4.6, 0.26},
    {"How realistic is the coordination of eye and hand?", 3.4, 1.08},
    {"How does training on it compare with a traditional laparoscopic operation?", 3.8, 0.53},
    {"How good and realistic is the force feedback?", 3.6, 0.73},
    {"How useful is it for learning what hands feel and do?", 3.8, 0.96},
    {"How useful is it for learning hand-eye coordination?", 4.2, 0.45},
    {"How useful is it for learning to use both hands?", 4.0, 0.52},
    {"How useful is it overall for learning the fundamental skills?", 3.9, 1.18},
}};

}  // namespace

std::span<const Question, kQuestionCount> Questions() { return kQuestions; }

int ParseAnswer(std::string_view text) {
  int value = -1;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || value < 0 || value > kBestAnswer) {
    throw InputError("\"" + std::string(text.substr(0, 32)) +
                     "\" is no answer; valid: whole numbers from 0 (very poor) to " + std::to_string(kBestAnswer) +
                     " (very good)");
  }
  return value;
}

Answers ParseAnswers(std::string_view text) {
  Answers answers{};
  for (std::size_t i = 0; i < kQuestionCount; ++i) {
    const std::size_t comma = text.find(',');
    if ((comma == std::string_view::npos) != (i + 1 == kQuestionCount)) {
      throw InputError("answers: valid: " + std::to_string(kQuestionCount) + " numbers with commas between them");
    }
    std::string_view one = text.substr(0, comma);
    while (one.starts_with(' ')) one.remove_prefix(1);
    while (one.ends_with(' ')) one.remove_suffix(1);
    try {
      answers[i] = ParseAnswer(one);
    } catch (const InputError& error) {
      throw InputError("answer " + std::to_string(i + 1) + ": " + error.what());
    }
    text.remove_prefix(comma == std::string_view::npos ? text.size() : comma + 1);
  }
  return answers;
}

std::string AnswersText(const Answers& answers) {
  std::string text;
  for (const int answer : answers) text += (text.empty() ? "" : ", ") + std::to_string(answer);
  return text;
}

void WriteAnswers(const fs::path& session, const Answers& answers) {
  if (!fs::is_directory(session)) throw InputError(session.string() + ": no folder of a session");
  const fs::path file = session / kFile, next = session / (std::string(kFile) + ".new");
  {
    std::ofstream stream(next, std::ios::binary);
    stream << kBegin << AnswersText(answers) << kEnd;
    stream.flush();
    if (!stream) throw InputError(next.string() + ": cannot be written: " + std::strerror(errno));
  }
  fs::rename(next, file);
}

std::optional<Answers> ReadAnswers(const fs::path& session) {
  const fs::path file = session / kFile;
  std::ifstream stream(file, std::ios::binary);
  if (!stream) return {};
  std::string text(kMostBytes, '\0');
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(stream.gcount()));
  if (!text.starts_with(kBegin) || !text.ends_with(kEnd)) {
    throw InputError(file.string() + ": no answers of a questionnaire; fill it in again: fulcrum questionnaire " +
                     session.filename().string());
  }
  try {
    return ParseAnswers(std::string_view(text).substr(kBegin.size(), text.size() - kBegin.size() - kEnd.size()));
  } catch (const InputError& error) {
    throw InputError(file.string() + ": " + error.what());
  }
}

std::vector<Answers> ReadAllAnswers(const fs::path& out, std::vector<std::string>* refused) {
  std::vector<fs::path> sessions;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(out, error)) {
    if (entry.is_directory(error) && !entry.is_symlink(error)) sessions.push_back(entry.path());
  }
  std::sort(sessions.begin(), sessions.end());
  std::vector<Answers> all;
  for (const fs::path& session : sessions) {
    try {
      if (const std::optional<Answers> answers = ReadAnswers(session)) all.push_back(*answers);
    } catch (const InputError& wrong) {
      refused->emplace_back(wrong.what());
    }
  }
  return all;
}

std::array<Opinion, kQuestionCount> OpinionOf(std::span<const Answers> answers) {
  std::array<Opinion, kQuestionCount> opinion;
  const auto people = static_cast<double>(answers.size());
  for (std::size_t i = 0; i < kQuestionCount; ++i) {
    double sum = 0, squares = 0;
    for (const Answers& one : answers) sum += one[i];
    const double mean = sum / people;
    for (const Answers& one : answers) squares += (one[i] - mean) * (one[i] - mean);
    opinion[i] = {mean, answers.size() > 1 ? std::sqrt(squares / (people - 1)) : 0};
  }
  return opinion;
}

}  // namespace fulcrum::training
