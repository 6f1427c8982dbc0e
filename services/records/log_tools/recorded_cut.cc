#include "services/records/log_tools/recorded_cut.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <map>
#include <optional>
#include <type_traits>

#include "services/base/core/error.h"
#include "services/base/core/generator_inputs.h"
#include "services/base/core/sheet_heat.h"
#include "services/records/log_tools/deformed_sheet.h"
#include "services/records/log_tools/recording.h"
#include "services/records/recording/recorded_scene.h"
#include "services/transport/bus/gate.h"
#include "services/transport/bus/input_account.h"

namespace fulcrum::log_tools {
namespace {

/// Distance between two samples of the metal's axis [m].
constexpr float kAxisStep_m = 0.25e-3f;
/// Length of the bare part of the neck, from the heel upwards [m].
constexpr float kBareNeck_m = 5e-3f;
/// Time for which a CauteryContact applies after its own time: five of its periods [s].
constexpr double kCurrentHolds_s = 0.05;
/// Longest gap over which a pose is interpolated [ns].
constexpr std::int64_t kPoseGap_ns = 50'000'000;

struct Pose {
  std::int64_t stamp_ns = 0;
  Vec3f p_WT = Vec3f::Zero();
  Quatf q_WT = Quatf::Identity();
};

/// Largest distance on the sheet between successive places of one contact along the metal [m].
constexpr float kSameContact_m = 1e-3f;
/// A contact continues in the next frame if its centre has moved no farther than this [m] and its weight is at least
/// this share of the strongest contact's.
constexpr float kContactStep_m = 2e-3f, kStillTouches = 0.2f;

/// Samples of the bare metal's axis in frame T: from the end of the foot along -x to the heel, up the neck along -z.
std::vector<Vec3f> MetalAxis(const ToolDescription& tool) {
  std::vector<Vec3f> axis;
  const auto steps = [](float length) { return std::max(1, static_cast<int>(std::lround(length / kAxisStep_m))); };
  const int foot = steps(tool.tip_length_m), neck = steps(kBareNeck_m);
  for (int i = foot; i > 0; --i) {
    axis.emplace_back(tool.tip_length_m * static_cast<float>(i) / static_cast<float>(foot), 0.0f, 0.0f);
  }
  for (int i = 0; i <= neck; ++i) {
    axis.emplace_back(0.0f, 0.0f, -kBareNeck_m * static_cast<float>(i) / static_cast<float>(neck));
  }
  return axis;
}

SheetTexels TexelsOf(const SceneView& scene) {
  SheetTexels texels;
  texels.texel_m = static_cast<double>(scene.membrane.texel_m);
  Vec2f low = scene.membrane_material.front(), high = low;
  for (const Vec2f& place : scene.membrane_material) {
    low = low.cwiseMin(place);
    high = high.cwiseMax(place);
  }
  const auto texel = [&](float metres) { return static_cast<int>(std::floor(metres / scene.membrane.texel_m)); };
  texels.x0 = texel(low.x());
  texels.y0 = texel(low.y());
  texels.width = texel(high.x()) + 1 - texels.x0;
  texels.height = texel(high.y()) + 1 - texels.y0;
  const std::size_t count = static_cast<std::size_t>(texels.width) * static_cast<std::size_t>(texels.height);
  texels.removed.assign(count, 0);
  texels.damage.assign(count, 0);
  texels.temperature.assign(count, 0);
  texels.removed_s.assign(count, std::numeric_limits<float>::infinity());
  return texels;
}

/// Heat that warms the wet sheet from body temperature to steam, without losses.
double VaporisingHeat_J_m(const ThermalParams& thermal, float width_m) {
  constexpr float kBoiling_C = 100.0f;
  const float warm_J_m3 =
      thermal.density_kg_m3 * thermal.heat_capacity_J_kgK * (kBoiling_C - thermal.body_temperature_C);
  return static_cast<double>(width_m * thermal.thickness_m * (warm_J_m3 + thermal.latent_heat_J_m3));
}

/// Processes the messages of a session in the order of the recording.
class Reader {
 public:
  Reader(const SceneView& scene, const ContactReach& reach) : sheet_(scene) {
    const std::optional<std::size_t> hook = FindTool(scene.tools, ToolKind::kHook);
    if (!hook) throw InputError(std::string("scene \"") + scene.name + "\" has no hook: nothing in it can cut");
    if (scene.membrane.node_count() == 0) {
      throw InputError(std::string("scene \"") + scene.name + "\" has no sheet: nothing in it can be cut");
    }
    tool_ = *hook;
    const ToolDescription& tool = scene.tools[tool_];
    axis_ = MetalAxis(tool);
    const float margin_m = scene.physics.collision_margin_m;
    reach_ = reach;
    for (const SheetPart& sheet : SheetsOf(scene)) {
      const ThermalParams thermal = ThermalOf(sheet, scene.thermal);
      const float skin_m = reach.with_collision_margin ? margin_m : std::min(margin_m, 0.5f * thermal.thickness_m);
      touch_m_.push_back(tool.tip_radius_m + skin_m);
      vaporising_J_m_.push_back(VaporisingHeat_J_m(thermal, 2 * tool.tip_radius_m));
    }
    limit_m_ = *std::max_element(touch_m_.begin(), touch_m_.end()) + reach.holds_m;
    cut_.texels = TexelsOf(scene);
  }

  void Begin(const SceneManifest& session) {
    start_ns_ = session.session_start_ns;
    cut_.session_id = session.session_id;
  }

  void Add(const ToolState& state) {
    const ToolSample& sample = state.tools[tool_];
    poses_.push_back({state.stamp.stamp_ns, sample.p_WT, sample.q_WT.normalized()});
    Settle(false);
  }

  void Add(const TissueFrame& frame) {
    if (frame.header.session_time_s < 0) return;
    waiting_.push_back(frame);
    Settle(false);
  }

  void Add(const CauteryContact& contact) {
    if (contact.tool != tool_) return;
    cut_.current.push_back({contact.session_time_s, contact.touching, CauteryMode::kOff, 0, contact.material});
  }

  void Add(const HandleState& state) { generator_.Add(state); }
  void Add(const GeneratorSetting& setting) { generator_.Add(setting); }

  void Add(const TopologyState& topology) {
    dead_nodes_ = topology.dead_nodes;
    dead_edges_ = topology.dead_edges;
    topology_changed_ = true;
    const double time_s = 1e-9 * static_cast<double>(topology.stamp.stamp_ns - start_ns_);
    cut_.lengths.push_back({time_s, static_cast<double>(topology.cut_length_m)});
  }

  void Add(const TemperaturePatch& patch) {
    if (patch.header.surface != BurntSurface::kMembrane) return;
    if (patch.texels.size() < std::size_t{4} * kPatchTexels * kPatchTexels) return;
    SheetTexels& texels = cut_.texels;
    const double time_s = 1e-9 * static_cast<double>(patch.header.stamp.stamp_ns - start_ns_);
    for (int y = 0; y < kPatchTexels; ++y) {
      const int row = static_cast<int>(patch.header.origin_y) + y - texels.y0;
      if (row < 0 || row >= texels.height) continue;
      for (int x = 0; x < kPatchTexels; ++x) {
        const int column = static_cast<int>(patch.header.origin_x) + x - texels.x0;
        if (column < 0 || column >= texels.width) continue;
        const std::uint8_t* texel = &patch.texels[4 * (static_cast<std::size_t>(y) * kPatchTexels + x)];
        const std::size_t i = texels.Index(column, row);
        const std::uint8_t removed = texel[3] == 0 ? 1 : 0;
        if (removed != 0 && !first_removed_s_) first_removed_s_ = time_s;
        if (removed != 0) texels.removed_s[i] = std::min(texels.removed_s[i], static_cast<float>(time_s));
        texels.revived += texels.removed[i] > removed ? 1 : 0;
        texels.removed[i] = removed;
        texels.damage[i] = texel[1];
        texels.temperature[i] = std::max({texels.temperature[i], texel[0], std::uint8_t{1}});
      }
    }
  }

  void Add(const ThermalEvent& event) {
    if (event.kind == ThermalEventKind::kCut) cut_events_s_.push_back(event.session_time_s);
  }

  void Add(const Health& health) {
    if (health.node == NodeId::kThermal && health.step.p50_us > 0) cut_.thermal_step = health.step;
  }

  RecordedCut Finish() {
    Settle(true);
    for (CurrentSample& sample : cut_.current) {
      const GeneratorDemand demand = generator_.At(start_ns_ + std::llround(1e9 * sample.time_s));
      if (demand.power_W > 0) {
        sample.mode = demand.mode;
        sample.power_W = demand.power_W;
      }
    }
    std::size_t at = 0;
    for (MetalFrame& frame : cut_.metal) {
      while (at + 1 < cut_.current.size() && cut_.current[at + 1].time_s <= frame.time_s + 1e-6) ++at;
      if (at >= cut_.current.size()) break;
      const double age_s = frame.time_s - cut_.current[at].time_s;
      if (age_s <= -1e-6 || age_s > kCurrentHolds_s) continue;
      frame.mode = cut_.current[at].mode;
      frame.power_W = cut_.current[at].power_W;
    }
    const auto touch = std::find_if(cut_.current.begin(), cut_.current.end(),
                                    [](const CurrentSample& sample) { return sample.touching && sample.energised(); });
    cut_.first_opening_s = std::numeric_limits<double>::quiet_NaN();
    if (touch != cut_.current.end() && first_removed_s_) {
      // A patch shows the hole up to one period late; the event gives its time to within a frame.
      const auto event = std::find_if(cut_events_s_.begin(), cut_events_s_.end(),
                                      [&](double time_s) { return time_s >= touch->time_s; });
      const bool sooner = event != cut_events_s_.end() && *event < *first_removed_s_;
      cut_.first_opening_s = (sooner ? *event : *first_removed_s_) - touch->time_s;
    }
    return std::move(cut_);
  }

 private:
  /// Processes the frames whose tool pose is known. At the end the remaining ones are discarded.
  void Settle(bool end) {
    while (!waiting_.empty()) {
      const TissueFrame& frame = waiting_.front();
      const std::int64_t stamp_ns = start_ns_ + std::llround(1e9 * frame.header.session_time_s);
      if (!end && (poses_.empty() || poses_.back().stamp_ns < stamp_ns)) return;
      // Of the poses before the frame only the newest is needed by later frames.
      while (poses_.size() > 1 && poses_[1].stamp_ns <= stamp_ns) poses_.pop_front();
      if (const std::optional<Pose> pose = PoseAt(stamp_ns)) Locate(frame, *pose);
      waiting_.pop_front();
    }
  }

  [[nodiscard]] std::optional<Pose> PoseAt(std::int64_t stamp_ns) const {
    if (poses_.size() < 2) return std::nullopt;
    const Pose &a = poses_[0], &b = poses_[1];
    if (stamp_ns < a.stamp_ns || stamp_ns > b.stamp_ns || b.stamp_ns - a.stamp_ns > kPoseGap_ns) return std::nullopt;
    const auto u =
        static_cast<float>(static_cast<double>(stamp_ns - a.stamp_ns) / static_cast<double>(b.stamp_ns - a.stamp_ns));
    return Pose{stamp_ns, a.p_WT + u * (b.p_WT - a.p_WT), a.q_WT.slerp(u, b.q_WT)};
  }

  void Locate(const TissueFrame& frame, const Pose& pose) {
    if (topology_changed_) sheet_.SetTopology(dead_nodes_, dead_edges_);
    topology_changed_ = false;
    const SheetTexels& texels = cut_.texels;
    const auto removed = [&texels](const Vec2f& place) {
      const Vec2d texel = place.cast<double>() / texels.texel_m;
      const int x = static_cast<int>(std::floor(texel.x())) - texels.x0;
      const int y = static_cast<int>(std::floor(texel.y())) - texels.y0;
      return x >= 0 && y >= 0 && x < texels.width && y < texels.height && texels.removed[texels.Index(x, y)] != 0;
    };
    if (!sheet_.SetPositions(frame.xyz, removed)) return;
    MetalFrame metal;
    metal.time_s = frame.header.session_time_s;
    metal.nearest_m = std::numeric_limits<float>::infinity();
    std::vector<Contact> contacts;
    bool follows = false;  // The previous sample along the metal touches too.
    bool strikes = false;
    for (const Vec3f& p_T : axis_) {
      const auto place = sheet_.Nearest(pose.p_WT + pose.q_WT * p_T, limit_m_, touch_m_);
      const float gap_m = place ? place->distance_m - touch_m_[place->sheet] : std::numeric_limits<float>::infinity();
      if (!(gap_m <= reach_.holds_m)) {
        follows = false;
        continue;
      }
      if (!follows || (place->material - metal.touched.back()).norm() > kSameContact_m) {
        contacts.push_back({.vaporising_J_m = vaporising_J_m_[place->sheet]});
      }
      follows = true;
      metal.touched.push_back(place->material);
      metal.nearest_m = std::min(metal.nearest_m, place->distance_m);
      strikes = strikes || gap_m < reach_.strikes_m;
      contacts.back().sum += (reach_.holds_m - gap_m) * place->material;
      contacts.back().weight += reach_.holds_m - gap_m;
    }
    const bool holds = !cut_.metal.empty() && cut_.metal.back().in_contact;
    if (strikes || holds) {
      ChooseContact(contacts, &metal);
    } else {
      metal.touched.clear();
    }
    cut_.metal.push_back(std::move(metal));
  }

  /// Successive touched places along the metal.
  struct Contact {
    Vec2f sum = Vec2f::Zero();
    float weight = 0;
    double vaporising_J_m = 0;
    [[nodiscard]] Vec2f centre() const { return sum / weight; }
  };
  void ChooseContact(const std::vector<Contact>& contacts, MetalFrame* metal) const {
    const auto strongest = std::max_element(contacts.begin(), contacts.end(),
                                            [](const Contact& a, const Contact& b) { return a.weight < b.weight; });
    if (strongest == contacts.end() || !(strongest->weight > 0)) return;
    metal->in_contact = true;
    metal->centre = strongest->centre();
    metal->vaporising_J_m = strongest->vaporising_J_m;
    const MetalFrame* last = cut_.metal.empty() ? nullptr : &cut_.metal.back();
    if (last == nullptr || !last->in_contact) return;
    float nearest = kContactStep_m;
    for (const Contact& contact : contacts) {
      const float distance = (contact.centre() - last->centre).norm();
      if (distance > nearest || contact.weight < kStillTouches * strongest->weight) continue;
      nearest = distance;
      metal->centre = contact.centre();
      metal->vaporising_J_m = contact.vaporising_J_m;
      metal->goes_on = true;
    }
  }

  std::size_t tool_ = 0;
  std::vector<Vec3f> axis_;
  ContactReach reach_;
  /// By sheet: distance of the axis from its middle where the metal touches it [m]; what VaporisingHeat_J_m gives.
  std::vector<float> touch_m_;
  std::vector<double> vaporising_J_m_;
  float limit_m_ = 0;  ///< No metal farther than this from any sheet touches one [m].
  std::int64_t start_ns_ = 0;
  DeformedSheet sheet_;
  std::vector<std::uint8_t> dead_nodes_, dead_edges_;
  bool topology_changed_ = false;
  std::optional<double> first_removed_s_;
  std::vector<double> cut_events_s_;
  GeneratorInputs generator_{std::numeric_limits<std::size_t>::max()};
  std::deque<Pose> poses_;
  std::deque<TissueFrame> waiting_;
  RecordedCut cut_;
};

}  // namespace

RecordedCut ReadCut(const std::filesystem::path& file, const SceneView& scene, const ContactReach& reach) {
  Reader reader(scene, reach);
  Recording recording(file,
                      {.topics = {"SceneManifest", "ToolState", "HandleState", "GeneratorSetting", "TissueFrame",
                                  "CauteryContact", "TopologyState", "TemperaturePatch", "ThermalEvent", "Health"}});
  // One per node; for a restarted node that of the newest process.
  std::map<std::pair<TopicId, std::string>, bus::InputAccount> accounts;
  std::optional<SceneManifest> session;
  Entry entry;
  while (recording.Next(&entry)) {
    bus::InputAccount& account =
        accounts.try_emplace({*entry.source->topic, entry.source->node}, false, true).first->second;
    (void)WithDecoded(*entry.source->topic, entry.message.data, [&]<class T>(const T& message) {
      if constexpr (std::is_same_v<T, SceneManifest>) {
        if (session) return;
        recording::RefuseOtherScene(file, message, scene);
        session = message;
        reader.Begin(message);
      } else if constexpr (requires { reader.Add(message); }) {
        // The generator is set before the session begins.
        const bool counts = session || std::is_same_v<T, GeneratorSetting>;
        if (!counts || !bus::PassesGate(message) || !account.IsOfOwner(bus::StampOf(message))) return;
        reader.Add(message);
      }
    });
  }
  if (!session) {
    throw InputError(file.string() +
                     ": contains no start of a session (no SceneManifest); is it a dump of the last seconds?");
  }
  return reader.Finish();
}

}  // namespace fulcrum::log_tools
