// From a patient's segmentation to a scene: a mesh per organ, the description of a scene around one of them, a report.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "services/base/core/scene_view.h"
#include "services/scene/anatomy/label_map.h"
#include "services/scene/compiler/compile.h"

namespace fulcrum::scene {

/// What becomes of a label of a map, or of a file of a folder of surfaces.
struct LabelUse {
  int label = 0;  ///< 0: `file` instead.
  std::string file;
  std::string name;
  bool is_organ = false;  ///< Deformable, under the membrane: one of all.
  std::string material;   ///< Of another deformable body; empty: fixed.
  SurfaceRole role = SurfaceRole::kOther;
  bool collides = true;
  int triangles_max = 10000;
};

struct LabelUses {
  std::vector<LabelUse> uses;
  /// Of surfaces from files: from their axes and unit to those of frame W in millimetres.
  Mat3d W_from_file = Mat3d::Identity();
};

/// Reads the uses of labels or files (YAML; keys: services/scene/README.md). Throws InputError "file:line: ...".
LabelUses ReadLabelUses(const std::filesystem::path& file);

/// A file of uses to be edited: every label of a map, or every mesh of a folder; the largest as organ. Throws
/// InputError.
std::string SuggestLabelUses(const std::filesystem::path& labels);

struct LabelReport {
  LabelUse use;
  std::size_t voxels = 0, triangles = 0;
  int pieces = 0;                             ///< Separate parts of the surface.
  double voxel_volume_ml = 0, volume_ml = 0;  ///< Of the voxels, of the mesh as written.
};

struct AnatomyImport {
  std::string name;              ///< Of the scene.
  std::filesystem::path labels;  ///< A NIfTI or DICOM file, or a folder of surfaces.
  std::filesystem::path map;
  std::filesystem::path out;  ///< Folder to be made.
};

/// Into a new or empty folder: NAME.yaml, a mesh per label (PLY, millimetres, axes of frame W: left, cranial,
/// anterior), report.html and NAME.png. Throws InputError.
std::vector<LabelReport> ImportAnatomyFiles(const AnatomyImport& import, const Progress& progress);

}  // namespace fulcrum::scene
