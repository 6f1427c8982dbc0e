#include "services/scene/compiler/new_scene.h"

#include <algorithm>
#include <cmath>

#include "services/base/core/error.h"
#include "services/scene/builder/build.h"
#include "services/scene/builder/geometry.h"
#include "services/scene/compiler/import.h"
#include "services/scene/compiler/mesh_repair.h"
#include "services/scene/compiler/placement.h"
#include "services/scene/compiler/print_text.h"
#include "services/scene/compiler/yaml_bodies.h"

namespace fulcrum::scene {
namespace {

/// The unit in which the organ is of a size that organs have.
std::string LikelyUnit(const MeshFile& file, const std::string& name) {
  constexpr double kSmall_m = 0.02, kLarge_m = 0.6;
  const double size = LongestSide(file);
  for (const char* unit : {"mm", "m", "cm", "um"}) {
    if (const double size_m = size * LengthUnit(unit); size_m >= kSmall_m && size_m <= kLarge_m) return unit;
  }
  throw InputError(name + ": its longest side is " + PrintText("%.4g", size) +
                   ", which is no organ in mm, cm, m or um; give --unit, and `scale` in the description");
}

/// Means over the rows and columns of a sheet [m].
struct SheetSize {
  double width = 0, length = 0;
};

SheetSize SizeOf(const MembraneSettings& m, const std::vector<Vec3d>& sheet) {
  SheetSize size;
  const auto node = [&](int r, int c) { return sheet[static_cast<std::size_t>(r) * m.cols + c]; };
  for (int r = 0; r < m.rows; ++r) {
    for (int c = 0; c < m.cols; ++c) {
      if (c > 0) size.width += (node(r, c) - node(r, c - 1)).norm() / m.rows;
      if (r > 0) size.length += (node(r, c) - node(r - 1, c)).norm() / m.cols;
    }
  }
  return size;
}

/// The least multiple of `step` that is not below `value`, plus one.
int Nodes(double value, int step) { return step * std::max(4, static_cast<int>(std::ceil(value / step))) + 1; }

/// Membrane of about square cells, at most as many as the built-in scene has.
void ChooseMembrane(const SheetSize& size, MembraneSettings* m) {
  constexpr double kMostNodes = 16000, kLeastCell_m = 0.0007;
  constexpr double kGapShare = 0.08, kLeastGap_m = 0.0015, kLargestGap_m = 0.0055, kReach_m = 0.0013;
  const double cell = std::max(kLeastCell_m, std::sqrt(size.width * size.length / kMostNodes));
  m->bending_row_stride = 4;
  m->bending_col_stride = 7;
  m->rows = Nodes(size.length / cell, m->bending_row_stride);
  m->cols = Nodes(size.width / cell, m->bending_col_stride);
  m->gap_m = std::clamp(kGapShare * std::min(size.width, size.length), kLeastGap_m, kLargestGap_m);
  m->binding_reach_m = m->gap_m + kReach_m;
}

/// Everything that a shaft or a line of sight can meet.
std::vector<Vec3d> ObstaclesOf(const Anatomy& anatomy) {
  std::vector<Vec3d> obstacles;
  for (const SolidBody& body : anatomy.solids) {
    obstacles.insert(obstacles.end(), body.vertices.begin(), body.vertices.end());
  }
  for (const SheetBody& sheet : anatomy.sheets) {
    obstacles.insert(obstacles.end(), sheet.nodes.begin(), sheet.nodes.end());
  }
  for (const Anatomy::Surrounding& s : anatomy.surroundings) {
    obstacles.insert(obstacles.end(), s.vertices.begin(), s.vertices.end());
  }
  return obstacles;
}

/// Room that a shaft or a line of sight needs.
struct Room {
  double radius;  ///< Around it [m].
  double near;    ///< Length of its end where it may be nearer to tissue [m].
};
constexpr Room kShaft{0.006, 0.02}, kScope{0.015, 0.04};

/// Distance of the nearest obstacle from the line between `from` and `target`, without its end; at most `room.radius`.
double Clearance(const std::vector<Vec3d>& obstacles, const Vec3d& from, const Vec3d& target, const Room& room) {
  const Vec3d along = from - target;
  const double length = along.norm();
  double least = room.radius;
  for (const Vec3d& p : obstacles) {
    const double f = std::clamp((p - target).dot(along) / (length * length), std::min(1.0, room.near / length), 1.0);
    least = std::min(least, (target + f * along - p).norm());
  }
  return least;
}

/// The place of a trocar around the membrane's middle, at this distance, that has enough room for its shaft on the way
/// to `target`: the wanted one, else a steeper one, else one with another bearing; if none has, the one with the most.
Vec3d Trocar(const Vec3d& wanted, const Vec3d& target, const Room& wants, const std::vector<Vec3d>& obstacles) {
  constexpr int kSteeper = 5, kBearings = 9;
  constexpr double kStep_rad = 0.22, kTurn_rad = 0.35;
  const double distance = wanted.norm(), bearing = std::atan2(wanted.y(), wanted.x()),
               elevation = std::asin(wanted.z() / distance);
  Vec3d best = wanted;
  double most = -1;
  for (int b = 0; b < kBearings; ++b) {
    // 0, 1, -1, 2, -2 ... turns.
    const int turns = (b + 1) / 2 * (b % 2 != 0 ? 1 : -1);
    const double turned = bearing + kTurn_rad * turns;
    for (int e = 0; e < kSteeper; ++e) {
      const double up = std::min(elevation + kStep_rad * e, 1.4);
      Vec3d trocar = distance * Vec3d(std::cos(up) * std::cos(turned), std::cos(up) * std::sin(turned), std::sin(up));
      const double room = Clearance(obstacles, trocar, target, wants);
      if (room >= wants.radius) return trocar;
      if (room > most) {
        most = room;
        best = trocar;
      }
    }
  }
  return best;
}

const Vec3d kScopeDirection = Vec3d(0.05, -0.71, 0.70).normalized();

double ScopeDistance(const SheetSize& size) {
  return std::clamp(1.2 * std::max(size.width, 0.5 * size.length), 0.06, 0.14);
}

/// Share of the membrane that other organs touch.
double CrowdedPart(const Anatomy& anatomy) {
  constexpr double kTouch_m = 0.004;
  constexpr std::size_t kStep = 13;
  std::size_t nodes = 0, crowded = 0;
  for (std::size_t i = 0; i < anatomy.sheets[0].nodes.size(); i += kStep, ++nodes) {
    for (const Anatomy::Surrounding& s : anatomy.surroundings) {
      const bool touches = std::any_of(s.vertices.begin(), s.vertices.end(), [&](const Vec3d& p) {
        return (p - anatomy.sheets[0].nodes[i]).norm() < kTouch_m;
      });
      if (touches && s.role != SurfaceRole::kRetroperitoneum) {
        ++crowded;
        break;
      }
    }
  }
  return static_cast<double>(crowded) / static_cast<double>(nodes);
}

/// Where something stands before the membrane, tries the organ's other sides and takes the first that can be seen, else
/// the best of them.
template <class Take>
void ChooseSide(NewScene* scene, ImportSettings* import, const Take& take, Anatomy* anatomy) {
  constexpr double kDistance_m = 0.09;
  const auto room = [&](const Anatomy& at) {
    const std::vector<Vec3d> obstacles = ObstaclesOf(at);
    const Vec3d scope = Trocar(kDistance_m * kScopeDirection, Vec3d::Zero(), kScope, obstacles);
    return Clearance(obstacles, scope, Vec3d::Zero(), kScope) * (1 - CrowdedPart(at));
  };
  double most = room(*anatomy);
  const Vec3d behind(0, 0, -1);
  for (const Vec3d& side : {Vec3d(0, 0, 1), Vec3d(1, 0, 1), Vec3d(-1, 0, 1), Vec3d(1, 0, 0), Vec3d(-1, 0, 0), behind}) {
    // No surgeon comes from behind if there is any other way.
    if (most >= kScope.radius || (side == behind && most > kShaft.radius)) return;
    const std::optional<Vec3f> before = import->facing;
    import->facing = side.cast<float>();
    try {
      Anatomy other = take();
      const double here = room(other);
      if (here > most) {
        most = here;
        scene->facing = side;
        *anatomy = std::move(other);
        continue;
      }
    } catch (const InputError&) {  // No membrane lies on that side.
    }
    import->facing = before;
  }
}

std::string TextOf(const Vec3d& p_mm) { return PrintText("[%.4g, %.4g, %.4g]", p_mm.x(), p_mm.y(), p_mm.z()); }

/// A scalar of YAML with any characters but those of control.
std::string Quoted(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (static_cast<unsigned char>(c) < 0x20) continue;
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c;
  }
  return quoted + "\"";
}

std::string OrganText(const NewScene& scene, const ImportSettings& import, bool is_patch) {
  std::string text = "organ:\n  import:\n    organ: " + Quoted(scene.mesh_text) + "\n    unit: " + scene.unit + "\n";
  if (import.cap_openings) text += "    cap_openings: true         # or wall_mm: 3, for a hollow organ\n";
  if (scene.facing) text += "    facing: " + TextOf(scene.facing->normalized()) + "\n";
  if (scene.at_mm) {
    text += "    patch: {at_mm: " + TextOf(*scene.at_mm) + "}   # further keys: width_mm, length_mm\n";
  } else if (!is_patch) {
    text += "    from: 0.1                  # the stretch of the centre line under the membrane\n    to: 0.9\n";
  } else {
    text += "    # patch: {at_mm: [x, y, z], width_mm: 60, length_mm: 80}   to move it, in the frame of the file\n";
  }
  text += PrintText("    cavity_mm: %.0f\n", 1e3 * import.cavity_m);
  const bool any_fixed = std::ranges::any_of(scene.neighbours, [](const auto& n) { return n.material.empty(); });
  if (any_fixed) text += "    surroundings:\n";
  for (const NewNeighbour& neighbour : scene.neighbours) {
    if (!neighbour.material.empty()) continue;
    const FixedSettings& s = neighbour.surface;
    text += "      - {name: " + s.name + ", role: " + std::string(RoleName(s.role)) +
            ", file: " + s.file.filename().string() +
            PrintText(", triangles_max: %d%s}\n", s.triangles_max, s.collides ? ", collides: true" : "");
  }
  return text;
}

std::string BodiesText(const NewScene& scene) {
  std::string text;
  for (const NewNeighbour& n : scene.neighbours) {
    if (n.material.empty()) continue;
    text +=
        text.empty() ? "bodies:                          # each held on the side that faces away from the organ\n" : "";
    text +=
        "  - {name: " + n.surface.name + ", material: " + n.material + ", mesh: " + n.surface.file.filename().string() +
        (n.cap_openings ? ", cap_openings: true" : "") +
        PrintText(", tet_edge_mm: %.1f, triangles_max: %d,\n     held_side: ", n.tet_edge_mm, n.surface.triangles_max) +
        TextOf(n.held_side) + "}\n";
  }
  if (!scene.attach.empty()) text += "\nattach:                          # tissue between what touches\n";
  for (const AttachSettings& a : scene.attach) {
    text += "  - {from: " + a.from + ", to: " + a.to + PrintText(", reach_mm: %.1f}\n", 1e3 * a.reach_m);
  }
  return text.empty() ? text : text + "\n";
}

std::string ScriptText(const SheetSize& size, const Vec3d& hook_wait_mm) {
  // Distances in millimetres become fractions of the sheet.
  constexpr double kSpeed = 0.004, kLongestCut = 0.030, kGraspBeside = 0.012, kCutBeside = 0.003;
  const double lift_mm = 1e3 * std::min(0.020, 0.25 * std::min(size.width, size.length));
  const double cut = std::min(kLongestCut, 0.4 * size.length);
  const double from = 0.5 - 0.5 * cut / size.length, to = 0.5 + 0.5 * cut / size.length;
  const double grasp = std::max(0.2, 0.5 - kGraspBeside / size.width),
               at = std::min(0.7, 0.5 + kCutBeside / size.width);
  const double press_mm = 0.15 * lift_mm, start_s = 7.3, end_s = start_s + cut / kSpeed;
  const std::string fold = PrintText("sheet: [%.3f, 0.5]", grasp);
  std::string text = PrintText(
      "script:                          # places: fractions (across, along) of the membrane and the "
      "height above it\n  duration_s: %.1f\n",
      end_s + 5.2);
  text += "  tool0:                         # closes on a fold, lifts it, releases it\n";
  const auto left = [&](double time_s, double height_mm, double jaw_deg) {
    text += PrintText("    - {time_s: %.1f, %s, height_mm: %.1f, jaw_deg: %.0f}\n", time_s, fold.c_str(), height_mm,
                      jaw_deg);
  };
  left(0, 45, 50);
  left(1.2, 10, 50);
  left(2.0, -2.5, 50);
  left(2.3, -2.5, 50);
  left(2.9, -2.5, 0);
  left(3.2, -2, 0);
  left(5.8, lift_mm, 0);
  left(end_s + 0.2, lift_mm, 0);
  left(end_s + 1.6, 3, 0);
  left(end_s + 2.2, 4, 50);
  left(end_s + 4.0, 40, 50);
  text += "  tool1:                         # waits aside, cuts along the organ beside the fold\n";
  const auto right = [&](double time_s, double t, double height_mm, const char* more) {
    text += PrintText("    - {time_s: %.1f, sheet: [%.3f, %.3f], height_mm: %.1f%s}\n", time_s, at, t, height_mm, more);
  };
  const std::string aside =
      PrintText(", offset_mm: [%.0f, %.0f, %.0f]", hook_wait_mm.x(), hook_wait_mm.y(), hook_wait_mm.z());
  right(0, from, 25, aside.c_str());
  right(4.5, from, 25, aside.c_str());
  right(6.3, from, 10, "");
  right(7.0, from, press_mm, "");
  right(start_s, from, press_mm, ", pedal: cut, power_W: 35");
  right(end_s, to, press_mm, ", pedal: cut, power_W: 35");
  right(end_s + 0.1, to, press_mm, "");
  right(end_s + 1.0, to, 14, "");
  right(end_s + 3.0, to, 25, aside.c_str());
  return text;
}

}  // namespace

std::string DescribeNewScene(const NewScene& given, const Progress& progress) {
  NewScene scene = given;
  if (scene.unit.empty()) {
    const MeshFile file = ReadMesh(scene.mesh);
    scene.unit = LikelyUnit(file, scene.mesh.string());
    if (progress) {
      progress(PrintText("unit: %s, so that the organ is %.0f mm long; --unit says otherwise", scene.unit.c_str(),
                         1e3 * LengthUnit(scene.unit) * LongestSide(file)));
    }
  }
  SceneSettings settings;
  ImportSettings& import = settings.import.emplace();
  import.organ_file = scene.mesh;
  import.scale_m = LengthUnit(scene.unit);
  if (scene.at_mm) {
    import.patch = true;
    import.patch_at_m = (1e-3 * *scene.at_mm).cast<float>();
  }
  if (scene.facing) import.facing = scene.facing->cast<float>();
  settings.membrane.rows = 101;
  settings.membrane.cols = 64;
  settings.membrane.gap_m = 0.003;
  for (const NewNeighbour& n : scene.neighbours) import.surroundings.push_back(n.surface);
  const auto take = [&] {
    try {
      return ImportAnatomy(settings, progress);
    } catch (const OpenSurfaceError& error) {
      if (progress) progress(std::string(error.what()) + "; they are capped");
      import.cap_openings = true;
      return ImportAnatomy(settings, progress);
    }
  };
  Anatomy anatomy = take();
  if (!scene.facing && !scene.neighbours.empty()) ChooseSide(&scene, &import, take, &anatomy);
  const std::vector<Vec3d> obstacles = ObstaclesOf(anatomy);
  const SheetSize size = SizeOf(settings.membrane, anatomy.sheets[0].nodes);
  ChooseMembrane(size, &settings.membrane);

  double radius = 0;
  for (const Vec3d& p : anatomy.solids[0].vertices) radius = std::max(radius, p.norm());
  import.cavity_m = std::max(0.085, 1.15 * radius);
  const Vec3d scope = 1e3 * Trocar(ScopeDistance(size) * kScopeDirection, Vec3d::Zero(), kScope, obstacles);
  const Vec3d grasper = 1e3 * Trocar(Vec3d(-0.085, -0.045, 0.092), Vec3d(-0.01, 0, 0), kShaft, obstacles);
  const Vec3d hook = 1e3 * Trocar(Vec3d(0.098, 0, 0.034), Vec3d(0.003, 0, 0), kShaft, obstacles);
  const MembraneSettings& m = settings.membrane;
  std::string text = "# " + PrintText("A membrane of %.0f x %.0f mm over ", 1e3 * size.width, 1e3 * size.length) +
                     Quoted(scene.mesh.filename().string()) + "." +
                     "\n# The membrane's middle is the origin of the scene, z leads away from the organ, y along it. "
                     "Every key: services/scene/README.md.\n" +
                     "name: \"" + scene.name + "\"\n" +
                     "description: " + Quoted("Organ from " + scene.mesh.filename().string()) + "\n\n";
  text += OrganText(scene, import, anatomy.is_patch) + "\n" + BodiesText(scene);
  text += PrintText(
      "membrane:\n  rows: %d\n  cols: %d\n  gap_mm: %.1f                  # fat between membrane and organ\n"
      "  binding_reach_mm: %.1f\n\n",
      m.rows, m.cols, 1e3 * m.gap_m, 1e3 * m.binding_reach_m);
  text += "tools:\n  tool0: {kind: grasper, trocar_mm: " + TextOf(grasper) +
          "}\n  tool1: {kind: hook, trocar_mm: " + TextOf(hook) +
          "}      # low at the side, so that the foot points down\n\n";
  text +=
      "physics:\n  mode: accurate\n  preset: default\n  damping_per_s: 20\n  gravity_m_s2: [0, 0, 0]        # the rest "
      "shape already is the shape under gravity\n  membrane_Et_N_per_m: 150\n  membrane_stiffening: 1\n"
      "  membrane_prestrain: 0.04\n  membrane_bending_uNm: 2\n  fat_youngs_modulus_kPa: 3\n"
      "  tube_youngs_modulus_kPa: 100   # of the organ\n  tube_poisson: 0.45\n  grasp_radius_mm: 4\n  grip_force_N: "
      "8\n\n";
  text +=
      "thermal:                         # peritoneum on fat\n  cell_um: 100\n  thickness_mm: 0.3\n"
      "  conductivity_W_mK: 0.45\n  latent_heat_J_m3: 1.6e9\n  sigma_S_m: 0.35\n  sigma_fat_S_m: 0.035\n"
      "  fat_depth_mm: 5\n  v_max_V: 350\n  hook_radius_mm: 0.5\n\n";
  text += "haptics: {force_limit_N: 3.3, slew_N_per_ms: 0.4, force_scale: 0.3}\n\n";
  text += PrintText(
      "render:\n  width: 960\n  height: 540\n  rate_Hz: 15\n  png_rate_Hz: 2\n  scope_tip_mm: [%.0f, %.0f, %.0f]\n"
      "  scope_target_mm: [0, 0, 0]\n  fov_deg: 60\n  scope_angle_deg: 30\n\n",
      scope.x(), scope.y(), scope.z());
  return text + ScriptText(size, Vec3d(10, -40, 5));
}

}  // namespace fulcrum::scene
