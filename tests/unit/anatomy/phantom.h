// What tests of segmentations share: a folder for their files, and a phantom with marked sides.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <functional>
#include <string>

#include "services/base/core/error.h"
#include "services/scene/anatomy/label_map.h"
#include "tests/support/nifti_writer.h"

namespace fulcrum::scene {

class Segmentation : public ::testing::Test {
 protected:
  Segmentation() { std::filesystem::create_directories(folder_); }
  ~Segmentation() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path Write(const std::string& name, const std::string& bytes) {
    fulcrum::testing::WriteBytes(folder_ / name, bytes);
    return folder_ / name;
  }
  static std::string Refusal(const std::function<void()>& work) {
    try {
      work();
      return "";
    } catch (const InputError& error) {
      return error.what();
    }
  }

  const std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("fulcrum_anatomy_test_" + std::to_string(getpid()));
};

/// Labels by a function of the place in frame W [mm].
template <class Label>
LabelMap Fill(const std::array<int, 3>& size, const Eigen::Affine3d& W_from_index, const Label& label) {
  LabelMap map;
  map.size = size;
  map.W_from_index = W_from_index;
  map.labels.resize(static_cast<std::size_t>(size[0]) * size[1] * size[2]);
  for (int k = 0; k < size[2]; ++k) {
    for (int j = 0; j < size[1]; ++j) {
      for (int i = 0; i < size[0]; ++i) {
        map.labels[map.Index(i, j, k)] = static_cast<std::uint16_t>(label(W_from_index * Vec3d(i, j, k)));
      }
    }
  }
  return map;
}

/// Marks of a phantom, in frame W [mm]: label 1 lies to the left, 2 cranial, 3 anterior of the middle.
inline int Mark(const Vec3d& p) {
  const Vec3d marks[3] = {{14, 0, 0}, {0, 14, 0}, {0, 0, 14}};
  for (int m = 0; m < 3; ++m) {
    if ((p - marks[m]).norm() < 4) return m + 1;
  }
  return 0;
}

inline Eigen::Affine3d Around(const Mat3d& ras, const std::array<int, 3>& size) {
  Eigen::Affine3d ras_from_index = Eigen::Affine3d::Identity();
  ras_from_index.linear() = ras;
  ras_from_index.translation() = -ras * (0.5 * Vec3d(size[0] - 1, size[1] - 1, size[2] - 1));
  return ras_from_index;
}

}  // namespace fulcrum::scene
