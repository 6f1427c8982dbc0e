// What a restarted physics node continues from, as bytes: positions now and one step before, tools and grasps,
// what has torn. Topology is not in it: TopologyState brings it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "physics_node/simulation/tissue_simulation.h"

namespace fulcrum::physics {

/// Grows with any change of the layout below.
inline constexpr std::uint32_t kCheckpointLayout = 3;

[[nodiscard]] std::size_t CheckpointCapacity(Index particle_count);

/// What the node itself remembers, beside the simulation.
struct NodeMemory {
  float max_displacement_m = 0;
  double contact_time_s = 0;  ///< Session time at which the tools were where they are for the tissue.
};

/// Fills `slot`, at least CheckpointCapacity() long; returns the bytes used.
std::size_t WriteCheckpoint(const TissueSimulation& simulation, const NodeMemory& memory, std::span<std::byte> slot);

/// How many steps had been made when it was written; 0 when the bytes are no checkpoint.
[[nodiscard]] std::uint64_t CheckpointSteps(std::span<const std::byte> payload);

/// Puts the simulation where the checkpoint was. Nothing, and the simulation as it was, when the bytes do not fit.
std::optional<NodeMemory> ReadCheckpoint(std::span<const std::byte> payload, TissueSimulation* simulation);

}  // namespace fulcrum::physics
