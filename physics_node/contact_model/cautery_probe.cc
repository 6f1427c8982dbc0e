// Centre of the contact along the metal, in stations; it moves with the time constant kCentreTime:
//
//   centre  = sum_k w_k s_k / sum_k w_k,   w_k = max(0, r + t/2 + g - |h_k|)^2 max(l_k, r)
//
//   s_k     samples along the metal [stations]                       h_k  distance of the axis from the sheet there [m]
//   r, t    radius of the metal, thickness of the sheet [m]          l_k  length of the piece on the sheet [m]
//   g       kStrikeGap, in contact kHoldGap [m]
//
// Gap of a cell in the footprint: gap_box.h.
#include "physics_node/contact_model/cautery_probe.h"

#include <algorithm>
#include <cmath>

#include "services/base/core/sheet_heat.h"

namespace fulcrum::physics {
namespace {

/// Least length of an edge of the mesh in the count of cells near the metal; bounds it [m].
constexpr float kShortestEdge = 1.0e-4f;
/// Distance of two stations along the metal [m]; larger where there would be more than kMaxStations.
constexpr float kStationSpacing = 5.0e-4f;
constexpr std::size_t kMaxStations = 24;
/// Samples between two stations for the centre of the contact.
constexpr int kCentreSamples = 4;
/// Largest distance on the sheet between the ends of a piece of metal [m]: with more they lie on two folds.
constexpr float kMaxPiece = 0.002f;
/// A station changes to another part of the sheet if that is nearer by this [m]; avoids alternation between folds.
constexpr float kNearerElsewhere = 3.0e-4f;
/// Largest distance from the sheet at which stations follow it [m].
constexpr float kMaxFollowed = 0.008f;
/// Height over the organ from which on the membrane is tented [m].
constexpr float kTentHeight = 0.002f;
/// Largest distance in rows and columns of a binding that represents the movement of the organ below a point.
constexpr int kBindingWindow = 6;
/// Time constant of the movement of the contact's centre along the metal [s]: where flat metal touches most is noise.
constexpr float kCentreTime = 0.15f;
/// Squared distance of a station without living membrane near it [m^2]: 1 m, beyond kMaxFollowed.
constexpr float kNoSheetSq = 1.0f;

}  // namespace

CauteryProbe::CauteryProbe(const TissueScene& scene, const TissueModel* model, const ParticleStore* particles)
    : scene_(scene),
      model_(model),
      particles_(particles),
      walk_(scene, model, particles),
      thickness_(ThicknessOfRows(scene)) {
  for (const float length : scene.membrane_rest_length) {
    spacing_ = std::max(spacing_, length);
  }
}

bool CauteryProbe::Tented(Index triangle, const std::array<float, 3>& barycentric) const {
  const auto nodes = model_->TriangleNodes(triangle);
  for (const SheetPart& sheet : scene_.sheets) {
    const std::uint32_t row = nodes[0] / model_->cols();
    if (row >= sheet.first_row && row < sheet.first_row + sheet.rows && sheet.over == kNoIndex) return true;
  }
  const Index first = scene_.membrane.first;
  std::array<Vec3f, 3> rest;
  Vec3f displacement = Vec3f::Zero();
  for (std::size_t i = 0; i < 3; ++i) {
    rest[i] = scene_.rest_position[first + nodes[i]];
    displacement += barycentric[i] * (walk_.NodePlace(nodes[i]) - rest[i]);
  }
  const auto cols = static_cast<int>(model_->cols()), rows = static_cast<int>(model_->rows());
  const int row = static_cast<int>(nodes[0]) / cols, col = static_cast<int>(nodes[0]) % cols;
  int nearest = 2 * kBindingWindow + 1;
  Vec3f beneath = Vec3f::Zero();
  for (int r = std::max(row - kBindingWindow, 0); r <= std::min(row + kBindingWindow, rows - 1); ++r) {
    for (int c = std::max(col - kBindingWindow, 0); c <= std::min(col + kBindingWindow, cols - 1); ++c) {
      const int apart = std::abs(r - row) + std::abs(c - col);
      const auto binding = apart < nearest ? model_->BindingOf(static_cast<Index>(r * cols + c)) : std::nullopt;
      if (!binding) {
        continue;
      }
      nearest = apart;
      beneath.setZero();
      for (std::size_t i = 0; i < 3; ++i) {
        beneath += binding->barycentric[i] *
                   (particles_->At(binding->surface[i]) - scene_.rest_position[binding->surface[i].base / 4]);
      }
    }
  }
  const Vec3f normal = (rest[1] - rest[0]).cross(rest[2] - rest[0]).normalized();
  return normal.dot(displacement - beneath) > kTentHeight;
}

/// From the end of the foot to the heel and up the neck.
void CauteryProbe::SetStations(const ToolDescription& tool) {
  constexpr std::size_t kRounding = 3;  // Stations added by rounding up foot and neck, and the last one.
  const float length = tool.tip_length_m + kBareNeck;
  const float spacing = std::max(kStationSpacing, length / static_cast<float>(kMaxStations - kRounding));
  const auto parts = [spacing](float part) { return std::max(1, static_cast<int>(std::ceil(part / spacing))); };
  const int foot = parts(tool.tip_length_m), neck = parts(kBareNeck);
  for (int i = 0; i < foot; ++i) {
    stations_.emplace_back().p_T =
        Vec3f(tool.tip_length_m * static_cast<float>(foot - i) / static_cast<float>(foot), 0, 0);
  }
  for (int i = 0; i <= neck; ++i) {
    stations_.emplace_back().p_T = Vec3f(0, 0, -kBareNeck * static_cast<float>(i) / static_cast<float>(neck));
  }
}

void CauteryProbe::FollowSheet(const ToolPose& pose, std::uint32_t tool, const ToolCollision& collision) {
  // Of the tool's pairs with living membrane: the nearest pair, and the least distance of each station.
  const ContactPair* nearest = nullptr;
  std::array<float, kMaxStations> alive_sq;
  alive_sq.fill(kNoSheetSq);
  for (std::size_t i = 0; i < stations_.size(); ++i) {
    stations_[i].p_W = pose.ToWorld(stations_[i].p_T);
  }
  for (const ContactPair& pair : collision.pairs()) {
    // ShapeOf: the hook's first capsule is the foot, its second the neck.
    if (pair.capsule / kMaxCapsules != tool || pair.capsule % kMaxCapsules > 1 ||
        pair.triangle >= collision.membrane_triangle_count() || !(pair.closest.distance_sq < kFarSq)) {
      continue;
    }
    if (nearest == nullptr || pair.closest.distance_sq < nearest->closest.distance_sq) {
      nearest = &pair;
    }
    for (std::size_t i = 0; i < stations_.size(); ++i) {
      alive_sq[i] = std::min(alive_sq[i], (stations_[i].p_W - pair.closest.on_triangle).squaredNorm());
    }
  }
  const Index seed = nearest != nullptr ? nearest->triangle / 2 : kNoIndex;
  float least = kMaxFollowed;
  for (std::size_t i = 0; i < stations_.size(); ++i) {
    Station& station = stations_[i];
    SheetPlace place =
        station.place.found() && followed_ ? walk_.Nearest(station.p_W, station.place.cell()) : SheetPlace{};
    const auto offer = [&](Index cell) {
      const SheetPlace other = walk_.Nearest(station.p_W, cell);
      if (!place.found() || other.distance_m < place.distance_m - kNearerElsewhere) {
        place = other;
      }
    };
    if (seed != kNoIndex && (!place.found() || place.distance_m > std::sqrt(alive_sq[i]) + kNearerElsewhere)) {
      offer(seed);
    }
    if (i > 0 && stations_[i - 1].place.found() && (!place.found() || place.cell() != stations_[i - 1].place.cell())) {
      offer(stations_[i - 1].place.cell());
    }
    station.place = place;
    if (!place.found()) {
      continue;
    }
    station.height_m = place.distance_m;
    if (!model_->TriangleAlive(place.triangle)) {
      // Remaining cells beyond the last living triangle are connected to it and extend by at most one edge.
      const float living_m = walk_.DistanceToLiving(station.p_W, place.cell());
      station.height_m = std::max(station.height_m, std::min(living_m - spacing_, kMaxFollowed));
    }
    least = std::min(least, place.distance_m);
  }
  followed_ = least < kMaxFollowed;
}

/// The sign of a height is that of the station before it, or the opposite where the metal between them crosses the
/// sheet. The common sign is that which agrees with the last step.
void CauteryProbe::SignHeights() {
  float sign = 1.0f, agreement = 0;
  for (std::size_t i = 0; i < stations_.size(); ++i) {
    Station& station = stations_[i];
    if (i > 0) {
      const Station& last = stations_[i - 1];
      const float length = (station.p_W - last.p_W).norm();
      const bool near = std::min(last.place.distance_m, station.place.distance_m) < length;
      sign = near && walk_.Crossing(last.p_W, station.p_W, last.place.cell()).found() ? -sign : sign;
    }
    station.height_m *= sign;
    agreement += station.height_m * station.last_height_m;
  }
  for (Station& station : stations_) {
    station.height_m = agreement < 0.0f ? -station.height_m : station.height_m;
    station.last_height_m = station.height_m;
  }
}

float CauteryProbe::ThicknessAt(Index cell) const {
  const Index row = cell / (scene_.membrane.cols - 1);
  return row < thickness_.size() ? thickness_[row] : scene_.thermal.thickness_m;
}

bool CauteryProbe::FindCentre(float radius_m, float step_s, Vec2f* centre) {
  const float gap = was_touching_ ? kHoldGap : kStrikeGap;
  float sum = 0, mean = 0;
  for (std::size_t i = 0; i + 1 < stations_.size(); ++i) {
    const Station &a = stations_[i], &b = stations_[i + 1];
    const float length = (b.place.material - a.place.material).norm();
    if (length > kMaxPiece) {
      continue;
    }
    // In contact the middle of the sheet is further from the axis by half its thickness.
    const float touch = radius_m + 0.5f * ThicknessAt(a.place.cell()), limit = touch + gap;
    for (int k = 0; k < kCentreSamples; ++k) {
      const float u = (static_cast<float>(k) + 0.5f) / kCentreSamples;
      const float nearer = limit - std::abs(a.height_m + u * (b.height_m - a.height_m));
      if (nearer > 0.0f) {
        // Metal perpendicular to the sheet covers at least its own radius.
        const float weight = nearer * nearer * std::max(length, radius_m);
        sum += weight;
        mean += weight * (static_cast<float>(i) + u);
      }
    }
  }
  if (!(sum > 0.0f)) {
    return false;
  }
  const float share = 1.0f - std::exp(-step_s / kCentreTime);
  centre_ = was_touching_ ? centre_ + share * (mean / sum - centre_) : mean / sum;
  const auto i = std::min(static_cast<std::size_t>(centre_), stations_.size() - 2);
  const float u = centre_ - static_cast<float>(i);
  const Vec2f &a = stations_[i].place.material, &b = stations_[i + 1].place.material;
  *centre = (b - a).norm() > kMaxPiece ? (u < 0.5f ? a : b) : Vec2f(a + u * (b - a));
  return true;
}

void CauteryProbe::AddGaps(Index triangle, const MetalAxis& axis, float radius_m) {
  if (!HasTriangle(scene_, triangle)) return;
  const MembraneTriangle t = MembraneTriangleAt(scene_.membrane.cols, triangle);
  const SheetAccess held{scene_, *model_, *particles_};
  const SlitSheet sheet(held);
  const TriangleParts parts = sheet.Parts(t);
  const float cushion = 0.5f * ThicknessAt(triangle / 2) + kContactSlack;
  SurfaceTriangle piece;
  for (std::size_t k = 0; k < 3; ++k) {
    piece.material[k] = scene_.membrane_material[t.nodes[k]];
  }
  if (parts.count == 0) {
    // No living edge holds the triangle: it lies between the lips.
    for (std::size_t k = 0; k < 3; ++k) {
      piece.place[k] = walk_.NodePlace(t.nodes[k]);
    }
    gaps_.Add(piece, axis, radius_m, cushion, [](const std::array<float, 3>&) { return true; });
    return;
  }
  for (std::size_t i = 0; i < parts.count; ++i) {
    piece.place = sheet.Corners(t.nodes, parts.owned[i]);
    gaps_.Add(piece, axis, radius_m, cushion, [&](const std::array<float, 3>& w) { return parts.IsOf(i, w); });
  }
}

/// Cells of the mesh near the metal: those around the places of the stations, and those of the contact pairs, which
/// also lie on other folds.
void CauteryProbe::FindNearCells(float reach_m, const ToolCollision& collision) {
  near_cells_.clear();
  const Index cols = scene_.membrane.cols - 1, rows = scene_.membrane.rows - 1;
  const auto& m = scene_.membrane_material;
  const auto count = [reach_m](const Vec2f& edge) {
    return static_cast<Index>(std::ceil(reach_m / std::max(edge.norm(), kShortestEdge)));
  };
  for (const Station& station : stations_) {
    if (!station.place.found() || station.place.distance_m > reach_m + spacing_) {
      continue;
    }
    const Index cell = station.place.cell(), row = cell / cols, col = cell % cols;
    const auto nodes = model_->TriangleNodes(2 * cell);
    const Index across = count(m[nodes[1]] - m[nodes[0]]), down = count(m[nodes[2]] - m[nodes[1]]);
    for (Index r = row - std::min(row, down); r <= std::min(row + down, rows - 1); ++r) {
      for (Index c = col - std::min(col, across); c <= std::min(col + across, cols - 1); ++c) {
        near_cells_.push_back(r * cols + c);
      }
    }
  }
  for (const ContactPair& pair : collision.pairs()) {
    if (pair.triangle < collision.membrane_triangle_count() && pair.closest.distance_sq < reach_m * reach_m) {
      near_cells_.push_back(pair.triangle / 2);
    }
  }
  std::sort(near_cells_.begin(), near_cells_.end());
  near_cells_.erase(std::unique(near_cells_.begin(), near_cells_.end()), near_cells_.end());
}

void CauteryProbe::FillFootprint(const ToolPose& pose, const ToolDescription& tool, const ToolCollision& collision,
                                 const Vec2f& centre, Footprint* print) {
  gaps_.Begin(centre, scene_.thermal.cell_m);
  const MetalAxis axis{pose.ToWorld(Vec3f(tool.tip_length_m, 0, 0)), pose.p_WT, pose.ToWorld(Vec3f(0, 0, -kBareNeck))};
  FindNearCells(tool.tip_radius_m + kFootprintReach, collision);
  for (const Index near : near_cells_) {
    AddGaps(2 * near, axis, tool.tip_radius_m);
    AddGaps(2 * near + 1, axis, tool.tip_radius_m);
  }
  gaps_.Encode(print);
}

CauteryContact CauteryProbe::Update(std::uint32_t tool, const ToolPose& pose, const ToolCollision& collision,
                                    float step_s) {
  CauteryContact contact;
  contact.tool = static_cast<std::uint8_t>(tool);
  const ToolDescription& description = scene_.tools[tool];
  if (stations_.empty()) {
    SetStations(description);
  }
  FollowSheet(pose, tool, collision);
  Vec2f centre = Vec2f::Zero();
  if (followed_) {
    SignHeights();
  }
  if (!followed_ || !FindCentre(description.tip_radius_m, step_s, &centre)) {
    was_touching_ = false;
    rate_.setZero();
    return contact;
  }
  const auto station = std::min_element(stations_.begin(), stations_.end(), [&](const Station& a, const Station& b) {
    return (a.place.material - centre).squaredNorm() < (b.place.material - centre).squaredNorm();
  });
  const SheetPlace place = walk_.At(centre, station->place.cell());
  contact.triangle = place.triangle;
  contact.barycentric = place.barycentric;
  contact.material = place.material;
  contact.touching = true;
  FillFootprint(pose, description, collision, contact.material, &contact.footprint);
  contact.tented = Tented(place.triangle, place.barycentric);
  contact.contact_radius_m = description.tip_radius_m;
  if (was_touching_) {
    rate_ += step_s / (step_s + kRateTime) * ((contact.material - last_material_) / step_s - rate_);
  }
  contact.material_rate = rate_;
  was_touching_ = true;
  last_material_ = contact.material;
  return contact;
}

}  // namespace fulcrum::physics
