// Contact of the electrode with the membrane: footprint of the hook's bare metal on the sheet, and whether the sheet is
// lifted off the tissue below.
#pragma once

#include <array>
#include <vector>

#include "physics_node/collision/open_cells.h"
#include "physics_node/collision/tool_collision.h"
#include "physics_node/contact_model/gap_box.h"
#include "physics_node/contact_model/sheet_place.h"
#include "services/base/core/slit_sheet.h"

namespace fulcrum::physics {

class CauteryProbe {
 public:
  CauteryProbe(const TissueScene& scene, const TissueModel* model, const ParticleStore* particles);

  /// Contact of hook `tool` after a step: footprint, centre, rate, tented; without stamp.
  ///
  /// The bare metal is the foot and the end of the neck. The footprint is its distance from each cell of the deformed
  /// sheet near it; each side of a slit continues unstretched up to its lip. Stations along the axis of the metal
  /// follow the nearest place of the sheet from step to step, also across slits, so the centre of the contact is
  /// continuous for a continuous motion of the tool. Their distances determine touch, with hysteresis.
  [[nodiscard]] CauteryContact Update(std::uint32_t tool, const ToolPose& pose, const ToolCollision& collision,
                                      float step_s);

 private:
  /// Access of SlitSheet to the membrane (services/base/core/slit_sheet.h).
  struct SheetAccess {
    const TissueScene& scene;
    const TissueModel& model;
    const ParticleStore& particles;
    [[nodiscard]] std::uint32_t rows() const { return scene.membrane.rows; }
    [[nodiscard]] std::uint32_t cols() const { return scene.membrane.cols; }
    [[nodiscard]] bool Gone(Index node) const { return !model.NodeAlive(node) || model.IsDebris(node); }
    [[nodiscard]] bool Severed(std::size_t edge) const {
      return !model.EdgeAlive(static_cast<Index>(edge / 3), static_cast<int>(edge % 3));
    }
    [[nodiscard]] Vec3f Place(Index node) const {
      return particles.At(particles.NodeRef(node / cols(), node % cols()));
    }
    [[nodiscard]] Vec3f Rest(Index node) const { return scene.rest_position[scene.membrane.first + node]; }
    [[nodiscard]] Vec2f Material(Index node) const { return scene.membrane_material[node]; }
  };
  /// A point of the metal's axis.
  struct Station {
    Vec3f p_T = Vec3f::Zero();
    Vec3f p_W = Vec3f::Zero();
    SheetPlace place;
    /// Signed distance of the axis from the sheet; at a cut at least that from its living border.
    float height_m = 0, last_height_m = 0;
  };
  void SetStations(const ToolDescription& tool);
  void FollowSheet(const ToolPose& pose, std::uint32_t tool, const ToolCollision& collision);
  void SignHeights();
  /// Thickness of the sheet of a cell [m]; without one that of `thermal`.
  [[nodiscard]] float ThicknessAt(Index cell) const;
  /// Mean place of the metal within the gap that conducts, weighted by (limit - distance)^2 and by the
  /// length that it covers. False: there is none.
  bool FindCentre(float radius_m, float step_s, Vec2f* centre);
  /// Gaps of the cells around `centre` from the metal.
  void FillFootprint(const ToolPose& pose, const ToolDescription& tool, const ToolCollision& collision,
                     const Vec2f& centre, Footprint* print);
  void FindNearCells(float reach_m, const ToolCollision& collision);
  /// A triangle is divided into the parts that its dead edges leave; a cell belongs to the part whose own corners are
  /// nearest to it.
  void AddGaps(Index triangle, const MetalAxis& axis, float radius_m);
  [[nodiscard]] bool Tented(Index triangle, const std::array<float, 3>& barycentric) const;

  TissueScene scene_;
  const TissueModel* model_;
  const ParticleStore* particles_;
  SheetWalk walk_;
  std::vector<float> thickness_;  ///< Of the sheet, by row of the grid [m].
  std::vector<Station> stations_;
  GapBox gaps_;
  std::vector<Index> near_cells_;
  float spacing_ = 0;      ///< Longest edge of the membrane at rest [m].
  bool followed_ = false;  ///< The stations have places on the sheet.
  float centre_ = 0;       ///< Of the contact, along the metal [stations].
  bool was_touching_ = false;
  Vec2f last_material_ = Vec2f::Zero(), rate_ = Vec2f::Zero();
};

}  // namespace fulcrum::physics
