#include "services/scene/compiler/yaml_bodies.h"

#include <algorithm>
#include <array>
#include <initializer_list>
#include <optional>
#include <set>

#include "services/base/core/sheets.h"
#include "services/scene/compiler/yaml_parameters.h"

namespace fulcrum::scene {
namespace {

using config::Range;
using config::StrictMap;

constexpr std::size_t kMostLinePoints = 64;
constexpr std::size_t kMostAttachments = 400, kMostRegions = 100;
constexpr double kLeastDensity_kg_m2 = 0.01;
constexpr float kLeastStep_m = 1e-4f;              ///< Between two points of a line.
constexpr int kBendingRows = 4, kBendingCols = 7;  ///< Largest strides of the hinges, as of the built-in membrane.
constexpr double kBindingReach_m = 0.0013;         ///< Beyond the gap, likewise.

enum class Ends { kNone, kFirst, kLast, kBoth };
const StrictMap::Choices<Ends> kEnds = {
    {"none", Ends::kNone}, {"first", Ends::kFirst}, {"last", Ends::kLast}, {"both", Ends::kBoth}};

void ReadSwept(StrictMap* map, ShapeSettings* shape) {
  shape->line_m = ReadLine(map);
  for (std::size_t i = 1; i < shape->line_m.size(); ++i) {
    if (!((shape->line_m[i] - shape->line_m[i - 1]).norm() > kLeastStep_m)) {
      map->Fail("x_mm", "two points that follow each other are less than 0.1 mm apart");
    }
  }
  shape->radius_m = map->NumbersSi("radius_mm", 1, kMostLinePoints, Range::Between(0.3, 200));
  if (shape->radius_m.size() == 1) shape->radius_m.resize(shape->line_m.size(), shape->radius_m[0]);
  if (shape->radius_m.size() != shape->line_m.size()) map->Fail("radius_mm", "must have one entry, or as many as x_mm");
}

/// The material that a body or sheet names. `said`: the keys that replace all that its file says.
NamedMaterial FindNamed(const StrictMap& map, const std::string& name, const MaterialLibrary& materials,
                        std::initializer_list<const char*> said) {
  if (materials.files() == MaterialLibrary::Files::kReplaced &&
      std::ranges::all_of(said, [&](const char* key) { return map.Has(key); })) {
    return {};
  }
  const std::optional<NamedMaterial> named = materials.Find(name);
  if (!named) map.Fail("material", materials.Unknown(name));
  return *named;
}

Material ReadMaterial(StrictMap* map, const MaterialLibrary& materials) {
  const std::string name = map->Text("material", 31);
  Material material = FindNamed(*map, name, materials, {"look", "youngs_modulus_kPa", "density_kg_m3"}).material;
  material.look = map->Choice("look", material.look, kSolidLookNames);
  ReadSi(map, "youngs_modulus_kPa", Range::Between(0.01, 1e4), &material.youngs_modulus_Pa);
  ReadSi(map, "density_kg_m3", Range::Between(100, 2e4), &material.density_kg_m3);
  return material;
}

BodySettings ReadBody(StrictMap map, const FindMesh& find, const MaterialLibrary& materials) {
  BodySettings body;
  body.name = map.Text("name", 31);
  body.material = ReadMaterial(&map, materials);
  const int sources = (map.Has("mesh") ? 1 : 0) + (map.Has("shape") ? 1 : 0) + (map.Has("tube") ? 1 : 0);
  if (sources == 0) map.Fail("name", "needs one of `mesh`, `shape` and `tube`");
  if (sources > 1)
    map.Fail(map.Has("tube") ? "tube" : "shape", "is one too many: give one of `mesh`, `shape` and `tube`");
  if (map.Has("mesh")) {
    body.file = find(map, "mesh");
    body.scale_m = ReadFileUnit(&map);
    body.cap_openings = map.Flag("cap_openings", body.cap_openings);
  }
  if (auto shape = map.OptionalMap("shape")) body.shape = ReadShape(*shape);
  if (auto tube = map.OptionalMap("tube")) {
    body.is_tube = true;
    ReadSwept(&*tube, &body.shape);
    body.tet_edge_m = 2 * body.shape.radius_m[0];
  }
  body.offset_m = map.Vector3Si("offset_mm", body.offset_m, Range::Between(-1000, 1000));
  ReadSi(&map, "tet_edge_mm", Range::Between(0.5, 50), &body.tet_edge_m);
  if (body.is_tube) {
    const Ends held = map.Choice("held_ends", Ends::kNone, kEnds);
    body.first_end_held = held == Ends::kFirst || held == Ends::kBoth;
    body.last_end_held = held == Ends::kLast || held == Ends::kBoth;
    return body;
  }
  ReadInteger(&map, "triangles_max", 100, 100000, &body.surface_triangles_max);
  if (map.Has("held_side")) {
    body.held_side = map.Vector3Si("held_side", Range::Between(-1, 1));
    if (!(body.held_side->norm() > 0.1f)) map.Fail("held_side", "must be a direction, not (nearly) zero");
    body.held_side->normalize();
    ReadSi(&map, "held_share", Range::Between(0.01, 0.95), &body.held_share);
  }
  return body;
}

/// Refuses a name that another body, sheet or fixed surface has.
void TakeName(const StrictMap& entry, const std::string& name, std::set<std::string>* names) {
  if (!names->insert(name).second) entry.Fail("name", "'" + name + "' is there twice");
}

enum class Held { kAll, kNone, kRows, kColumns };
const StrictMap::Choices<Held> kHeld = {
    {"all", Held::kAll}, {"none", Held::kNone}, {"ends", Held::kRows}, {"sides", Held::kColumns}};

/// The largest divisor of `cells` up to `most`.
int Stride(int cells, int most) {
  while (cells % most != 0) --most;
  return most;
}

/// Flexural rigidity of an incompressible plate: E t^3 / (12 (1 - 1/4)).
double BendingOf(double youngs_modulus_Pa, double thickness_m) {
  return youngs_modulus_Pa * thickness_m * thickness_m * thickness_m / 9;
}

/// A value of the sheet's own that concerns heat: 0, or at least `least`.
void ReadOwn(StrictMap* map, const char* key, double most, float least, const char* reason, float* value) {
  *value = static_cast<float>(map->NumberSi(key, static_cast<double>(*value), Range::Between(0, most)));
  if (*value > 0.0f && *value < least) map->Fail(key, reason);
}

/// What a sheet is made of, if it does not leave that to the sections `physics` and `thermal`.
void ReadSheetMaterial(StrictMap* map, const MaterialLibrary& materials, SheetSettings* sheet) {
  constexpr double kLeastEt_N_per_m = 1e-3;
  constexpr float kLeastFat_Pa = 1;
  double tear_stretch = 0;
  if (const std::string name = map->TextOr("material", "", 31); !name.empty()) {
    NamedMaterial named =
        FindNamed(*map, name, materials, {"youngs_modulus_kPa", "thickness_mm", "density_kg_m2", "tear_stretch"});
    double& modulus_Pa = named.material.youngs_modulus_Pa;
    ReadSi(map, "youngs_modulus_kPa", Range::Between(0.01, 1e4), &modulus_Pa);
    if (named.thickness_m == 0 && !map->Has("thickness_mm")) {
      map->Fail("material", "has no thickness: give the sheet's `thickness_mm`");
    }
    ReadSi(map, "thickness_mm", Range::Between(0.01, 5), &named.thickness_m);
    if (modulus_Pa * named.thickness_m < kLeastEt_N_per_m) {
      map->Fail("thickness_mm", "times youngs_modulus_kPa must be at least 0.001 N/m");
    }
    sheet->own.Et_N_per_m = static_cast<float>(modulus_Pa * named.thickness_m);
    sheet->own.bending_Nm = static_cast<float>(BendingOf(modulus_Pa, named.thickness_m));
    sheet->grid.density_kg_m2 = std::max(named.material.density_kg_m3 * named.thickness_m, kLeastDensity_kg_m2);
    tear_stretch = named.tear_stretch;
    sheet->heat = {static_cast<float>(named.thickness_m), static_cast<float>(named.conductivity_W_mK),
                   static_cast<float>(named.sigma_S_m)};
  } else {
    // Without a material the stiffness is that of `physics`, whatever the thickness.
    ReadOwn(map, "thickness_mm", 5, kSheetThicknessMin_m, "must be at least 0.01, or 0 (that of `thermal`)",
            &sheet->heat.thickness_m);
  }
  ReadOwn(map, "conductivity_W_mK", 2, kSheetConductivityMin_W_mK, "must be at least 0.05, or 0 (that of `thermal`)",
          &sheet->heat.conductivity_W_mK);
  ReadOwn(map, "sigma_S_m", 5, kSheetSigmaMin_S_m, "must be at least 0.001, or 0 (that of `thermal`)",
          &sheet->heat.sigma_S_m);
  ReadSi(map, "density_kg_m2", Range::Between(kLeastDensity_kg_m2, 50), &sheet->grid.density_kg_m2);
  sheet->own.fat_youngs_modulus_Pa =
      static_cast<float>(map->NumberSi("fat_youngs_modulus_kPa", 0, Range::Between(0, 1e6)));
  if (sheet->own.fat_youngs_modulus_Pa > 0.0f && sheet->own.fat_youngs_modulus_Pa < kLeastFat_Pa) {
    map->Fail("fat_youngs_modulus_kPa", "must be at least 0.001, or 0 (that of `physics`)");
  }
  sheet->own.tear_stretch = static_cast<float>(map->Number("tear_stretch", tear_stretch, Range::Between(0, 10)));
}

SheetSettings ReadSheet(StrictMap map, const MaterialLibrary& materials) {
  SheetSettings sheet;
  sheet.name = map.Text("name", 31);
  if (map.Has("over") == map.Has("between")) {
    map.Fail("name", "needs either `over` (a body) or `between` (two lines)");
  }
  MembraneSettings& grid = sheet.grid;
  grid.rows = 33;
  grid.cols = 29;
  if (map.Has("over")) {
    sheet.over = map.Text("over", 31);
    if (map.Has("at_mm")) sheet.at_m = map.Vector3Si("at_mm", Range::Between(-5000, 5000));
    if (map.Has("facing")) {
      sheet.facing = map.Vector3Si("facing", Range::Between(-1, 1));
      if (!(sheet.facing->norm() > 0.1f)) map.Fail("facing", "must be a direction, not (nearly) zero");
    }
    if (map.Has("width_mm")) sheet.width_m = map.NumberSi("width_mm", Range::Between(5, 400));
    if (map.Has("length_mm")) sheet.length_m = map.NumberSi("length_mm", Range::Between(5, 400));
    grid.gap_m = 0.0015;
    ReadSi(&map, "gap_mm", Range::Between(0.5, 30), &grid.gap_m);
  } else {
    StrictMap between = map.Map("between");
    StrictMap first = between.Map("first"), last = between.Map("last");
    sheet.between_m = {ReadLine(&first), ReadLine(&last)};
    for (StrictMap* line : {&first, &last}) {
      const std::vector<Vec3f>& points = sheet.between_m[line == &first ? 0 : 1];
      for (std::size_t i = 1; i < points.size(); ++i) {
        if (!((points[i] - points[i - 1]).norm() > kLeastStep_m)) {
          line->Fail("x_mm", "two points that follow each other are less than 0.1 mm apart");
        }
      }
    }
    grid.gap_m = 0.003;
  }
  ReadInteger(&map, "rows", 2, 5000, &grid.rows);
  ReadInteger(&map, "cols", 2, 5000, &grid.cols);
  ReadSheetMaterial(&map, materials, &sheet);
  ReadInteger(&map, "binding_row_stride", 1, 1000, &grid.binding_row_stride);
  ReadInteger(&map, "binding_col_stride", 1, 1000, &grid.binding_col_stride);
  grid.binding_reach_m = grid.gap_m + kBindingReach_m;
  ReadSi(&map, "binding_reach_mm", Range::Between(0.5, 60), &grid.binding_reach_m);
  grid.bending_row_stride = Stride(grid.rows - 1, kBendingRows);
  grid.bending_col_stride = Stride(grid.cols - 1, kBendingCols);
  const Held held = map.Choice("held", Held::kAll, kHeld);
  sheet.ends_held = held == Held::kAll || held == Held::kRows;
  sheet.sides_held = held == Held::kAll || held == Held::kColumns;
  return sheet;
}

const StrictMap::Choices<AttachKind> kAttachKinds = {{"glued", AttachKind::kGlued}, {"sliding", AttachKind::kSliding}};

Vec3f ReadTurn(StrictMap* map) {
  const std::vector<double> turn = map->NumbersSi("turn_deg", {0, 0, 0}, 3, 3, Range::Between(-180, 180));
  return Eigen::Vector3d(turn[0], turn[1], turn[2]).cast<float>();
}

void ReadRegions(StrictMap* root, SceneSettings* scene) {
  std::set<std::string> names;
  for (StrictMap& entry : root->Maps("regions", 0, kMostRegions)) {
    RegionSettings region;
    region.name = entry.Text("name", 31);
    TakeName(entry, region.name, &names);
    region.is_box = entry.Has("box_mm");
    if (region.is_box == entry.Has("ellipsoid_mm")) {
      entry.Fail("name", "needs either `box_mm` (lengths of its sides) or `ellipsoid_mm` (semi-axes)");
    }
    region.half_m = region.is_box ? Vec3f(0.5f * entry.Vector3Si("box_mm", Range::Between(0.1, 2000)))
                                  : entry.Vector3Si("ellipsoid_mm", Range::Between(0.1, 1000));
    region.at_m = entry.Vector3Si("at_mm", region.at_m, Range::Between(-5000, 5000));
    region.turn_rad = ReadTurn(&entry);
    scene->regions.push_back(region);
  }
}

AttachSettings ReadAttach(StrictMap* entry, const std::set<std::string>& bodies, const std::string& organ,
                          const std::vector<RegionSettings>& regions) {
  AttachSettings attach;
  attach.from = entry->Text("from", 31);
  attach.to = entry->Text("to", 31);
  for (const auto& [key, name] : {std::pair{"from", attach.from}, std::pair{"to", attach.to}}) {
    if (bodies.contains(name)) continue;
    entry->Fail(key, std::string("'").append(name).append("' is no body of this scene").append(organ));
  }
  if (attach.from == attach.to) entry->Fail("to", "must be another body");
  ReadSi(entry, "reach_mm", Range::Between(0.1, 50), &attach.reach_m);
  ReadSi(entry, "youngs_modulus_kPa", Range::Between(0.001, 1e4), &attach.youngs_modulus_Pa);
  attach.kind = entry->Choice("kind", attach.kind, kAttachKinds);
  const auto region = [&](const char* key) {
    const std::string name = entry->TextOr(key, "", 31);
    if (name.empty() || std::ranges::find(regions, name, &RegionSettings::name) != regions.end()) return name;
    std::string known;
    for (const RegionSettings& r : regions) known += (known.empty() ? "; those of `regions`: " : ", ") + r.name;
    entry->Fail(key,
                "'" + name + "' is no region of this scene" + (known.empty() ? ", which has no `regions`" : known));
  };
  attach.from_region = region("from_region");
  attach.to_region = region("to_region");
  return attach;
}

}  // namespace

std::vector<Vec3f> ReadLine(StrictMap* map) {
  std::array<std::vector<double>, 3> axes;
  const std::array keys = {"x_mm", "y_mm", "z_mm"};
  for (std::size_t k = 0; k < 3; ++k) {
    axes[k] = map->NumbersSi(keys[k], 2, kMostLinePoints, Range::Between(-5000, 5000));
    if (axes[k].size() != axes[0].size()) map->Fail(keys[k], "must have as many entries as x_mm");
  }
  std::vector<Vec3f> points;
  for (std::size_t i = 0; i < axes[0].size(); ++i) {
    points.push_back(Eigen::Vector3d(axes[0][i], axes[1][i], axes[2][i]).cast<float>());
  }
  return points;
}

std::string_view RoleName(SurfaceRole role) {
  return std::find_if(kSurfaceRoles.begin(), kSurfaceRoles.end(), [&](const auto& r) { return r.second == role; })
      ->first;
}

SurfaceRole RoleNamed(const std::string& name) {
  std::string valid;
  for (const auto& [word, role] : kSurfaceRoles) {
    if (word == name) return role;
    valid += (valid.empty() ? "" : ", ") + std::string(word);
  }
  throw InputError("role '" + name + "'; valid: " + valid);
}

double LengthUnit(const std::string& name) {
  for (const auto& [unit, metres] : kLengthUnits) {
    if (unit == name) return metres;
  }
  throw InputError("unit '" + name + "'; valid: m, cm, mm, um");
}

double ReadFileUnit(StrictMap* map) {
  StrictMap::Choices<double> units{{"import", 0.0}};
  units.insert(units.end(), kLengthUnits.begin(), kLengthUnits.end());
  return map->Choice("unit", 0.0, units);
}

ShapeSettings ReadShape(StrictMap map) {
  ShapeSettings shape;
  if (!map.Has("ellipsoid_mm")) {
    ReadSwept(&map, &shape);
    return shape;
  }
  shape.radii_m = map.Vector3Si("ellipsoid_mm", Range::Between(1, 500));
  shape.at_m = map.Vector3Si("at_mm", shape.at_m, Range::Between(-5000, 5000));
  shape.turn_rad = ReadTurn(&map);
  return shape;
}

FixedSettings ReadFixedSurface(StrictMap* map) {
  FixedSettings surface;
  surface.name = map->Text("name", 31);
  surface.role = map->Choice("role", surface.role, kSurfaceRoles);
  surface.offset_m = map->Vector3Si("offset_mm", surface.offset_m, Range::Between(-500, 500));
  ReadInteger(map, "triangles_max", 100, 100000, &surface.triangles_max);
  surface.collides = map->Flag("collides", surface.collides);
  return surface;
}

std::vector<StrictMap> ReadBodies(StrictMap* root, const FindMesh& find, const MaterialLibrary& materials,
                                  SceneSettings* scene) {
  std::set<std::string> names;
  if (scene->has_organ) names.insert("organ");
  for (StrictMap& entry : root->Maps("bodies", 0, kMostBodies)) {
    scene->bodies.push_back(ReadBody(entry, find, materials));
    TakeName(entry, scene->bodies.back().name, &names);
  }
  const std::set<std::string> bodies = names;
  const std::string organ = scene->has_organ ? ", nor `organ`" : "";
  std::vector<StrictMap> sheets = root->Maps("sheets", 0, kMaxSheets - 1);
  for (StrictMap& entry : sheets) {
    const SheetSettings& sheet = scene->sheets.emplace_back(ReadSheet(entry, materials));
    if (!sheet.over.empty() && !bodies.contains(sheet.over)) {
      entry.Fail("over", "'" + sheet.over + "' is no body of this scene");
    }
    if (sheet.name == "membrane") entry.Fail("name", "`membrane` is the name of the sheet over the organ");
    TakeName(entry, sheet.name, &names);
  }
  ReadRegions(root, scene);
  for (StrictMap& entry : root->Maps("attach", 0, kMostAttachments)) {
    scene->attach.push_back(ReadAttach(&entry, bodies, organ, scene->regions));
  }
  if (scene->import) {
    for (const FixedSettings& surface : scene->import->surroundings) names.insert(surface.name);
  }
  for (StrictMap& entry : root->Maps("fixed", 0, kMostSurroundings)) {
    FixedSettings& surface = scene->fixed.emplace_back(ReadFixedSurface(&entry));
    if (entry.Has("mesh") == entry.Has("shape")) entry.Fail("name", "needs either `mesh` or `shape`");
    if (entry.Has("mesh")) {
      surface.file = find(entry, "mesh");
      surface.scale_m = ReadFileUnit(&entry);
    }
    if (auto shape = entry.OptionalMap("shape")) surface.shape = ReadShape(*shape);
    surface.inside = entry.Flag("inside", surface.inside);
    if (surface.name == "membrane" || surface.name == "cavity") {
      entry.Fail("name", "'" + surface.name + "' is the name of another surface; choose another one");
    }
    TakeName(entry, surface.name, &names);
  }
  return sheets;
}

}  // namespace fulcrum::scene
