// Length of the slit: the length of the tip's path along which the sheet is severed.
//
// The path is walked cell by cell. A stretch counts when its cell is gone, at once or up to a second later. Once the
// tip has left it behind, everything within one tip radius of it is marked as counted, so that going over an old slit
// again adds nothing.
#pragma once

#include <deque>

#include "thermal_node/coupling/source_window.h"
#include "thermal_node/heat/heat_field.h"

namespace fulcrum::thermal {

class CutMeter {
 public:
  struct Stretch {
    CellIndex cell;
    float length_m;
    float age_s;
    float radius_m;
    std::uint32_t counted;
  };

  /// Adds the path of one frame of an energised tip.
  void Walk(const HeatField& field, const TipPath& path);
  /// Counts what has been severed, and marks what the tip has left; call once per frame.
  void Update(HeatField* field, float dt_s);

  [[nodiscard]] float length_m() const { return static_cast<float>(length_m_); }
  [[nodiscard]] bool pending() const { return !stretches_.empty(); }

  struct State {
    double length_m;
    float tip_s, tip_t, walked_m;
  };
  [[nodiscard]] State state() const { return {length_m_, tip_.x(), tip_.y(), walked_m_}; }
  [[nodiscard]] const std::deque<Stretch>& stretches() const { return stretches_; }
  void Restore(const State& state, std::deque<Stretch> stretches);

 private:
  std::deque<Stretch> stretches_;
  double length_m_ = 0;
  Vec2f tip_ = Vec2f::Zero();
  float walked_m_ = 0;  ///< Length of path not yet given to a cell.
};

}  // namespace fulcrum::thermal
