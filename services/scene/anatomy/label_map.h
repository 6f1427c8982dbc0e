// A segmentation: one label per voxel, and where the voxels lie in the patient.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "services/base/core/types.h"

namespace fulcrum::scene {

/// A segment of a DICOM segmentation, in which segments may overlap.
struct Segment {
  int number = 0;           ///< 1 to 65535, its label.
  std::string name;         ///< SegmentLabel, printable UTF-8.
  std::size_t voxels = 0;   ///< Of the segment itself.
  std::size_t covered = 0;  ///< Of these: also of a segment with a higher number, which takes precedence.
};

/// Label 0 is nothing. Voxel (i, j, k) has index i + nx (j + ny k) and its centre at W_from_index (i, j, k).
struct LabelMap {
  std::array<int, 3> size{0, 0, 0};
  std::vector<std::uint16_t> labels;
  /// To the axes of frame W in millimetres: x to the patient's left, y cranial, z anterior. The origin is the
  /// scanner's.
  Eigen::Affine3d W_from_index = Eigen::Affine3d::Identity();
  std::vector<Segment> segments;  ///< Of a DICOM segmentation, in the order of their numbers.

  [[nodiscard]] std::size_t Index(int i, int j, int k) const {
    return static_cast<std::size_t>(i) +
           static_cast<std::size_t>(size[0]) * (static_cast<std::size_t>(j) + static_cast<std::size_t>(size[1]) * k);
  }
};

inline constexpr std::size_t kMostVoxels = 1'000'000'000;
inline constexpr int kMostLabel = 65535;
inline constexpr int kLeastVoxelsAlong = 2, kMostVoxelsAlong = 4096;  ///< Of each axis.

/// Reads a file that begins as DICOM as ReadDicomSegmentation, any other as NIfTI-1 or -2 (.nii, .nii.gz, .hdr with
/// .img): one volume of whole numbers 0 to 65535, with a position in the patient (sform or qform).
/// @param wanted the segments that are used, in DICOM; empty: all. Throws InputError "file: reason; valid".
LabelMap ReadLabelMap(const std::filesystem::path& file, const std::set<int>& wanted = {});

/// Voxels of each label but 0.
std::map<int, std::size_t> CountLabels(const LabelMap& map);

}  // namespace fulcrum::scene
