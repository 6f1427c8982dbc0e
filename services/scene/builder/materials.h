// Materials of solids by name, with the source of their stiffness.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "services/base/core/scene_view.h"

namespace fulcrum::scene {

struct Material {
  SolidLook look = SolidLook::kBowel;
  double youngs_modulus_Pa = 1e5;
  double density_kg_m3 = 1050;
};

struct NamedMaterial {
  std::string_view name;
  Material material;
  double least_Pa, most_Pa;  ///< Spread of the published moduli.
  std::string_view source;
};

/// Sorted by name.
std::span<const NamedMaterial> Materials();

/// For messages.
std::string MaterialNames();

/// nullptr: none of this name.
const NamedMaterial* FindMaterial(std::string_view name);

}  // namespace fulcrum::scene
