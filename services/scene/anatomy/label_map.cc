#include "services/scene/anatomy/label_map.h"

#include <nifti2_io.h>

#include <cmath>
#include <cstdio>
#include <memory>
#include <string>

#include "services/base/core/error.h"
#include "services/scene/anatomy/dicom_outline.h"
#include "services/scene/anatomy/dicom_segmentation.h"

namespace fulcrum::scene {
namespace {

struct FreeImage {
  void operator()(nifti_image* image) const { nifti_image_free(image); }
};
using Image = std::unique_ptr<nifti_image, FreeImage>;

[[noreturn]] void Refuse(const std::filesystem::path& file, const std::string& reason) {
  throw InputError(file.string() + ": " + reason);
}

/// From voxel indices to the axes right, anterior, superior of NIfTI [mm].
Eigen::Matrix4d ToRas(const std::filesystem::path& file, const nifti_image& image, double to_mm) {
  if (image.sform_code <= 0 && image.qform_code <= 0) {
    Refuse(file, "has neither sform nor qform, so left and right are not known; write the file with its orientation");
  }
  const nifti_dmat44& m = image.sform_code > 0 ? image.sto_xyz : image.qto_xyz;
  Eigen::Matrix4d ras = Eigen::Matrix4d::Identity();
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 4; ++c) ras(r, c) = to_mm * m.m[r][c];
  }
  const double volume = std::abs(ras.block<3, 3>(0, 0).determinant());
  if (!ras.allFinite() || !(volume > 1e-6 && volume < 1e6)) {
    char text[96];
    std::snprintf(text, sizeof(text), "its voxels have a volume of %.3g cubic millimetres; valid: 1e-6 to 1e6", volume);
    Refuse(file, text);
  }
  return ras;
}

template <class T>
void Take(const std::filesystem::path& file, const nifti_image& image, LabelMap* map) {
  // A slope of 0 means that nothing is scaled.
  const double slope = image.scl_slope == 0 ? 1 : image.scl_slope, offset = image.scl_slope == 0 ? 0 : image.scl_inter;
  const T* values = static_cast<const T*>(image.data);
  for (std::size_t i = 0; i < map->labels.size(); ++i) {
    const double value = slope * static_cast<double>(values[i]) + offset;
    if (!(value >= 0 && value <= kMostLabel) || value != std::floor(value)) {
      Refuse(file,
             "voxel " + std::to_string(i) + " is " + std::to_string(value) +
                 "; valid: whole numbers 0 to 65535. This is no label map, or it was resampled with interpolation");
    }
    map->labels[i] = static_cast<std::uint16_t>(value);
  }
}

LabelMap ReadNifti(const std::filesystem::path& file) {
  nifti_set_debug_level(0);  // Its messages would go to standard error.
  Image image(nifti_image_read(file.c_str(), 0));
  if (image == nullptr)
    Refuse(file, "is no NIfTI file (.nii, .nii.gz, .hdr with .img) and no DICOM file, or is cut short");
  const std::int64_t size[3] = {image->nx, image->ny, image->nz};
  for (const std::int64_t n : size) {
    if (n < kLeastVoxelsAlong || n > kMostVoxelsAlong) {
      Refuse(file, "is " + std::to_string(size[0]) + " x " + std::to_string(size[1]) + " x " + std::to_string(size[2]) +
                       " voxels; valid: " + std::to_string(kLeastVoxelsAlong) + " to " +
                       std::to_string(kMostVoxelsAlong) + " either way");
    }
  }
  const auto voxels =
      static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]) * static_cast<std::size_t>(size[2]);
  if (voxels > kMostVoxels || static_cast<std::size_t>(image->nvox) != voxels) {
    Refuse(file, "holds " + std::to_string(image->nvox) + " values for " + std::to_string(voxels) +
                     " voxels; valid: one value each, at most " + std::to_string(kMostVoxels));
  }
  LabelMap map;
  map.size = {static_cast<int>(size[0]), static_cast<int>(size[1]), static_cast<int>(size[2])};
  double to_mm = 1;
  if (image->xyz_units == NIFTI_UNITS_METER) to_mm = 1e3;
  if (image->xyz_units == NIFTI_UNITS_MICRON) to_mm = 1e-3;
  // Right, anterior, superior become left, cranial, anterior: a rotation, so left stays left.
  Eigen::Matrix4d W_from_ras = Eigen::Matrix4d::Zero();
  W_from_ras(0, 0) = -1;
  W_from_ras(1, 2) = 1;
  W_from_ras(2, 1) = 1;
  W_from_ras(3, 3) = 1;
  map.W_from_index.matrix() = W_from_ras * ToRas(file, *image, to_mm);

  if (nifti_image_load(image.get()) != 0 || image->data == nullptr) {
    Refuse(file, "its voxels cannot be read: the file is cut short");
  }
  map.labels.resize(voxels);
  switch (image->datatype) {
    case DT_UINT8:
      Take<std::uint8_t>(file, *image, &map);
      break;
    case DT_INT8:
      Take<std::int8_t>(file, *image, &map);
      break;
    case DT_UINT16:
      Take<std::uint16_t>(file, *image, &map);
      break;
    case DT_INT16:
      Take<std::int16_t>(file, *image, &map);
      break;
    case DT_UINT32:
      Take<std::uint32_t>(file, *image, &map);
      break;
    case DT_INT32:
      Take<std::int32_t>(file, *image, &map);
      break;
    case DT_UINT64:
      Take<std::uint64_t>(file, *image, &map);
      break;
    case DT_INT64:
      Take<std::int64_t>(file, *image, &map);
      break;
    case DT_FLOAT32:
      Take<float>(file, *image, &map);
      break;
    case DT_FLOAT64:
      Take<double>(file, *image, &map);
      break;
    default:
      Refuse(file, "has values of type " + std::to_string(image->datatype) + "; valid: whole or real numbers");
  }
  return map;
}

}  // namespace

LabelMap ReadLabelMap(const std::filesystem::path& file, const std::set<int>& wanted) {
  std::error_code error;
  if (std::filesystem::is_directory(file, error)) Refuse(file, "is a folder, no label map. " + DicomFolderAdvice(file));
  if (!std::filesystem::is_regular_file(file, error)) Refuse(file, "is no file");
  return IsDicom(file) ? ReadDicomSegmentation(file, wanted) : ReadNifti(file);
}

std::map<int, std::size_t> CountLabels(const LabelMap& map) {
  std::vector<std::size_t> counts(kMostLabel + 1, 0);
  for (const std::uint16_t label : map.labels) ++counts[label];
  std::map<int, std::size_t> present;
  for (int label = 1; label <= kMostLabel; ++label) {
    if (counts[static_cast<std::size_t>(label)] > 0) present[label] = counts[static_cast<std::size_t>(label)];
  }
  return present;
}

}  // namespace fulcrum::scene
