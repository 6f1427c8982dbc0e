#include "render_node/scene_graph/edge_lines.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "render_node/scene_graph/program.h"

namespace fulcrum::render {
namespace {

// Where the surface beside an edge must lie for the edge to be visible, relative to the edge [m]. Inside an outline the
// round wall of a shaft comes nearer: by 1.1 mm within 0.25 mm of the outline of a radius of 2.5 mm. The rest allows
// for an edge along the line of sight, whose depth changes within a pixel.
constexpr float kInsideNearer_m = 0.0015f, kInsideFarther_m = 0.0007f, kOutsideNearer_m = 0.0007f;
constexpr Index kRimSides = 128;
constexpr float kOutline = 0, kCrease = 1, kRim = 2;  // Kinds of edge.vert.

float WindowDepth(const Eigen::Matrix4f& projection, float depth_m) {
  return 0.5f + 0.5f * (-projection(2, 2) + projection(2, 3) / depth_m);
}

}  // namespace

EdgeLines::EdgeLines() {
  mesh_.state()->setAttributeAndModes(MakeProgram("edge.vert", "edge.frag"));
  mesh_.state()->setRenderBinDetails(1, "RenderBin");
}

void EdgeLines::AddStrip(const std::array<Vec2f, 2>& ends, const Vec2f& outward, float kind,
                         const std::array<Float4, 2>& depths, float half_width) {
  const auto first = static_cast<Index>(positions_.size());
  for (std::size_t k = 0; k < 2; ++k) {
    for (const float across : {-half_width, half_width}) {
      const Vec2f place = ends.at(k) + across * outward;
      positions_.emplace_back(place.x(), place.y(), across);
      normals_.emplace_back(outward.x(), outward.y(), kind);
      coordinates_.push_back(depths.at(k));
    }
  }
  triangles_.push_back({first, first + 1, first + 2});
  triangles_.push_back({first + 1, first + 3, first + 2});
}

void EdgeLines::Set(std::span<const EdgeLine> lines, const Laparoscope& eye, const Vec2f& size,
                    const Vec2f& circle_radius, float reach) {
  positions_.clear();
  normals_.clear();
  coordinates_.clear();
  triangles_.clear();
  const float half_width = std::max(reach, 0.5f * std::numbers::sqrt2_v<float>);
  for (const EdgeLine& line : lines) {
    std::array<Float4, 2> depths{};
    for (std::size_t k = 0; k < 2; ++k) {
      const float depth = line.depths.at(k);
      depths.at(k) = {WindowDepth(eye.projection, depth - kInsideNearer_m),
                      WindowDepth(eye.projection, depth + kInsideFarther_m),
                      WindowDepth(eye.projection, depth - kOutsideNearer_m), 0};
    }
    AddStrip(line.ends, line.outward, line.crease ? kCrease : kOutline, depths, half_width);
  }
  // The rim is the polygon that the field is drawn as.
  const auto rim = [&](Index k) {
    const float angle = 2 * std::numbers::pi_v<float> * static_cast<float>(k) / kRimSides;
    return Vec2f(0.5f * size + Vec2f(std::cos(angle), std::sin(angle)).cwiseProduct(circle_radius));
  };
  for (Index k = 0; k < kRimSides; ++k) {
    const std::array<Vec2f, 2> ends{rim(k), rim(k + 1)};
    const Vec2f along = (ends[1] - ends[0]).normalized();
    AddStrip(ends, {along.y(), -along.x()}, kRim, {}, half_width);
  }
  mesh_.SetPositions(positions_);
  mesh_.SetNormals(normals_);
  mesh_.SetCoordinates(coordinates_);
  mesh_.SetTriangles(triangles_);
}

}  // namespace fulcrum::render
