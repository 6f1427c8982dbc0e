// What a recording tells of a cut: the sheet's texels at the end, where the metal was on the sheet, where the current
// was put, and the length that was reported.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "services/base/core/scene_view.h"

namespace fulcrum::log_tools {

/// Metal touches the sheet where its axis is nearer to the sheet's middle than its radius, what physics keeps between
/// the two, and the gap across which an arc strikes; then until it is farther than the gap across which an arc holds.
/// At the 500 V peak of a cutting generator air and steam break down across 0.05 to 0.15 mm (Paschen).
struct ContactReach {
  /// False: physics keeps half the sheet's thickness from bare metal. True: all of PhysicsParams::collision_margin_m,
  /// as in recordings from before CauteryContact had points of the metal.
  bool with_collision_margin = false;
  float strikes_m = 0.1e-3f, holds_m = 0.15e-3f;
};

/// Texels of the atlas that cover the sheet, row by row; what they were in the last patch that showed them.
struct SheetTexels {
  int x0 = 0, y0 = 0;  ///< Atlas texel of the first column and row.
  int width = 0, height = 0;
  double texel_m = 1e-4;
  std::vector<std::uint8_t> removed;      ///< 1 where there is nothing any more.
  std::vector<std::uint8_t> damage;       ///< 255 * (1 - exp(-Omega)).
  std::vector<std::uint8_t> temperature;  ///< Highest of all patches: 20 C + value * 0.5 K; 0: never shown.
  std::vector<float> removed_s;           ///< Session time of the first patch that shows it removed; else infinite.
  int revived = 0;                        ///< Texels that were removed and were tissue again in a later patch.

  [[nodiscard]] std::size_t Index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
  }
};

/// Where the metal touched the sheet at the time of one TissueFrame.
struct MetalFrame {
  double time_s = 0;           ///< Session time.
  std::vector<Vec2f> touched;  ///< Places of the sheet that an arc holds to [m].
  bool in_contact = false;     ///< `touched` is not empty.
  /// Of one contact, the nearer places the heavier [m]. Long metal may touch a rim here and a fold there: it is the
  /// contact of the frame before, or the closest one.
  Vec2f centre = Vec2f::Zero();
  bool goes_on = false;                  ///< The contact is that of the frame before.
  float nearest_m = 0;                   ///< Least distance of the metal's axis to the sheet.
  CauteryMode mode = CauteryMode::kOff;  ///< Of the pedals; off without power.
  float power_W = 0;                     ///< Set power of that mode.
};

/// One CauteryContact, with pedal and set power of its time.
struct CurrentSample {
  double time_s = 0;
  bool touching = false;
  CauteryMode mode = CauteryMode::kOff;  ///< Off where there was no power.
  float power_W = 0;
  Vec2f material = Vec2f::Zero();  ///< [m]
  [[nodiscard]] bool energised() const { return mode != CauteryMode::kOff; }
};

struct ReportedLength {
  double time_s = 0;
  double length_m = 0;
};

struct RecordedCut {
  std::string session_id;
  SheetTexels texels;
  std::vector<MetalFrame> metal;
  std::vector<CurrentSample> current;
  std::vector<ReportedLength> lengths;
  TimingSummary thermal_step;  ///< As thermal_node last told.
  /// Heat that warms and vaporises a strip of the sheet as wide as the metal, per length [J/m]: a power divided by it
  /// is the speed at which that power can cut so wide at most.
  double vaporising_J_m = 0;
  /// From the first energised touch to the first cut that thermal_node tells of, or to the first patch with a removed
  /// texel where that is sooner [s]; NaN: no patch has one.
  double first_opening_s = 0;
};

/// Of the hook of the scene. Throws InputError (no recording, no session in it, a scene without a hook) or
/// MismatchError (a recording of another scene).
[[nodiscard]] RecordedCut ReadCut(const std::filesystem::path& recording, const SceneView& scene,
                                  const ContactReach& reach = {});

}  // namespace fulcrum::log_tools
