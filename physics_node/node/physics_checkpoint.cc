#include "physics_node/node/physics_checkpoint.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <iterator>

namespace fulcrum::physics {
namespace {

struct ToolRecord {
  float p_WT[3];
  float q_WT[4];  ///< w x y z.
  float jaw_rad;
  std::uint32_t known;
  std::uint32_t grasp_state;
  std::uint32_t held_count;
};
struct HeldRecord {
  std::uint32_t particle;
  float p_T[3];
};
struct ClipRecord {
  float p_AC[3];
  float q_AC[4];  ///< w x y z.
  float q_WC[4];
  float length_m;
  std::uint32_t anchors[3];
  std::uint32_t tool;
  std::uint32_t particle_count;
};
struct ClippedRecord {
  std::uint32_t particle;
  float p_C[3];
};
struct Header {
  std::uint64_t periods;
  std::uint32_t particle_count;
  float max_displacement_m;
  double contact_time_s;
  std::uint32_t torn_bytes;       ///< 0: nothing has torn.
  std::uint32_t further_periods;  ///< Of the last step, beyond one.
  ToolRecord tools[kMaxTools];
  std::uint32_t clip_count, clips_lost, clips_refused;
  std::uint32_t clipped_count;  ///< Particles of all clips.
};
// Followed by positions, previous positions (3 floats a particle each), then the held particles tool by tool,
// then the bits of the torn edges, then the clips, each followed by its particles.

// Bounds of plausible values, beyond those of any session.
constexpr float kMostCoordinate_m = 10;
constexpr float kMostJaw_rad = 3;
constexpr float kUnitTolerance = 1e-3f;                ///< Of the squared norm of a quaternion, far above rounding.
constexpr std::uint64_t kMostPeriods = 1'000'000'000;  ///< About four months at 100 Hz.

bool IsPlausible(const ToolRecord& tool) {
  const auto within = [](float value, float limit) { return std::abs(value) <= limit; };  // false for NaN
  float norm = 0;
  for (const float q : tool.q_WT) norm += q * q;
  return tool.grasp_state <= static_cast<std::uint32_t>(Grasp::State::kClosedEmpty) &&
         (tool.known == 0 || (std::all_of(std::begin(tool.p_WT), std::end(tool.p_WT),
                                          [&](float x) { return within(x, kMostCoordinate_m); }) &&
                              within(norm - 1, kUnitTolerance) && within(tool.jaw_rad, kMostJaw_rad)));
}

std::byte* Append(const auto& record, std::byte* at) {
  std::memcpy(at, &record, sizeof(record));
  return at + sizeof(record);
}
const std::byte* Take(const std::byte* at, auto* record) {
  std::memcpy(record, at, sizeof(*record));
  return at + sizeof(*record);
}

void Put(const Quatf& q, float* wxyz) {
  wxyz[0] = q.w();
  std::copy_n(q.vec().data(), 3, wxyz + 1);
}
Quatf QuaternionOf(const float* wxyz) { return {wxyz[0], wxyz[1], wxyz[2], wxyz[3]}; }

std::byte* WriteClips(const ClipMemory& memory, std::byte* at) {
  for (const AppliedClip& clip : memory.clips) {
    ClipRecord record{};
    std::copy_n(clip.placed.p_AC.data(), 3, record.p_AC);
    Put(clip.placed.q_AC, record.q_AC);
    Put(clip.q_WC, record.q_WC);
    record.length_m = clip.placed.length_m;
    std::copy(clip.placed.anchors.begin(), clip.placed.anchors.end(), record.anchors);
    record.tool = clip.placed.tool;
    record.particle_count = static_cast<std::uint32_t>(clip.tissue.size());
    at = Append(record, at);
    for (const ClippedParticle& clipped : clip.tissue) {
      at = Append(ClippedRecord{clipped.particle, {clipped.p_C.x(), clipped.p_C.y(), clipped.p_C.z()}}, at);
    }
  }
  return at;
}

/// False: the particles of the clips are not as many as the header says. The bytes are as long as it says.
bool ReadClips(const Header& header, const std::byte* at, ClipMemory* memory) {
  memory->lost = header.clips_lost;
  memory->refused = header.clips_refused;
  std::uint32_t left = header.clipped_count;
  for (std::uint32_t i = 0; i < header.clip_count; ++i) {
    ClipRecord record;
    at = Take(at, &record);
    if (record.particle_count > left || record.tool >= kMaxTools) return false;
    left -= record.particle_count;
    AppliedClip& clip = memory->clips.emplace_back();
    clip.placed.p_AC = Vec3f(record.p_AC[0], record.p_AC[1], record.p_AC[2]);
    clip.placed.q_AC = QuaternionOf(record.q_AC);
    clip.q_WC = QuaternionOf(record.q_WC);
    clip.placed.length_m = record.length_m;
    std::copy_n(record.anchors, 3, clip.placed.anchors.begin());
    clip.placed.tool = static_cast<std::uint8_t>(record.tool);
    for (std::uint32_t k = 0; k < record.particle_count; ++k) {
      ClippedRecord clipped;
      at = Take(at, &clipped);
      clip.tissue.push_back({clipped.particle, Vec3f(clipped.p_C[0], clipped.p_C[1], clipped.p_C[2])});
    }
  }
  return left == 0;
}

std::size_t PositionsBytes(Index particles) { return 3 * sizeof(float) * std::size_t{particles}; }

}  // namespace

std::size_t CheckpointCapacity(Index particle_count) {
  // At most three edges per particle.
  return sizeof(Header) + 2 * PositionsBytes(particle_count) + (3 * std::size_t{particle_count} + 7) / 8 +
         kMaxTools * sizeof(HeldRecord) * std::size_t{particle_count} +
         kMaxClips * (sizeof(ClipRecord) + kMostClipped * sizeof(ClippedRecord));
}

std::size_t WriteCheckpoint(const TissueSimulation& simulation, const NodeMemory& node, std::span<std::byte> slot) {
  const ParticleStore& particles = simulation.particles();
  const Index count = particles.particle_count();
  const SimulationMemory memory = simulation.Save();
  Header header{};
  header.periods = memory.periods;
  header.further_periods = memory.last_periods - 1;
  header.particle_count = count;
  header.max_displacement_m = node.max_displacement_m;
  header.contact_time_s = node.contact_time_s;
  std::byte* at = slot.data() + sizeof(Header) + 2 * PositionsBytes(count);
  for (std::size_t i = 0; i < kMaxTools; ++i) {
    ToolRecord& tool = header.tools[i];
    const ToolPose& pose = memory.pose[i];
    std::copy_n(pose.p_WT.data(), 3, tool.p_WT);
    tool.q_WT[0] = pose.q_WT.w();
    std::copy_n(pose.q_WT.vec().data(), 3, tool.q_WT + 1);
    tool.jaw_rad = pose.jaw_rad;
    tool.known = memory.known[i] ? 1 : 0;
    tool.grasp_state = static_cast<std::uint32_t>(memory.grasp_state[i]);
    tool.held_count = static_cast<std::uint32_t>(memory.held[i].size());
    for (const HeldParticle& held : memory.held[i]) {
      const HeldRecord record{held.particle, {held.p_T.x(), held.p_T.y(), held.p_T.z()}};
      std::memcpy(at, &record, sizeof(record));
      at += sizeof(record);
    }
  }
  header.torn_bytes = static_cast<std::uint32_t>(memory.torn_edges.size());
  std::copy(memory.torn_edges.begin(), memory.torn_edges.end(), reinterpret_cast<std::uint8_t*>(at));
  at += memory.torn_edges.size();
  header.clip_count = static_cast<std::uint32_t>(memory.clips.clips.size());
  header.clips_lost = memory.clips.lost;
  header.clips_refused = memory.clips.refused;
  for (const AppliedClip& clip : memory.clips.clips) {
    header.clipped_count += static_cast<std::uint32_t>(clip.tissue.size());
  }
  at = WriteClips(memory.clips, at);
  std::memcpy(slot.data(), &header, sizeof(header));
  auto* floats = reinterpret_cast<float*>(slot.data() + sizeof(Header));
  particles.CopyPositions({floats, 3 * std::size_t{count}});
  particles.CopyPrevious({floats + 3 * std::size_t{count}, 3 * std::size_t{count}});
  return static_cast<std::size_t>(at - slot.data());
}

std::uint64_t CheckpointPeriods(std::span<const std::byte> payload) {
  Header header{};
  if (payload.size() >= sizeof(header)) {
    std::memcpy(&header, payload.data(), sizeof(header));
  }
  return header.periods;
}

std::optional<NodeMemory> ReadCheckpoint(std::span<const std::byte> payload, TissueSimulation* simulation) {
  Header header;
  if (payload.size() < sizeof(header)) {
    return std::nullopt;
  }
  std::memcpy(&header, payload.data(), sizeof(header));
  const std::size_t floats = 3 * std::size_t{header.particle_count};
  std::size_t size = sizeof(Header) + 2 * PositionsBytes(header.particle_count);
  for (const ToolRecord& tool : header.tools) {
    size += sizeof(HeldRecord) * std::size_t{tool.held_count};
  }
  size += header.torn_bytes;
  size +=
      sizeof(ClipRecord) * std::size_t{header.clip_count} + sizeof(ClippedRecord) * std::size_t{header.clipped_count};
  if (payload.size() != size || header.particle_count != simulation->particles().particle_count() ||
      header.further_periods >= TissueSimulation::kMostStepPeriods || header.periods > kMostPeriods ||
      !(header.max_displacement_m >= 0 && header.max_displacement_m <= kMostCoordinate_m) ||
      !std::isfinite(header.contact_time_s)) {
    return std::nullopt;
  }
  std::vector<float> xyz(floats), previous(floats);
  std::memcpy(xyz.data(), payload.data() + sizeof(Header), floats * sizeof(float));
  std::memcpy(previous.data(), payload.data() + sizeof(Header) + floats * sizeof(float), floats * sizeof(float));
  const std::byte* at = payload.data() + sizeof(Header) + 2 * floats * sizeof(float);
  SimulationMemory memory;
  memory.periods = header.periods;
  memory.last_periods = header.further_periods + 1;
  for (std::size_t i = 0; i < kMaxTools; ++i) {
    const ToolRecord& tool = header.tools[i];
    if (!IsPlausible(tool)) {
      return std::nullopt;
    }
    const Quatf q(tool.q_WT[0], tool.q_WT[1], tool.q_WT[2], tool.q_WT[3]);
    memory.pose[i] = {Vec3f(tool.p_WT[0], tool.p_WT[1], tool.p_WT[2]), q.normalized(), tool.jaw_rad};
    memory.known[i] = tool.known != 0;
    memory.grasp_state[i] = static_cast<Grasp::State>(tool.grasp_state);
    for (std::uint32_t h = 0; h < tool.held_count; ++h, at += sizeof(HeldRecord)) {
      HeldRecord record;
      std::memcpy(&record, at, sizeof(record));
      memory.held[i].push_back({record.particle, Vec3f(record.p_T[0], record.p_T[1], record.p_T[2])});
    }
  }
  const auto* torn = reinterpret_cast<const std::uint8_t*>(at);
  memory.torn_edges.assign(torn, torn + header.torn_bytes);
  if (!ReadClips(header, at + header.torn_bytes, &memory.clips)) {
    return std::nullopt;
  }
  if (!simulation->Restore(xyz, previous, memory)) {
    return std::nullopt;
  }
  simulation->LetStillBodiesSleep();
  return NodeMemory{header.max_displacement_m, header.contact_time_s};
}

}  // namespace fulcrum::physics
