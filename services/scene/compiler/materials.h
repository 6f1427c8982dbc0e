// Materials by name: one YAML file each, with the spread and the source of its stiffness (services/scene/README.md).
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "services/base/config/strict_yaml.h"
#include "services/scene/builder/scene_settings.h"

namespace fulcrum::scene {

extern const config::StrictMap::Choices<SolidLook> kSolidLookNames;

struct NamedMaterial {
  Material material;
  double least_Pa = 0, most_Pa = 0;  ///< Spread of the published moduli.
  double thickness_m = 0;            ///< As a sheet; 0: not given.
  double tear_stretch = 0;           ///< As a sheet; 0: that of the scene.
  /// As a sheet: thermal and electrical; 0: that of the scene.
  double conductivity_W_mK = 0, sigma_S_m = 0;
  std::string source;
};

/// NAME.yaml in the folders `materials` beside files of scenes, then among the shipped ones.
class MaterialLibrary {
 public:
  enum class Files {
    kNeeded,
    /// Not read where a description replaces all that they say, as the effective YAML of a compiled scene does.
    kReplaced
  };
  /// @param beside folders of files of scenes; of two materials of one name the first counts.
  explicit MaterialLibrary(const std::vector<std::filesystem::path>& beside = {}, Files files = Files::kNeeded);

  [[nodiscard]] Files files() const { return files_; }

  /// nullopt: none of this name. Throws InputError if its file is malformed.
  [[nodiscard]] std::optional<NamedMaterial> Find(const std::string& name) const;
  /// Sorted.
  [[nodiscard]] std::vector<std::string> Names() const;
  /// For refusals: "'NAME' is not one of ...", and where another one can be put.
  [[nodiscard]] std::string Unknown(const std::string& name) const;

 private:
  std::vector<std::filesystem::path> folders_;
  Files files_;
};

}  // namespace fulcrum::scene
