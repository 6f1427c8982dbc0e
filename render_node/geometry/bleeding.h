// Blood: a vessel that is opened before heat has sealed it bleeds onto the sheet, where it runs, gathers, clots and is
// washed off or aspirated (geometry/sheet_fluid.h). The number of sources is bounded. The state is a function of
// events, tubes and shape of the sheet over time, in steps of 20 ms, independent of the number of pictures. Pure.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "render_node/geometry/atlas.h"
#include "render_node/geometry/membrane_mesh.h"
#include "render_node/geometry/sheet_fluid.h"
#include "render_node/geometry/vessel_supply.h"

namespace fulcrum::render {

class Bleeding {
 public:
  /// @param vessels square pattern of four bytes per texel; alpha is the density of vessels. @param per_m repetitions
  /// of the pattern per metre of (s, t). @param rim of SheetRim(), as for SheetFluid. Keeps references to the pattern,
  /// the rim and the arrays of `scene`.
  Bleeding(const SceneView& scene, std::span<const std::uint8_t> vessels, int texels, float per_m,
           std::span<const float> rim = {});

  /// Replaces the clips: a vessel that they cut off (geometry/vessel_supply.h) does not bleed, or stops with the next
  /// Update. One that is free again does not bleed until it is cut again. @pre anchors are vertices of the scene.
  void SetClips(std::span<const Clip> clips);

  /// Registers a cut at `material` [m]: a vessel that ends at its rim in living tissue begins to bleed.
  void Cut(const Vec2f& material, const Atlas& atlas, double session_time_s);

  /// Follows the time with the tubes as they are now. A source that is cut away goes
  /// on at the new rim. Sources close that heat has sealed (damage above a half there) or that have bled for 8 s.
  /// Returns whether the film of the atlas has changed.
  bool Update(double session_time_s, const MembraneMesh& membrane, std::span<const WorkingTube> tubes, Atlas* atlas);

  /// Finds anew which vessels clips have cut off, after a change of clips and, half a second apart, of cuts. Returns
  /// true where the answer may be another one.
  bool FindCutOff(const Atlas& atlas, double session_time_s);
  /// Per texel of the atlas' film: 255 where a vessel is cut off. Empty before the first clip.
  [[nodiscard]] std::span<const std::uint8_t> cut_off() const { return cut_off_; }

  [[nodiscard]] int sources() const;
  /// Something bleeds or flows: the next Update will change the film.
  [[nodiscard]] bool moves() const { return sources() > 0 || fluid_.flows(); }
  /// At rest, but so long after the last time that clots look older.
  [[nodiscard]] bool AgesAt(double session_time_s) const {
    // Half a step later, so that Update makes all of the steps, rounded as its times are.
    return fluid_.ages() && session_time_s >= time_s_ + (kStepsOfAge - step_ + 0.5) * SheetFluid::kStep_s;
  }
  [[nodiscard]] const SheetFluid& fluid() const { return fluid_; }
  [[nodiscard]] double shed_m3() const { return shed_m3_; }  ///< By all sources since the start.

 private:
  static constexpr int kStepsOfAge = 100;
  struct Source {
    bool open = false;
    Vec2f material = Vec2f::Zero();
    int steps = 0;        // Steps since it opened.
    double opened_s = 0;  // Session time of the cut [s].
  };
  /// The strongest vessel in living tissue beside a place that is not cut off; none if there is none.
  [[nodiscard]] std::optional<Vec2f> LivingVessel(const Vec2f& material, const Atlas& atlas);
  /// Closes the sources that clips have cut off; a vessel has two ends at a cut, of which the other one may go on.
  void StopCutOff(const Atlas& atlas);
  void Bleed(Source* source, const Atlas& atlas);

  SceneView scene_;
  VesselSupply supply_;
  bool clips_changed_ = false;
  std::uint64_t removals_ = 0;  // Of the atlas when clips were last taken into account.
  std::vector<std::uint8_t> cut_off_;
  bool cut_off_known_ = true;
  std::uint64_t cut_off_removals_ = 0;
  double cut_off_found_s_ = 0;  // Session time.
  SheetFluid fluid_;
  std::array<Source, 8> sources_;
  std::size_t next_source_ = 0;
  double time_s_ = 0;  // Session time of the last step [s].
  int step_ = 0;       // Since blood aged last.
  double shed_m3_ = 0;
};

}  // namespace fulcrum::render
