// Bodies of the kernels of collision detection; compiled for each instruction set.
#pragma once

#include "physics_node/collision/kernels.h"
#include "physics_node/collision/touch_impl.h"
#include "physics_node/simd/lanes.h"

namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE {

void ComputeBlockBounds(const GridArrays& g, const BlockBounds& bounds) {
  const float* planes[3] = {g.x, g.y, g.z};
  const int cell_rows = g.rows > 1 ? g.rows - 1 : 1;
  std::size_t out = 0;
  for (int r0 = 0; r0 < cell_rows; r0 += 8) {
    const int r1 = r0 + 8 < g.rows ? r0 + 8 : g.rows - 1;
    for (int s0 = 0; s0 < g.slots; s0 += 8, out += 8) {
      const int s1 = s0 + 8 < g.slots ? s0 + 8 : g.slots;  // Inclusive when it is a slot, else the wrap.
      for (int axis = 0; axis < 3; ++axis) {
        F8 lo = F8::All(3e38f), hi = F8::All(-3e38f);
        for (int r = r0; r <= r1; ++r) {
          const float* row = planes[axis] + static_cast<std::size_t>(r) * 8 * static_cast<std::size_t>(g.slots);
          for (int s = s0; s < s1; ++s) {
            const F8 v = F8::Load(row + 8 * s);
            lo = Min(lo, v);
            hi = Max(hi, v);
          }
          const F8 edge = s1 < g.slots ? F8::Load(row + 8 * s1) : RotateDown(F8::Load(row));
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
