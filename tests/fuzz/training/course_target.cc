// A course: refused with the file's name, or read to exercises of plain names and passing scores in range.
#include "services/base/core/error.h"
#include "services/session/training/course.h"
#include "tests/fuzz/line_mutator.h"
#include "tests/fuzz/target.h"

namespace fulcrum::fuzz {
namespace {

class Course final : public Target {
 public:
  Outcome Offer(Input input) override {
    file_.Write(input);
    try {
      const training::Course course = training::ReadCourse(file_.path());
      for (const training::Exercise& exercise : course.exercises) {
        Promise(!exercise.scene.empty(), "an exercise without a scene");
        Promise(exercise.pass_pct >= 0 && exercise.pass_pct <= 100, "a passing score out of range");
      }
      return Outcome::kAccepted;
    } catch (const InputError& refusal) {
      Promise(std::string_view(refusal.what()).find(file_.path().filename().string()) != std::string_view::npos,
              "a refusal that names no file");
      return Outcome::kRefused;
    }
  }
  Bytes Mutate(Input input, unsigned seed) override { return BytesOf(MutateLines(TextOf(input), seed)); }
  std::vector<std::string> Words() override {
    return {"name: ", "description: ", "exercises: ", "scene: ", "pass_pct: "};
  }
  std::vector<Seed> Seeds() override { return FilesOf("deploy/courses", ".yaml"); }

 private:
  MemoryFile file_;
};

}  // namespace

std::unique_ptr<Target> MakeCourse() { return std::make_unique<Course>(); }

}  // namespace fulcrum::fuzz
