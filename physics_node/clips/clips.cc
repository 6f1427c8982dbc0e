#include "physics_node/clips/clips.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <utility>

#include "physics_node/clips/rigid_fit.h"
#include "services/base/core/sheets.h"

namespace fulcrum::physics {
namespace {

/// Distance from a line below which tissue is in one line [m]: how it is turned about the line is not known.
constexpr float kLeastWidth_m = 2e-4f;
/// Of a clip of a checkpoint, farthest place at rest from its middle [m].
constexpr float kMostReach_m = 1.0f;
/// Of the squared norm of a quaternion, far above rounding.
constexpr float kUnitTolerance = 1e-3f;
/// Added to J's inverse over its trace: a set in one line has no stiffness about the line.
constexpr double kLeastTurnStiffness = 1e-6;

bool Has(const AppliedClip& clip, Index particle) {
  return std::any_of(clip.tissue.begin(), clip.tissue.end(),
                     [particle](const ClippedParticle& clipped) { return clipped.particle == particle; });
}
bool HasAnchors(const AppliedClip& clip) {
  return std::all_of(clip.placed.anchors.begin(), clip.placed.anchors.end(),
                     [&](Index anchor) { return Has(clip, anchor); });
}

/// Squared distance of a place in the tool's frame from the middle line of jaws of a length.
float FromMiddleLineSq(const Vec3f& p_T, float length) {
  return (p_T - Vec3f(0, 0, std::clamp(p_T.z(), -length, 0.0f))).squaredNorm();
}

/// Of the particles the two that are farthest apart, and the one farthest from their line. None if all are near a line.
std::optional<std::array<Index, 3>> WidestTriangle(std::span<const Index> tissue, const ParticleStore& particles) {
  const auto at = [&](Index particle) { return particles.At(particles.Ref(particle)); };
  std::array<Index, 3> corners{};
  float farthest_sq = 0, largest_sq = 0;
  for (std::size_t i = 0; i < tissue.size(); ++i) {
    for (std::size_t j = i + 1; j < tissue.size(); ++j) {
      if (const float sq = (at(tissue[j]) - at(tissue[i])).squaredNorm(); sq > farthest_sq) {
        farthest_sq = sq;
        corners = {tissue[i], tissue[j], 0};
      }
    }
  }
  if (!(farthest_sq > 0.0f)) return std::nullopt;
  const Vec3f a = at(corners[0]), b = at(corners[1]);
  for (const Index particle : tissue) {
    if (const float sq = (b - a).cross(at(particle) - a).squaredNorm(); sq > largest_sq) {
      largest_sq = sq;
      corners[2] = particle;
    }
  }
  if (!(largest_sq > kLeastWidth_m * kLeastWidth_m * farthest_sq)) return std::nullopt;
  return corners;
}

}  // namespace

Clips::Clips(const TissueScene& scene)
    : possible_(std::any_of(scene.tools.begin(), scene.tools.end(),
                            [](const ToolDescription& tool) { return tool.kind == ToolKind::kClipApplier; })),
      columns_(scene.membrane.cols),
      sheet_of_rows_(SheetOfRows(scene)) {
  if (possible_) {
    clips_.reserve(kMaxClips);
    elements_.reserve(kMaxClips);
  }
}

bool Clips::IsClipped(Index particle) const {
  return std::any_of(clips_.begin(), clips_.end(), [particle](const AppliedClip& clip) { return Has(clip, particle); });
}

bool Clips::Anchor(const ClipPose& pose, const ParticleStore& particles, AppliedClip* clip) const {
  std::vector<Index> all;
  std::array<std::vector<Index>, kMaxSheets> of_sheets;
  for (const ClippedParticle& clipped : clip->tissue) {
    all.push_back(clipped.particle);
    if (clipped.particle < particles.tube_count()) continue;
    of_sheets[sheet_of_rows_[(clipped.particle - particles.tube_count()) / columns_]].push_back(clipped.particle);
  }
  // What reads where a clip closes the vessels of a sheet needs places on one sheet.
  std::stable_sort(of_sheets.begin(), of_sheets.end(),
                   [](const auto& a, const auto& b) { return a.size() > b.size(); });
  std::optional<std::array<Index, 3>> anchors;
  for (const std::vector<Index>& of_sheet : of_sheets) {
    if (!anchors) anchors = WidestTriangle(of_sheet, particles);
  }
  if (!anchors) anchors = WidestTriangle(all, particles);
  if (!anchors) return false;
  clip->placed.anchors = *anchors;
  const auto at = [&](std::size_t k) { return particles.At(particles.Ref((*anchors)[k])); };
  return Place(pose, at(0), at(1), at(2), &clip->placed);
}

bool Clips::Apply(std::uint8_t tool, const ToolDescription& description, const ToolPose& pose,
                  std::span<const Index> held, const ParticleStore& particles) {
  const float length = description.tip_length_m;
  const Vec3f middle_T(0, 0, -0.5f * length);
  AppliedClip clip;
  clip.placed.tool = tool;
  clip.placed.length_m = length;
  clip.q_WC = pose.q_WT;
  std::vector<std::pair<float, ClippedParticle>> near;
  for (const Index particle : held) {
    if (IsClipped(particle)) continue;
    const Vec3f p_T = pose.ToTool(particles.At(particles.Ref(particle)));
    near.push_back({FromMiddleLineSq(p_T, length), {particle, p_T - middle_T}});
  }
  std::sort(near.begin(), near.end(), [](const auto& a, const auto& b) {
    return std::pair(a.first, a.second.particle) < std::pair(b.first, b.second.particle);
  });
  near.resize(std::min(near.size(), kMostClipped));
  for (const auto& [distance_sq, clipped] : near) clip.tissue.push_back(clipped);
  if (clips_.size() == kMaxClips || clip.tissue.size() < kLeastClipped ||
      !Anchor({pose.ToWorld(middle_T), pose.q_WT}, particles, &clip)) {
    ++refused_;
    ++revision_;
    return false;
  }
  elements_.push_back(MakeElement(clip, particles));
  clips_.push_back(std::move(clip));
  ++revision_;
  return true;
}

void Clips::DropDead(const TissueModel& model, const ParticleStore& particles) {
  for (std::size_t i = 0; i < clips_.size();) {
    AppliedClip& clip = clips_[i];
    const std::size_t before = clip.tissue.size();
    std::erase_if(clip.tissue,
                  [&](const ClippedParticle& clipped) { return model.BaseInverseMass(clipped.particle) == 0.0f; });
    if (clip.tissue.size() == before) {
      ++i;
      continue;
    }
    ++revision_;
    clip.q_WC = elements_[i].turn.cast<float>();
    elements_[i] = MakeElement(clip, particles);
    if (clip.tissue.size() >= kLeastClipped && (HasAnchors(clip) || AnchorAnew(particles, &elements_[i], &clip))) {
      ++i;
      continue;
    }
    clips_.erase(clips_.begin() + static_cast<std::ptrdiff_t>(i));
    elements_.erase(elements_.begin() + static_cast<std::ptrdiff_t>(i));
    ++lost_;
  }
}

bool Clips::AnchorAnew(const ParticleStore& particles, Element* e, AppliedClip* clip) const {
  const float* const place = particles.raw().data();
  if (!Fit(place, e)) return false;
  clip->q_WC = e->turn.cast<float>();
  const Vec3f centre = MomentsOf(*e, place).centre.cast<float>();
  return Anchor({centre - clip->q_WC * e->middle, clip->q_WC}, particles, clip);
}

Clips::Element Clips::MakeElement(const AppliedClip& clip, const ParticleStore& particles) {
  Element e;
  Vec3d middle = Vec3d::Zero();
  for (const ClippedParticle& clipped : clip.tissue) {
    e.at.push_back(particles.Ref(clipped.particle));
    middle += clipped.p_C.cast<double>();
  }
  middle /= static_cast<double>(std::max<std::size_t>(clip.tissue.size(), 1));
  for (const ClippedParticle& clipped : clip.tissue) {
    e.p.push_back((clipped.p_C.cast<double>() - middle).cast<float>());
  }
  e.middle = middle.cast<float>();
  e.turn = clip.q_WC.cast<double>().normalized();
  e.q.assign(e.at.size(), Vec3f::Zero());
  e.force = e.product = e.q;
  return e;
}

Clips::Moments Clips::MomentsOf(const Element& e, const float* place) {
  Vec3d centre = Vec3d::Zero();
  for (const ParticleRef at : e.at) centre += FieldAt(place, at).cast<double>();
  centre /= static_cast<double>(e.at.size());
  Mat3d A = Mat3d::Zero();
  for (std::size_t i = 0; i < e.at.size(); ++i) {
    A += (FieldAt(place, e.at[i]).cast<double>() - centre) * e.p[i].cast<double>().transpose();
  }
  return {centre, A};
}

bool Clips::Fit(const float* place, Element* e) {
  const auto [centre, A] = MomentsOf(*e, place);
  // A particle that is not finite is reset at the end of the substep.
  if (!centre.allFinite() || !A.allFinite()) return false;
  e->turn = FitRotation(A, e->turn);
  const Mat3d R = e->turn.toRotationMatrix();
  Mat3d of_q = Mat3d::Zero(), of_d = Mat3d::Zero();
  for (std::size_t i = 0; i < e->at.size(); ++i) {
    const Vec3d q = R * e->p[i].cast<double>(), d = FieldAt(place, e->at[i]).cast<double>() - centre - q;
    of_q += q * q.transpose();
    of_d += d * q.transpose();
    e->q[i] = q.cast<float>();
    e->force[i] = (-static_cast<double>(kStiffness_N_per_m) * d).cast<float>();
  }
  const Mat3d H = TurnStiffness(of_q);
  const double more = TurnStiffness(of_d).norm() + kLeastTurnStiffness * H.trace();
  if (more > 0) {
    e->inverse = (H + more * Mat3d::Identity()).inverse().cast<float>();
  } else {
    e->inverse.setZero();
  }
  return true;
}

void Clips::AddForce(float* residual) const {
  for (const Element& e : elements_) {
    for (std::size_t i = 0; e.acts && i < e.at.size(); ++i) AddField(residual, e.at[i], e.force[i]);
  }
}

double Clips::Multiply(const float* p) {
  double sum = 0;
  for (Element& e : elements_) {
    if (!e.acts) continue;
    Vec3f mean = Vec3f::Zero(), moment = Vec3f::Zero();
    for (std::size_t i = 0; i < e.at.size(); ++i) {
      const Vec3f v = FieldAt(p, e.at[i]);
      mean += v;
      moment += e.q[i].cross(v);
    }
    mean /= static_cast<float>(e.at.size());
    const Vec3f turn = e.inverse * moment;
    for (std::size_t i = 0; i < e.at.size(); ++i) {
      const Vec3f v = FieldAt(p, e.at[i]);
      e.product[i] = kStiffness_N_per_m * (v - mean - turn.cross(e.q[i]));
      sum += static_cast<double>(v.dot(e.product[i]));
    }
  }
  return sum;
}

void Clips::AddProduct(float scale, float* out) const {
  for (const Element& e : elements_) {
    for (std::size_t i = 0; e.acts && i < e.at.size(); ++i) AddField(out, e.at[i], scale * e.product[i]);
  }
}

double Clips::Energy(const float* place) const {
  double sum = 0;
  for (const Element& e : elements_) {
    if (!e.acts) continue;
    const auto [centre, A] = MomentsOf(e, place);
    const Mat3d R = FitRotation(A, e.turn).toRotationMatrix();
    for (std::size_t i = 0; i < e.at.size(); ++i) {
      const Vec3d d = FieldAt(place, e.at[i]).cast<double>() - centre - R * e.p[i].cast<double>();
      sum += 0.5 * static_cast<double>(kStiffness_N_per_m) * d.squaredNorm();
    }
  }
  return sum;
}

void Clips::Project(ParticleStore* particles) {
  for (Element& e : elements_) {
    const float* const place = particles->pool();
    if (!Fit(place, &e)) continue;
    const Vec3f centre = MomentsOf(e, place).centre.cast<float>();
    for (std::size_t i = 0; i < e.at.size(); ++i) {
      if (particles->InverseMass(e.at[i]) > 0.0f) particles->Set(e.at[i], centre + e.q[i]);
    }
  }
}

void Clips::Fill(ClipState* state) const {
  state->count = static_cast<std::uint32_t>(clips_.size());
  state->clips = {};
  for (std::size_t i = 0; i < clips_.size(); ++i) state->clips[i] = clips_[i].placed;
}

void Clips::AddTo(Hash64* hash) const {
  for (const AppliedClip& clip : clips_) {
    hash->AddValue(clip.placed.tool);
    for (const ClippedParticle& clipped : clip.tissue) {
      hash->AddValue(clipped.particle);
      hash->Add(std::span<const float>(clipped.p_C.data(), 3));
    }
  }
}

ClipMemory Clips::Save() const {
  ClipMemory memory{clips_, lost_, refused_};
  for (std::size_t i = 0; i < clips_.size(); ++i) memory.clips[i].q_WC = elements_[i].turn.cast<float>();
  return memory;
}

bool Clips::Fits(const ClipMemory& memory, Index particle_count) const {
  if (memory.clips.empty()) return true;
  if (!possible_ || memory.clips.size() > kMaxClips) return false;
  const auto is_unit = [](const Quatf& q) { return std::abs(q.squaredNorm() - 1.0f) <= kUnitTolerance; };
  std::vector<Index> all;
  for (const AppliedClip& clip : memory.clips) {
    const Clip& placed = clip.placed;
    // False for NaN.
    if (!(placed.p_AC.norm() <= kMostReach_m && is_unit(placed.q_AC) && is_unit(clip.q_WC) && placed.length_m >= 0.0f &&
          placed.length_m <= kMaxClipLength_m && placed.tool < kMaxTools && clip.tissue.size() >= kLeastClipped &&
          clip.tissue.size() <= kMostClipped)) {
      return false;
    }
    for (const ClippedParticle& clipped : clip.tissue) {
      if (clipped.particle >= particle_count || !(clipped.p_C.norm() <= kMostReach_m)) return false;
      all.push_back(clipped.particle);
    }
    if (!HasAnchors(clip) || placed.anchors[0] == placed.anchors[1] || placed.anchors[0] == placed.anchors[2] ||
        placed.anchors[1] == placed.anchors[2]) {
      return false;
    }
  }
  std::sort(all.begin(), all.end());
  return std::adjacent_find(all.begin(), all.end()) == all.end();
}

void Clips::Restore(const ClipMemory& memory, const ParticleStore& particles) {
  clips_ = memory.clips;
  elements_.clear();
  for (const AppliedClip& clip : clips_) elements_.push_back(MakeElement(clip, particles));
  lost_ = memory.lost;
  refused_ = memory.refused;
  ++revision_;
}

}  // namespace fulcrum::physics
