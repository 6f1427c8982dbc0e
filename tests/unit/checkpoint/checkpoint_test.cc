#include "services/base/runtime/checkpoint.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "services/base/core/error.h"

namespace fulcrum::runtime {
namespace {

constexpr std::uint64_t kScene = 0xabcdef;
constexpr std::uint32_t kLayout = 1;

class CheckpointTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "fulcrum_checkpoint_XXXXXX").string();
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    folder_ = name;
    file_ = folder_ / "node.checkpoint";
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  /// Every byte of the payload is a function of `value`, so that a mixture of two payloads is detected.
  static void Write(CheckpointFile* checkpoint, std::uint64_t value, std::size_t words) {
    const auto slot = checkpoint->Begin();
    for (std::size_t i = 0; i < words; ++i) {
      const std::uint64_t word = value * 0x9e3779b97f4a7c15ull + i;
      std::memcpy(slot.data() + 8 * i, &word, 8);
    }
    checkpoint->Commit(8 * words);
  }
  static bool Matches(std::span<const std::byte> payload, std::uint64_t value) {
    for (std::size_t i = 0; i < payload.size() / 8; ++i) {
      std::uint64_t word;
      std::memcpy(&word, payload.data() + 8 * i, 8);
      if (word != value * 0x9e3779b97f4a7c15ull + i) {
        return false;
      }
    }
    return true;
  }
  void FlipByte(std::size_t offset) const {
    std::fstream stream(file_, std::ios::in | std::ios::out | std::ios::binary);
    stream.seekg(static_cast<std::streamoff>(offset));
    const int byte = stream.get();
    stream.seekp(static_cast<std::streamoff>(offset));
    stream.put(static_cast<char>(byte ^ 0x10));
  }

  std::filesystem::path folder_, file_;
};

TEST_F(CheckpointTest, NewFileHoldsNothing) {
  const CheckpointFile checkpoint(file_, kScene, kLayout, 100);
  EXPECT_FALSE(checkpoint.Latest().has_value());
}

TEST_F(CheckpointTest, LastCommitComesBackAfterReopening) {
  {
    CheckpointFile checkpoint(file_, kScene, kLayout, 800);
    Write(&checkpoint, 1, 100);
    Write(&checkpoint, 2, 50);
    Write(&checkpoint, 3, 80);
  }
  const CheckpointFile checkpoint(file_, kScene, kLayout, 800);
  const auto latest = checkpoint.Latest();
  ASSERT_TRUE(latest.has_value());
  EXPECT_EQ(latest->sequence, 3u);
  EXPECT_EQ(latest->payload.size(), 640u);
  EXPECT_TRUE(Matches(latest->payload, 3));
}

TEST_F(CheckpointTest, NewestSequenceIsSeenFromOutside) {
  EXPECT_EQ(NewestSequence(file_), 0u) << "no file";
  CheckpointFile checkpoint(file_, kScene, kLayout, 800);
  EXPECT_EQ(NewestSequence(file_), 0u);
  Write(&checkpoint, 1, 100);
  Write(&checkpoint, 2, 100);
  EXPECT_EQ(NewestSequence(file_), 2u);
  (void)checkpoint.Begin();
  EXPECT_EQ(NewestSequence(file_), 2u) << "the older slot is being filled";
  std::ofstream(folder_ / "other") << "not a checkpoint, but as long as the header of one";
  EXPECT_EQ(NewestSequence(folder_ / "other"), 0u);
}

TEST_F(CheckpointTest, ThePreviousSlotIsThereUntilItIsFilledAnew) {
  CheckpointFile checkpoint(file_, kScene, kLayout, 800);
  EXPECT_FALSE(checkpoint.Previous());
  Write(&checkpoint, 1, 100);
  EXPECT_FALSE(checkpoint.Previous());
  Write(&checkpoint, 2, 50);
  const auto previous = checkpoint.Previous();
  ASSERT_TRUE(previous);
  EXPECT_EQ(previous->sequence, 1u);
  EXPECT_TRUE(Matches(previous->payload, 1));
  (void)checkpoint.Begin();
  EXPECT_FALSE(checkpoint.Previous());
}

TEST_F(CheckpointTest, WhetherAProcessHasItIsSeenFromOutside) {
  EXPECT_FALSE(IsInUse(file_)) << "no file";
  {
    const CheckpointFile checkpoint(file_, kScene, kLayout, 800);
    EXPECT_TRUE(IsInUse(file_));
  }
  EXPECT_FALSE(IsInUse(file_));
  const CheckpointFile again(file_, kScene, kLayout, 800);
  EXPECT_TRUE(IsInUse(file_)) << "the query does not change the file";
}

TEST_F(CheckpointTest, PeekReadsTheNewestWholeSlotOfAFileThatIsInUse) {
  EXPECT_FALSE(CheckpointFile::Peek(file_, kScene, kLayout, 800)) << "no file";
  CheckpointFile checkpoint(file_, kScene, kLayout, 800);
  EXPECT_FALSE(CheckpointFile::Peek(file_, kScene, kLayout, 800)) << "it is empty";
  // Either slot may be the newest.
  for (const std::uint64_t value : {1, 2, 3}) {
    Write(&checkpoint, value, 20 * value);
    const auto peeked = CheckpointFile::Peek(file_, kScene, kLayout, 800);
    ASSERT_TRUE(peeked);
    EXPECT_EQ(peeked->size(), 160 * value);
    EXPECT_TRUE(Matches(*peeked, value));
  }
  // The process is stopped while it fills the next slot.
  const auto slot = checkpoint.Begin();
  std::memset(slot.data(), 0xff, 400);
  const auto peeked = CheckpointFile::Peek(file_, kScene, kLayout, 800);
  ASSERT_TRUE(peeked);
  EXPECT_TRUE(Matches(*peeked, 3));
  checkpoint.Commit(400);
  EXPECT_EQ(checkpoint.Latest()->sequence, 4u) << "Peek does not change the file";
}

TEST_F(CheckpointTest, PeekTakesNothingThatIsAlteredOrOfAnother) {
  {
    CheckpointFile checkpoint(file_, kScene, kLayout, 800);
    Write(&checkpoint, 1, 100);
    Write(&checkpoint, 2, 100);
  }
  EXPECT_FALSE(CheckpointFile::Peek(file_, kScene + 1, kLayout, 800));
  EXPECT_FALSE(CheckpointFile::Peek(file_, kScene, kLayout + 1, 800));
  EXPECT_FALSE(CheckpointFile::Peek(file_, kScene, kLayout, 808));
  FlipByte(4 * 4096 + 17);  // The payload of slot 1.
  const auto peeked = CheckpointFile::Peek(file_, kScene, kLayout, 800);
  ASSERT_TRUE(peeked);
  EXPECT_TRUE(Matches(*peeked, 1));
  FlipByte(2 * 4096 + 17);
  EXPECT_FALSE(CheckpointFile::Peek(file_, kScene, kLayout, 800));
  std::filesystem::resize_file(file_, 4096);
  EXPECT_FALSE(CheckpointFile::Peek(file_, kScene, kLayout, 800)) << "cut after its header";
  std::ofstream(folder_ / "other") << "not a checkpoint, but as long as the header of one";
  EXPECT_FALSE(CheckpointFile::Peek(folder_ / "other", kScene, kLayout, 800));
}

TEST_F(CheckpointTest, UnsealedSlotLeavesTheOlderOne) {
  {
    CheckpointFile checkpoint(file_, kScene, kLayout, 800);
    Write(&checkpoint, 1, 100);
    const auto slot = checkpoint.Begin();
    std::memset(slot.data(), 0xff, 400);
  }
  const CheckpointFile checkpoint(file_, kScene, kLayout, 800);
  ASSERT_TRUE(checkpoint.Latest().has_value());
  EXPECT_TRUE(Matches(checkpoint.Latest()->payload, 1));
}

TEST_F(CheckpointTest, AlteredNewestSlotFallsBackToTheOlderOneAndIsOverwrittenNext) {
  {
    CheckpointFile checkpoint(file_, kScene, kLayout, 800);
    Write(&checkpoint, 1, 100);
    Write(&checkpoint, 2, 100);
  }
  FlipByte(3 * 4096 + 4096 + 17);  // Slot 1: header page at 3 * 4096, then its payload.
  CheckpointFile checkpoint(file_, kScene, kLayout, 800);
  EXPECT_TRUE(checkpoint.complaint().ends_with("was altered from outside: the node goes on from what is whole"))
      << checkpoint.complaint();
  ASSERT_TRUE(checkpoint.Latest().has_value());
  EXPECT_EQ(checkpoint.Latest()->sequence, 1u);
  EXPECT_TRUE(Matches(checkpoint.Latest()->payload, 1));
  Write(&checkpoint, 7, 100);
  EXPECT_TRUE(Matches(checkpoint.Latest()->payload, 7));
}

TEST_F(CheckpointTest, BothSlotsAlteredIsAnEmptyCheckpoint) {
  {
    CheckpointFile checkpoint(file_, kScene, kLayout, 800);
    Write(&checkpoint, 1, 100);
    Write(&checkpoint, 2, 100);
  }
  FlipByte(2 * 4096 + 3);
  FlipByte(4 * 4096 + 3);
  const CheckpointFile checkpoint(file_, kScene, kLayout, 800);
  EXPECT_FALSE(checkpoint.Latest().has_value());
  EXPECT_TRUE(checkpoint.complaint().ends_with("was altered from outside: the node begins anew"))
      << checkpoint.complaint();
}

TEST_F(CheckpointTest, OtherSceneLayoutOrCapacityIsReplacedAndToldWithTheReason) {
  const auto refused = [&](std::uint64_t scene, std::uint32_t layout, std::size_t capacity, const std::string& why) {
    {
      CheckpointFile checkpoint(file_, kScene, kLayout, 800);
      Write(&checkpoint, 1, 100);
    }
    const CheckpointFile checkpoint(file_, scene, layout, capacity);
    EXPECT_FALSE(checkpoint.Latest().has_value()) << why;
    EXPECT_EQ(checkpoint.complaint(), file_.string() + " " + why + ": replaced, the node begins anew");
  };
  refused(kScene + 1, kLayout, 800, "is of another scene");
  refused(kScene, kLayout + 1, 800, "has layout 1, this build reads 2");
  refused(kScene, kLayout, 808, "has not the size that its scene asks for");
  std::filesystem::remove(file_);
  EXPECT_EQ(CheckpointFile(file_, kScene, kLayout, 800).complaint(), "") << "a new file is no fault";
  std::ofstream(file_) << "not a checkpoint";
  const CheckpointFile checkpoint(file_, kScene, kLayout, 800);
  EXPECT_FALSE(checkpoint.Latest().has_value());
  EXPECT_EQ(checkpoint.complaint(), file_.string() + " is no checkpoint: replaced, the node begins anew");
}

TEST_F(CheckpointTest, SecondProcessIsRefusedWithTheFileName) {
  const CheckpointFile checkpoint(file_, kScene, kLayout, 800);
  try {
    const CheckpointFile second(file_, kScene, kLayout, 800);
    FAIL() << "a second writer was accepted";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("node.checkpoint"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("in use"), std::string::npos) << error.what();
  }
}

TEST_F(CheckpointTest, MissingFolderIsRefused) {
  EXPECT_THROW(CheckpointFile(folder_ / "no" / "file", kScene, kLayout, 8), InputError);
}

TEST_F(CheckpointTest, CommitWithoutBeginOrBeyondCapacityIsABug) {
  CheckpointFile checkpoint(file_, kScene, kLayout, 800);
  EXPECT_THROW(checkpoint.Commit(8), std::logic_error);
  (void)checkpoint.Begin();
  EXPECT_THROW(checkpoint.Commit(801), std::logic_error);
}

// The guarantee: for a kill at any moment the file opens and holds one whole payload, never a mixture, and never one
// older than the last but one that the writer reported.
TEST_F(CheckpointTest, SurvivesKillAtAnyMoment) {
  constexpr int kKills = 150;
  constexpr std::size_t kWords = 4000;
  std::mt19937 random(1);
  std::uint64_t reached = 0;
  for (int kill_index = 0; kill_index < kKills; ++kill_index) {
    int report[2];
    ASSERT_EQ(::pipe(report), 0);
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      CheckpointFile checkpoint(file_, kScene, kLayout, 8 * kWords);
      std::uint64_t value = checkpoint.Latest() ? checkpoint.Latest()->sequence : 0;
      for (;;) {
        ++value;
        Write(&checkpoint, value, kWords);
        if (::write(report[1], &value, sizeof(value)) != sizeof(value)) {
          ::_exit(1);
        }
      }
    }
    ::close(report[1]);
    std::uint64_t reported = reached;
    const int reads = 1 + static_cast<int>(random() % 5);
    for (int i = 0; i < reads; ++i) {
      ASSERT_EQ(::read(report[0], &reported, sizeof(reported)), static_cast<ssize_t>(sizeof(reported)));
    }
    ::usleep(random() % 300);
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    std::uint64_t value;
    while (::read(report[0], &value, sizeof(value)) == static_cast<ssize_t>(sizeof(value))) {
      reported = value;
    }
    ::close(report[0]);

    const CheckpointFile checkpoint(file_, kScene, kLayout, 8 * kWords);
    const auto latest = checkpoint.Latest();
    ASSERT_TRUE(latest.has_value());
    EXPECT_TRUE(latest->sequence == reported || latest->sequence == reported + 1)
        << latest->sequence << " against " << reported;
    ASSERT_TRUE(Matches(latest->payload, latest->sequence)) << "mixed payload after kill " << kill_index;
    reached = latest->sequence;
  }
  EXPECT_GE(reached, static_cast<std::uint64_t>(kKills));
}

}  // namespace
}  // namespace fulcrum::runtime
