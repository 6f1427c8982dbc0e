#include "physics_node/contact_model/cautery_probe.h"

#include <algorithm>
#include <cmath>

namespace fulcrum::physics {
namespace {

/// An arc strikes across a gap of this size between metal and sheet, and holds up to the second one [m]. At the 500 V
/// peak of a cutting generator air and steam break down across 0.05 to 0.15 mm (Paschen).
constexpr float kStrikeGap = 1.0e-4f, kHoldGap = 2.5e-4f;
/// Gaps are given up to this one: what discharges and sparks reach [m].
constexpr float kFootprintReach = 7.0e-4f;
/// Tissue gives under the metal, and its surface is wet: so much of a gap along the normal is none [m].
constexpr float kContactSlack = 5.0e-5f;
/// Edges of the mesh count as no shorter than this, so that few are looked at [m].
constexpr float kShortestEdge = 1.0e-4f;
/// Bare metal up the neck [m].
constexpr float kBareNeck = 0.005f;
/// Between two stations along the metal [m]; more where they would be too many.
constexpr float kStationSpacing = 5.0e-4f;
constexpr std::size_t kMostStations = 24;
/// The metal between two stations is looked at in so many places for the centre of the contact.
constexpr int kLooks = 4;
/// Pieces of metal whose ends lie farther apart on the sheet lie on two folds of it [m].
constexpr float kLongestPiece = 0.002f;
/// A station that is so much nearer to another part of the sheet goes over to it [m].
constexpr float kNearerElsewhere = 3.0e-4f;
/// Beyond this nothing is followed any more [m].
constexpr float kLost = 0.008f;
/// The membrane counts as lifted off what lies beneath from here on [m].
constexpr float kTentHeight = 0.002f;
/// A binding this many rows and columns away still tells how the organ beneath has moved.
constexpr int kBindingWindow = 6;
constexpr float kRateSmoothing = 0.03f;  ///< [s]
/// The centre of the contact moves along the metal this slowly: where metal lies flat, which part of it touches most is
/// noise [s].
constexpr float kCentreFollows = 0.15f;

}  // namespace

CauteryProbe::CauteryProbe(const SceneView& scene, const TissueModel* model, const ParticleStore* particles)
    : scene_(scene), model_(model), particles_(particles), walk_(scene, model, particles) {
  for (const float length : scene.membrane_rest_length) {
    spacing_ = std::max(spacing_, length);
  }
}

bool CauteryProbe::Tented(Index triangle, const std::array<float, 3>& barycentric) const {
  const auto nodes = model_->TriangleNodes(triangle);
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
  const float length = tool.tip_length_m + kBareNeck;
  const float spacing = std::max(kStationSpacing, length / static_cast<float>(kMostStations - 3));
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
  // Of the tool's pairs with living membrane: the nearest, and how near each station is to any.
  const ContactPair* nearest = nullptr;
  std::array<float, kMostStations> alive_sq;
  alive_sq.fill(1.0f);
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
  float least = kLost;
  for (std::size_t i = 0; i < stations_.size(); ++i) {
    Station& station = stations_[i];
    SheetPlace place =
        station.place.found() && known_ ? walk_.Nearest(station.p_W, station.place.cell()) : SheetPlace{};
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
      // Cells that live beyond the last living triangle hang on it and reach no farther than one edge.
      const float living_m = walk_.DistanceToLiving(station.p_W, place.cell());
      station.height_m = std::max(station.height_m, std::min(living_m - spacing_, kLost));
    }
    least = std::min(least, place.distance_m);
  }
  known_ = least < kLost;
}

/// The sign of a height is that of the station before it, or the opposite where the metal between them goes through the
/// sheet; over all, what agrees with the last step.
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

bool CauteryProbe::FindCentre(float radius_m, Vec2f* centre) {
  // Where the sheet lies against the metal, its middle is half its thickness farther from the axis.
  const float touch = radius_m + 0.5f * scene_.thermal.thickness_m;
  const float limit = touch + (was_touching_ ? kHoldGap : kStrikeGap);
  float sum = 0, mean = 0;
  for (std::size_t i = 0; i + 1 < stations_.size(); ++i) {
    const Station &a = stations_[i], &b = stations_[i + 1];
    const float length = (b.place.material - a.place.material).norm();
    if (length > kLongestPiece) {
      continue;
    }
    for (int k = 0; k < kLooks; ++k) {
      const float u = (static_cast<float>(k) + 0.5f) / kLooks;
      const float nearer = limit - std::abs(a.height_m + u * (b.height_m - a.height_m));
      if (nearer > 0.0f) {
        // Metal that stands on the sheet covers it no less than metal that lies on it.
        const float weight = nearer * nearer * std::max(length, radius_m);
        sum += weight;
        mean += weight * (static_cast<float>(i) + u);
      }
    }
  }
  if (!(sum > 0.0f)) {
    return false;
  }
  const float share = 1.0f - std::exp(-scene_.physics.dt_s / kCentreFollows);
  centre_ = was_touching_ ? centre_ + share * (mean / sum - centre_) : mean / sum;
  const auto i = std::min(static_cast<std::size_t>(centre_), stations_.size() - 2);
  const float u = centre_ - static_cast<float>(i);
  const Vec2f &a = stations_[i].place.material, &b = stations_[i + 1].place.material;
  *centre = (b - a).norm() > kLongestPiece ? (u < 0.5f ? a : b) : Vec2f(a + u * (b - a));
  return true;
}

/// A cell belongs to the part of its triangle whose own corners are nearest to it.
void CauteryProbe::AddGaps(Index triangle, const MetalAxis& axis, float radius_m) {
  const MembraneTriangle t = MembraneTriangleAt(scene_.membrane.cols, triangle);
  const Held held{scene_, *model_, *particles_};
  const SlitSheet sheet(held);
  const TriangleParts parts = sheet.Parts(t);
  SheetTriangle piece;
  for (std::size_t k = 0; k < 3; ++k) {
    piece.material[k] = scene_.membrane_material[t.nodes[k]];
  }
  if (parts.count == 0) {
    // Nothing that lives holds it: it lies between the lips.
    for (std::size_t k = 0; k < 3; ++k) {
      piece.place[k] = walk_.NodePlace(t.nodes[k]);
    }
    AddGaps(piece, axis, radius_m, [](const std::array<float, 3>&) { return true; });
    return;
  }
  for (std::size_t i = 0; i < parts.count; ++i) {
    piece.place = sheet.Corners(t.nodes, parts.owned[i]);
    AddGaps(piece, axis, radius_m, [&](const std::array<float, 3>& w) { return parts.IsOf(i, w); });
  }
}

/// Of a gap along the sheet's normal the half of its thickness is none, and what soft, wet tissue gives.
template <class Belongs>
void CauteryProbe::AddGaps(const SheetTriangle& piece, const MetalAxis& axis, float radius_m, const Belongs& belongs) {
  const auto& x = piece.place;
  const Vec3f normal = (x[1] - x[0]).cross(x[2] - x[0]).normalized();
  const float cushion = 0.5f * scene_.thermal.thickness_m + kContactSlack;
  ForCellsIn(piece.material, scene_.thermal.cell_m, gap_x_, gap_y_, gap_x_ + kGapCells - 1, gap_y_ + kGapCells - 1,
             [&](std::int32_t ix, std::int32_t iy, const std::array<float, 3>& w) {
               if (!belongs(w)) {
                 return;
               }
               const Vec3f p = w[0] * x[0] + w[1] * x[1] + w[2] * x[2];
               float& gap = gap_m_[static_cast<std::size_t>((iy - gap_y_) * kGapCells + ix - gap_x_)];
               for (std::size_t k = 1; k < axis.size(); ++k) {
                 const Vec3f along = axis[k] - axis[k - 1];
                 const Vec3f offset = axis[k - 1] + ClosestOnSegment(p, axis[k - 1], axis[k]) * along - p;
                 const float height = normal.dot(offset), off = std::max(std::abs(height) - cushion, 0.0f);
                 const float lateral_sq = std::max(offset.squaredNorm() - height * height, 0.0f);
                 gap = std::min(gap, std::sqrt(lateral_sq + off * off) - radius_m);
               }
             });
}

/// Cells of the mesh that the metal may be near to: around the places of its stations, and those of its contacts, which
/// find other folds, too.
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
  const float cell = scene_.thermal.cell_m;
  gap_x_ = static_cast<std::int32_t>(std::floor(centre.x() / cell)) - kGapCells / 2;
  gap_y_ = static_cast<std::int32_t>(std::floor(centre.y() / cell)) - kGapCells / 2;
  gap_m_.fill(2 * kFootprintReach);
  const MetalAxis axis{pose.ToWorld(Vec3f(tool.tip_length_m, 0, 0)), pose.p_WT, pose.ToWorld(Vec3f(0, 0, -kBareNeck))};
  FindNearCells(tool.tip_radius_m + kFootprintReach, collision);
  for (const Index near : near_cells_) {
    AddGaps(2 * near, axis, tool.tip_radius_m);
    AddGaps(2 * near + 1, axis, tool.tip_radius_m);
  }
  int left = kGapCells, right = -1, top = kGapCells, bottom = -1;
  for (int j = 0; j < kGapCells; ++j) {
    for (int i = 0; i < kGapCells; ++i) {
      if (gap_m_[static_cast<std::size_t>(j * kGapCells + i)] < kFootprintReach) {
        left = std::min(left, i);
        right = std::max(right, i);
        top = std::min(top, j);
        bottom = j;
      }
    }
  }
  if (right < 0) {
    return;
  }
  print->x = gap_x_ + left;
  print->y = gap_y_ + top;
  print->width = static_cast<std::uint32_t>(right - left + 1);
  for (int j = top; j <= bottom; ++j) {
    for (int i = left; i <= right; ++i) {
      print->gap.push_back(Footprint::Encode(gap_m_[static_cast<std::size_t>(j * kGapCells + i)]));
    }
  }
}

CauteryContact CauteryProbe::Update(std::uint32_t tool, const ToolPose& pose, const ToolCollision& collision) {
  CauteryContact contact;
  contact.tool = static_cast<std::uint8_t>(tool);
  const ToolDescription& description = scene_.tools[tool];
  if (stations_.empty()) {
    SetStations(description);
  }
  FollowSheet(pose, tool, collision);
  Vec2f centre = Vec2f::Zero();
  if (known_) {
    SignHeights();
  }
  if (!known_ || !FindCentre(description.tip_radius_m, &centre)) {
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
    const float dt = scene_.physics.dt_s;
    rate_ += dt / (dt + kRateSmoothing) * ((contact.material - last_material_) / dt - rate_);
  }
  contact.material_rate = rate_;
  was_touching_ = true;
  last_material_ = contact.material;
  return contact;
}

}  // namespace fulcrum::physics
