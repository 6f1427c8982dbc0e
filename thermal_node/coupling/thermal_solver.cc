#include "thermal_node/coupling/thermal_solver.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "services/base/core/hash.h"
#include "thermal_node/coupling/tip_parts.h"
#include "thermal_node/heat/sheet_materials.h"

namespace fulcrum::thermal {
namespace {

/// Half width of the square around the tip that is searched for blanched and charred tissue [cells].
constexpr int kSearchCells = 12;
/// Shortest time between two events of one kind [s]: few enough for sounds and the report; assumed.
constexpr float kSteamQuiet_s = 0.2f, kCutQuiet_s = 0.1f, kQuarantineQuiet_s = 1.0f;
constexpr float kCutReport_m = 5e-4f;  ///< A cut event per half millimetre.

/// If the tissue beneath is computed, the sheet's sink to it is set to 0: the contact with the volume replaces it.
ThermalParams SheetParams(ThermalParams params) {
  if (params.volume != 0) params.h_below_W_m2K = 0;
  return params;
}

std::vector<Material> MaterialsOf(const SheetScene& scene) {
  if (scene.thermal.model == ThermalModel::kPaper) return MakeMaterials(scene, scene.thermal, MakePaperMaterial);
  return MakeMaterials(scene, SheetParams(scene.thermal), MakeMaterial);
}

}  // namespace

ThermalSolver::ThermalSolver(const SheetScene& scene)
    : params_(scene.thermal),
      field_(MakeSheet(scene), MaterialsOf(scene)),
      topology_(scene, field_.sheet()),
      damage_(field_.material().body_C),
      protected_(scene, field_),
      source_(field_.materials(), field_.sheet()) {
  if (scene.thermal.model == ThermalModel::kPaper) paper_ = std::make_unique<PaperModel>(scene, field_.sheet());
  events_.reserve(64);
  alarms_.reserve(16);
  if (params_.volume != 0 && paper_ == nullptr && field_.sheet().tile_count() > 0) {
    volume_ = std::make_unique<VolumeField>(field_.sheet(), params_);
    contact_ = std::make_unique<SheetContact>(field_.materials(), volume_->material());
    source_.KeepLeak();
  }
  figures_.highest_C = figures_.present_C = field_.material().body_C;
}

bool ThermalSolver::Idle(std::span<const TipInput> tips) const {
  const bool below_idle = volume_ == nullptr || volume_->idle();
  const float hook_theta = source_.interface().hook_theta;
  const bool acts = std::any_of(tips.begin(), tips.end(), [&](const TipInput& tip) { return Acts(tip, hook_theta); });
  return !acts && field_.idle() && below_idle && !topology_.staged() && tears_.empty() && !protected_.warm() &&
         cut_length_m_ == cut_meter_.length_m();
}

void ThermalSolver::Step(std::span<const TipInput> tips, float dt_s) {
  events_.clear();
  committed_ = false;
  stepped_ = !Idle(tips);
  source_.CoolHook(dt_s);
  figures_.hook_C = field_.material().body_C + source_.interface().hook_theta;
  if (!stepped_) {
    memory_.energised = 0;
    figures_.power_W = figures_.set_power_W = figures_.voltage_V = 0;
    return;
  }
  ++frame_;
  clock_s_ += dt_s;
  const double before_J = ledger_.generator;
  paper_ == nullptr ? AccurateFrame(tips, dt_s) : PaperFrame(tips, dt_s);
  FollowLength(dt_s);
  UpdateProtected(dt_s);
  if (!tips.empty()) {
    const float time_s = Duration(tips, dt_s);
    figures_.power_W = static_cast<float>((ledger_.generator - before_J) / static_cast<double>(time_s));
    figures_.set_power_W = tips.back().active ? tips.back().power_W : 0.0f;
    const Vec2f before = last_tip_.path.to;
    last_tip_ = tips.back();
    // The slit that the metal has left may still become longer.
    if (!last_tip_.active && !last_tip_.touching) last_tip_.path.to = before;
    silent_s_ = 0;
  } else if ((silent_s_ += dt_s) > kSilent_s) {
    figures_.power_W = figures_.set_power_W = figures_.voltage_V = 0;
  }
  figures_.present_C = field_.material().body_C + field_.MaxTheta();
  figures_.highest_C = std::max(figures_.highest_C, figures_.present_C);
  ReportEvents(last_tip_);
}

void ThermalSolver::Tear(std::span<const std::uint8_t> torn_edges) {
  const std::size_t edges = 3 * std::size_t{topology_.rows()} * topology_.cols();
  tears_.clear();
  crack_.clear();
  for (std::size_t byte = 0; byte < std::min(torn_edges.size(), (edges + 7) / 8); ++byte) {
    if (torn_edges[byte] == 0) continue;
    for (std::size_t edge = 8 * byte; edge < std::min(8 * byte + 8, edges); ++edge) {
      if (TestBit(torn_edges, edge) && topology_.EdgeLives(static_cast<Index>(edge))) {
        const auto index = static_cast<Index>(edge);
        tears_.push_back(index);
        topology_.ForEdgesBeside(index, [&](Index other) {
          if (TestBit(torn_edges, other)) crack_.emplace_back(index, other);
        });
      }
    }
  }
}

/// Cells and mesh must agree, so a torn edge is severed by removing a line of cells across its strand. These lines are
/// joined across the triangles between them to one crack, which conducts neither heat nor current.
void ThermalSolver::StageTears() {
  if (tears_.empty()) return;
  RemovedBox taken;
  const auto take = [&](CellIndex cell) {
    Tile* tile = field_.Wake(cell.ix / kTile, cell.iy / kTile);
    const int k = (cell.iy % kTile) * kTile + cell.ix % kTile;
    if (tile == nullptr || (tile->state.flags[k] & kNoTissue) != 0) return;
    field_.TakeOut(tile, k, kRemoved, &ledger_.removed);
    taken.Add(cell);
  };
  for (const Index edge : tears_) topology_.ForCellsAcross(field_.sheet(), edge, take);
  for (const auto& [edge, other] : crack_) topology_.ForCellsBetween(field_.sheet(), edge, other, take);
  tears_.clear();
  crack_.clear();
  if (taken.empty()) return;
  for (int ty = taken.low.iy / kTile; ty <= taken.high.iy / kTile; ++ty) {
    for (int tx = taken.low.ix / kTile; tx <= taken.high.ix / kTile; ++tx) {
      if (Tile* tile = field_.Find(tx, ty); tile != nullptr && tile->state.awake != 0)
        field_.RefreshTheta(tile, &ledger_);
    }
  }
  topology_.StageCut(field_, taken.low, taken.high);
  torn_.Add(taken);
}

void ThermalSolver::AccurateFrame(std::span<const TipInput> tips, float dt_s) {
  source_.ClearStats();
  ApplySource(tips, dt_s, 0.0f, 0.5f);
  source_.DepositFar(&field_, true, &ledger_);
  figures_.substeps = field_.Diffuse(dt_s, &ledger_);
  ApplySource(tips, dt_s, 0.5f, 1.0f);
  source_.DepositFar(&field_, false, &ledger_);
  UpdateVolume(dt_s);
  UpdateDamage(dt_s);
  StageTears();
  UpdateTopology();
  if (!tips.empty()) figures_.voltage_V = tips.back().active ? source_.stats().voltage_V : 0.0f;
  figures_.shortened += source_.stats().shortened ? 1 : 0;
  figures_.solves = source_.stats().solves;
  figures_.iterations = source_.stats().iterations;
}

void ThermalSolver::PaperFrame(std::span<const TipInput> tips, float dt_s) {
  const TipInput tip = tips.empty() ? TipInput{} : tips.back();
  // The paper's electrode has a fixed voltage, so the set power has no influence.
  const float voltage = tip.active ? MakeDrive(params_, tip.mode, tip.power_W).v_max_V : 0.0f;
  if (tip.active) AddPath(tip.path, tip.mode);
  if (tip.active) paper_->Heat(&field_, {tip.path.from, tip.path.radius_m, voltage, tip.path.tented}, dt_s, &ledger_);
  figures_.substeps = field_.Diffuse(dt_s, &ledger_);
  paper_->CoolBorder(&field_, dt_s, &ledger_);
  StageTears();
  torn_ = {};
  const RemovedBox removed = paper_->RemoveNodes(&field_, &topology_, &ledger_);
  removed_.Add(removed);
  if (at_commit_frame()) UpdateCutMeter(std::exchange(removed_, {}));
  committed_ = at_commit_frame() && topology_.Commit();
  figures_.voltage_V = voltage;
  figures_.solves = tip.active ? 1 : 0;
  figures_.iterations = tip.active ? kPaperSweeps : 0;
}

void ThermalSolver::ApplySource(std::span<const TipInput> tips, float dt_s, float from, float to) {
  ForPartsOf(tips, dt_s, from, to, [&](const TipInput& tip, const TipPath& part, float length_s) {
    if (!Acts(tip, source_.interface().hook_theta)) return;
    const Drive drive = tip.active ? MakeDrive(params_, tip.mode, tip.power_W) : Drive{};
    if (tip.active) AddPath(part, tip.mode);
    source_.Run(&field_, part, drive, length_s, &ledger_);
    if (volume_ != nullptr && tip.active) AddLeakHeat(length_s);
  });
}

void ThermalSolver::AddLeakHeat(float duration_s) {
  const CellIndex corner = source_.corner();
  const float per_V2s = volume_->material().source_per_V2;
  for (int j = 0; j < kWindow; ++j) {
    for (int i = 0; i < kWindow; ++i) {
      const float v2s = source_.leak_V2s()[j * kWindow + i];
      if (v2s > 0.0f) volume_->AddSource({corner.ix + i, corner.iy + j}, per_V2s * v2s, duration_s);
    }
  }
}

void ThermalSolver::UpdateVolume(float dt_s) {
  if (volume_ == nullptr) return;
  contact_->Step(dt_s, &field_, volume_.get(), &ledger_);
  figures_.burn_depth_m = volume_->deepest_burn_m();
}

void ThermalSolver::UpdateDamage(float dt_s) {
  for (Tile* tile : field_.awake()) {
    if (!damage_.Update(tile, dt_s)) field_.QuarantineBadDamage(tile, &ledger_);
  }
}

void ThermalSolver::UpdateTopology() {
  const SourceStats& stats = source_.stats();
  if (stats.removed_cells > 0) {
    topology_.StageCut(field_, stats.low, stats.high);
    removed_.Add(RemovedBox{stats.low, stats.high});
  }
  if (!at_commit_frame()) {
    StageShrink();
    return;
  }
  if (!removed_.empty() || !torn_.empty()) {
    RemovedBox changed = removed_;
    changed.Add(torn_);
    const RemovedBox crumbs = crumbs_.TakeOut(&field_, changed, &ledger_);
    if (!crumbs.empty()) topology_.StageCut(field_, crumbs.low, crumbs.high);
    if (!removed_.empty()) {
      removed_.Add(crumbs);
      UpdateCutMeter(std::exchange(removed_, {}));
    }
    torn_ = {};
    figures_.debris_m2 = static_cast<float>(crumbs_.area_m2());
  }
  committed_ = topology_.Commit();
}

/// Each frame between two commits evaluates its share of the tiles, so that each tile is evaluated once per commit.
void ThermalSolver::StageShrink() {
  constexpr int kShares = kCommitFrames - 1;
  const int share = static_cast<int>(frame_ % kCommitFrames) - 1;
  for (const Tile* tile : field_.awake()) {
    // Below kDamageStart collagen does not change; see DamageModel.
    const bool due = (tile->tx + 2 * tile->ty) % kShares == share;
    if (due && tile->theta_max > kDamageStart) topology_.StageShrink(field_, *tile);
  }
}

void ThermalSolver::AddPath(const TipPath& path, CauteryMode mode) {
  if (mode == CauteryMode::kCut || mode == CauteryMode::kBlend) cut_meter_.AddPath(path.from, path.to);
}

void ThermalSolver::UpdateCutMeter(const RemovedBox& removed) {
  if (removed.empty()) return;
  cut_meter_.Update(field_, removed.low, removed.high);
  figures_.cut_width_p50_m = cut_meter_.width_p50_m();
  figures_.cut_width_p95_m = cut_meter_.width_p95_m();
  figures_.cut_off_way_m = cut_meter_.off_path_p95_m();
}

void ThermalSolver::FollowLength(float dt_s) {
  if (!at_commit_frame()) return;
  cut_length_m_ = std::min(cut_meter_.length_m(), cut_length_m_ + kLengthRate_m_s * kCommitFrames * dt_s);
}

void ThermalSolver::UpdateProtected(float dt_s) {
  protected_dt_s_ += dt_s;
  if (frame_ % kProtectedFrames != kProtectedFrame) return;
  alarms_.clear();
  protected_.Update(field_, volume_.get(), damage_.cell_death(), std::exchange(protected_dt_s_, 0.0f), &alarms_);
  for (const ProtectedAlarm& alarm : alarms_) {
    const bool ureter = alarm.kind == ProtectedKind::kUreter;
    const auto kind = alarm.injury ? (ureter ? ThermalEventKind::kUreterInjury : ThermalEventKind::kNerveInjury)
                                   : (ureter ? ThermalEventKind::kUreterWarning : ThermalEventKind::kNerveWarning);
    ++(alarm.injury ? figures_.injuries : figures_.warnings);
    Report(kind, alarm.material, alarm.theta, alarm.omega, 0.0f);
  }
}

void ThermalSolver::Report(ThermalEventKind kind, const Vec2f& at, float theta, float value, float quiet_s) {
  float& quiet_until = memory_.quiet_until_s[static_cast<std::size_t>(kind)];
  if (clock_s_ < quiet_until) return;
  quiet_until = clock_s_ + quiet_s;
  events_.push_back({kind, at, field_.material().body_C + theta, value});
}

void ThermalSolver::ReportEvents(const TipInput& tip) {
  const Vec2f at = tip.path.to;
  if (tip.active && memory_.energised == 0) {
    memory_.blanched = memory_.charred = memory_.opened = 0;
    Report(ThermalEventKind::kContact, at, field_.MaxTheta(), tip.power_W, 0.0f);
  }
  memory_.energised = tip.active ? 1 : 0;
  if (ledger_.vapour > memory_.vapour && tip.active) {
    Report(ThermalEventKind::kSteam, at, field_.material().theta_boil, figures_.power_W, kSteamQuiet_s);
  }
  memory_.vapour = ledger_.vapour;
  const bool opens = tip.active && memory_.opened == 0 && source_.stats().removed_cells > 0;
  if (opens) memory_.opened = 1;
  if (opens || cut_length_m() >= memory_.reported_cut_m + kCutReport_m) {
    memory_.reported_cut_m = cut_length_m();
    Report(ThermalEventKind::kCut, at, field_.MaxTheta(), cut_length_m(), kCutQuiet_s);
  }
  if (field_.quarantined() != memory_.quarantined) {
    memory_.quarantined = field_.quarantined();
    const Vec2f where = field_.sheet().CentreOf(field_.last_quarantined());
    Report(ThermalEventKind::kQuarantine, where, 0.0f, static_cast<float>(memory_.quarantined), kQuarantineQuiet_s);
  }
  if (!tip.active || !at_commit_frame() || (memory_.blanched != 0 && memory_.charred != 0)) return;
  const CellIndex centre = field_.sheet().CellOf(at);
  for (int dj = -kSearchCells; dj <= kSearchCells; ++dj) {
    for (int di = -kSearchCells; di <= kSearchCells; ++di) {
      const CellIndex cell{centre.ix + di, centre.iy + dj};
      if (!field_.sheet().Contains(cell)) continue;
      const Tile* tile = field_.Find(cell.ix / kTile, cell.iy / kTile);
      if (tile == nullptr) continue;
      const int k = (cell.iy % kTile) * kTile + cell.ix % kTile;
      const float theta = tile->theta[ThetaIndex(cell.ix % kTile, cell.iy % kTile)];
      if (memory_.blanched == 0 && tile->state.omega_collagen[k] >= 1.0f) {
        memory_.blanched = 1;
        Report(ThermalEventKind::kBlanch, field_.sheet().CentreOf(cell), theta, tile->state.omega_collagen[k], 0.0f);
      }
      if (memory_.charred == 0 && tile->state.charred[k] >= 0.5f) {
        memory_.charred = 1;
        Report(ThermalEventKind::kChar, field_.sheet().CentreOf(cell), theta, tile->state.charred[k], 0.0f);
      }
    }
  }
}

std::uint64_t ThermalSolver::TickHash() const {
  Hash64 hash;
  for (const Tile* tile : field_.awake()) {
    hash.AddValue(tile->index);
    hash.Add(std::span<const float>(tile->theta_sum));
  }
  if (volume_ != nullptr) volume_->AddSums(&hash);
  hash.AddValue(topology_.revision());
  hash.AddValue(ledger_.joule);
  hash.AddValue(ledger_.Out());
  hash.AddValue(cut_length_m());
  hash.AddValue(frame_);
  return hash.value();
}

std::uint64_t ThermalSolver::FullHash() const {
  Hash64 hash;
  hash.AddValue(TickHash());
  for (const Tile* tile : field_.Existing()) {
    const TileState& s = tile->state;
    if (IsBlank(s)) continue;
    hash.AddValue(tile->index);
    for (const auto* field : {&s.enthalpy, &s.water, &s.omega_cell, &s.omega_collagen, &s.charred}) {
      hash.Add(std::span<const float>(*field));
    }
    hash.Add(std::span<const std::uint8_t>(s.flags));
    hash.AddValue(s.awake);
    hash.AddValue(s.tented);
  }
  if (volume_ != nullptr) {
    for (const Brick* brick : volume_->Existing()) {
      hash.AddValue(brick->index);
      hash.AddValue(brick->awake);
      hash.Add(std::span<const float>(brick->enthalpy));
      hash.Add(std::span<const float>(brick->omega));
    }
  }
  const Interface& interface = source_.interface();
  for (const float value : {interface.film, interface.burning, interface.hook_theta}) hash.AddValue(value);
  const TopologyBits& bits = topology_.committed();
  for (const auto* field : {&bits.dead_nodes, &bits.dead_edges, &bits.shrink}) {
    hash.Add(std::span<const std::uint8_t>(*field));
  }
  for (const ProtectedSample& sample : protected_.samples()) {
    hash.AddValue(sample.theta);
    hash.AddValue(sample.omega);
  }
  return hash.value();
}

}  // namespace fulcrum::thermal
