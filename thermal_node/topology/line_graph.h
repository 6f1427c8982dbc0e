// A centre line as a graph of stretches between ends and forks, and its length. Short spurs are pruned first, because
// they result from a rough border of the hole and not from a cut. Then each stretch is smoothed, because a chain of
// cells is up to 8 % longer than the line that it represents. Last, free ends are extended to the end of the hole.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "thermal_node/topology/centre_line.h"

namespace fulcrum::thermal {

class LineGraph {
 public:
  /// Length of the line [m]; sets weights().
  [[nodiscard]] float Measure(const HeatField& field, std::span<const LineCell> cells);
  /// Length that each cell represents [cells]; 0 on pruned spurs. Extensions to the end of the hole are not included.
  [[nodiscard]] std::span<const float> weights() const { return weights_; }

 private:
  /// Neighbours of a cell along the line; no more than four, see Link().
  struct Node {
    std::array<std::uint32_t, 4> to{};
    std::uint8_t count = 0;
    std::uint8_t walked = 0;  ///< A bit per neighbour: link already traced.
    bool pruned = false;
  };
  /// Cells trail_[begin, end), first and last included. On a ring the first cell is repeated as the last.
  struct Stretch {
    std::uint32_t begin, end;
    float reach;   ///< Length by steps plus the half width at free ends [cells]; the criterion for spurs.
    float length;  ///< Smoothed length with the extensions at free ends [cells].
  };

  void Link();
  void Trace();
  void Walk(std::uint32_t from, unsigned link);
  /// Removes the shortest spur of each fork if it is short enough. Returns false if none was removed.
  bool Prune();
  void CutOff(const Stretch& spur);
  void Unlink(std::uint32_t from, std::uint32_t to);
  /// Half width of the hole at a cell [cells].
  [[nodiscard]] float Radius(std::uint32_t cell) const;
  /// Protrusion of a spur from the border of the hole at its fork, less the threshold above which it counts [cells].
  [[nodiscard]] float Excess(const Stretch& spur, std::uint32_t fork) const;
  [[nodiscard]] bool IsFree(std::uint32_t cell) const { return nodes_[cell].count <= 1; }
  [[nodiscard]] bool IsSpur(const Stretch& stretch) const {
    return IsFree(trail_[stretch.begin]) != IsFree(trail_[stretch.end - 1]);
  }
  /// Distance from the free end of the smoothed stretch to the end of the hole [cells].
  [[nodiscard]] float Extension(const HeatField& field, std::uint32_t cell, bool at_front) const;
  [[nodiscard]] float LongestChord(const HeatField& field, std::uint32_t cell) const;
  void Smooth(const Stretch& stretch);
  [[nodiscard]] float LengthOf(const HeatField& field, const Stretch& stretch);

  std::span<const LineCell> cells_;
  float cell_m_ = 1e-4f;
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> trail_;
  std::vector<Stretch> stretches_;
  std::vector<Vec2f> smooth_;  ///< Smoothed points of one stretch [cells].
  std::vector<float> weights_;
  std::vector<std::uint32_t> spurs_;  ///< Indices of stretches.
};

}  // namespace fulcrum::thermal
