// Length, width and straying of the slit, measured on the hole itself: on the centre line of the removed cells. Length
// and width do not depend on the tip's path, so a spark that jumps ahead or a second pass over the same place does not
// falsify them. Straying is the distance of the line from that path.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "thermal_node/coupling/tool_path.h"
#include "thermal_node/heat/heat_field.h"
#include "thermal_node/topology/centre_line.h"
#include "thermal_node/topology/line_graph.h"

namespace fulcrum::thermal {

class CutMeter {
 public:
  /// Adds a straight piece of the path that the contact's centre took with current on; material coordinates [m].
  void AddPath(const Vec2f& from, const Vec2f& to);
  /// Updates line and measures after cells within a box (both corners inclusive) were removed.
  void Update(const HeatField& field, CellIndex low, CellIndex high);
  /// Computes the line of the whole hole from scratch. It may differ in single cells from the line of repeated updates.
  void Rebuild(const HeatField& field);

  /// Sum of the lengths of all holes' centre lines, each from end to end of its hole, with branches; never decreases
  /// [m].
  [[nodiscard]] float length_m() const { return length_m_; }
  /// Width of the hole across the centre line: median and 95th percentile over its length [m].
  [[nodiscard]] float width_p50_m() const { return width_p50_m_; }
  [[nodiscard]] float width_p95_m() const { return width_p95_m_; }
  /// Distance of the centre line from the contact's path, 95th percentile over its length, at most kPathReach_m [m].
  [[nodiscard]] float off_path_p95_m() const { return off_path_p95_m_; }

  // For checkpoints. All measures follow from these and the hole, bit for bit.
  [[nodiscard]] std::span<const LineCell> line() const { return line_.cells(); }
  [[nodiscard]] const ToolPath& path() const { return path_; }
  /// Restores a checkpoint. Returns false, and leaves an empty meter, if no meter of this field can have had these
  /// values.
  [[nodiscard]] bool Restore(const HeatField& field, float length_m, std::span<const CellIndex> line,
                             std::span<const ToolPath::Point> path, const ToolPath::End& path_end);

 private:
  void Measure(const HeatField& field);
  void UpdatePathDistances(const HeatField& field);
  void SetPercentiles(float cell_m);

  CentreLine line_;
  LineGraph graph_;
  ToolPath path_;
  std::vector<LineCell> known_;    ///< Line of the last update; off_path_m_ refers to its cells.
  std::vector<Vec2f> known_at_;    ///< Centres of these cells [m].
  std::vector<float> off_path_m_;  ///< Distance of each of these cells from the path [m].
  std::vector<float> off_path_next_, histogram_;
  float length_m_ = 0, width_p50_m_ = 0, width_p95_m_ = 0, off_path_p95_m_ = 0;
};

}  // namespace fulcrum::thermal
