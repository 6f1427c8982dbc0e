// Any bytes as the trainees' database: refused as a whole, or read, and then a session can be added and read again, or
// the file is refused and unchanged.
#include <cmath>

#include "services/base/core/error.h"
#include "services/session/supervisor/training_log.h"
#include "tests/fuzz/target.h"

namespace fulcrum::fuzz {
namespace {

using supervisor::TrainingLog;
using supervisor::TrainingRow;

TrainingRow Row() {
  return {"A. Trainee", "20260101-120000", "line", "2026-01-01 12:00:00 UTC", 60, true, 80.5, {{"path_length_m", 1.5}}};
}

class Trainee final : public Target {
 public:
  Trainee() {
    {
      TrainingLog log(file_);
      for (int i = 0; i < 2; ++i) log.Add(Row());
    }
    good_ = ReadFile(file_);
  }
  /// A database is some pages of 4 KiB, so an input that does not begin as a database is used as patches over a valid
  /// one.
  Outcome Offer(Input input) override {
    Bytes content(input.begin(), input.end());
    if (!TextOf(input).starts_with("SQLite format 3")) {
      content = good_;
      Patch(input, &content);
    }
    for (const char* const beside : {"-journal", "-wal", "-shm"}) std::filesystem::remove(file_.string() + beside);
    WriteFile(file_, content);
    try {
      const TrainingLog log(file_, TrainingLog::Access::kRead);
      for (const auto& [name, sessions] : log.Trainees()) (void)log.SessionsOf(name, "");
      (void)log.SessionsOf(Row().trainee, Row().scene);
    } catch (const InputError&) {
      return Outcome::kRefused;
    }
    Promise(ReadFile(file_) == content, "reading has changed the file");
    try {
      TrainingLog log(file_);
      const std::size_t before = log.SessionsOf(Row().trainee, Row().scene).size();
      log.Add(Row());
      Promise(log.SessionsOf(Row().trainee, Row().scene).size() == before + 1, "a session that was added is not there");
    } catch (const InputError&) {
      return Outcome::kRefused;
    }
    return Outcome::kAccepted;
  }
  std::vector<Seed> Seeds() override { return {{"unchanged", {0}}, {"whole", good_}}; }

 private:
  const ScratchFolder folder_;
  const std::filesystem::path file_ = folder_.path() / "trainees.db";
  Bytes good_;
};

}  // namespace

std::unique_ptr<Target> MakeTrainee() { return std::make_unique<Trainee>(); }

}  // namespace fulcrum::fuzz
