// Value types of the topics. Nodes use these and never a generated type: services/transport/bus/convert converts them
// to IDL.
//
// Conventions: SI units; world frame W right-handed, z up, metres; a tool frame T has its origin at the tip and +z
// along the shaft from the handle towards the tip; quaternions are unit, (w, x, y, z) in IDL. Each field is described
// again in its IDL file; rate, QoS and owner are in idl/README.md.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "services/base/core/footprint.h"
#include "services/base/core/types.h"

namespace fulcrum {

inline constexpr int kMaxTools = 4;                 ///< Devices, handles and tools on one cart.
inline constexpr int kMaxContacts = 4;              ///< Contacts per tool in a ContactModel.
inline constexpr int kMaxTissueVertices = 250'000;  ///< Of a TissueFrame.
inline constexpr int kMaxMembraneNodes = 250'000;   ///< Of a TopologyState.
inline constexpr int kPatchTexels = 256;            ///< Edge of a TemperaturePatch.
inline constexpr int kAtlasTexels = 4096;           ///< Edge of the atlas.

/// A place for each tool, at the origin.
inline std::array<Vec3f, kMaxTools> AtOrigin() {
  std::array<Vec3f, kMaxTools> places;
  places.fill(Vec3f::Zero());
  return places;
}

/// Identifies one sample of one writer.
struct Stamp {
  std::uint64_t sequence = 0;  ///< Starts at 1 and grows by 1 per sample of this writer.
  std::uint64_t epoch = 0;     ///< CLOCK_MONOTONIC [ns] when the writer started: grows with each restart.
  std::int64_t stamp_ns = 0;   ///< CLOCK_MONOTONIC of the data [ns].
};

enum class NodeId : std::uint8_t { kSupervisor, kHandleBridge, kHaptics, kPhysics, kThermal, kRender, kRecorder };
inline constexpr int kNodeCount = 7;
/// "supervisor", "handle_bridge", "haptics_node", ...: the name of the executable.
const char* NodeName(NodeId node);

// ---------------------------------------------------------------------------------------------- HandleState

enum PedalBits : std::uint8_t { kPedalNone = 0, kPedalCut = 1, kPedalCoag = 2, kPedalBlend = 4 };

struct HandleSample {
  bool present = false;
  float jaw_angle_rad = 0;  ///< 0 closed to about 1.05 open.
  float jaw_rate_rad_s = 0;
  float quality = 0;  ///< 0 unusable to 1: every line of the last half second was valid.
  std::uint16_t raw_counts = 0;
};

struct HandleState {
  Stamp stamp;
  std::array<HandleSample, kMaxTools> handles;
  std::uint8_t pedals = kPedalNone;  ///< PedalBits.
};

// ------------------------------------------------------------------------------------------ GeneratorSetting

enum class CauteryMode : std::uint8_t { kOff, kCut, kCoag, kBlend };

inline constexpr float kMaxSetPower_W = 300.0f;  ///< Largest power of a GeneratorSetting.

/// Settings of the electrosurgical generator's panel, by mode [W].
struct GeneratorSetting {
  Stamp stamp;  ///< stamp_ns: time from which it applies.
  float cut_W = 0;
  float coag_W = 0;
  float blend_W = 0;
};

// -------------------------------------------------------------------------------------------- OperatorInput

enum class OperatorSource : std::uint8_t { kNone, kWindow, kProgram, kBrowser };

struct OperatorTool {
  Vec3f p_WT = Vec3f::Zero();  ///< Intended place of the tip [m].
  float jaw_angle_rad = 0;     ///< Intended angle, 0 closed to about 1.05 open.
  float roll_rad = 0;          ///< Intended rotation about the shaft, clockwise as seen from the handle.
  bool moves = false;          ///< The source operates this tool.
};

/// Intention of an operator without a haptic device.
struct OperatorInput {
  Stamp stamp;
  std::int64_t claim_ns = 0;  ///< CLOCK_MONOTONIC at which the source took the controls [ns]; 0: released.
  std::array<OperatorTool, kMaxTools> tools;
  std::uint8_t pedals = kPedalNone;  ///< PedalBits.
  OperatorSource source = OperatorSource::kNone;
};

// ------------------------------------------------------------------------------------------------ ToolState

/// The jaw of a scope is the zoom ring of its camera head: 0 wide (services/base/core/scope.h). That of a suction and
/// irrigation tube is its trumpet valve (services/base/core/suction.h).
enum class ToolKind : std::uint8_t { kNone, kGrasper, kHook, kScissors, kScope, kSuction, kClipApplier };
/// A scope is held clear of the tissue: nothing collides with it.
constexpr bool TouchesTissue(ToolKind kind) { return kind != ToolKind::kNone && kind != ToolKind::kScope; }

enum class ServoState : std::uint8_t { kOff, kNormal, kHold, kFade, kRise };

struct ToolSample {
  ToolKind kind = ToolKind::kNone;
  ServoState state = ServoState::kOff;
  Vec3f p_WT = Vec3f::Zero();  ///< Tip (proxy of the virtual coupling) [m].
  Quatf q_WT = Quatf::Identity();
  Vec3f v_WT = Vec3f::Zero();  ///< Tip velocity [m/s].
  Vec3f w_WT = Vec3f::Zero();  ///< Angular velocity [rad/s].
  Vec3f f_W = Vec3f::Zero();   ///< Force sent to the hand, at the tip, after all limits [N].
  float model_age_s = 0;       ///< Age of the contact model in use [s].
  std::uint8_t buttons = 0;    ///< Bit per pressed button of the device; bit 0: the one nearest to the tip.
};

struct ToolState {
  Stamp stamp;
  std::array<ToolSample, kMaxTools> tools;
};

// ---------------------------------------------------------------------------------------------- TissueFrame

struct TissueFrameHeader {
  Stamp stamp;
  std::uint64_t scene_hash = 0;
  std::uint64_t topology_revision = 0;  ///< Revision that these positions respect.
  std::uint64_t tool_sequence = 0;      ///< Sequence of the consumed ToolState.
  std::uint64_t handle_sequence = 0;    ///< Sequence of the consumed HandleState.
  double session_time_s = 0;
  double simulated_time_s = 0;  ///< Simulated time of these positions; breathing surfaces are placed for this time.
  double next_within_s = 0;     ///< At most until the next frame; longer at rest.
  std::uint32_t vertex_count = 0;
  /// Bit per tool: the grasper holds tissue.
  std::uint32_t grasping_tools = 0;
};

/// Positions of all simulated particles in scene order [m], x y z interleaved. A reader gets them rounded to multiples
/// of kTissueStep_m (tissue_blocks.h).
struct TissueFrame {
  TissueFrameHeader header;
  std::vector<float> xyz;
  struct View {
    TissueFrameHeader& header;
    std::vector<float>& xyz;  ///< To be resized to 3 * vertex_count.
  };
};

// --------------------------------------------------------------------------------------------- ContactModel

enum class ContactKind : std::uint8_t { kNone, kSurface, kGrasp };

/// Local model of one contact, evaluated by the servo at 1 kHz between two messages. All in frame W, SI.
struct Contact {
  ContactKind kind = ContactKind::kNone;
  std::uint32_t id = 0;         ///< Stays the same while the contact lasts.
  Vec3f x_ref = Vec3f::Zero();  ///< Tool tip at which f_ref was measured [m].
  Vec3f f_ref = Vec3f::Zero();  ///< Force of the tissue on the tool at x_ref [N].
  Vec3f n = Vec3f::UnitZ();     ///< Outward surface normal.
  Vec3f e1 = Vec3f::UnitX();    ///< First principal tangent.
  Vec3f p_s = Vec3f::Zero();    ///< Point of the surface as it would be without this tool [m].
  Vec3f v_s = Vec3f::Zero();    ///< Its velocity [m/s].
  Vec3f u_c = Vec3f::Zero();    ///< Tissue displacement at the contact [m].
  Vec3f du_c = Vec3f::Zero();   ///< Its rate [m/s].
  float gap = 0;                ///< > 0 before touch [m].
  float k1 = 0;                 ///< Linear skin stiffness [N/m].
  float k3 = 0;                 ///< Cubic skin stiffness [N/m^3].
  float kt = 0;                 ///< Tangential stiffness [N/m].
  float k_body = 0;             ///< Elastic stiffness of the bulk, Kb [N/m].
  float b_body = 0;             ///< Viscosity of the bulk, Bb [N s/m].
  float friction = 0;
  float kappa1 = 0, kappa2 = 0;  ///< Principal curvatures [1/m].
  float slip_force = 0;          ///< Above this force the grasp slips off [N].
  float radius = 0;              ///< The model is valid within this distance of x_ref [m].
};

struct DeviceContacts {
  std::uint32_t count = 0;
  float p_ext_W = 0;      ///< Largest power that the tissue may supply from outside [W].
  float force_cap_N = 0;  ///< Upper limit of the force.
  std::array<Contact, kMaxContacts> contacts;
};

struct ContactModel {
  Stamp stamp;
  std::uint64_t tool_sequence = 0;  ///< ToolState for which it was computed.
  std::int64_t tool_stamp_ns = 0;   ///< Stamp of that ToolState: t_s of the model [ns].
  float physics_dt_s = 0;
  std::array<DeviceContacts, kMaxTools> devices;
};

// ------------------------------------------------------------------------------------------- CauteryContact

/// Position of the active electrode's metal. Its current follows from HandleState and GeneratorSetting
/// (services/base/core/generator_inputs.h).
struct CauteryContact {
  Stamp stamp;
  double session_time_s = 0;
  std::uint64_t topology_revision = 0;
  bool touching = false;  ///< The metal touches the membrane, or is close enough for an arc.
  bool tented = false;    ///< Membrane lifted off the tissue beneath.
  bool on_solid = false;  ///< The metal touches no membrane, but the surface of a solid.
  std::uint8_t tool = 0;
  /// Membrane triangle: 2 * cell + half, cell = row * (cols-1) + col; on a solid: of TissueScene::tube_surface.
  std::uint32_t triangle = kNoIndex;
  std::array<float, 3> barycentric{0, 0, 0};
  /// (s, t) of the contact's centre on the rest sheet, or in the charts of the solids (solid_charts.h) [m].
  Vec2f material = Vec2f::Zero();
  Vec2f material_rate = Vec2f::Zero();  ///< Its rate of change [m/s].
  float contact_radius_m = 0;           ///< Radius of the metal about its axis.
  Footprint footprint;                  ///< Footprint of the bare metal on the deformed membrane or solid.
};

// -------------------------------------------------------------------------------------------- TopologyState

/// Complete state of cuts and shrinkage. Membrane node = row * cols + col; edge = 3 * node + direction with direction 0
/// to (row, col+1), 1 to (row+1, col), 2 to (row+1, col+1).
struct TopologyState {
  Stamp stamp;
  std::uint64_t scene_hash = 0;
  std::uint64_t revision = 0;  ///< 0: no change so far.
  std::uint32_t rows = 0;
  std::uint32_t cols = 0;
  float cut_length_m = 0;
  float cut_width_m = 0;    ///< Width of the slit, 95th percentile along it.
  float cut_off_way_m = 0;  ///< Distance of the slit's centre line from the path of the metal, 95th percentile.
  std::vector<std::uint8_t> dead_nodes;  ///< Bit field, rows * cols bits, least significant bit first.
  std::vector<std::uint8_t> dead_edges;  ///< Bit field, 3 * rows * cols bits.
  std::vector<std::uint8_t> shrink;      ///< Per edge: the rest length is multiplied by 1 - kShrinkUnit * value.
};
inline constexpr float kShrinkUnit = 0.002f;

/// Complete state of what traction has torn since the start of the session. The owner of the topology severs these
/// edges; they hold until TopologyState contains them.
struct TearState {
  Stamp stamp;
  std::uint64_t scene_hash = 0;
  std::uint32_t rows = 0;
  std::uint32_t cols = 0;
  std::vector<std::uint8_t> torn_edges;  ///< Bit field, 3 * rows * cols bits, as TopologyState::dead_edges.
};

inline constexpr int kOpenWindow = 64;  ///< Edge length of OpenCells [cells].

/// Cells of the membrane around the hook that are gone. A cut opens cells long before it severs the edges of the mesh
/// to which they belong.
struct OpenCells {
  Stamp stamp;
  std::uint64_t scene_hash = 0;
  std::int32_t x = 0, y = 0;                      ///< floor(s / cell_m), floor(t / cell_m) of the first cell.
  std::array<std::uint64_t, kOpenWindow> rows{};  ///< Bit per cell.

  [[nodiscard]] bool IsOpen(std::int32_t ix, std::int32_t iy) const {
    const std::int64_t i = std::int64_t{ix} - x, j = std::int64_t{iy} - y;
    return i >= 0 && j >= 0 && i < kOpenWindow && j < kOpenWindow &&
           ((rows[static_cast<std::size_t>(j)] >> static_cast<unsigned>(i)) & 1u) != 0;
  }
};

// ------------------------------------------------------------------------------------------------ ClipState

inline constexpr int kMaxClips = 16;  ///< Clips in a session.

/// A clip on the tissue, placed relative to three of its vertices: services/base/core/clips.h.
struct Clip {
  Vec3f p_AC = Vec3f::Zero();  ///< Middle of the clip [m].
  Quatf q_AC = Quatf::Identity();
  std::array<std::uint32_t, 3> anchors{0, 1, 2};  ///< Vertices of the tissue in the order of TissueFrame.
  float length_m = 0;                             ///< Along z of C.
  std::uint8_t tool = 0;                          ///< That applied it.
};

/// All clips on the tissue, in the order in which they were applied.
struct ClipState {
  Stamp stamp;
  std::uint64_t scene_hash = 0;
  std::uint32_t count = 0;
  std::array<Clip, kMaxClips> clips;
};

inline bool TestBit(std::span<const std::uint8_t> bits, std::size_t i) { return (bits[i >> 3] >> (i & 7u)) & 1u; }
inline void SetBit(std::span<std::uint8_t> bits, std::size_t i) {
  bits[i >> 3] = static_cast<std::uint8_t>(bits[i >> 3] | (1u << (i & 7u)));
}

// ----------------------------------------------------------------------------------------- TemperaturePatch

/// What can be burnt, each with an atlas of its own.
enum class BurntSurface : std::uint16_t { kMembrane, kSolids };

struct TemperaturePatchHeader {
  Stamp stamp;
  std::uint64_t topology_revision = 0;
  std::uint16_t slot = 0;  ///< Index of the hot spot; a slot is reused when its spot has gone cold.
  BurntSurface surface = BurntSurface::kMembrane;
  std::uint32_t origin_x = 0;  ///< Texel of the atlas where the patch begins (s direction).
  std::uint32_t origin_y = 0;  ///< The same in the t direction.
  float max_temperature_C = 0;
};

/// 256 x 256 texels of four bytes, row by row (t slow, s fast):
/// temperature (20 °C + value * 0.5 K), damage (255 * (1 - exp(-Omega_collagen))), dryness and char (0 wet, 128 dry,
/// 255 char), alive (255) or removed (0).
struct TemperaturePatch {
  TemperaturePatchHeader header;
  std::vector<std::uint8_t> texels;
  struct View {
    TemperaturePatchHeader& header;
    std::span<std::uint8_t> texels;  ///< 4 * 256 * 256.
  };
};

// -------------------------------------------------------------------------------------------------- Picture

inline constexpr std::size_t kMaxPictureBytes = 512 * 1024;

/// A picture of the laparoscope with what shows where a pixel lies in W.
/// With stereo (`render.stereo` of the scene) the eye is in the middle of the two, and pixels are those of an eye's
/// part stretched to the whole picture.
struct PictureHeader {
  Stamp stamp;                                            ///< Time of the shown ToolState.
  double session_time_s = 0;                              ///< Session time at which it was drawn.
  std::uint64_t tool_sequence = 0;                        ///< Sequence of the shown ToolState; 0: none yet.
  std::uint64_t tissue_sequence = 0;                      ///< Sequence of the shown TissueFrame.
  std::uint32_t width = 0;                                ///< [pixels]
  std::uint32_t height = 0;                               ///< [pixels]
  std::uint32_t size = 0;                                 ///< Used bytes of `jpeg`.
  std::uint16_t present = 0;                              ///< Bit per tool: a person can operate it.
  std::uint16_t scopes = 0;                               ///< Bit per tool: it is a scope.
  Vec3f eye_W = Vec3f::Zero();                            ///< Place of the eye [m].
  Vec3f right_W = Vec3f::UnitX(), up_W = Vec3f::UnitZ();  ///< Unit vectors of the picture.
  Vec3f forward_W = Vec3f::UnitY();                       ///< Unit vector of the view.
  float pixel_rad = 1e-3f;                                ///< Angle of a pixel in the middle [rad].
  std::array<Vec3f, kMaxTools> tip_W = AtOrigin();        ///< Tips of the shown tools [m].
  float scale = 1;                                        ///< Drawn size over that of the picture.
};

struct Picture {
  PictureHeader header;
  std::vector<std::uint8_t> jpeg;
  struct View {
    PictureHeader& header;
    std::span<std::uint8_t> jpeg;  ///< kMaxPictureBytes.
  };
};

// --------------------------------------------------------------------------------------------- ThermalEvent

enum class ThermalEventKind : std::uint8_t {
  kContact,
  kBlanch,
  kSteam,
  kCut,
  kChar,
  kUreterWarning,
  kUreterInjury,
  kNerveWarning,
  kNerveInjury,
  kQuarantine,
  kSolidBurn
};
inline constexpr std::size_t kThermalEventKinds = 11;
inline constexpr std::uint8_t kNoSolid = 255;

struct ThermalEvent {
  Stamp stamp;
  double session_time_s = 0;
  ThermalEventKind kind = ThermalEventKind::kContact;
  Vec2f material = Vec2f::Zero();  ///< Place on the membrane (s, t), with `solid` in the charts of the solids [m].
  float temperature_C = 0;
  /// Kind-specific: cut length so far [m] for kCut, damage integral for injuries, the solid's dead area [m^2] for
  /// kSolidBurn.
  float value = 0;
  /// What was burnt, for kSolidBurn and for warnings and injuries of a solid: index in TissueScene::solids, 0 in a
  /// scene of one organ.
  std::uint8_t solid = kNoSolid;
  std::uint64_t topology_revision = 0;
};

// --------------------------------------------------------------------------- SceneManifest, TickManifest

enum class SessionMode : std::uint8_t { kLive, kLockStep };

struct SceneManifest {
  Stamp stamp;
  std::string scene_name;
  std::string session_id;
  std::uint64_t scene_hash = 0;
  std::int64_t session_start_ns = 0;  ///< CLOCK_MONOTONIC at session time 0 [ns].
  SessionMode mode = SessionMode::kLive;
  /// The session has a recorder: a new process waits until the recorder has discovered it before it begins.
  bool recorded = false;
};

/// Every message, M(T) each, in the order of the topics' numbers: a new one is added at the end. Everything that treats
/// all messages alike is made from this list: TopicId, the roles (services/transport/bus/topics.h), the gate's
/// declarations, the ports.
// clang-format off
#define FULCRUM_MESSAGES(M) \
  M(HandleState) M(ToolState) M(TissueFrame) M(ContactModel) M(CauteryContact) M(TopologyState) \
  M(TemperaturePatch) M(ThermalEvent) M(SceneManifest) M(TickManifest) \
  M(Health) M(TearState) M(OpenCells) M(GeneratorSetting) M(OperatorInput) M(Picture) \
  M(ClipState)
// clang-format on

#define FULCRUM_TOPIC_ID(T) k##T,
enum class TopicId : std::uint8_t { FULCRUM_MESSAGES(FULCRUM_TOPIC_ID) };
#undef FULCRUM_TOPIC_ID
#define FULCRUM_ONE_MORE(T) +1
inline constexpr int kTopicCount = 0 FULCRUM_MESSAGES(FULCRUM_ONE_MORE);
#undef FULCRUM_ONE_MORE

struct ConsumedInput {
  TopicId topic = TopicId::kHandleState;
  std::uint64_t epoch = 0;
  std::uint64_t sequence = 0;  ///< 0: none yet.
};

struct TickManifest {
  Stamp stamp;
  NodeId node = NodeId::kPhysics;
  std::uint64_t tick = 0;
  double session_time_s = 0;
  std::uint64_t state_hash = 0;
  std::vector<ConsumedInput> consumed;  ///< At most kMaxConsumedInputs of services/transport/bus/gate.h.
  /// Of haptics_node: CLOCK_MONOTONIC of each tick after the manifest before, the last one of this tick [ns]; at most
  /// kMaxTickTimes.
  std::vector<std::int64_t> tick_times_ns;
};

// --------------------------------------------------------------------------------------------------- Health

enum class HealthState : std::uint8_t { kStarting, kWaiting, kRunning, kDegraded, kStopping };

struct TimingSummary {
  float p50_us = 0, p99_us = 0, max_us = 0;
};

struct InputHealth {
  TopicId topic = TopicId::kHandleState;
  bool matched = false;  ///< A writer is alive.
  float age_ms = 0;      ///< Age of the newest sample; negative before the first.
  std::uint64_t received = 0;
  std::uint64_t lost = 0;      ///< Gaps in the sequence.
  std::uint64_t rejected = 0;  ///< Dropped at the gate (not finite, out of range, wrong scene).
};

/// A named figure of a node, for example "peak_force_N" or "cut_length_mm".
struct Metric {
  std::string name;  ///< At most 31 characters, unit as suffix.
  double value = 0;
};

struct Health {
  Stamp stamp;
  NodeId node = NodeId::kSupervisor;
  HealthState state = HealthState::kStarting;
  std::int32_t pid = 0;
  std::uint64_t schema_hash = 0;
  std::uint64_t scene_hash = 0;
  float rate_asked_Hz = 0;
  float rate_achieved_Hz = 0;  ///< Mean over the last second.
  std::uint64_t ticks = 0;
  std::uint64_t overruns = 0;  ///< Periods skipped since the start.
  std::uint64_t write_failures = 0;
  TimingSummary step;               ///< Duration of the step, since the start.
  TimingSummary wake;               ///< Lateness of the wake-up, since the start.
  std::string last_error;           ///< At most 255 characters; empty if there is no error.
  std::vector<InputHealth> inputs;  ///< At most 16.
  std::vector<Metric> metrics;      ///< At most 28.
};

}  // namespace fulcrum
