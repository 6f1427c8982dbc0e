// Scalar, vector and index types shared by every module. SI units throughout.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>

namespace fulcrum {

using Vec2f = Eigen::Vector2f;
using Vec3f = Eigen::Vector3f;
using Vec2d = Eigen::Vector2d;
using Vec3d = Eigen::Vector3d;
using Mat3f = Eigen::Matrix3f;
using Mat3d = Eigen::Matrix3d;
using Quatf = Eigen::Quaternionf;

using Index = std::uint32_t;
inline constexpr Index kNoIndex = 0xffffffffu;

/// Vertices of one triangle, counter-clockwise seen from outside.
using Triangle = std::array<Index, 3>;
/// Vertices of one tetrahedron; positive volume means (b-a)x(c-a).(d-a) > 0.
using Tetrahedron = std::array<Index, 4>;

// Scene arrays are memory-mapped without conversion, so these types must be packed.
static_assert(sizeof(Vec2f) == 8 && sizeof(Vec3f) == 12 && sizeof(Triangle) == 12);

}  // namespace fulcrum
