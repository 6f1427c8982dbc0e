// The space of the abdomen that nothing in the scene uses: where the picture may add anatomy that is not simulated.
// Pure.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "services/base/core/scene_view.h"

namespace fulcrum::render {

/// The sphere of tissue that closes the picture where the scene's surfaces end, seen from inside.
struct Cavity {
  Vec3f centre;
  float radius;  ///< [m]
};
[[nodiscard]] Cavity CavityOf(const SceneView& scene);

/// A scalar in space: values at the nodes of a regular grid, linear in between.
class GridField {
 public:
  GridField() = default;
  /// Covers the box of half-width `half` [m] around `centre` by nodes `spacing` [m] apart, all with `value`.
  GridField(const Vec3f& centre, float half, float spacing, float value);
  /// At `p`, frame W; `outside` beyond the nodes but the outermost ones.
  [[nodiscard]] float At(const Vec3f& p, float outside) const;
  /// Lowers the nodes nearer than `reach` to `p` to their distance to it, less `margin` [m].
  void Lower(const Vec3f& p, float reach, float margin);
  /// Lowers all nodes but the outermost ones to the distance to the nearest of some points, less the point's own
  /// margin, their fourth number [m]. Exact next to the points; farther away a node may get another point that is
  /// nearly as near.
  void LowerAll(std::span<const Eigen::Vector4f> points);
  [[nodiscard]] std::size_t size() const { return values_.size(); }
  [[nodiscard]] Vec3f NodeAt(std::size_t node) const;
  [[nodiscard]] float& operator[](std::size_t node) { return values_[node]; }
  [[nodiscard]] float operator[](std::size_t node) const { return values_[node]; }
  /// Number of the nearest node; size() if `p` is outside.
  [[nodiscard]] std::size_t NearestNode(const Vec3f& p) const;

 private:
  Vec3f low_ = Vec3f::Zero();
  float spacing_ = 1;
  int count_ = 0;  // Of nodes a side.
  std::vector<float> values_;
};

class FreeSpace {
 public:
  /// Decoration keeps this distance to all tissue at rest [m]: as far as the scripts pull it, and the width of a jaw.
  static constexpr float kToTissue_m = 0.018f;
  /// … to each straight line from the scope or a trocar to a place of the tissue [m]: a shaft and its tremor.
  static constexpr float kToLines_m = 0.008f;
  /// … to fixed surfaces and the cavity [m].
  static constexpr float kToWalls_m = 0.0025f;

  explicit FreeSpace(const SceneView& scene);

  /// Radius of the largest ball around `p` that keeps all distances and is not nearer to the scope than the scope's
  /// target; negative where none does.
  [[nodiscard]] float Room(const Vec3f& p) const;
  /// Distance to the nearest fixed surface or the cavity [m].
  [[nodiscard]] float ToWalls(const Vec3f& p) const;
  /// True if no fixed surface hides `p` from the scope at its place in the scene.
  [[nodiscard]] bool Seen(const Vec3f& p) const;
  /// Towards the scope and the trocars: away from the bed on which bowel lies. Unit.
  [[nodiscard]] const Vec3f& up() const { return up_; }
  [[nodiscard]] const Cavity& cavity() const { return cavity_; }
  /// A field over the same nodes, with `value`.
  [[nodiscard]] GridField MakeField(float value) const;

 private:
  void AddWalls(const SceneView& scene);
  void KeepClear(const SceneView& scene);

  Cavity cavity_;
  Vec3f scope_tip_, up_ = Vec3f::UnitZ();
  float nearest_ = 0;  // To the scope [m].
  GridField walls_, kept_;
  std::vector<std::uint8_t> hiding_;  // Nodes near a fixed surface that faces the scope.
};

}  // namespace fulcrum::render
