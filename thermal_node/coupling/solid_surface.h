// Burns on the surface of the solids: the layer beneath the hook as cells of the solids' charts, with the same current,
// heat, boiling and damage as the membrane. Nothing is cut: what vaporises leaves a pit as deep as the layer.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "services/base/core/scene_view.h"
#include "services/base/core/solid_charts.h"
#include "services/base/core/solids.h"
#include "thermal_node/coupling/source_window.h"
#include "thermal_node/coupling/tip_tracker.h"
#include "thermal_node/damage/arrhenius.h"
#include "thermal_node/heat/heat_field.h"

namespace fulcrum::thermal {

/// Depth of the layer, assumed: what a disc of 1 mm heats first.
inline constexpr float kSolidLayer_m = 5e-4f;
/// Depth at which the potential beneath has fallen to 0; far beyond the metal's radius it hardly matters. Assumed.
inline constexpr float kSolidDepth_m = 0.01f;
/// Radius of the hot disc from which heat flows into the depth: the mean conductance of a disc at one temperature on a
/// half space is 4 k / (pi a) (Carslaw and Jaeger 1959, section 8.2).
inline constexpr float kSolidDisc_m = 1e-3f;

/// The material of the layer: the wall of the rectum (volume/volume_material.h) with the electrical conductivity of the
/// scene's membrane in every depth, since serosa covers most organs.
[[nodiscard]] Material MakeSolidMaterial(const ThermalParams& params);

/// A solid whose surface has become warm or damaged enough for a warning (protected/protected_structures.h).
struct SolidWarning {
  Index solid = 0;
  Vec2f material = Vec2f::Zero();  ///< Hottest cell of the solid, in the charts [m].
  float temperature_C = 0;         ///< There.
};

struct SolidBurn {
  Index solid = 0;                 ///< Index in TissueScene::solids; 0 in a scene of one organ.
  bool first = false;              ///< The first of this solid.
  Vec2f material = Vec2f::Zero();  ///< Where, in the charts [m].
  float temperature_C = 0;         ///< Highest of all solids.
  float dead_m2 = 0;               ///< Area of the solid's dead surface since the start.
};

class SolidSurface {
 public:
  explicit SolidSurface(const TissueScene& scene);
  SolidSurface(const SolidSurface&) = delete;  // members hold references to each other
  SolidSurface& operator=(const SolidSurface&) = delete;

  /// Advances one frame; `hook`: state of the metal, which the membrane shares. Returns false after a few comparisons
  /// if there is neither current nor warm tissue.
  bool Step(std::span<const TipInput> tips, float dt_s, Interface* hook);

  /// Chart of a triangle of the solids' surface; kNoIndex: none.
  [[nodiscard]] Index ChartOf(Index triangle) const {
    return triangle < charts_.of_triangle.size() ? charts_.of_triangle[triangle] : kNoIndex;
  }
  /// Whether a place lies in the box of a triangle's chart; false for a triangle without one.
  [[nodiscard]] bool IsOn(Index triangle, const Vec2f& material) const;
  /// Share of the triangles that have no chart, because the atlas is full.
  [[nodiscard]] float left_out() const { return left_out_; }
  [[nodiscard]] const HeatField& field() const { return field_; }
  [[nodiscard]] HeatField* mutable_field() { return &field_; }
  [[nodiscard]] const Ledger& ledger() const { return ledger_; }
  /// Power that the generator delivers to solids, mean over the time of the last samples, and what is set there [W].
  [[nodiscard]] float power_W() const { return power_W_; }
  [[nodiscard]] float set_power_W() const { return set_power_W_; }
  [[nodiscard]] float voltage_V() const { return voltage_V_; }
  /// Frames in which the metal did not fit into the potential's window; see kMetalReach.
  [[nodiscard]] std::uint32_t shortened() const { return shortened_; }
  [[nodiscard]] float highest_C() const { return highest_C_; }
  /// Area of dead surface (cell death, Omega >= 1) of all solids since the start [m^2]; updated every tenth frame.
  [[nodiscard]] float dead_m2() const;
  /// Burns to be reported after the last Step: of each solid at its first square millimetre and each further one.
  [[nodiscard]] std::span<const SolidBurn> burns() const { return burns_; }
  /// Warnings after the last Step: one of each solid, at the first count of its cells that gives cause for one.
  [[nodiscard]] std::span<const SolidWarning> warnings() const { return warnings_; }
  [[nodiscard]] bool warned(Index solid) const { return solid < kMaxSolids && (warned_ >> solid & 1u) != 0; }
  /// Whether a burn of this solid has been reported since the start.
  [[nodiscard]] bool reported(Index solid) const { return solid < kMaxSolids && reported_m2_[solid] > 0.0f; }

  /// Hash of sums over the warm state; 0 while nothing has been heated since the start.
  [[nodiscard]] std::uint64_t TickHash() const;

  // Checkpoints (coupling/checkpoint_state.cc). A state that was never heated takes a few bytes.
  [[nodiscard]] static std::size_t CheckpointCapacity();
  /// Returns the bytes used; 0 when `out` is too small.
  [[nodiscard]] std::size_t Save(std::span<std::byte> out) const;
  /// The same of tissue that was never heated.
  [[nodiscard]] static std::size_t SaveNothing(std::span<std::byte> out);
  /// Returns false, and leaves a fresh state, if no solver can have written the bytes.
  [[nodiscard]] bool Restore(std::span<const std::byte> bytes);
  /// Back to tissue that was never heated.
  void Clear();

 private:
  struct Record;
  SolidSurface(const TissueScene& scene, SolidCharts charts);
  void ApplySource(std::span<const TipInput> tips, float dt_s, float from, float to);
  /// What the cells of a solid show.
  struct Count {
    double dead = 0;  ///< Area of its dead cells, in cells.
    CellIndex last_dead;
    std::optional<CellIndex> hottest;  ///< None: no cell of the solid was heated.
    float theta = 0;                   ///< Of the hottest cell [K].
    float omega = 0;                   ///< Largest damage integral of cell death.
  };
  void MeasureBurns();
  /// Solid of a place in the charts; kNoIndex: none.
  [[nodiscard]] Index SolidAt(const Vec2f& material) const;
  /// Adds a tile's cells to the counts of their solids.
  void CountCells(const Tile& tile, std::array<Count, kMaxSolids>* counts);

  ThermalParams params_;
  Material material_;
  HeatField field_;
  DamageModel damage_;
  SourceWindow source_;
  SolidCharts charts_;
  std::vector<std::vector<Index>> charts_of_tile_;  ///< By tile; empty until it was warm.
  Ledger ledger_;
  using BySolid = std::array<float, kMaxSolids>;
  std::vector<SolidBurn> burns_;
  std::vector<SolidWarning> warnings_;
  std::uint32_t warned_ = 0;  ///< Bit of each solid; kMaxSolids bits.
  std::uint64_t frame_ = 0;   ///< Frames in which something was computed.
  float power_W_ = 0, set_power_W_ = 0, voltage_V_ = 0, highest_C_ = 0, left_out_ = 0;
  float silent_s_ = 0;  ///< Time since the last sample [s].
  std::uint32_t shortened_ = 0;
  Vec2f place_ = Vec2f::Zero();  ///< Of the last sample that heated [m].
  BySolid dead_m2_{}, reported_m2_{};
};

}  // namespace fulcrum::thermal
