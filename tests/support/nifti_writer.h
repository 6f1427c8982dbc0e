// Writes label maps as NIfTI-1 files, for tests.
#pragma once

#include <nifti1.h>
#include <zlib.h>

#include <Eigen/Geometry>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>

#include "services/scene/anatomy/label_map.h"

namespace fulcrum::testing {

/// The header of a map whose voxels are 16-bit numbers.
/// @param ras_from_index to right, anterior, superior [mm]. @param by_quaternion as qform, which can mirror, but not
/// shear; else as sform.
inline nifti_1_header NiftiHeader(const scene::LabelMap& map, const Eigen::Affine3d& ras_from_index,
                                  bool by_quaternion) {
  nifti_1_header header{};
  header.sizeof_hdr = 348;
  header.dim[0] = 3;
  for (int a = 0; a < 3; ++a) header.dim[a + 1] = static_cast<short>(map.size[static_cast<std::size_t>(a)]);
  for (int a = 4; a < 8; ++a) header.dim[a] = 1;
  header.datatype = DT_UINT16;
  header.bitpix = 16;
  header.vox_offset = 352;
  header.xyzt_units = NIFTI_UNITS_MM;
  std::memcpy(header.magic, "n+1", 4);
  const Mat3d linear = ras_from_index.linear();
  for (int a = 0; a < 3; ++a) header.pixdim[a + 1] = static_cast<float>(linear.col(a).norm());
  if (by_quaternion) {
    header.qform_code = NIFTI_XFORM_SCANNER_ANAT;
    Mat3d axes = linear.colwise().normalized();
    const bool mirrors = axes.determinant() < 0;
    header.pixdim[0] = mirrors ? -1 : 1;
    if (mirrors) axes.col(2) = -axes.col(2);
    Eigen::Quaterniond q(axes);
    if (q.w() < 0) q.coeffs() = -q.coeffs();
    header.quatern_b = static_cast<float>(q.x());
    header.quatern_c = static_cast<float>(q.y());
    header.quatern_d = static_cast<float>(q.z());
    header.qoffset_x = static_cast<float>(ras_from_index.translation().x());
    header.qoffset_y = static_cast<float>(ras_from_index.translation().y());
    header.qoffset_z = static_cast<float>(ras_from_index.translation().z());
  } else {
    header.sform_code = NIFTI_XFORM_SCANNER_ANAT;
    float* rows[3] = {header.srow_x, header.srow_y, header.srow_z};
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 4; ++c) rows[r][c] = static_cast<float>(ras_from_index.matrix()(r, c));
    }
  }
  return header;
}

inline std::string NiftiBytes(const scene::LabelMap& map, const nifti_1_header& header) {
  std::string bytes(352 + 2 * map.labels.size(), '\0');
  std::memcpy(bytes.data(), &header, sizeof(header));
  std::memcpy(bytes.data() + 352, map.labels.data(), 2 * map.labels.size());
  return bytes;
}

/// Compressed where the name ends in .gz.
inline void WriteBytes(const std::filesystem::path& file, const std::string& bytes) {
  if (file.extension() != ".gz") {
    std::ofstream(file, std::ios::binary) << bytes;
    return;
  }
  const gzFile out = gzopen(file.c_str(), "wb1");
  gzwrite(out, bytes.data(), static_cast<unsigned>(bytes.size()));
  gzclose(out);
}

/// The axes of frame W (left, cranial, anterior) from right, anterior, superior.
inline Mat3d WFromRas() {
  Mat3d m;
  m << -1, 0, 0, 0, 0, 1, 0, 1, 0;
  return m;
}

}  // namespace fulcrum::testing
