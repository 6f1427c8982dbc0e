#include "services/session/training/course.h"

#include <algorithm>
#include <iterator>
#include <system_error>

#include "services/base/config/strict_yaml.h"

namespace fulcrum::training {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostExercises = 100, kLongestName = 63;
constexpr double kUsualPass_pct = 75;

}  // namespace

Course ReadCourse(const fs::path& file) {
  config::StrictYaml yaml = config::StrictYaml::FromFile(file);
  config::StrictMap root = yaml.root();
  Course course{root.Text("name", kLongestName), root.TextOr("description", ""), {}};
  for (config::StrictMap& entry : root.Maps("exercises", 1, kMostExercises)) {
    const std::string scene = entry.Text("scene", kLongestName);
    const bool known =
        std::ranges::any_of(course.exercises, [&](const Exercise& other) { return other.scene == scene; });
    if (known) entry.Fail("scene", "'" + scene + "' is in the course already");
    course.exercises.push_back({scene, entry.Number("pass_pct", kUsualPass_pct, config::Range::Between(1, 100))});
  }
  yaml.Finish();
  return course;
}

std::vector<Course> ReadCourses(const fs::path& folder) {
  std::error_code error;
  std::vector<fs::path> files;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    if (entry->path().extension() == ".yaml") files.push_back(entry->path());
  }
  std::ranges::sort(files);
  std::vector<Course> courses;
  std::ranges::transform(files, std::back_inserter(courses), ReadCourse);
  return courses;
}

}  // namespace fulcrum::training
