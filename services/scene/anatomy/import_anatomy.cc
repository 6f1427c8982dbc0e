#include "services/scene/anatomy/import_anatomy.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>
#include <functional>
#include <map>
#include <numbers>
#include <optional>
#include <set>

#include "services/base/config/strict_yaml.h"
#include "services/base/core/error.h"
#include "services/base/core/escape.h"
#include "services/scene/anatomy/dicom_segmentation.h"
#include "services/scene/anatomy/organ_surface.h"
#include "services/scene/anatomy/surface_nets.h"
#include "services/scene/builder/geometry.h"
#include "services/scene/compiler/materials.h"
#include "services/scene/compiler/mesh_repair.h"
#include "services/scene/compiler/new_scene.h"
#include "services/scene/compiler/preview.h"
#include "services/scene/compiler/print_text.h"
#include "services/scene/compiler/tetrahedralise.h"
#include "services/scene/compiler/yaml_bodies.h"

namespace fulcrum::scene {
namespace {

namespace fs = std::filesystem;
using config::Range;
using config::StrictMap;
using config::StrictYaml;

constexpr int kMostLabels = 1 + kMostSurroundings;
/// Triangles of an organ's file: more than the scene embeds.
constexpr int kOrganTriangles = 40000;
constexpr std::size_t kLeastVoxels = 30;  ///< Fewer are noise of a segmentation.

void WriteText(const fs::path& file, const std::string& text) {
  std::ofstream out(file, std::ios::binary);
  if (!out.write(text.data(), static_cast<std::streamsize>(text.size())).flush()) {
    throw InputError(file.string() + ": cannot be written");
  }
}

const Segment* SegmentOf(const LabelMap& map, int label) {
  const auto found = std::ranges::find_if(map.segments, [&](const Segment& s) { return s.number == label; });
  return found == map.segments.end() ? nullptr : &*found;
}

/// What became of voxels that a label lacks; empty: nothing.
std::string CoveredText(const LabelMap& map, int label) {
  const Segment* segment = SegmentOf(map, label);
  if (segment == nullptr || segment->covered == 0) return "";
  return PrintText(
      ". %zu more also belong to a segment with a higher number, which takes precedence: leave that one out of the map",
      segment->covered);
}

std::string Page(const AnatomyImport& import, const LabelMap& map, const std::vector<LabelReport>& reports) {
  const bool has_voxels = !map.labels.empty();
  const Mat3d axes = map.W_from_index.linear();
  std::string page = "<!DOCTYPE html><meta charset=utf-8><title>" + EscapeHtml(import.name) +
                     "</title><style>body{font:15px sans-serif;margin:2em;max-width:1300px}td,th{padding:.2em "
                     ".8em;text-align:right}td:first-child,th:first-child{text-align:left}</style><h1>" +
                     EscapeHtml(import.name) + "</h1><p>From " + EscapeHtml(import.labels.filename().string());
  if (has_voxels) {
    page += PrintText(": %d × %d × %d voxels of %.2f × %.2f × %.2f mm", map.size[0], map.size[1], map.size[2],
                      axes.col(0).norm(), axes.col(1).norm(), axes.col(2).norm());
  }
  page += ".</p><table><tr><th>organ";
  page += has_voxels ? "<th>label<th>voxels<th>ml of voxels<th>ml of mesh<th>difference" : "<th>ml of mesh";
  page += "<th>pieces<th>triangles";
  std::string overlaps;
  for (const LabelReport& r : reports) {
    const Segment* segment = SegmentOf(map, r.use.label);
    if (segment != nullptr && segment->covered > 0) {
      overlaps += PrintText(" %zu voxels of ", segment->covered) + EscapeHtml(r.use.name) +
                  " also belong to a segment with a higher number, which takes precedence.";
    }
    page += "<tr><td>" + EscapeHtml(r.use.name) +
            (segment != nullptr && !segment->name.empty() ? " – " + EscapeHtml(segment->name) : "") +
            (r.use.is_organ            ? " (under the membrane)"
             : !r.use.material.empty() ? " (deformable)"
                                       : "");
    page += has_voxels ? PrintText("<td>%d<td>%zu<td>%.2f<td>%.2f<td>%+.1f %%", r.use.label, r.voxels,
                                   r.voxel_volume_ml, r.volume_ml, 100 * (r.volume_ml / r.voxel_volume_ml - 1))
                       : PrintText("<td>%.2f", r.volume_ml);
    page += PrintText("<td>%d<td>%zu", r.pieces, r.triangles);
  }
  page += "</table><p>";
  if (has_voxels)
    page +=
        "Before their triangles are reduced to triangles_max, surfaces stay within a voxel of the "
        "boundary of the voxels." +
        overlaps + " ";
  return page + "Of an organ in several pieces only the largest is used.</p><p><img src=\"" + EscapeHtml(import.name) +
         ".png\" width=1280></p>";
}

/// From axes named by their directions in the patient to left, cranial, anterior; none: no such frame.
std::optional<Mat3d> FromAxes(std::string_view axes) {
  constexpr std::string_view kDirections = "LRSIAP";
  Mat3d m = Mat3d::Zero();
  for (std::size_t a = 0; a < axes.size() && a < 3; ++a) {
    const std::size_t at = kDirections.find(axes[a]);
    if (at == std::string_view::npos) return std::nullopt;
    m(static_cast<Eigen::Index>(at / 2), static_cast<Eigen::Index>(a)) = at % 2 == 0 ? 1 : -1;
  }
  return m.determinant() == 1 ? std::optional(m) : std::nullopt;
}

/// A name for a file, of at most 31 characters.
std::string FileName(const std::string& text) {
  std::string name = text.substr(0, 31);
  for (char& c : name) c = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' ? c : '_';
  return name;
}

using Say = std::function<void(const std::string&)>;

/// By the uses' names.
std::map<std::string, TriangleMesh> SurfacesOfLabels(const AnatomyImport& import, const std::vector<LabelUse>& uses,
                                                     const Say& say, LabelMap* map,
                                                     std::map<int, std::size_t>* counts) {
  std::set<int> used;
  for (const LabelUse& use : uses) used.insert(use.label);
  *map = ReadLabelMap(import.labels, used);
  say(PrintText("%d x %d x %d voxels", map->size[0], map->size[1], map->size[2]));
  for (const Segment& s : map->segments) {
    if (s.covered > 0) {
      say(PrintText(
          "segment %d (%s): %zu of %zu voxels also belong to a segment with a higher number, which takes precedence",
          s.number, s.name.c_str(), s.covered, s.voxels));
    }
  }
  *counts = CountLabels(*map);
  std::vector<int> wanted;
  for (const LabelUse& use : uses) {
    const auto count = counts->find(use.label);
    if (count == counts->end() || count->second < kLeastVoxels) {
      throw InputError(import.map.string() + ": label " + std::to_string(use.label) + " (" + use.name + ") has " +
                       std::to_string(count == counts->end() ? 0 : count->second) + " voxels in " +
                       import.labels.string() + "; valid: at least " + std::to_string(kLeastVoxels) +
                       CoveredText(*map, use.label));
    }
    wanted.push_back(use.label);
  }
  std::map<int, TriangleMesh> of_labels = SurfacesOf(*map, wanted);
  say("surfaces found");
  std::map<std::string, TriangleMesh> surfaces;
  for (const LabelUse& use : uses) surfaces[use.name] = std::move(of_labels.at(use.label));
  return surfaces;
}

std::map<std::string, TriangleMesh> SurfacesOfFiles(const AnatomyImport& import, const LabelUses& read,
                                                    const Say& say) {
  std::map<std::string, TriangleMesh> surfaces;
  for (const LabelUse& use : read.uses) {
    TriangleMesh mesh = SurfaceOf(ReadMesh(import.labels / use.file));
    for (Vec3d& p : mesh.vertices) p = read.W_from_file * p;
    say(PrintText("%s: %zu triangles", use.file.c_str(), mesh.triangles.size()));
    surfaces[use.name] = std::move(mesh);
  }
  return surfaces;
}

const LabelUse& OrganOf(const std::vector<LabelUse>& uses) {
  return *std::find_if(uses.begin(), uses.end(), [](const LabelUse& u) { return u.is_organ; });
}

/// Edges of the tetrahedra, held sides and attachments of the deformable neighbours.
void DescribeBodies(const std::vector<LabelUse>& uses, const std::map<std::string, TriangleMesh>& surfaces,
                    NewScene* scene) {
  constexpr double kVertices = 6000, kMostOfOne = 1200, kTetsPerVertex = 5;  // Of all, beside membrane and organ.
  constexpr double kTouch_mm = 2, kReach_m = 0.004;
  std::vector<NewNeighbour*> deformable;
  for (NewNeighbour& n : scene->neighbours) {
    if (!n.material.empty()) deformable.push_back(&n);
  }
  const TriangleMesh& organ = surfaces.at(OrganOf(uses).name);
  const double tets = kTetsPerVertex * std::min(kMostOfOne, kVertices / static_cast<double>(deformable.size()));
  for (std::size_t i = 0; i < deformable.size(); ++i) {
    NewNeighbour& n = *deformable[i];
    const TriangleMesh& mesh = surfaces.at(n.surface.name);
    // A regular tetrahedron has edge^3 / (6 sqrt 2).
    n.cap_openings = IsOpen(mesh);
    n.tet_edge_mm = std::clamp(std::cbrt(6 * std::numbers::sqrt2 * std::abs(VolumeOf(mesh)) / tets), 0.5, 50.0);
    const Vec3d away = MiddleOf(mesh) - MiddleOf(organ);
    if (away.norm() > 0) n.held_side = away.normalized();
    // The surface of the tetrahedra is up to a quarter of their edge off.
    const double reach = std::max(kReach_m, 0.4e-3 * n.tet_edge_mm);
    if (AreNear(mesh, organ, kTouch_mm)) scene->attach.push_back({n.surface.name, "organ", reach});
    for (std::size_t j = 0; j < i; ++j) {
      const std::string& other = deformable[j]->surface.name;
      if (AreNear(mesh, surfaces.at(other), kTouch_mm)) scene->attach.push_back({n.surface.name, other, reach});
    }
  }
}

}  // namespace

LabelUses ReadLabelUses(const fs::path& file) {
  StrictYaml yaml = StrictYaml::FromFile(file);
  StrictMap root = yaml.root();
  const MaterialLibrary materials;
  LabelUses result;
  std::set<std::string> names, sources;
  int organs = 0;
  for (StrictMap& entry : root.Maps("labels", 1, kMostLabels)) {
    LabelUse use;
    if (entry.Has("file")) {
      use.file = entry.Text("file");
    } else {
      use.label = static_cast<int>(entry.Integer("label", 1, 65535));
    }
    use.name = entry.Text("name", 31);
    const auto is_plain = [](unsigned char c) { return std::isalnum(c) != 0 || c == '-' || c == '_'; };
    if (!std::all_of(use.name.begin(), use.name.end(), is_plain)) {
      entry.Fail("name", "must be letters, digits, '-' and '_': it names a file");
    }
    use.is_organ = entry.Flag("organ", false);
    organs += use.is_organ ? 1 : 0;
    if (use.is_organ && organs > 1)
      entry.Fail("organ",
                 "there is one already: a scene has one organ under the membrane; give the others a `material`");
    const std::string role = entry.TextOr("role", RoleName(use.role), 31);
    try {
      use.role = RoleNamed(role);
    } catch (const InputError& error) {
      entry.Fail("role", error.what());
    }
    use.collides = entry.Flag("collides", use.collides);
    use.material = entry.TextOr("material", "", 31);
    if (!use.material.empty() && !materials.Find(use.material)) {
      entry.Fail("material", materials.Unknown(use.material));
    }
    if (!use.material.empty() && use.name == "organ") {
      entry.Fail("name", "'organ' means the one under the membrane; give a deformable body another name");
    }
    if (use.is_organ && !use.material.empty()) {
      entry.Fail("material", "is for the others: the scene's `physics` has the organ's modulus");
    }
    use.triangles_max = static_cast<int>(entry.Integer("triangles_max", use.triangles_max, 100, 100000));
    if (!names.insert(use.name).second) entry.Fail("name", "is there twice");
    if (!sources.insert(use.file + "/" + std::to_string(use.label)).second) {
      entry.Fail(use.label > 0 ? "label" : "file", "is there twice");
    }
    if ((use.label > 0) != (result.uses.empty() ? use.label > 0 : result.uses[0].label > 0)) {
      root.Fail("labels", "must all have `label`, or all `file`");
    }
    result.uses.push_back(use);
  }
  if (organs == 0) root.Fail("labels", "one entry must have `organ: true`");
  if (result.uses[0].label == 0) {
    const std::string axes = root.Text("axes", 3);
    const std::optional<Mat3d> W_from_axes = FromAxes(axes);
    if (!W_from_axes) {
      root.Fail("axes", "'" + axes +
                            "' must be the directions of x, y and z in the patient, as in LPS, RAS or LSA: L or R, "
                            "A or P, S or I, which together do not mirror");
    }
    result.W_from_file = 1e3 * LengthUnit(root.TextOr("unit", "mm", 2)) * *W_from_axes;
  }
  yaml.Finish();
  return result;
}

std::string SuggestLabelUses(const fs::path& labels) {
  struct Entry {
    std::string source, name;
    double size;
    std::string unit;
  };
  std::vector<Entry> entries;
  const bool is_folder = fs::is_directory(labels);
  if (is_folder) {
    for (const auto& entry : fs::directory_iterator(labels)) {
      std::string extension = entry.path().extension().string();
      for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
      if (!entry.is_regular_file() ||
          !std::set<std::string>{".stl", ".obj", ".off", ".ply", ".vtk", ".vtp"}.contains(extension))
        continue;
      entries.push_back({"file: \"" + entry.path().filename().string() + "\"", FileName(entry.path().stem().string()),
                         static_cast<double>(ReadMesh(entry.path()).triangles.size()), "triangles"});
    }
    std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) { return a.source < b.source; });
  } else {
    const LabelMap map = ReadLabelMap(labels);
    const double voxel_ml = 1e-3 * std::abs(map.W_from_index.linear().determinant());
    if (map.segments.empty()) {
      for (const auto& [label, count] : CountLabels(map)) {
        const std::string number = std::to_string(label);
        entries.push_back({"label: " + number, "label" + number, static_cast<double>(count) * voxel_ml, "ml"});
      }
    }
    for (const Segment& s : map.segments) {
      if (s.voxels == 0) continue;
      const std::string number = std::to_string(s.number), name = FileName(s.name);
      const bool has_name = name.find_first_not_of("_-") != std::string::npos;
      const double covered_ml = static_cast<double>(s.covered) * voxel_ml;
      entries.push_back(
          {"label: " + number, has_name ? name : "label" + number, static_cast<double>(s.voxels) * voxel_ml,
           s.covered == 0 ? "ml" : PrintText("ml, of it %.6g in segments with higher numbers", covered_ml)});
    }
  }
  if (entries.empty()) {
    throw InputError(labels.string() + (is_folder ? ": holds no surface (.stl, .obj, .off, .ply, .vtk, .vtp). " +
                                                        DicomFolderAdvice(labels)
                                                  : ": every voxel is 0, so nothing is labelled"));
  }
  const auto largest =
      std::max_element(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) { return a.size < b.size; });
  std::string names_of_materials;
  for (const std::string& name : MaterialLibrary().Names()) {
    names_of_materials += (names_of_materials.empty() ? "" : ", ") + name;
  }
  std::string text =
      "# What becomes of each: one organ, which gets the membrane; the others are deformable with a `material` (" +
      names_of_materials +
      "), else fixed. What is left out is ignored.\n# role: abdominal_wall, retroperitoneum, pelvis, bladder or other, "
      "which "
      "decides the colour.\n";
  if (is_folder)
    text +=
        "axes: LPS   # where x, y and z of the files lead in the patient: LPS (3D Slicer, most others), RAS, LSA ...\n"
        "unit: mm\n";
  text += "labels:\n";
  // The larger ones, as many as a scene has room for; the others as comments.
  std::vector<double> sizes;
  sizes.reserve(entries.size());
  for (const Entry& entry : entries) sizes.push_back(entry.size);
  std::sort(sizes.rbegin(), sizes.rend());
  const double least = sizes[std::min<std::size_t>(sizes.size(), kMostLabels) - 1];
  int listed = 0;
  std::set<std::string> names;
  for (Entry& entry : entries) {
    const std::string base = entry.name.substr(0, 26);
    for (int n = 2; !names.insert(entry.name).second; ++n) entry.name = base + "_" + std::to_string(n);
    const bool fits = entry.size >= least && listed < kMostLabels;
    listed += fits ? 1 : 0;
    text += std::string(fits ? "  - {" : "  # - {") + entry.source + ", name: " + entry.name +
            (&entry == &*largest ? ", organ: true" : ", role: other") +
            PrintText("}   # %.6g %s\n", entry.size, entry.unit.c_str());
  }
  return text;
}

namespace {

/// Removes what an import that fails has written, else the corrected command would find it there already.
class OutFolder {
 public:
  explicit OutFolder(fs::path folder) : folder_(std::move(folder)) {
    std::error_code error;
    is_new_ = fs::create_directories(folder_, error);
    if (error) throw InputError(folder_.string() + ": cannot be made (" + error.message() + ")");
  }
  ~OutFolder() {
    if (is_done_) return;
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(folder_, error)) fs::remove(entry.path(), error);
    if (is_new_) fs::remove(folder_, error);
  }
  OutFolder(const OutFolder&) = delete;
  OutFolder& operator=(const OutFolder&) = delete;
  void Keep() { is_done_ = true; }

 private:
  fs::path folder_;
  bool is_new_ = false, is_done_ = false;
};

}  // namespace

std::vector<LabelReport> ImportAnatomyFiles(const AnatomyImport& import, const Progress& progress) {
  const auto say = [&](const std::string& text) {
    if (progress) progress(text);
  };
  std::error_code error;
  if (fs::exists(import.out, error) && !(fs::is_directory(import.out, error) && fs::is_empty(import.out, error))) {
    throw InputError(import.out.string() + " is there already and not empty; give another folder, or remove it");
  }
  const LabelUses read = ReadLabelUses(import.map);
  const std::vector<LabelUse>& uses = read.uses;
  const bool has_voxels = uses[0].label > 0;
  LabelMap map;
  std::map<int, std::size_t> counts;
  std::map<std::string, TriangleMesh> surfaces =
      has_voxels ? SurfacesOfLabels(import, uses, say, &map, &counts) : SurfacesOfFiles(import, read, say);
  OutFolder out(import.out);

  const double voxel_ml = 1e-3 * std::abs(map.W_from_index.linear().determinant());
  std::vector<LabelReport> reports;
  NewScene scene;
  scene.name = import.name;
  scene.unit = "mm";
  for (const LabelUse& use : uses) {
    TriangleMesh& surface = surfaces.at(use.name);
    LabelReport report{use, has_voxels ? counts.at(use.label) : 0, 0, PiecesOf(surface), 0, 0};
    report.voxel_volume_ml = static_cast<double>(report.voxels) * voxel_ml;
    surface = Decimate(surface, use.is_organ ? kOrganTriangles : use.triangles_max);
    if (!has_voxels && TurnOutward(&surface)) say(use.file + ": is inside out and turned");
    report.volume_ml = 1e-3 * VolumeOf(surface);
    report.triangles = surface.triangles.size();
    const std::string file = use.name + ".ply";
    WriteText(import.out / file, Ply(surface));
    say(PrintText("%s: %.1f ml, %d pieces, %zu triangles", file.c_str(), report.volume_ml, report.pieces,
                  report.triangles));
    if (!use.is_organ) {
      NewNeighbour& neighbour = scene.neighbours.emplace_back();
      neighbour.surface.name = use.name;
      neighbour.surface.role = use.role;
      neighbour.surface.file = import.out / file;
      neighbour.surface.triangles_max = use.triangles_max;
      neighbour.surface.collides = use.collides;
      neighbour.material = use.material;
    }
    reports.push_back(report);
  }
  DescribeBodies(uses, surfaces, &scene);
  scene.mesh_text = OrganOf(uses).name + ".ply";
  scene.mesh = import.out / scene.mesh_text;
  const fs::path yaml = import.out / (import.name + ".yaml");
  WriteText(yaml, DescribeNewScene(scene, progress));
  const CompiledScene compiled = CompileScene(yaml, {}, progress);
  WriteText(import.out / (import.name + ".png"), PreviewOf(compiled.data.View()));
  WriteText(import.out / "report.html", Page(import, map, reports));
  out.Keep();
  say("wrote " + import.out.string());
  return reports;
}

}  // namespace fulcrum::scene
