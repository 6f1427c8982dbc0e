// What a substep of mode accurate would be on a GPU, stage by stage: counted from ImplicitSolver's stages, not
// measured. And a model of its time.
#pragma once

#include <string>
#include <vector>

#include "tests/benchmark/gpu_prototype/host_case.h"

namespace fulcrum::physics::gpu_prototype {

struct StageCost {
  std::string name;
  int launches = 0;  ///< One for each loop of the host that writes other data.
  int phases = 0;    ///< Of which each must wait for the one before; with loops of one phase fused, the launches.
  double bytes = 0;  ///< Read and written once each; neighbours come from a cache.
  double flops = 0;  ///< Counted in the source, to about a quarter.
};

/// Of a substep with `iterations` of conjugate gradients, of the tissue that is awake, without contacts, line search
/// and energies.
[[nodiscard]] std::vector<StageCost> CostOfSubstep(const HostCase& host, int iterations);
[[nodiscard]] StageCost SumOf(const std::vector<StageCost>& stages);
/// Bytes that cross to the host a step when the solve is on the device and all else is not: all positions.
[[nodiscard]] double BytesOut(const HostCase& host);

/// A model, not a measurement: launches one after the other, the bytes at the device's bandwidth, round trips to the
/// host in between.
struct GpuModel {
  double launch_us = 5;  ///< From one dependent launch to the next.
  double bandwidth_GB_s = 500;
  double round_trip_us = 20;  ///< A result that the host waits for, and the next launch.
  double link_GB_s = 12;      ///< Between host and device.
};
[[nodiscard]] double SubstepUs(const GpuModel& model, double launches, double bytes, int round_trips);

}  // namespace fulcrum::physics::gpu_prototype
