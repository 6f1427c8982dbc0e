// Bodies of the kernels of collision detection; compiled for each instruction set. First touch and feet: touch_impl.h.
//
// Bounds of a block B of the membrane, per axis:
//
//   lo_B = min x_n,   hi_B = max x_n     over the nodes n of its cells [m]
//
// Stencil: block (rb, sb, lane) consists of the cells of rows 8 rb .. 8 rb + 7 and slots 8 sb .. 8 sb + 7 of a lane;
// its nodes are one row and one slot more, since a cell (r, c) has the nodes r, r + 1 and c, c + 1. Behind the last
// slot follows slot 0 of the next lane.
//
// Layout: planes of lane-blocked rows (GridArrays), one block per lane; results at (rb * slot_blocks + sb) * 8 + lane.
#pragma once

#include "physics_node/collision/kernels.h"
#include "physics_node/collision/touch_impl.h"
#include "physics_node/simd/lanes.h"

namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE {

void ComputeBlockBounds(const GridArrays& g, const BlockBounds& bounds) {
  const float* planes[3] = {g.x, g.y, g.z};
  constexpr int kSide = static_cast<int>(kBlockCells);
  const int cell_rows = g.rows > 1 ? g.rows - 1 : 1;
  std::size_t out = 0;
  for (int r0 = 0; r0 < cell_rows; r0 += kSide) {
    const int r1 = r0 + kSide < g.rows ? r0 + kSide : g.rows - 1;
    for (int s0 = 0; s0 < g.slots; s0 += kSide, out += kLanes) {
      const int s1 = s0 + kSide < g.slots ? s0 + kSide : g.slots;  // The slot behind the block; g.slots: it wraps.
      for (int axis = 0; axis < 3; ++axis) {
        F8 lo = F8::All(kLargestFinite), hi = F8::All(-kLargestFinite);
        for (int r = r0; r <= r1; ++r) {
          const float* row = planes[axis] + static_cast<std::size_t>(r) * kLanes * static_cast<std::size_t>(g.slots);
          for (int s = s0; s < s1; ++s) {
            const F8 v = F8::Load(row + kLanes * s);
            lo = Min(lo, v);
            hi = Max(hi, v);
          }
          const F8 edge = s1 < g.slots ? F8::Load(row + kLanes * s1) : RotateDown(F8::Load(row));
          lo = Min(lo, edge);
          hi = Max(hi, edge);
        }
        lo.Store(bounds.lo[axis] + out);
        hi.Store(bounds.hi[axis] + out);
      }
    }
  }
}

constexpr collision::Kernels MakeKernels(const char* name) { return {name, ComputeBlockBounds, FirstTouch, Feet}; }

}  // namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE
