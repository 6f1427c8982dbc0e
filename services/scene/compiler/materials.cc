#include "services/scene/compiler/materials.h"

#include <algorithm>
#include <set>

#include "services/base/runtime/install_places.h"

namespace fulcrum::scene {
namespace {

namespace fs = std::filesystem;

using config::Range;
using config::StrictMap;
using config::StrictYaml;

constexpr std::size_t kLongestSource = 500, kLongestName = 31;
const Range kModulus_kPa = Range::Between(0.01, 1e4);
const Range kConductivity_W_mK = Range::Between(0.05, 2), kSigma_S_m = Range::Between(0.001, 5);

/// A name is part of a path, which must not lead out of the folder.
bool IsName(const std::string& name) {
  return !name.empty() && name.size() <= kLongestName && std::ranges::all_of(name, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  });
}

NamedMaterial Read(const fs::path& file) {
  StrictYaml yaml = StrictYaml::FromFile(file);
  StrictMap root = yaml.root();
  NamedMaterial read;
  read.material.look = root.Choice("look", kSolidLookNames);
  read.material.youngs_modulus_Pa = root.NumberSi("youngs_modulus_kPa", kModulus_kPa);
  const std::vector<double> spread = root.NumbersSi("spread_kPa", 2, 2, kModulus_kPa);
  read.least_Pa = spread[0];
  read.most_Pa = spread[1];
  if (!(read.least_Pa <= read.material.youngs_modulus_Pa && read.material.youngs_modulus_Pa <= read.most_Pa)) {
    root.Fail("spread_kPa", "must contain youngs_modulus_kPa");
  }
  read.material.density_kg_m3 = root.NumberSi("density_kg_m3", Range::Between(100, 2e4));
  if (root.Has("thickness_mm")) read.thickness_m = root.NumberSi("thickness_mm", Range::Between(0.01, 5));
  if (root.Has("tear_stretch")) read.tear_stretch = root.Number("tear_stretch", Range::Above(1, 10));
  if (root.Has("conductivity_W_mK")) read.conductivity_W_mK = root.NumberSi("conductivity_W_mK", kConductivity_W_mK);
  if (root.Has("sigma_S_m")) read.sigma_S_m = root.NumberSi("sigma_S_m", kSigma_S_m);
  read.source = root.Text("source", kLongestSource);
  yaml.Finish();
  return read;
}

}  // namespace

const StrictMap::Choices<SolidLook> kSolidLookNames = {
    {"bowel", SolidLook::kBowel},   {"bladder", SolidLook::kBladder},
    {"liver", SolidLook::kLiver},   {"gallbladder", SolidLook::kGallbladder},
    {"fat", SolidLook::kFat},       {"muscle", SolidLook::kMuscle},
    {"artery", SolidLook::kArtery}, {"vein", SolidLook::kVein},
    {"ureter", SolidLook::kUreter}, {"nerve", SolidLook::kNerve}};

MaterialLibrary::MaterialLibrary(const std::vector<fs::path>& beside, Files files) : files_(files) {
  for (const fs::path& folder : beside) folders_.push_back(folder / "materials");
  folders_.push_back(runtime::ShareFolder() / "materials");
}

std::optional<NamedMaterial> MaterialLibrary::Find(const std::string& name) const {
  if (!IsName(name)) return std::nullopt;
  for (const fs::path& folder : folders_) {
    const fs::path file = folder / (name + ".yaml");
    std::error_code error;
    if (fs::is_regular_file(file, error)) return Read(file);
  }
  return std::nullopt;
}

std::vector<std::string> MaterialLibrary::Names() const {
  std::set<std::string> names;
  for (const fs::path& folder : folders_) {
    std::error_code error;
    for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
      const std::string name = entry->path().stem().string();
      if (entry->path().extension() == ".yaml" && IsName(name)) names.insert(name);
    }
  }
  return {names.begin(), names.end()};
}

std::string MaterialLibrary::Unknown(const std::string& name) const {
  std::string known;
  for (const std::string& one : Names()) known += (known.empty() ? "" : ", ") + one;
  const bool only_shipped = folders_.size() == 1;
  return "'" + name + "' is not one of " + known +
         (only_shipped ? "" : "; another one: materials/" + (IsName(name) ? name : "NAME") + ".yaml beside the scene");
}

}  // namespace fulcrum::scene
