#include "render_node/geometry/bleeding.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

namespace fulcrum::render {
namespace {

// Maximum number of steps per update; the rest of a longer pause is skipped. More than from one ageing to the next, or
// blood at rest, which is updated only to age, would age late.
constexpr int kMostSteps = 150;
constexpr double kClots_s = 8;  // Assumed: after this time a small vessel has closed by itself.
// Assumed: a small arteriole of the peritoneum, 1.2 ml in a minute; it pulses 72 times in a minute by a half.
constexpr double kBleeds_m3_s = 20e-9;
constexpr double kPulse_rad_s = 7.54, kPulse = 0.5;
constexpr int kRim = 16;                           // Number of points around a cut that are checked for vessels.
constexpr float kRimRadii[] = {0.0005f, 0.0008f};  // [m]
constexpr float kVessel = 0.75f;                   // Of the pattern: from 0.5 on, a slit of 30 mm bled in six places.
constexpr std::uint8_t kSealed = 128;
constexpr float kSameVessel_m = 0.006f;
constexpr double kCutOffAgain_s = 0.5;

}  // namespace

Bleeding::Bleeding(const SceneView& scene, std::span<const std::uint8_t> vessels, int texels, float per_m,
                   std::span<const float> rim)
    : scene_(scene), supply_(scene, vessels, texels, per_m), fluid_(scene, rim) {}

std::optional<Vec2f> Bleeding::LivingVessel(const Vec2f& material, const Atlas& atlas) {
  struct Place {
    Vec2f material;
    float strength;
  };
  std::vector<Place> found;
  for (const float radius : kRimRadii) {
    for (int k = 0; k < kRim; ++k) {
      const float angle = 2 * std::numbers::pi_v<float> * static_cast<float>(k) / kRim;
      const Vec2f place = material + radius * Vec2f(std::cos(angle), std::sin(angle));
      const auto texel = atlas.At(place);
      const float strength = supply_.VesselAt(place);
      if (texel && (*texel)[3] >= 128 && (*texel)[1] < kSealed && strength > kVessel)
        found.push_back({place, strength});
    }
  }
  std::ranges::stable_sort(found, std::greater(), &Place::strength);
  const auto best = std::ranges::find_if(found, [&](const Place& p) { return !supply_.CutOff(p.material, atlas); });
  return best == found.end() ? std::nullopt : std::optional(best->material);
}

void Bleeding::SetClips(std::span<const Clip> clips) {
  supply_.SetClips(clips);
  clips_changed_ = true;
  cut_off_known_ = false;
}

bool Bleeding::FindCutOff(const Atlas& atlas, double session_time_s) {
  if (!supply_.has_clips() && cut_off_.empty()) return false;
  const bool recut =
      atlas.removals() != cut_off_removals_ && std::abs(session_time_s - cut_off_found_s_) >= kCutOffAgain_s;
  if (cut_off_known_ && !recut) return false;
  cut_off_known_ = true;
  cut_off_removals_ = atlas.removals();
  cut_off_found_s_ = session_time_s;
  const auto width = static_cast<std::size_t>(atlas.film_width());
  cut_off_.assign(width * static_cast<std::size_t>(atlas.film_height()), 0);
  const float texel_m = 2 * atlas.texel_m();
  supply_.ForEachCutOff(atlas, [&](const Vec2f& material) {
    const auto x = static_cast<std::size_t>(material.x() / texel_m),
               y = static_cast<std::size_t>(material.y() / texel_m);
    if (x < width && y * width + x < cut_off_.size()) cut_off_[y * width + x] = 255;
  });
  return true;
}

void Bleeding::StopCutOff(const Atlas& atlas) {
  if (!clips_changed_ && atlas.removals() == removals_) return;
  clips_changed_ = false;
  removals_ = atlas.removals();
  for (Source& source : sources_) {
    if (!source.open || !supply_.CutOff(source.material, atlas)) continue;
    const std::optional<Vec2f> other = LivingVessel(source.material, atlas);
    source.open = other.has_value();
    if (other) source.material = *other;
  }
}

void Bleeding::Cut(const Vec2f& material, const Atlas& atlas, double session_time_s) {
  const std::optional<Vec2f> best = LivingVessel(material, atlas);
  if (!best || scene_.membrane_material.empty()) return;
  const bool known = std::any_of(sources_.begin(), sources_.end(), [&](const Source& source) {
    return source.open && (source.material - *best).norm() < kSameVessel_m;
  });
  if (known) return;
  if (!moves() && fluid_.dry()) time_s_ = session_time_s;
  sources_[next_source_] = {true, *best, 0, session_time_s};
  next_source_ = (next_source_ + 1) % sources_.size();
}

int Bleeding::sources() const {
  return static_cast<int>(std::count_if(sources_.begin(), sources_.end(), [](const Source& s) { return s.open; }));
}

bool Bleeding::Update(double session_time_s, const MembraneMesh& membrane, std::span<const WorkingTube> tubes,
                      Atlas* atlas) {
  if (sources() == 0 && fluid_.dry() && tubes.empty()) {
    time_s_ = session_time_s;
    return false;
  }
  if (supply_.has_clips()) StopCutOff(*atlas);
  fluid_.SetShape(membrane, atlas);
  static_assert(kMostSteps > kStepsOfAge);
  time_s_ = std::max(time_s_, session_time_s - kMostSteps * SheetFluid::kStep_s);
  for (; time_s_ + SheetFluid::kStep_s <= session_time_s; time_s_ += SheetFluid::kStep_s) {
    for (Source& source : sources_) {
      if (source.open && source.opened_s <= time_s_) Bleed(&source, *atlas);
    }
    fluid_.Step(tubes);
    if (++step_ < kStepsOfAge) continue;
    step_ = 0;
    fluid_.Age(kStepsOfAge * SheetFluid::kStep_s);
  }
  return fluid_.Show(atlas);
}

void Bleeding::Bleed(Source* source, const Atlas& atlas) {
  auto texel = atlas.At(source->material);
  if (texel && (*texel)[3] < 128) {
    if (const auto rim = LivingVessel(source->material, atlas)) {
      source->material = *rim;
      texel = atlas.At(*rim);
    }
  }
  if (!texel || (*texel)[3] < 128 || (*texel)[1] >= kSealed || source->steps >= kClots_s / SheetFluid::kStep_s) {
    source->open = false;
    return;
  }
  const double phase = kPulse_rad_s * SheetFluid::kStep_s * source->steps++;
  const double volume_m3 = kBleeds_m3_s * SheetFluid::kStep_s * (1 + kPulse * std::sin(phase));
  shed_m3_ += fluid_.Bleed(source->material, volume_m3);
}

}  // namespace fulcrum::render
