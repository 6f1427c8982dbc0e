#include "services/scene/builder/materials.h"

#include <algorithm>
#include <array>

namespace fulcrum::scene {
namespace {

// Young's modulus is three times the shear modulus where a source gives that: the tissue is nearly incompressible.
constexpr std::array<NamedMaterial, 8> kMaterials{{
    {"artery",
     {SolidLook::kArtery, 630e3, 1050},
     489e3,
     771e3,
     "hepatic artery, shear modulus 210 +- 47 kPa (Phys. Med. Biol. 64, 2019, 225001, table 1)"},
    {"bile_duct",
     {SolidLook::kUreter, 498e3, 1060},
     297e3,
     699e3,
     "shear modulus 166 +- 67 kPa (Phys. Med. Biol. 64, 2019, 225001, table 1)"},
    {"bladder",
     {SolidLook::kBladder, 300e3, 1050},
     227e3,
     365e3,
     "wall, porcine, 284 +- 57 and 315 +- 50 kPa in two directions (Davis et al., Urology 113, 2018, 235)"},
    {"bowel",
     {SolidLook::kBowel, 100e3, 1050},
     5e3,
     5180e3,
     "assumed, between the toe region of the wall and its modulus at large strain"},
    {"fat", {SolidLook::kFat, 3e3, 950}, 1e3, 5e3, "assumed: usual values of simulations of adipose tissue"},
    {"gallbladder",
     {SolidLook::kGallbladder, 255e3, 1060},
     230e3,
     280e3,
     "wall, shear modulus 85 +- 8.2 kPa (Phys. Med. Biol. 64, 2019, 225001, table 1)"},
    {"liver",
     {SolidLook::kLiver, 5.4e3, 1060},
     4.2e3,
     6.6e3,
     "shear modulus 1.8 +- 0.4 kPa (Phys. Med. Biol. 64, 2019, 225001, table 1)"},
    {"ureter", {SolidLook::kUreter, 498e3, 1060}, 297e3, 699e3, "assumed: that of the bile duct"},
}};

}  // namespace

std::span<const NamedMaterial> Materials() { return kMaterials; }

std::string MaterialNames() {
  std::string names;
  for (const NamedMaterial& m : kMaterials) names += (names.empty() ? "" : ", ") + std::string(m.name);
  return names;
}

const NamedMaterial* FindMaterial(std::string_view name) {
  const auto at = std::ranges::find(kMaterials, name, &NamedMaterial::name);
  return at == kMaterials.end() ? nullptr : &*at;
}

}  // namespace fulcrum::scene
