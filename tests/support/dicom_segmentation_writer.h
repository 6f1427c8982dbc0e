// Writes segmentations as DICOM files, for tests: by DCMTK's module for them (dcmseg), which shares no code with the
// reader.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "services/scene/anatomy/label_map.h"

namespace fulcrum::testing {

struct DicomSegments {
  std::array<int, 3> size{0, 0, 0};
  /// Of a voxel's centre, to the patient's left, posterior, superior [mm]. @pre right-handed, axes at right angles.
  Eigen::Affine3d lps_from_index = Eigen::Affine3d::Identity();
  struct Segment {
    std::string name;
    std::vector<std::uint8_t> voxels;  ///< As in a LabelMap: 0 or 1, or a share of `largest`.
  };
  std::vector<Segment> segments;  ///< Numbers from 1 on.
};

struct DicomOptions {
  int largest = 0;                ///< MaximumFractionalValue; 0: BINARY.
  bool writes_empty = false;      ///< Frames without a voxel, which may be missing.
  bool states_spacing = true;     ///< SpacingBetweenSlices.
  bool planes_of_frames = false;  ///< Orientation and spacing in every frame, else shared.
  bool is_implicit = false;       ///< Without types (VR), with the lengths of sequences; else the reverse.
  unsigned shuffled = 0;          ///< Seed of the order of frames; 0: by segment, then along k.
};

/// Segment n of the voxels with label n, for all labels up to the largest.
DicomSegments SegmentsOf(const scene::LabelMap& map);

/// The same bytes each time. Throws std::runtime_error with DCMTK's reason.
void WriteDicomSegmentation(const std::filesystem::path& file, const DicomSegments& segments,
                            const DicomOptions& options = {});

/// The axes of frame W (left, cranial, anterior) from left, posterior, superior.
inline Mat3d WFromLps() {
  Mat3d m;
  m << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  return m;
}

}  // namespace fulcrum::testing
