// From a patient's segmentation to a scene: a mesh per label, the description of a scene around the organ, a report.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "services/base/core/scene_view.h"
#include "services/scene/anatomy/label_map.h"
#include "services/scene/compiler/compile.h"

namespace fulcrum::scene {

/// What becomes of a label.
struct LabelUse {
  int label = 0;
  std::string name;
  bool is_organ = false;  ///< Deformable, under the membrane: one of all. The others are fixed surroundings.
  SurfaceRole role = SurfaceRole::kOther;
  bool collides = true;
  int triangles_max = 4000;
};

/// Reads the uses of labels (YAML; keys: services/scene/README.md). Throws InputError "file:line: ...".
std::vector<LabelUse> ReadLabelUses(const std::filesystem::path& file);

/// A file of uses to be edited: every label of the map, the largest as organ.
std::string SuggestLabelUses(const LabelMap& map);

struct LabelReport {
  LabelUse use;
  std::size_t voxels = 0, triangles = 0;
  int pieces = 0;                           ///< Separate parts of the surface.
  double voxel_volume_ml = 0, volume_ml = 0;  ///< Of the voxels, of the surface.
};

struct AnatomyImport {
  std::string name;                  ///< Of the scene.
  std::filesystem::path labels, map;
  std::filesystem::path out;         ///< Folder to be made.
};

/// Writes NAME.yaml, a mesh per label (PLY, millimetres, axes of frame W: left, cranial, anterior), report.html and
/// NAME.png. Throws InputError.
std::vector<LabelReport> ImportAnatomyFiles(const AnatomyImport& import, const Progress& progress);

}  // namespace fulcrum::scene
