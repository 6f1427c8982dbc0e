// Checkpoint of a physics node as bytes: positions now and one step before, tools and grasps, torn edges,
// clips. The topology is not part of it: it comes from TopologyState.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "physics_node/simulation/tissue_simulation.h"

namespace fulcrum::physics {

/// Increased with any change of the layout.
inline constexpr std::uint32_t kCheckpointLayout = 4;

[[nodiscard]] std::size_t CheckpointCapacity(Index particle_count);

/// State of the node outside of the simulation.
struct NodeMemory {
  float max_displacement_m = 0;
  double contact_time_s = 0;  ///< Session time of the poses that the tissue has reached.
};

/// Fills `slot`, at least CheckpointCapacity() long; returns the bytes used.
std::size_t WriteCheckpoint(const TissueSimulation& simulation, const NodeMemory& memory, std::span<std::byte> slot);

/// Periods simulated at the time of writing; 0 if the bytes are no checkpoint.
[[nodiscard]] std::uint64_t CheckpointPeriods(std::span<const std::byte> payload);

/// Restores the simulation. No value, with the simulation unchanged, if the bytes do not fit.
std::optional<NodeMemory> ReadCheckpoint(std::span<const std::byte> payload, TissueSimulation* simulation);

}  // namespace fulcrum::physics
