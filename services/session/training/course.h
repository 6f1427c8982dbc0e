// Courses: exercises in the order in which they are learned, each with the score that passes it.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace fulcrum::training {

struct Exercise {
  std::string scene;    ///< Name of a scene that has the section `assessment`.
  double pass_pct = 0;  ///< Score from which the exercise is passed [%].
};

struct Course {
  std::string name, description;
  std::vector<Exercise> exercises;
};

/// Reads deploy/courses/NAME.yaml: `name`, `description`, and `exercises`, a list of `scene` and `pass_pct`. Throws
/// InputError (file, line, key, valid range).
[[nodiscard]] Course ReadCourse(const std::filesystem::path& file);

/// All courses of a folder in the order of their file names; none when the folder is missing. Throws InputError.
[[nodiscard]] std::vector<Course> ReadCourses(const std::filesystem::path& folder);

}  // namespace fulcrum::training
