// Data of a cut in a recording: the sheet's texels at the end, the positions of the metal on the sheet, the places of
// the current, and the reported length.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "services/base/core/scene_view.h"

namespace fulcrum::log_tools {

/// Distances at which metal touches the sheet. Contact begins when the distance from its axis to the sheet's middle is
/// below the sum of its radius, the distance that physics keeps between the two, and the gap across which an arc
/// strikes; it ends beyond the gap across which an arc is sustained. At the 500 V peak of a cutting generator air and
/// steam break down across 0.05 to 0.15 mm (Paschen).
struct ContactReach {
  /// False: physics keeps half the sheet's thickness from bare metal. True: it keeps the whole
  /// PhysicsParams::collision_margin_m, as in recordings made before CauteryContact contained points of the metal.
  bool with_collision_margin = false;
  float strikes_m = 0.1e-3f, holds_m = 0.15e-3f;
};

/// Texels of the atlas that cover the sheet, row by row, with the values of the last patch that contained them.
struct SheetTexels {
  int x0 = 0, y0 = 0;  ///< Atlas texel of the first column and row.
  int width = 0, height = 0;
  double texel_m = 1e-4;
  std::vector<std::uint8_t> removed;      ///< 1 where the tissue is removed.
  std::vector<std::uint8_t> damage;       ///< 255 * (1 - exp(-Omega)).
  std::vector<std::uint8_t> temperature;  ///< Highest value of all patches: 20 C + value * 0.5 K; 0: in no patch.
  std::vector<float> removed_s;  ///< Session time of the first patch in which it is removed; otherwise infinite.
  int revived = 0;               ///< Texels that were removed and were tissue again in a later patch.

  [[nodiscard]] std::size_t Index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
  }
};

/// Places where the metal touched the sheet at the time of one TissueFrame.
struct MetalFrame {
  double time_s = 0;           ///< Session time.
  std::vector<Vec2f> touched;  ///< Places of the sheet within the reach of a sustained arc [m].
  bool in_contact = false;     ///< `touched` is not empty.
  /// Centre of one contact, weighted by proximity [m]. Long metal may touch a rim at one place and a fold at another:
  /// this is the contact of the previous frame, or otherwise the closest one.
  Vec2f centre = Vec2f::Zero();
  bool goes_on = false;                  ///< The contact is that of the previous frame.
  float nearest_m = 0;                   ///< Smallest distance of the metal's axis from the sheet.
  CauteryMode mode = CauteryMode::kOff;  ///< Mode of the pedals; off without power.
  float power_W = 0;                     ///< Set power of that mode.
  /// Heat that warms and vaporises a strip of the metal's width of the sheet of `centre`, per length [J/m]: power
  /// divided by this value is the highest speed at which that power can cut at this width.
  double vaporising_J_m = 0;
};

/// One CauteryContact, with the mode and the set power at its time.
struct CurrentSample {
  double time_s = 0;
  bool touching = false;
  CauteryMode mode = CauteryMode::kOff;  ///< Off if there was no power.
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
  TimingSummary thermal_step;  ///< Last value in the Health of thermal_node.
  /// Time from the first energised touch to the first cut reported by thermal_node, or to the first patch with a
  /// removed texel if that is earlier [s]; NaN: no patch has one.
  double first_opening_s = 0;
};

/// Reads the cut made with the scene's hook. Throws InputError (no recording, no session in it, a scene without a hook)
/// or MismatchError (a recording of another scene).
[[nodiscard]] RecordedCut ReadCut(const std::filesystem::path& recording, const SceneView& scene,
                                  const ContactReach& reach = {});

}  // namespace fulcrum::log_tools
