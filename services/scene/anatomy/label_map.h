// A segmentation: one label per voxel, and where the voxels lie in the patient.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <vector>

#include "services/base/core/types.h"

namespace fulcrum::scene {

/// Label 0 is nothing. Voxel (i, j, k) has index i + nx (j + ny k) and its centre at W_from_index (i, j, k).
struct LabelMap {
  std::array<int, 3> size{0, 0, 0};
  std::vector<std::uint16_t> labels;
  /// To the axes of frame W in millimetres: x to the patient's left, y cranial, z anterior. The origin is the
  /// scanner's.
  Eigen::Affine3d W_from_index = Eigen::Affine3d::Identity();

  [[nodiscard]] std::size_t Index(int i, int j, int k) const {
    return static_cast<std::size_t>(i) +
           static_cast<std::size_t>(size[0]) * (static_cast<std::size_t>(j) + static_cast<std::size_t>(size[1]) * k);
  }
};

inline constexpr std::size_t kMostVoxels = 1'000'000'000;

/// Reads a NIfTI-1 or -2 file (.nii, .nii.gz, .hdr with .img): one volume of whole numbers 0 to 65535, with a position
/// in the patient (sform or qform). Throws InputError "file: reason; valid".
LabelMap ReadLabelMap(const std::filesystem::path& file);

/// Voxels of each label but 0.
std::map<int, std::size_t> CountLabels(const LabelMap& map);

}  // namespace fulcrum::scene
