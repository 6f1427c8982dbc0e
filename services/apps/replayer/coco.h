// Annotations of a data set in the format of COCO (cocodataset.org): images, categories, and for each instance in an
// image its box, area and mask.
#pragma once

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "services/apps/replayer/truth.h"

namespace fulcrum::replay {

/// Lengths of alternating runs of 0 and 1 in a mask, column by column from the upper left: COCO's uncompressed form.
[[nodiscard]] std::vector<std::uint32_t> RunLengths(const Channel& instances, int instance);

class CocoFile {
 public:
  /// Throws InputError when the file cannot be written.
  explicit CocoFile(const std::filesystem::path& file);

  /// Adds an image and all instances that it shows. `file_name` is relative to the annotations' folder.
  void Add(int image, const std::string& file_name, const Truth& truth);
  /// Completes the file. Throws InputError.
  void Finish();

 private:
  const std::filesystem::path file_;
  std::ofstream out_;
  std::string images_;
  std::uint64_t annotations_ = 0;
};

}  // namespace fulcrum::replay
