// Materials by name: the shipped ones, those beside a scene, and what bodies and sheets take from them.
#include "services/scene/compiler/materials.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>

#include "services/base/core/error.h"
#include "services/scene/compiler/compile.h"
#include "services/scene/compiler/scene_yaml.h"

namespace fulcrum::scene {
namespace {

namespace fs = std::filesystem;

constexpr const char* kGel =
    "look: fat\nyoungs_modulus_kPa: 40\nspread_kPa: [30, 60]\ndensity_kg_m3: 1000\n"
    "thickness_mm: 0.5\ntear_stretch: 2\nsource: measured in the lab\n";

class MaterialsTest : public testing::Test {
 protected:
  MaterialsTest() { fs::create_directories(folder_ / "materials"); }
  ~MaterialsTest() override { fs::remove_all(folder_); }
  void Write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / "materials" / name) << text;
  }
  /// A scene with a pad and a band.
  [[nodiscard]] fs::path Scene(const std::string& of_pad, const std::string& of_band) const {
    const fs::path file = folder_ / "scene.yaml";
    std::ofstream(file)
        << "name: materials\nphysics: {mode: accurate}\n"
           "bodies: [{name: pad, shape: {ellipsoid_mm: [30, 25, 10], at_mm: [0, 0, 80]}, tet_edge_mm: 7, "
        << of_pad << ", held_side: [0, 0, -1]}]\n"
        << "sheets: [{name: band, between: {first: {x_mm: [-2, 2], y_mm: [-20, -20], z_mm: [60, 60]},\n"
           "  last: {x_mm: [-2, 2], y_mm: [20, 20], z_mm: [60, 60]}}, rows: 21, cols: 2"
        << of_band << "}]\n";
    return file;
  }
  [[nodiscard]] SceneDescription Read(const std::string& of_pad, const std::string& of_band) const {
    return ReadSceneYaml(Scene(of_pad, of_band), {});
  }
  [[nodiscard]] std::string RefusalOf(const std::string& of_pad, const std::string& of_band) const {
    try {
      (void)Read(of_pad, of_band);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }

  fs::path folder_ = fs::temp_directory_path() / ("scene_materials_test." + std::to_string(::getpid()));
};

TEST_F(MaterialsTest, ShippedOnesNameTheirSource) {
  const MaterialLibrary library;
  const std::vector<std::string> names = library.Names();
  EXPECT_GE(names.size(), 10u);
  for (const std::string& name : names) {
    SCOPED_TRACE(name);
    const std::optional<NamedMaterial> read = library.Find(name);
    ASSERT_TRUE(read);
    EXPECT_GT(read->source.size(), 10u);
  }
  EXPECT_EQ(library.Find("liver")->material.look, SolidLook::kLiver);
  EXPECT_FALSE(library.Find("cheese"));
}

TEST_F(MaterialsTest, ThoseBesideTheSceneComeFirst) {
  Write("gel.yaml", kGel);
  Write("liver.yaml", kGel);
  const SceneDescription read = Read("material: liver", ", material: gel");
  EXPECT_EQ(read.settings.bodies[0].material.youngs_modulus_Pa, 40e3);
  EXPECT_EQ(read.settings.bodies[0].material.look, SolidLook::kFat);
  EXPECT_EQ(MaterialLibrary().Find("liver")->material.youngs_modulus_Pa, 5.4e3);
  fs::create_directories(folder_ / "below");
  std::ofstream(folder_ / "below" / "mine.yaml") << "name: mine\nbase: ../scene.yaml\n";
  EXPECT_EQ(ReadSceneYaml(folder_ / "below" / "mine.yaml", {}).settings.bodies[0].material.youngs_modulus_Pa, 40e3)
      << "and those beside its base";
}

TEST_F(MaterialsTest, ASheetTakesItsProperties) {
  Write("gel.yaml", kGel);
  const SceneData plain = CompileScene(Scene("material: liver", ", held: ends"), {}, {}).data;
  EXPECT_EQ(plain.sheets[0].Et_N_per_m, 0);
  EXPECT_EQ(plain.sheets[0].tear_stretch, 0);
  const SceneDescription read = Read("material: liver", ", material: gel, fat_youngs_modulus_kPa: 7, held: ends");
  const SceneData data = BuildScene(read.settings, {});
  EXPECT_FLOAT_EQ(data.sheets[0].Et_N_per_m, 20);
  EXPECT_FLOAT_EQ(data.sheets[0].bending_Nm, 40e3f * 0.5e-3f * 0.5e-3f * 0.5e-3f / 9);
  EXPECT_FLOAT_EQ(data.sheets[0].fat_youngs_modulus_Pa, 7000);
  EXPECT_FLOAT_EQ(data.sheets[0].tear_stretch, 2);
  const Index inner = data.fixed.membrane.first + 20;
  ASSERT_GT(plain.inverse_mass[inner], 0);
  EXPECT_NEAR(data.inverse_mass[inner] / plain.inverse_mass[inner], 0.5 / (1000 * 0.5e-3), 1e-4);

  const SceneData other = BuildScene(
      Read("material: liver", ", material: gel, thickness_mm: 0.2, youngs_modulus_kPa: 100, tear_stretch: 3").settings,
      {});
  EXPECT_FLOAT_EQ(other.sheets[0].Et_N_per_m, 20);
  EXPECT_FLOAT_EQ(other.sheets[0].bending_Nm, 100e3f * 0.2e-3f * 0.2e-3f * 0.2e-3f / 9);
  EXPECT_FLOAT_EQ(other.sheets[0].tear_stretch, 3);
}

TEST_F(MaterialsTest, ASheetTakesItsHeat) {
  const auto heat_of = [&](const char* sheet) {
    const SceneData data = BuildScene(Read("material: liver", sheet).settings, {});
    const SheetPart& part = data.sheets[0];
    return std::array{part.thickness_m, part.conductivity_W_mK, part.sigma_S_m};
  };
  EXPECT_EQ(heat_of(", held: ends"), (std::array{0.0f, 0.0f, 0.0f})) << "that of `thermal`";
  EXPECT_EQ(heat_of(", thickness_mm: 1, conductivity_W_mK: 0.5, sigma_S_m: 0.2"), (std::array{1e-3f, 0.5f, 0.2f}));
  const SceneData plain = BuildScene(Read("material: liver", ", thickness_mm: 1").settings, {});
  EXPECT_EQ(plain.sheets[0].Et_N_per_m, 0) << "without a material the stiffness is that of `physics`";
  Write("gel.yaml", kGel);
  EXPECT_EQ(heat_of(", material: gel"), (std::array{0.5e-3f, 0.0f, 0.0f}));
  Write("gel.yaml", std::string(kGel) + "conductivity_W_mK: 0.6\nsigma_S_m: 1.5\n");
  EXPECT_EQ(heat_of(", material: gel"), (std::array{0.5e-3f, 0.6f, 1.5f}));
  EXPECT_EQ(heat_of(", material: gel, thickness_mm: 0.2, sigma_S_m: 0"), (std::array{0.2e-3f, 0.6f, 0.0f}));
  const SceneDescription read = Read("material: liver", ", material: gel");
  const SceneDescription again = ParseSceneYaml(read.effective_yaml, "again.yaml", {});
  EXPECT_EQ(BuildScene(again.settings, {}).fixed.hash, BuildScene(read.settings, {}).fixed.hash);
}

// A recording's scene is read again elsewhere (replayer --set), where the files beside it are not.
TEST_F(MaterialsTest, TheEffectiveDescriptionNeedsNoFileOfTheirs) {
  Write("gel.yaml", kGel);
  const SceneDescription read = Read("material: gel", ", material: gel");
  const SceneDescription again = ParseSceneYaml(read.effective_yaml, "again.yaml", {});
  EXPECT_EQ(BuildScene(again.settings, {}).fixed.hash, BuildScene(read.settings, {}).fixed.hash);
  EXPECT_EQ(again.settings.bodies[0].material.youngs_modulus_Pa, 40e3);
  EXPECT_EQ(again.settings.sheets[0].own.Et_N_per_m, read.settings.sheets[0].own.Et_N_per_m);
  for (const char* extreme : {", material: fat, thickness_mm: 0.01", ", material: gel, thickness_mm: 5",
                              ", material: gel, thickness_mm: 0.1, youngs_modulus_kPa: 0.01"}) {
    const SceneDescription at_end = Read("material: liver", extreme);
    EXPECT_EQ(ParseSceneYaml(at_end.effective_yaml, "again.yaml", {}).effective_yaml, at_end.effective_yaml) << extreme;
  }
}

TEST_F(MaterialsTest, AMisspeltNameIsRefusedThoughAllIsSaid) {
  EXPECT_NE(RefusalOf("material: liver",
                      ", material: peritonium, youngs_modulus_kPa: 500, thickness_mm: 0.3, "
                      "density_kg_m2: 0.3, tear_stretch: 3")
                .find("'peritonium' is not one of"),
            std::string::npos);
}

TEST_F(MaterialsTest, BadOnesAreRefused) {
  const auto expect = [&](const std::string& text, const char* what) {
    EXPECT_NE(text.find(what), std::string::npos) << text;
  };
  expect(RefusalOf("material: cheese", ""),
         "scene.yaml:3: bodies[0].material: 'cheese' is not one of artery, bile_duct,");
  expect(RefusalOf("material: cheese", ""), "another one: materials/cheese.yaml beside the scene");
  // A name is no path.
  std::ofstream(folder_ / "outside.yaml") << kGel;
  expect(RefusalOf("material: ../outside", ""), "'../outside' is not one of");
  expect(RefusalOf("material: liver", ", material: liver"), "material: has no thickness");
  expect(RefusalOf("material: liver", ", tear_stretch: 0.5"), "sheets[0].tear_stretch: must be above 1 + physics.");
  Write("gel.yaml", kGel);
  expect(RefusalOf("material: liver", ", material: gel, thickness_mm: 0.01, youngs_modulus_kPa: 0.01"),
         "at least 0.001 N/m");
  expect(RefusalOf("material: liver", ", fat_youngs_modulus_kPa: 0.0001"), "must be at least 0.001");
  expect(RefusalOf("material: liver", ", thickness_mm: 0.001"), "thickness_mm: must be at least 0.01, or 0");
  expect(RefusalOf("material: liver", ", thickness_mm: 6"), "thickness_mm");
  expect(RefusalOf("material: liver", ", conductivity_W_mK: 0.01"), "conductivity_W_mK: must be at least 0.05, or 0");
  expect(RefusalOf("material: liver", ", conductivity_W_mK: 3"), "conductivity_W_mK");
  expect(RefusalOf("material: liver", ", sigma_S_m: 0.0001"), "sigma_S_m: must be at least 0.001, or 0");
  expect(RefusalOf("material: liver", ", sigma_S_m: .nan"), "sigma_S_m");
  Write("gel.yaml", std::string(kGel) + "viscosity: 3\n");
  expect(RefusalOf("material: gel", ""), "gel.yaml:8: viscosity");
  Write("gel.yaml", std::string(kGel).replace(std::string(kGel).find("tear_stretch: 2"), 15, "tear_stretch: 0.5"));
  expect(RefusalOf("material: gel", ""), "gel.yaml:6: tear_stretch");
  Write("gel.yaml", std::string(kGel) + "sigma_S_m: 7\n");
  expect(RefusalOf("material: gel", ""), "gel.yaml:8: sigma_S_m");
  Write("gel.yaml", "look: fat\nyoungs_modulus_kPa: 40\nspread_kPa: [50, 60]\ndensity_kg_m3: 1000\nsource: no\n");
  expect(RefusalOf("material: gel", ""), "gel.yaml:3: spread_kPa: must contain youngs_modulus_kPa");
}

}  // namespace
}  // namespace fulcrum::scene
