// The shipped courses, and files that are none.
#include "services/session/training/course.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "services/base/core/error.h"
#include "services/scene/compiler/scene_yaml.h"

namespace fulcrum::training {
namespace {

namespace fs = std::filesystem;

const fs::path kDeploy = fs::path(FULCRUM_SOURCE_DIR) / "deploy";

TEST(ShippedCourses, HaveTenExercisesAtLeastAllOfThemAssessed) {
  std::size_t exercises = 0;
  for (const Course& course : ReadCourses(kDeploy / "courses")) {
    EXPECT_FALSE(course.description.empty()) << course.name;
    for (const Exercise& exercise : course.exercises) {
      const auto scene = scene::ReadSceneYaml(kDeploy / "scenes" / (exercise.scene + ".yaml"), {}, {});
      EXPECT_EQ(scene.settings.assessment.on, 1u) << exercise.scene;
      EXPECT_EQ(scene.settings.name, exercise.scene);
      EXPECT_TRUE(scene.settings.description.starts_with("Exercise: ")) << exercise.scene;
      ++exercises;
    }
  }
  EXPECT_GE(exercises, 10u);
}

TEST(Course, IsRefusedWithFileLineKeyAndRange) {
  const fs::path file = fs::temp_directory_path() / "fulcrum_course_test.yaml";
  const auto refusal = [&](const std::string& text) -> std::string {
    std::ofstream(file) << text;
    try {
      (void)ReadCourse(file);
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_EQ(refusal("name: A\nexercises:\n  - {scene: line}\n"), "accepted");
  for (const auto& [text, part] : std::initializer_list<std::pair<std::string, std::string>>{
           {"exercises:\n  - {scene: line}\n", "name"},
           {"name: A\n", "exercises"},
           {"name: A\nexercises: []\n", "exercises"},
           {"name: A\nexercises:\n  - {scene: line, pass_pct: 101}\n", ":3: exercises[0].pass_pct"},
           {"name: A\nexercises:\n  - {scene: line}\n  - {scene: line}\n", "already"},
           {"name: A\nlevel: 3\nexercises:\n  - {scene: line}\n", "level"}}) {
    const std::string said = refusal(text);
    EXPECT_NE(said.find(part), std::string::npos) << said;
    EXPECT_NE(said.find(file.string()), std::string::npos) << said;
  }
  fs::remove(file);
  EXPECT_TRUE(ReadCourses("/nowhere").empty());
}

}  // namespace
}  // namespace fulcrum::training
