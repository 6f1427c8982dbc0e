#include "services/session/console/attempt_films.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace fulcrum::console {
namespace {

namespace fs = std::filesystem;

class FilmPage final : public Socket {
 public:
  void SendText(std::string text) override { said.push_back(std::move(text)); }
  bool SendBytes(std::shared_ptr<const std::string> bytes) override {
    pictures.push_back(*bytes);
    return true;
  }
  std::vector<std::string> said, pictures;
};

/// Films drawn by a shell script in place of the replayer, which sends "jpeg" for each time but 2.
class AttemptFilmsTest : public testing::Test {
 protected:
  AttemptFilmsTest() {
    fs::create_directories(folder_ / "session");
    Write(
        "printf 'end 4.5\\n'\n"
        "while read t; do\n"
        "  case $t in 2.*) printf '%s 0\\n' $t;; *) printf '%s 4\\njpeg' $t;; esac\n"
        "done\n");
    std::ofstream(folder_ / "session" / "recording.mcap") << "recorded";
  }

  ~AttemptFilmsTest() override { fs::remove_all(folder_); }

  void Write(const std::string& script) {
    std::ofstream(replayer_) << "#!/bin/sh\n" << script;
    fs::permissions(replayer_, fs::perms::owner_all);
  }
  /// Runs what the projectors have posted, as the server's thread does.
  void Turn() {
    std::vector<std::function<void()>> work;
    {
      const std::lock_guard lock(mutex_);
      work.swap(work_);
    }
    for (const auto& one : work) one();
  }
  [[nodiscard]] bool Says(const FilmPage& page, const std::string& text) {
    for (int i = 0; i < 2000; ++i) {
      Turn();
      if (!page.said.empty() && page.said.back().find(text) != std::string::npos) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return false;
  }

  const fs::path folder_ =
      fs::path(testing::TempDir()) /
      ("films_" + std::to_string(::getpid()) + "_" + testing::UnitTest::GetInstance()->current_test_info()->name());
  const fs::path replayer_ = folder_ / "replayer";
  std::mutex mutex_;
  std::vector<std::function<void()>> work_;
  AttemptFilms films_{replayer_,
                      [this](const std::string& session) {
                        return session == "session" || session == "empty" ? folder_ / session : fs::path();
                      },
                      [this](std::function<void()> work) {
                        const std::lock_guard lock(mutex_);
                        work_.push_back(std::move(work));
                      }};
};

TEST_F(AttemptFilmsTest, SendsThePictureOfEachTimeAndThenTheTime) {
  FilmPage page;
  films_.Open(&page);
  films_.Receive(&page, "t=1");  // No session yet.
  films_.Receive(&page, "session=session");
  ASSERT_TRUE(Says(page, "{\"end\":4.5}"));
  films_.Receive(&page, "t=1.25");
  ASSERT_TRUE(Says(page, "{\"t\":1.25}"));
  EXPECT_EQ(page.pictures, std::vector<std::string>{"jpeg"});
  films_.Receive(&page, "t=2");
  ASSERT_TRUE(Says(page, "{\"t\":2}"));
  EXPECT_EQ(page.pictures.size(), 1u) << "the same picture";
  for (const char* bad : {"t=-1", "t=nan", "t=1e9", "session=session", "x", "%", ""}) films_.Receive(&page, bad);
  films_.Receive(&page, "t=3");
  ASSERT_TRUE(Says(page, "{\"t\":3}"));
  EXPECT_EQ(page.said.size(), 4u);
  films_.Close(&page);
}

TEST_F(AttemptFilmsTest, RefusesWhatMayNotBeSeenOrIsNotThere) {
  FilmPage other, empty;
  films_.Open(&other);
  films_.Receive(&other, "session=other");
  EXPECT_TRUE(Says(other, "no attempt \\\"other\\\" of yours"));
  films_.Open(&empty);
  films_.Receive(&empty, "session=empty");
  EXPECT_TRUE(Says(empty, "not recorded"));
}

TEST_F(AttemptFilmsTest, SaysWhyTheReplayerHasEnded) {
  Write("printf 'a warning\\nreplayer: of another scene\\n' >&2\nexit 3\n");
  FilmPage page;
  films_.Open(&page);
  films_.Receive(&page, "session=session");
  EXPECT_TRUE(Says(page, "{\"trouble\":\"of another scene\"}"));
  // The page may try again.
  Write("kill -9 $$\n");
  films_.Receive(&page, "session=session");
  EXPECT_TRUE(Says(page, "could not be drawn"));
}

TEST_F(AttemptFilmsTest, RefusesAnswersThatAreNone) {
  for (const char* script : {"printf '1 99999999999\\n'; sleep 60", "head -c 100000 /dev/zero; sleep 60"}) {
    Write(script);
    FilmPage page;
    films_.Open(&page);
    films_.Receive(&page, "session=session");
    EXPECT_TRUE(Says(page, "could not be drawn")) << script;
    films_.Close(&page);
  }
}

TEST_F(AttemptFilmsTest, FilmsAreFewAndEndWithTheirPages) {
  std::vector<FilmPage> pages(AttemptFilms::kMost + 1);
  for (FilmPage& page : pages) {
    films_.Open(&page);
    films_.Receive(&page, "session=session");
  }
  for (std::size_t i = 0; i < AttemptFilms::kMost; ++i) EXPECT_TRUE(Says(pages[i], "end"));
  EXPECT_TRUE(Says(pages.back(), "Other pages show attempts"));
  films_.Close(&pages.front());
  films_.Receive(&pages.back(), "session=session");
  EXPECT_TRUE(Says(pages.back(), "end"));
  films_.End();
  Turn();
}

}  // namespace
}  // namespace fulcrum::console
