// Annotations of a data set in the format of COCO (cocodataset.org): images, categories, and for each instance in an
// image its box, area and mask.
#pragma once

#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "services/apps/replayer/truth.h"

namespace fulcrum::replay {

/// Where an instance is in an image.
struct InstanceMask {
  int left, top, right, bottom;  ///< Box around it [pixels], half open, from the upper left.
  std::uint64_t area = 0;        ///< [pixels]
  /// Lengths of alternating runs of 0 and 1, column by column from the upper left: COCO's uncompressed form.
  std::vector<std::uint32_t> runs{};
};

/// Of all instances of an image but 0.
[[nodiscard]] std::map<int, InstanceMask> InstanceMasks(const Channel& instances);

class CocoFile {
 public:
  /// Throws InputError when the file cannot be written.
  explicit CocoFile(const std::filesystem::path& file);

  /// Adds an image and all instances that it shows. `file_name` is relative to the annotations' folder.
  void Add(int image, const std::string& file_name, const Channel& instances, const Truth& truth);
  /// Completes the file. Throws InputError.
  void Finish();

 private:
  const std::filesystem::path file_;
  std::ofstream out_;
  std::string images_;
  std::uint64_t annotations_ = 0;
};

}  // namespace fulcrum::replay
