#include "services/scene/builder/quality.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>

#include "services/base/core/sheet_heat.h"
#include "services/base/core/solids.h"
#include "services/scene/builder/geometry.h"

namespace fulcrum::scene {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Smallest and largest value, both 0 if no value was added.
struct Extent {
  double least = kInfinity, largest = -kInfinity;
  void Add(double value) {
    least = std::min(least, value);
    largest = std::max(largest, value);
  }
  void Settle() {
    if (least > largest) {
      least = largest = 0;
    }
  }
};

void MeasureOrgan(const SceneView& s, SceneQuality* q) {
  Extent volume, angle, edge;
  for (const Tetrahedron& t : s.tets) {
    std::array<Vec3d, 4> x;
    for (int k = 0; k < 4; ++k) {
      x[k] = s.rest_position[t[k]].cast<double>();
    }
    const double v = SignedVolume(x[0], x[1], x[2], x[3]);
    q->organ_volume_m3 += v;
    volume.Add(v);
    const DihedralRange dihedral = DihedralAngles(x);
    angle.Add(dihedral.least_deg);
    angle.Add(dihedral.largest_deg);
    q->mean_least_dihedral_deg += dihedral.least_deg / static_cast<double>(s.tets.size());
    q->inverted_tets += v > 0 ? 0 : 1;
  }
  for (const StretchConstraint& e : s.tube_edges) {
    edge.Add(e.rest_length);
    q->mean_edge_m += e.rest_length / static_cast<double>(s.tube_edges.size());
  }
  for (Extent* extent : {&volume, &angle, &edge}) {
    extent->Settle();
  }
  q->least_tet_volume_m3 = volume.least;
  q->least_dihedral_deg = angle.least;
  q->largest_dihedral_deg = angle.largest;
  q->least_edge_m = edge.least;
  q->largest_edge_m = edge.largest;
}

void MeasureMembrane(const SceneView& s, SceneQuality* q) {
  Extent ratio, binding;
  double squares = 0;
  const std::size_t cols = s.membrane.cols;
  const std::size_t step[3] = {1, cols, cols + 1};
  for (std::size_t i = 0; i < s.membrane_rest_length.size(); ++i) {
    const double rest = s.membrane_rest_length[i];
    if (rest > 0) {
      const std::size_t a = i / 3, b = a + step[i % 3];
      const double r = static_cast<double>((s.membrane_material[b] - s.membrane_material[a]).norm()) / rest;
      ratio.Add(r);
      squares += (r - 1) * (r - 1);
      ++q->membrane_springs;
    }
  }
  for (const Binding& b : s.bindings) {
    binding.Add(b.rest_length);
  }
  ratio.Settle();
  binding.Settle();
  q->least_flat_ratio = ratio.least;
  q->largest_flat_ratio = ratio.largest;
  q->rms_flat_error = q->membrane_springs ? std::sqrt(squares / static_cast<double>(q->membrane_springs)) : 0;
  q->least_binding_m = binding.least;
  q->largest_binding_m = binding.largest;
  Extent stretch, area;
  for (const AtlasMetric& m : MeasureAtlas(s)) {
    stretch.Add(m.stretches()[0]);
    stretch.Add(m.stretches()[1]);
    area.Add(m.area());
  }
  stretch.Settle();
  area.Settle();
  q->least_atlas_stretch = stretch.least;
  q->largest_atlas_stretch = stretch.largest;
  q->least_atlas_area = area.least;
  q->largest_atlas_area = area.largest;
  Vec2f extent = Vec2f::Zero();
  for (const Vec2f& m : s.membrane_material) {
    extent = extent.cwiseMax(m);
  }
  q->sheet_m = {extent.x(), extent.y()};
}

}  // namespace

std::vector<bool> SheetsHeld(const SceneView& s) {
  std::vector<bool> held(s.sheets.size(), false);
  const std::vector<std::size_t> sheet_of = SheetOfRows(s);
  for (const Binding& b : s.bindings) {
    if (!held.empty()) held[sheet_of[(b.membrane - s.membrane.first) / s.membrane.cols]] = true;
  }
  for (std::size_t i = 0; i < held.size(); ++i) {
    const SheetPart& sheet = s.sheets[i];
    for (Index row = sheet.first_row; row < sheet.first_row + sheet.rows; ++row) {
      for (Index col = 0; col < sheet.cols; ++col) {
        if (s.inverse_mass[s.membrane.first + row * s.membrane.cols + col] == 0) held[i] = true;
      }
    }
  }
  return held;
}

double AtlasMetric::area() const { return std::sqrt(std::max(ss * tt - st * st, 0.0)); }

std::array<double, 2> AtlasMetric::stretches() const {
  const double mean = (ss + tt) / 2, radius = std::hypot((ss - tt) / 2, st);
  return {std::sqrt(std::max(mean - radius, 0.0)), std::sqrt(mean + radius)};
}

std::vector<AtlasMetric> MeasureAtlas(const SceneView& s) {
  std::vector<AtlasMetric> metrics;
  const std::size_t rows = s.membrane.rows, cols = s.membrane.cols;
  for (std::size_t r = 0; r + 1 < rows; ++r) {
    for (std::size_t c = 0; c + 1 < cols; ++c) {
      if (!HasCell(s, static_cast<Index>(r), static_cast<Index>(c))) continue;
      const std::size_t n = r * cols + c;
      const auto x = [&](std::size_t k) { return Vec3d(s.rest_position[s.membrane.first + k].cast<double>()); };
      const auto m = [&](std::size_t k) { return Eigen::Vector2d(s.membrane_material[k].cast<double>()); };
      Eigen::Matrix<double, 3, 2> place;
      Eigen::Matrix2d material;
      // Sums of opposite edges of the cell: twice the derivative of the bilinear map at its middle.
      const std::size_t across = n + 1, along = n + cols, both = n + cols + 1;
      place << x(across) - x(n) + x(both) - x(along), x(along) - x(n) + x(both) - x(across);
      material << m(across) - m(n) + m(both) - m(along), m(along) - m(n) + m(both) - m(across);
      const Eigen::Matrix<double, 3, 2> map = place * material.inverse();
      const Eigen::Matrix2d metric = map.transpose() * map;
      metrics.push_back({metric(0, 0), metric(0, 1), metric(1, 1)});
    }
  }
  return metrics;
}

SceneQuality Measure(const SceneView& s) {
  SceneQuality q{};
  q.vertices = s.rest_position.size();
  q.organ_vertices = s.tube_vertex_count;
  q.tets = s.tets.size();
  q.organ_springs = s.tube_edges.size();
  q.bending = s.bending.size();
  q.bindings = s.bindings.size();
  const auto colours = [](std::span<const Index> offsets) { return offsets.empty() ? 0 : offsets.size() - 1; };
  q.colours = {colours(s.tet_colours), colours(s.tube_edge_colours), colours(s.bending_colours),
               colours(s.binding_colours)};
  MeasureOrgan(s, &q);
  MeasureMembrane(s, &q);
  for (const EmbeddedVertex& v : s.surface_vertices) {
    for (const float w : v.barycentric) {
      q.least_weight = std::min<double>(q.least_weight, w);
    }
  }
  for (const ScriptKey& key : s.script) {
    q.largest_reach_m = std::max<double>(q.largest_reach_m, (key.p_W - s.tools[key.tool].p_WP).norm());
  }
  return q;
}

std::string Describe(const SceneView& s, const SceneQuality& q) {
  std::string text;
  char line[160];
  const auto add = [&](const char* format, auto... values) {
    std::snprintf(line, sizeof(line), format, values...);
    text += line;
    text += '\n';
  };
  add(!s.sheets.empty() || q.membrane_springs == 0 ? "  vertices   %zu: solids %zu, grid of the sheets %u x %u"
      : s.solids.empty()                           ? "  vertices   %zu: organ %zu, membrane %u x %u"
                                                   : "  vertices   %zu: solids %zu, membrane %u x %u",
      q.vertices, q.organ_vertices, s.membrane.rows, s.membrane.cols);
  const std::vector<bool> is_held = SheetsHeld(s);
  for (std::size_t i = 0; i < s.sheets.size(); ++i) {
    const SheetPart& sheet = s.sheets[i];
    add("  sheet      %s: %u x %u, %.3g mm%s%s", sheet.name, sheet.rows, sheet.cols,
        1e3 * static_cast<double>(ThermalOf(sheet, s.thermal).thickness_m),
        IsSpanned(sheet) ? ", air on both sides" : "",
        is_held[i] ? "" : "; neither held nor bound, so nothing keeps it in its place");
  }
  for (const Solid& solid : s.solids) {
    add("  body       %s: %u vertices, %.3g kPa", solid.name, solid.vertex_count,
        1e-3 * static_cast<double>(solid.youngs_modulus_Pa));
  }
  const std::vector<Index> solid_of = SolidOfVertices(s);
  std::vector<bool> is_loose(s.solids.size(), true);
  for (std::size_t v = 0; v < solid_of.size() && !s.solids.empty(); ++v) {
    if (s.inverse_mass[v] == 0) is_loose[solid_of[v]] = false;
  }
  std::vector<bool> slides(s.solids.size(), false);
  std::size_t sliding = 0;
  for (const Attachment& a : s.attachments) {
    if (!a.normal.isZero(0.0f)) {
      slides[solid_of[a.vertex]] = slides[solid_of[a.surface[0]]] = true;
      ++sliding;
    } else {
      is_loose[solid_of[a.vertex]] = is_loose[solid_of[a.surface[0]]] = false;
    }
  }
  for (std::size_t i = 0; i < s.solids.size(); ++i) {
    if (!is_loose[i]) continue;
    add(slides[i] ? "  loose      %s: only slides on others, so it can move away along them"
                  : "  loose      %s: neither held nor attached, so gravity lets it fall",
        s.solids[i].name);
  }
  if (!s.attachments.empty()) {
    add("  attached   by %zu springs%s", s.attachments.size(),
        sliding > 0 ? (", " + std::to_string(sliding) + " of them sliding").c_str() : "");
  }
  add("  stretch    %zu: organ %zu, membrane %zu (and %zu bindings)", q.organ_springs + q.membrane_springs,
      q.organ_springs, q.membrane_springs, q.bindings);
  add("  volume     %zu tetrahedra, %.1f ml", q.tets, 1e6 * q.organ_volume_m3);
  add("  bending    %zu", q.bending);
  add("  colours    tets %zu, organ springs %zu, bending %zu, bindings %zu", q.colours[0], q.colours[1], q.colours[2],
      q.colours[3]);
  add("  tets       %zu inverted, least volume %.4f mm3, dihedral angles %.1f to %.1f deg (least of each: %.1f on "
      "average)",
      q.inverted_tets, 1e9 * q.least_tet_volume_m3, q.least_dihedral_deg, q.largest_dihedral_deg,
      q.mean_least_dihedral_deg);
  add("  edges      %.2f to %.2f mm, %.2f on average", 1e3 * q.least_edge_m, 1e3 * q.largest_edge_m,
      1e3 * q.mean_edge_m);
  if (q.bindings > 0) add("  bindings   %.2f to %.2f mm long", 1e3 * q.least_binding_m, 1e3 * q.largest_binding_m);
  if (q.membrane_springs > 0) {
    add(s.sheets.size() > 1 ? "  flattened  all of them %.1f x %.1f mm, lengths kept to %.2f %% rms, %.1f to %.1f %%"
                            : "  flattened  %.1f x %.1f mm, lengths kept to %.2f %% rms, %.1f to %.1f %%",
        1e3 * q.sheet_m[0], 1e3 * q.sheet_m[1], 100 * q.rms_flat_error, 100 * (q.least_flat_ratio - 1),
        100 * (q.largest_flat_ratio - 1));
    add("  atlas      true length over length in the atlas %.3f to %.3f a cell, area %.3f to %.3f",
        q.least_atlas_stretch, q.largest_atlas_stretch, q.least_atlas_area, q.largest_atlas_area);
  }
  add("  surface    %zu vertices, %zu triangles, least embedding weight %.2f", s.surface_vertices.size(),
      s.surface_triangles.size(), q.least_weight);
  add("  around     %zu surfaces, %zu triangles; %zu ureters and nerves", s.static_surfaces.size(),
      s.static_triangles.size(), s.protected_structures.size());
  add("  script     %.1f s, %zu keys, at most %.0f mm from the trocar", static_cast<double>(s.script_duration_s),
      s.script.size(), 1e3 * q.largest_reach_m);
  for (std::size_t i = 0; i < s.tools.size(); ++i) {
    if (s.tools[i].kind == ToolKind::kScissors) add("  scissors   tool%zu: they push tissue aside and cut nothing", i);
  }
  add("  hash       %016llx", static_cast<unsigned long long>(s.hash));
  return text;
}

}  // namespace fulcrum::scene
