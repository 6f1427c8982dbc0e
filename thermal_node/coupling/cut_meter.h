// Length, width and straying of the slit, measured on the hole itself: on the centre line of the removed cells. Length
// and width do not depend on the tip's path, so a spark that jumps ahead or a second pass over the same place does not
// falsify them; how far the line lies from that path is a figure of its own.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "thermal_node/coupling/tool_way.h"
#include "thermal_node/heat/heat_field.h"
#include "thermal_node/topology/centre_line.h"
#include "thermal_node/topology/line_graph.h"

namespace fulcrum::thermal {

class CutMeter {
 public:
  /// The contact's centre went straight from one place to the other with current on; material coordinates [m].
  void AddWay(const Vec2f& from, const Vec2f& to);
  /// Measures again after cells within a box (inclusive) were removed.
  void Update(const HeatField& field, CellIndex low, CellIndex high);
  /// Finds the line anew, of the whole hole. It may differ from the one that grew with the hole by a cell here and
  /// there.
  void Rebuild(const HeatField& field);

  /// Centre lines of all holes, from end to end of each hole, with branches; never falls [m].
  [[nodiscard]] float length_m() const { return length_m_; }
  /// Width of the hole across the centre line: median and 95th percentile over its length [m].
  [[nodiscard]] float width_p50_m() const { return width_p50_m_; }
  [[nodiscard]] float width_p95_m() const { return width_p95_m_; }
  /// Distance of the centre line from the contact's way, 95th percentile over its length, at most kWayReach_m [m].
  [[nodiscard]] float off_way_p95_m() const { return off_way_p95_m_; }

  // For checkpoints. What is measured follows from these and the hole, in the same bits.
  [[nodiscard]] std::span<const LineCell> line() const { return line_.cells(); }
  [[nodiscard]] const ToolWay& way() const { return way_; }
  /// False, and a meter that has measured nothing, when the values cannot have come from a meter of this field.
  [[nodiscard]] bool Restore(const HeatField& field, float length_m, std::span<const CellIndex> line,
                             std::span<const ToolWay::Point> way, const ToolWay::End& way_end);

 private:
  void Measure(const HeatField& field);
  void KeepOffWay(const HeatField& field);
  void SetPercentiles(float cell_m);

  CentreLine line_;
  LineGraph graph_;
  ToolWay way_;
  std::vector<LineCell> known_;   ///< The line of the last update, to which off_way_m_ belongs.
  std::vector<Vec2f> known_at_;   ///< Its cells' centres [m].
  std::vector<float> off_way_m_;  ///< Distance of each cell from the way.
  std::vector<float> off_way_next_, histogram_;
  float length_m_ = 0, width_p50_m_ = 0, width_p95_m_ = 0, off_way_p95_m_ = 0;
};

}  // namespace fulcrum::thermal
