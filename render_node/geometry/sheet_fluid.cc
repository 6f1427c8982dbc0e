#include "render_node/geometry/sheet_fluid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "render_node/geometry/texel.h"
#include "services/base/core/sheets.h"

namespace fulcrum::render {
namespace {

constexpr int kFilmCells = 2;   // Of the film in a cell, in each direction.
constexpr int kFilmTexels = 2;  // Of the atlas in a cell of its film.
constexpr int kSubsteps = 4;
constexpr float kGravity_m_s2 = 9.81f;
// Kinematic viscosity at 37 degrees: blood of a haematocrit of 45 % at high shear (3.5 mPa s), and water [m^2/s].
constexpr float kBlood_m2_s = 3.3e-6f, kWater_m2_s = 0.7e-6f;
constexpr float kWets_m = 5e-5f;     // Assumed: so much stays on the tissue.
constexpr float kGives = 0.2f;       // Largest share for one neighbour in a substep: all four leave a fifth.
constexpr float kSteepest = 0.3f;    // A level surface on a steeper wall is as thick as on this one.
constexpr float kMost_m = 0.006f;    // Thicker liquid runs over the side that holds it.
constexpr float kRough_m = 7e-5f;    // Assumed unevenness of the tissue, which leads a run to the sides …
constexpr float kWave_per_m = 2100;  // … about 3 mm from crest to crest.
// Front of a liquid on dry tissue: a thinner one does not advance, which keeps a run narrow.
constexpr float kFront_m = 2.5e-4f;
constexpr float kNothing_m = 4e-7f;  // What flows to one neighbour in a substep; less is not seen in seconds.
constexpr float kDry_m = 1e-8f;
constexpr float kReach_m = 0.003f;      // Of the suction, beyond the wall of the tube,
constexpr float kSideHoles_m = 0.010f;  // along its last centimetre, which has holes.
constexpr float kDraws_s = 0.06f;       // Time constant at the holes.
constexpr float kClotDraws = 0.03f;     // A clot is drawn so much more slowly, and only where the tube touches it.
constexpr float kClotReach_m = 0.001f;
constexpr float kJet_m = 0.06f;  // A jet that meets no tissue so far ahead meets none.
constexpr float kJetRadius_m = 0.003f, kJetWidens = 0.05f;
constexpr float kWetting_m_s = 0.012f;  // Assumed: the jet leaves so much in its middle; the rest splashes off, clear.
constexpr float kJetDepth_m = 0.0012f;  // The jet drives thicker liquid off.
constexpr float kLoosens_s = 6;         // Time constant with which the jet breaks a clot up.
constexpr float kClots_s = 90;          // Time constants, assumed: of undiluted blood to clot,
constexpr float kAbsorbed_s = 30;       // of a film of water to be absorbed.
constexpr float kFilm_m = 2 * kWets_m;  // At most, of what no longer flows.
constexpr float kLastBlood_m = 2e-6f;   // What is left clots at once.

float Share(float seconds, float time_constant_s) { return 1 - std::exp(-seconds / time_constant_s); }

/// Distance from p to the tube's last centimetre, from its wall on [m]; negative inside.
float FromHoles(const WorkingTube& tube, const Vec3f& p) {
  const float behind = std::clamp((tube.tip_W - p).dot(tube.axis_W), 0.0f, kSideHoles_m);
  return (p - tube.tip_W + behind * tube.axis_W).norm() - tube.radius_m;
}

std::uint8_t ByteOf(float thickness, float full) {
  return static_cast<std::uint8_t>(255 * std::min(1.0f, thickness / full) + 0.5f);
}

}  // namespace

SheetFluid::Cell SheetFluid::CellOf(int x, int y) const {
  return static_cast<Cell>(TexelIndex(x + 1, y + 1, width_ + 2));
}

std::array<SheetFluid::Cell, 4> SheetFluid::Neighbours(Cell cell) const {
  const auto row = static_cast<Cell>(width_ + 2);
  return {cell + 1, cell - 1, cell + row, cell - row};
}

void SheetFluid::MakeCells() {
  const MembraneGrid& grid = scene_.membrane;
  cell_m_ = kFilmCells * kFilmTexels * grid.texel_m;
  Vec2f extent = Vec2f::Zero();
  for (const Vec2f& m : scene_.membrane_material) extent = extent.cwiseMax(m);
  width_ = static_cast<int>(extent.x() / cell_m_) + 1;
  height_ = static_cast<int>(extent.y() / cell_m_) + 1;
  const std::size_t count = static_cast<std::size_t>(width_ + 2) * static_cast<std::size_t>(height_ + 2);
  anchors_.assign(count, {});
  columns_.assign(count, {});
  place_.assign(count, Vec3f::Zero());
  steepness_.assign(count, 1.0f);
  rough_.assign(count, std::numeric_limits<float>::quiet_NaN());
  level_.assign(count, 0.0f);
  rested_z_.assign(count, 0.0f);
  of_.assign(count, 0);
  is_wet_.assign(count, 0);
  const auto first = [](float low) { return std::max(0, static_cast<int>(low - 0.5f)); };
  for (std::uint32_t row = 0; row + 1 < grid.rows; ++row) {
    for (std::uint32_t col = 0; col + 1 < grid.cols; ++col) {
      for (int half = 0; half < (HasCell(scene_, row, col) ? 2 : 0); ++half) {
        const MembraneTriangle t = MembraneTriangleAt(grid.cols, row, col, half);
        const Vec2f a = scene_.membrane_material[t.nodes[0]] / cell_m_;
        const Vec2f ab = scene_.membrane_material[t.nodes[1]] / cell_m_ - a;
        const Vec2f ac = scene_.membrane_material[t.nodes[2]] / cell_m_ - a;
        const float area = ab.x() * ac.y() - ab.y() * ac.x();
        if (std::abs(area) < 1e-6f) continue;  // [cells]: a triangle without extent.
        const Vec2f low = a + Vec2f::Zero().cwiseMin(ab).cwiseMin(ac);
        const Vec2f high = a + Vec2f::Zero().cwiseMax(ab).cwiseMax(ac);
        for (int y = first(low.y()); y <= std::min(height_ - 1, static_cast<int>(high.y())); ++y) {
          for (int x = first(low.x()); x <= std::min(width_ - 1, static_cast<int>(high.x())); ++x) {
            const Vec2f p = Vec2f(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f) - a;
            const float b1 = (p.x() * ac.y() - p.y() * ac.x()) / area, b2 = (ab.x() * p.y() - ab.y() * p.x()) / area;
            constexpr float kEdge = -1e-4f;  // A middle on an edge belongs to one of the two at least.
            const bool inside = b1 >= kEdge && b2 >= kEdge && 1 - b1 - b2 >= kEdge;
            if (inside && !Tissue(CellOf(x, y))) anchors_[CellOf(x, y)] = {t.nodes, b1, b2};
          }
        }
      }
    }
  }
}

SheetFluid::Cell SheetFluid::CellAt(const Vec2f& material) const {
  if (width_ == 0) return kNoIndex;
  const Vec2f place = material / cell_m_;
  const bool within = place.x() >= 0 && place.y() >= 0 && place.x() < static_cast<float>(width_) &&
                      place.y() < static_cast<float>(height_);
  const Cell cell = within ? CellOf(static_cast<int>(place.x()), static_cast<int>(place.y())) : kNoIndex;
  return within && Tissue(cell) ? cell : kNoIndex;
}

void SheetFluid::Wet(Cell cell) {
  if (is_wet_[cell] != 0) return;
  is_wet_[cell] = 1;
  wet_.push_back(cell);
  FindShapeAround(cell);
}

void SheetFluid::Changed(Cell cell) {
  const int x = static_cast<int>(cell) % (width_ + 2) - 1, y = static_cast<int>(cell) / (width_ + 2) - 1;
  changed_ = changed_.United({x, y, 1, 1});
}

double SheetFluid::Bleed(const Vec2f& material, double volume_m3) {
  if (width_ == 0) MakeCells();
  const Cell cell = CellAt(material);
  if (cell == kNoIndex) return 0;
  const float before = columns_[cell].blood;
  columns_[cell].blood += static_cast<float>(volume_m3 / VolumeOf(1));
  Wet(cell);
  flows_ = ages_ = true;
  return VolumeOf(columns_[cell].blood - before);
}

void SheetFluid::SetShape(const MembraneMesh& membrane, const Atlas* atlas) {
  sheet_ = &membrane;
  atlas_ = atlas;
  ++shape_;
  // Of one cell against its height when all came to rest, so that slow motion adds up.
  constexpr float kMoved_m = 2e-5f;
  for (const Cell cell : wet_) {
    FindShapeAround(cell);
    flows_ = flows_ || std::abs(place_[cell].z() - rested_z_[cell]) > kMoved_m;
  }
}

void SheetFluid::FindShapeAround(Cell cell) {
  FindShape(cell);
  for (const Cell other : Neighbours(cell)) {
    if (Tissue(other)) FindShape(other);
  }
}

void SheetFluid::FindShape(Cell cell) {
  if (of_[cell] == shape_ || sheet_ == nullptr) return;
  of_[cell] = shape_;
  const Anchor& at = anchors_[cell];
  const auto positions = sheet_->positions();
  const Vec3f &a = positions[at.nodes[0]], &b = positions[at.nodes[1]], &c = positions[at.nodes[2]];
  place_[cell] = a + at.b1 * (b - a) + at.b2 * (c - a);
  const Vec3f normal = (b - a).cross(c - a);
  steepness_[cell] = std::max(kSteepest, std::abs(normal.z()) / std::max(normal.norm(), 1e-12f));
  const auto row = static_cast<Cell>(width_ + 2);
  if (std::isnan(rough_[cell])) {
    const float s = kWave_per_m * cell_m_ * static_cast<float>(cell % row);
    const float t = kWave_per_m * cell_m_ * static_cast<float>(cell / row);
    rough_[cell] = kRough_m * std::sin(s + std::sin(0.43f * t)) * std::sin(0.9f * t + std::sin(0.52f * s));
  }
  place_[cell].z() += rough_[cell];
  if (atlas_ != nullptr && atlas_->removals() > 0) {
    // Its index counts the border around the sheet.
    const Vec2f middle(static_cast<float>(cell % row) - 0.5f, static_cast<float>(cell / row) - 0.5f);
    // Of a slit that is narrower than a cell no middle need be removed.
    bool cut = false;
    for (const float x : {-0.375f, -0.125f, 0.125f, 0.375f}) {
      for (const float y : {-0.375f, -0.125f, 0.125f, 0.375f}) {
        cut = cut || atlas_->Removed(cell_m_ * (middle + Vec2f(x, y)));
      }
    }
    if (cut) place_[cell].z() -= kSlit_m;
  }
  level_[cell] = place_[cell].z();
}

void SheetFluid::Step(std::span<const WorkingTube> tubes) {
  const bool works = std::any_of(tubes.begin(), tubes.end(), [](const auto& t) { return t.flow != TubeFlow::kNone; });
  if ((!flows_ || wet_.empty()) && !works) return;
  for (const WorkingTube& tube : tubes) {
    if (tube.flow == TubeFlow::kIrrigates) Irrigate(tube);
    if (tube.flow == TubeFlow::kAspirates) Aspirate(tube);
  }
  for (int k = 0; k < kSubsteps; ++k) Flow();
  for (const Cell cell : wet_) Changed(cell);
  DropDry();
  if (flows_) return;
  for (const Cell cell : wet_) rested_z_[cell] = place_[cell].z();
}

void SheetFluid::DropDry() {
  std::erase_if(wet_, [this](Cell cell) {
    Column& column = columns_[cell];
    if (column.liquid() > kMost_m) Spill(cell, 1 - kMost_m / column.liquid());
    if (column.liquid() + column.clot >= kDry_m) return false;
    ran_off_m3_ += VolumeOf(column.blood + column.clot);
    column = {};
    is_wet_[cell] = 0;
    level_[cell] = place_[cell].z();
    return true;
  });
}

void SheetFluid::Spill(Cell cell, float share) {
  Column& column = columns_[cell];
  ran_off_m3_ += VolumeOf(share * column.blood);
  column.blood -= share * column.blood;
  column.water -= share * column.water;
}

bool SheetFluid::HeldAtRim(Cell cell) const {
  const Index node = anchors_[cell].nodes[0];
  return node < rim_.size() && rim_[node] > 0.5f;
}

void SheetFluid::Flow() {
  constexpr float kSubstep_s = static_cast<float>(kStep_s) / kSubsteps;
  transfers_.clear();
  for (const Cell cell : wet_) {
    const Column& column = columns_[cell];
    level_[cell] = place_[cell].z() + (column.liquid() + column.clot) / steepness_[cell];
  }
  for (const Cell cell : wet_) {
    const Column& column = columns_[cell];
    const float mobile = column.liquid() - kWets_m;
    if (mobile <= 0) continue;
    const float viscosity = (kBlood_m2_s * column.blood + kWater_m2_s * column.water) / column.liquid();
    const float carries = kGravity_m_s2 * mobile * mobile * mobile / (3 * viscosity) * kSubstep_s / cell_m_;
    for (const Cell other : Neighbours(cell)) {
      float gives = 0;  // [m]
      const bool on = Tissue(other);
      if (on) {
        const float fall = level_[cell] - level_[other];
        if (fall <= 0 || (mobile < kFront_m && columns_[other].liquid() < 0.5f * kWets_m)) continue;
        gives = std::min({carries * fall / cell_m_, kGives * mobile, kGives * fall * steepness_[cell]});
      } else if (!HeldAtRim(cell)) {
        gives = std::min(carries, kGives * mobile);
      }
      if (gives < kNothing_m) continue;
      const float share = gives / column.liquid();
      transfers_.push_back({cell, on ? other : kNoIndex, share * column.blood, share * column.water});
    }
  }
  // What a cell gives refers to what it had before the substep.
  for (const Transfer& transfer : transfers_) {
    columns_[transfer.from].blood -= transfer.blood;
    columns_[transfer.from].water -= transfer.water;
    if (transfer.to == kNoIndex) {
      ran_off_m3_ += VolumeOf(transfer.blood);
      continue;
    }
    columns_[transfer.to].blood += transfer.blood;
    columns_[transfer.to].water += transfer.water;
    Wet(transfer.to);
  }
  flows_ = !transfers_.empty();
}

void SheetFluid::Aspirate(const WorkingTube& tube) {
  constexpr auto kStep = static_cast<float>(kStep_s);
  const float share = Share(kStep, kDraws_s);
  const auto near_share = [&](Cell cell) {
    const float away = std::max(0.0f, FromHoles(tube, place_[cell]));
    return away < kReach_m ? share * (1 - away / kReach_m) : 0.0f;
  };
  double wanted_m3 = 0;
  for (const Cell cell : wet_) wanted_m3 += VolumeOf(near_share(cell) * columns_[cell].liquid());
  const double most_m3 = static_cast<double>(kAspiration_m3_s) * kStep_s;
  const float part = wanted_m3 > most_m3 ? static_cast<float>(most_m3 / wanted_m3) : 1.0f;
  for (const Cell cell : wet_) {
    const float taken = part * near_share(cell);
    if (taken <= 0) continue;
    Column& column = columns_[cell];
    const float blood = taken * column.blood;
    const float clot = FromHoles(tube, place_[cell]) < kClotReach_m ? kClotDraws * taken * column.clot : 0.0f;
    aspirated_m3_ += VolumeOf(blood + clot);
    column.blood -= blood;
    column.water -= taken * column.water;
    column.clot -= clot;
  }
  flows_ = true;
}

/// The node of the sheet that the jet meets first, and in its middle.
Index SheetFluid::NodeAhead(const WorkingTube& tube) const {
  constexpr float kPressed_m = 0.003f;  // A tube that presses on the tissue is a little beneath its nodes.
  Index nearest = kNoIndex;
  float least_m = kJet_m;
  for (Index node = 0; node < scene_.membrane.node_count(); ++node) {
    if (sheet_->node_gone(node)) continue;
    const Vec3f to = sheet_->positions()[node] - tube.tip_W;
    const float ahead = to.dot(tube.axis_W);
    const float beside = (to - ahead * tube.axis_W).norm();
    if (ahead < -kPressed_m || beside >= kJetRadius_m || ahead + beside >= least_m) continue;
    nearest = node;
    least_m = ahead + beside;
  }
  return nearest;
}

void SheetFluid::Irrigate(const WorkingTube& tube) {
  if (sheet_ == nullptr) return;
  const Index node = NodeAhead(tube);
  if (node == kNoIndex) return;
  if (width_ == 0) MakeCells();
  constexpr auto kStep = static_cast<float>(kStep_s);
  const Vec2f centre = scene_.membrane_material[node] / cell_m_;
  const float ahead = std::max(0.0f, (sheet_->positions()[node] - tube.tip_W).dot(tube.axis_W));
  const float radius_m = kJetRadius_m + kJetWidens * ahead, radius = radius_m / cell_m_;
  const auto from = [radius](float middle) { return std::max(0, static_cast<int>(middle - radius)); };
  const auto to = [radius](float middle, int count) { return std::min(count - 1, static_cast<int>(middle + radius)); };
  for (int y = from(centre.y()); y <= to(centre.y(), height_); ++y) {
    for (int x = from(centre.x()); x <= to(centre.x(), width_); ++x) {
      const Vec2f middle(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
      const float r2 = (middle - centre).squaredNorm() / (radius * radius);
      const Cell cell = CellOf(x, y);
      if (r2 >= 1 || !Tissue(cell)) continue;
      Column& column = columns_[cell];
      column.water += kWetting_m_s * kStep * (1 - r2);
      const float loosened = Share(kStep * (1 - r2), kLoosens_s) * column.clot;
      column.clot -= loosened;
      column.blood += loosened;
      if (column.liquid() > kJetDepth_m) Spill(cell, 1 - kJetDepth_m / column.liquid());
      Wet(cell);
    }
  }
  flows_ = ages_ = true;
}

void SheetFluid::Age(double seconds) {
  const float clots = Share(static_cast<float>(seconds), kClots_s);
  const float absorbed = Share(static_cast<float>(seconds), kAbsorbed_s);
  ages_ = false;
  for (const Cell cell : wet_) {
    Column& column = columns_[cell];
    if (column.liquid() <= 0) continue;
    const float undiluted = column.blood / column.liquid();
    const float clotted = column.blood < kLastBlood_m ? column.blood : clots * undiluted * undiluted * column.blood;
    column.blood -= clotted;
    column.clot += clotted;
    if (column.water < kFilm_m) column.water -= column.water < kLastBlood_m ? column.water : absorbed * column.water;
    ages_ = ages_ || column.liquid() > 0;
    Changed(cell);
  }
}

bool SheetFluid::Show(Atlas* atlas) {
  if (changed_.empty()) return false;
  // A cell of the film lies a quarter of a cell beside the middle of this one. A smooth kernel, because a front that
  // stands still would show the edges of the cells.
  constexpr std::array<float, 3> kNearer{0.14f, 0.47f, 0.39f};  // Of the cells before, at and after, on the near side.
  const auto column = [this](int x, int y) {
    return x >= 0 && y >= 0 && x < width_ && y < height_ ? columns_[CellOf(x, y)] : Column{};
  };
  const auto smooth = [&](int x, int y) {
    const int along = x % kFilmCells == 0 ? -1 : 1, across = y % kFilmCells == 0 ? -1 : 1;
    Column sum;
    for (int v = -1; v <= 1; ++v) {
      for (int u = -1; u <= 1; ++u) {
        const Column near = column(x / kFilmCells + along * u, y / kFilmCells + across * v);
        const float weight = kNearer[static_cast<std::size_t>(u + 1)] * kNearer[static_cast<std::size_t>(v + 1)];
        sum.blood += weight * near.blood;
        sum.water += weight * near.water;
        sum.clot += weight * near.clot;
      }
    }
    return sum;
  };
  bool changed = false;
  const int x0 = std::max(0, kFilmCells * (changed_.x - 1)), y0 = std::max(0, kFilmCells * (changed_.y - 1));
  const int x1 = std::min(atlas->film_width(), kFilmCells * (changed_.x + changed_.width + 1));
  const int y1 = std::min(atlas->film_height(), kFilmCells * (changed_.y + changed_.height + 1));
  for (int y = y0; y < y1; ++y) {
    for (int x = x0; x < x1; ++x) {
      const Column film = smooth(x, y);
      changed |= atlas->SetLiquid(x, y, ByteOf(film.blood + film.clot, kFullBlood_m), ByteOf(film.clot, kFullClot_m),
                                  ByteOf(film.water, kFullWater_m));
    }
  }
  changed_ = {};
  return changed;
}

SheetFluid::Balance SheetFluid::blood() const {
  Balance balance{0, 0, aspirated_m3_, ran_off_m3_};
  for (const Cell cell : wet_) {
    balance.liquid += VolumeOf(columns_[cell].blood);
    balance.clotted += VolumeOf(columns_[cell].clot);
  }
  return balance;
}

SheetFluid::Column SheetFluid::At(const Vec2f& material) const {
  const Cell cell = CellAt(material);
  return cell == kNoIndex ? Column{} : columns_[cell];
}

}  // namespace fulcrum::render
