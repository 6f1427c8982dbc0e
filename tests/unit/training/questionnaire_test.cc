// The questionnaire: what it asks, what it stores, what it refuses, and the figures of the paper's Table 5.
#include "services/session/training/questionnaire.h"

#include <gtest/gtest.h>

#include <fstream>
#include <numeric>
#include <random>

#include "services/base/core/error.h"
#include "tests/unit/supervisor/temporary_folder.h"

namespace fulcrum::training {
namespace {

namespace fs = std::filesystem;

constexpr Answers kSome{0, 1, 2, 3, 4, 5, 0, 1, 2, 3, 4, 5};

TEST(PaperTable5, MeansAndDeviationsOfThePapersSurgeons) {
  constexpr std::array kMeans{3.9, 4.3, 3.9, 4.3, 4.6, 3.4, 3.8, 3.6, 3.8, 4.2, 4.0, 3.9};
  constexpr std::array kDeviations{0.61, 0.65, 0.76, 0.53, 0.26, 1.08, 0.53, 0.73, 0.96, 0.45, 0.52, 1.18};
  for (std::size_t i = 0; i < kQuestionCount; ++i) {
    EXPECT_EQ(Questions()[i].mean, kMeans[i]) << i + 1;
    EXPECT_EQ(Questions()[i].deviation, kDeviations[i]) << i + 1;
  }
}

TEST(Questionnaire, AnswersAreStoredInTheSession) {
  const supervisor::TemporaryFolder folder;
  EXPECT_FALSE(ReadAnswers(folder.path()));
  WriteAnswers(folder.path(), Answers{});
  WriteAnswers(folder.path(), kSome);
  EXPECT_EQ(ReadAnswers(folder.path()), kSome);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), {}), 1) << "nothing else is left there";
  EXPECT_THROW(WriteAnswers(folder.path() / "none", kSome), InputError);
}

TEST(Questionnaire, RefusesWhatIsNoAnswer) {
  EXPECT_EQ(ParseAnswers("0, 1,2, 3 ,4,5,0,1,2,3,4,5"), kSome);
  for (const char* bad : {"", "6", "-1", "3.5", "three", "3 ", "0x3"})
    EXPECT_THROW((void)ParseAnswer(bad), InputError) << bad;
  for (const char* bad : {"", "1,2,3", "0,1,2,3,4,5,0,1,2,3,4,6", "0,1,2,3,4,5,0,1,2,3,4,5,1", "0,1,2,3,4,5,0,1,2,3,4,",
                          "0;1;2;3;4;5;0;1;2;3;4;5"}) {
    EXPECT_THROW((void)ParseAnswers(bad), InputError) << bad;
  }
  try {
    (void)ParseAnswers("0,1,9,3,4,5,0,1,2,3,4,5");
    ADD_FAILURE();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(),
                 "answer 3: \"9\" is no answer; valid: whole numbers from 0 (very poor) to 5 (very good)");
  }
}

TEST(Questionnaire, AnyBytesAreAnswersOrAnError) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 20000; ++trial) {
    std::string text = trial % 2 == 0 ? AnswersText(kSome) : std::string(random() % 64, ' ');
    for (int edits = 0; edits < 3 && !text.empty(); ++edits) text[random() % text.size()] = static_cast<char>(random());
    try {
      for (const int answer : ParseAnswers(text)) ASSERT_TRUE(answer >= 0 && answer <= kBestAnswer);
    } catch (const InputError&) {  // Either is right.
    }
  }
}

TEST(Questionnaire, SummaryIsOverAllSessionsThatCanBeRead) {
  const supervisor::TemporaryFolder folder;
  for (const char* name : {"a", "b", "c", "spoilt", "without"}) fs::create_directory(folder.path() / name);
  fs::create_directory_symlink(folder.path() / "a", folder.path() / "latest");
  Answers answers{};
  answers[2] = 2;
  WriteAnswers(folder.path() / "a", answers);
  answers[2] = 3;
  WriteAnswers(folder.path() / "b", answers);
  answers[2] = 4;
  WriteAnswers(folder.path() / "c", answers);
  std::ofstream(folder.path() / "spoilt" / "questionnaire.json") << "{\"answers\": [1, 2]}\n";
  std::vector<std::string> refused;
  const std::vector<Answers> all = ReadAllAnswers(folder.path(), &refused);
  ASSERT_EQ(all.size(), 3u);
  ASSERT_EQ(refused.size(), 1u);
  EXPECT_NE(refused[0].find("spoilt"), std::string::npos);
  const auto opinion = OpinionOf(all);
  EXPECT_DOUBLE_EQ(opinion[2].mean, 3);
  EXPECT_DOUBLE_EQ(opinion[2].deviation, 1);
  EXPECT_EQ(OpinionOf(std::span(all).first(1))[2].deviation, 0);
}

}  // namespace
}  // namespace fulcrum::training
