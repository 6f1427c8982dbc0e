// Small solids built from rings: instruments, ureter and nerve. Pure.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "services/base/core/types.h"

namespace fulcrum::render {

struct Solid {
  std::vector<Vec3f> positions;
  std::vector<Vec3f> normals;
  std::vector<std::array<float, 4>> colours;  ///< Linear red, green, blue; alpha: metallic share, 0 … 1.
  std::vector<Triangle> triangles;
};

using Colour = std::array<float, 4>;

inline constexpr float kHookNeck = 0.012f;  ///< [m], as the collision shape of the physics node.

/// A round tube along a polyline, with `segments` sides and capped ends. @pre two points or more; radii as many.
void AppendTube(std::span<const Vec3f> path, std::span<const float> radii, int segments, const Colour& colour,
                Solid* solid);

/// Joins outlines with equal numbers of points, each counter-clockwise as seen from the last one, by flat faces and
/// caps.
void AppendLoft(std::span<const std::vector<Vec3f>> outlines, const Colour& colour, Solid* solid);

/// Shaft from z = -shaft_length to the hinge (grasper) or to the neck (hook), in frame T.
struct ToolShape {
  float shaft_radius_m;
  float shaft_length_m;
  float tip_radius_m;
  float tip_length_m;
};
[[nodiscard]] Solid GrasperShaft(const ToolShape& shape);
/// The jaw on the +x side, closed, with the hinge at the origin and the tip at z = tip_length.
[[nodiscard]] Solid GrasperJaw(const ToolShape& shape);
/// Blade of scissors, curved and pointed; placed like GrasperJaw.
[[nodiscard]] Solid ScissorBlade(const ToolShape& shape);
/// Clip applier: a tube of brushed steel without insulation, up to its jaws.
[[nodiscard]] Solid ClipApplierShaft(const ToolShape& shape);
/// Jaw of a clip applier, slim and parallel-sided, with a leg of the next clip in its groove; placed like GrasperJaw.
[[nodiscard]] Solid ClipApplierJaw(const ToolShape& shape);
/// A closed clip in frame C (idl/clip.idl): two legs of 1 mm, joined by a round bend. @param length_m at least 4 mm are
/// drawn.
[[nodiscard]] Solid TitaniumClip(float length_m);
/// Suction and irrigation tube: straight, of steel, with an open end at the origin and two rings of side holes behind
/// it.
[[nodiscard]] Solid SuctionTube(const ToolShape& shape);
/// L-hook: heel at the origin, foot along +x, neck along -z (frame T).
[[nodiscard]] Solid Hook(const ToolShape& shape);

}  // namespace fulcrum::render
