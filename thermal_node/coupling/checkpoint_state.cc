// Checkpoint layout of the thermal solver: a header, the potential's start value, the cut's centre line and tool path,
// protected structures, topology, then every tile that is not blank (checkpoint_bytes.h), then the bricks of the volume
// with the rows that differ from 0. That of the solids' surface: a record, the potential's start value, tiles.
#include <algorithm>
#include <cmath>
#include <utility>

#include "thermal_node/coupling/checkpoint_bytes.h"
#include "thermal_node/coupling/solid_surface.h"
#include "thermal_node/coupling/thermal_solver.h"

namespace fulcrum::thermal {

namespace {

/// Identifies the layout; must change with it.
constexpr std::uint64_t kLayout = 0x7468726d'0000000aull;
constexpr std::uint64_t kSolidLayout = 0x736f6c69'00000003ull;
/// A checkpoint of one model cannot be restored by another, so the model is part of the layout.
constexpr std::uint64_t LayoutOf(ThermalModel model) { return kLayout + (static_cast<std::uint64_t>(model) << 16); }
/// Bytes for tiles: about 1100 with all their arrays, enough for half a metre of cut; a checkpoint that needs
/// more is not written and Health reports it.
constexpr std::size_t kTileCapacity = std::size_t{24} << 20;
/// Bytes for tiles of the solids' surface: about 380 with all their arrays, 150 square centimetres.
constexpr std::size_t kSolidTileCapacity = std::size_t{8} << 20;
/// Bytes for the centre line of three metres of cut and for the tool path.
constexpr std::size_t kCutCapacity =
    (std::size_t{1} << 15) * sizeof(CellIndex) + kPathCapacity * sizeof(ToolPath::Point);
/// Bytes for bricks: about thirty that are damaged down to the bottom.
constexpr std::size_t kVolumeCapacity = std::size_t{32} << 20;

bool IsPlausible(const SourceWindow::State& window) {
  // A start value: any finite number is valid. It lies between 0 and 1 where the last solve converged.
  return AllWithin(window.start, -1e3f, 1e3f) && std::abs(window.corner.ix) <= -kNowhere.ix &&
         std::abs(window.corner.iy) <= -kNowhere.iy && window.step_s >= 0.0f && std::isfinite(window.step_s) &&
         window.interface.IsPlausible();
}

/// Stored record of a brick: its warm box, and the box of the rows that hold damage.
struct BrickRecord {
  std::int32_t index, awake;
  WarmBox warm, damaged;
};

WarmBox DamagedBox(const Brick& brick) {
  WarmBox box;
  for (int k = 0; k < kLayers; ++k) {
    for (int j = 0; j < kBrick; ++j) {
      const float* row = &brick.omega[BrickIndex(0, j, k)];
      if (std::none_of(row, row + kBrick, [](float omega) { return omega != 0.0f; })) continue;
      box = {0, kBrick, std::min(box.row0, j), std::max(box.row1, j + 1), k + 1};
    }
  }
  return box;
}

/// Calls visit(rows of a layer) for all layers of the box until it returns false.
template <class Cells, class Visit>
bool ForRows(const WarmBox& box, Cells& cells, const Visit& visit) {
  if (box.empty()) return true;
  for (int k = 0; k < box.layers; ++k) {
    const auto count = static_cast<std::size_t>(box.row1 - box.row0) * kBrick;
    if (!visit(std::span(&cells[BrickIndex(0, box.row0, k)], count))) return false;
  }
  return true;
}

bool IsValid(const WarmBox& box, int columns, int rows) {
  const auto good = [](int value, int step) { return value >= 0 && value <= kBrick && value % step == 0; };
  return good(box.col0, columns) && good(box.col1, columns) && good(box.row0, rows) && good(box.row1, rows) &&
         (box.empty() || box.col0 < box.col1) && box.layers >= 0 && box.layers <= kLayers;
}

void PutVolume(const VolumeField& volume, Writer* writer) {
  const std::vector<const Brick*> bricks = volume.Existing();
  VolumeField::Totals totals = volume.totals();
  totals.brick_count = static_cast<std::uint32_t>(bricks.size());
  writer->PutValue(totals);
  const auto put = [&](std::span<const float> rows) {
    writer->Put(rows);
    return true;
  };
  for (const Brick* brick : bricks) {
    const BrickRecord record{brick->index, brick->awake ? 1 : 0, brick->box, DamagedBox(*brick)};
    writer->PutValue(record);
    ForRows(record.warm, brick->enthalpy, put);
    ForRows(record.damaged, brick->omega, put);
  }
}

bool GetVolume(Reader* reader, VolumeField* volume) {
  VolumeField::Totals totals;
  if (!reader->GetValue(&totals)) return false;
  const VolumeLedger& ledger = totals.ledger;
  if (!std::isfinite(ledger.joule + ledger.from_sheet + ledger.perfused + ledger.dropped + ledger.quarantined) ||
      !(totals.deepest_burn_m >= 0 && std::isfinite(totals.deepest_burn_m))) {
    return false;
  }
  const auto get = [&](std::span<float> rows) { return reader->Get(rows); };
  std::int32_t last = -1;
  for (std::uint32_t n = 0; n < totals.brick_count; ++n) {
    BrickRecord record;
    if (!reader->GetValue(&record) || record.index <= last || record.index >= volume->brick_count() ||
        !IsValid(record.warm, kBoxColumns, kBoxRows) || !IsValid(record.damaged, 1, 1)) {
      return false;
    }
    last = record.index;
    Brick* brick = volume->BeginRestore(record.index);
    brick->box = record.warm;
    brick->awake = record.awake != 0;
    if (!ForRows(record.warm, brick->enthalpy, get) || !ForRows(record.damaged, brick->omega, get)) return false;
    volume->FinishRestore(brick);
  }
  volume->RestoreTotals(totals);
  return true;
}

}  // namespace

struct ThermalSolver::Header {
  std::uint64_t layout;
  std::uint64_t frame, revision, quarantined;
  Ledger ledger;
  SolverFigures figures;
  EventMemory memory;
  RemovedBox removed;
  ToolPath::End path_end;
  std::array<float, 2> last_at;  ///< Of the newest sample [m].
  float measured_length_m, cut_length_m, clock_s, protected_dt_s;
  std::uint32_t tile_count, line_count, path_count, sample_count, structure_count;
  std::uint32_t node_bytes, edge_bytes, shrink_bytes, protected_warm, has_volume, last_active, spare;

  [[nodiscard]] bool Finite() const {
    float sum = clock_s + protected_dt_s + memory.reported_cut_m;
    for (const float quiet : memory.quiet_until_s) sum += quiet;
    for (const float figure :
         {figures.highest_C, figures.present_C, figures.power_W, figures.voltage_V, figures.debris_m2,
          figures.cut_width_p50_m, figures.cut_width_p95_m, figures.cut_off_way_m})
      sum += figure;
    return std::isfinite(sum) &&
           std::isfinite(ledger.joule + ledger.generator + ledger.Out() + ledger.hook + ledger.film + ledger.plume) &&
           std::isfinite(memory.vapour);
  }
};

std::size_t ThermalSolver::CheckpointCapacity(const SheetScene& scene) {
  const std::size_t nodes = scene.membrane.node_count();
  const std::size_t fixed = (std::size_t{1} << 18) + kCutCapacity + 64 * scene.protected_points.size() + 4 * nodes;
  const Sheet sheet = MakeSheet(scene);
  const std::size_t tiles = std::min(kTileCapacity, sheet.tile_count() * (sizeof(TileState) + 64));
  if (scene.thermal.model == ThermalModel::kPaper) return fixed + tiles + TexturePotential::StateBytes();
  if (scene.thermal.volume == 0 || sheet.tile_count() == 0) return fixed + tiles;
  const std::size_t bricks = VolumeField(sheet, scene.thermal).brick_count();
  constexpr std::size_t kBrickBytes = 2 * sizeof(float) * kBrickCells + 64;
  return fixed + tiles + std::min(kVolumeCapacity, bricks * kBrickBytes + 128);
}

std::size_t ThermalSolver::Save(std::span<std::byte> out) const {
  if (topology_.staged()) return 0;
  Writer writer(out);
  Header header{};
  header.layout = LayoutOf(params_.model);
  header.frame = frame_;
  header.revision = topology_.revision();
  header.quarantined = field_.quarantined();
  header.ledger = ledger_;
  header.figures = figures_;
  header.memory = memory_;
  header.last_at = {last_tip_.path.to.x(), last_tip_.path.to.y()};
  header.last_active = last_tip_.active ? 1 : 0;
  header.clock_s = clock_s_;
  header.protected_dt_s = protected_dt_s_;
  header.tile_count = StoredTiles(field_);
  std::vector<CellIndex> line;
  for (const LineCell& cell : cut_meter_.line()) line.push_back(cell.at);
  const std::span<const ToolPath::Point> path = cut_meter_.path().points();
  header.removed = removed_;
  header.path_end = cut_meter_.path().end();
  header.measured_length_m = cut_meter_.length_m();
  header.cut_length_m = cut_length_m_;
  header.line_count = static_cast<std::uint32_t>(line.size());
  header.path_count = static_cast<std::uint32_t>(path.size());
  header.sample_count = static_cast<std::uint32_t>(protected_.samples().size());
  header.structure_count = static_cast<std::uint32_t>(protected_.alarm_state().size());
  const TopologyBits& bits = topology_.committed();
  header.node_bytes = static_cast<std::uint32_t>(bits.dead_nodes.size());
  header.edge_bytes = static_cast<std::uint32_t>(bits.dead_edges.size());
  header.shrink_bytes = static_cast<std::uint32_t>(bits.shrink.size());
  header.protected_warm = protected_.warm() ? 1 : 0;
  header.has_volume = volume_ != nullptr ? 1 : 0;
  writer.PutValue(header);
  SourceWindow::State window;
  source_.Export(&window);
  writer.PutValue(window);
  if (paper_ != nullptr) {
    writer.PutValue(paper_->corner());
    writer.Put(std::as_const(*paper_).potential());
  }
  writer.Put(std::span<const CellIndex>(line));
  writer.Put(path);
  writer.Put(protected_.samples());
  writer.Put(protected_.alarm_state());
  for (const auto* field : {&bits.dead_nodes, &bits.dead_edges, &bits.shrink}) {
    writer.Put(std::span<const std::uint8_t>(*field));
  }
  PutTiles(field_, &writer);
  if (volume_ != nullptr) PutVolume(*volume_, &writer);
  return writer.used();
}

bool ThermalSolver::Restore(std::span<const std::byte> bytes) {
  Reader reader(bytes);
  Header header;
  SourceWindow::State window;
  if (!reader.GetValue(&header) || header.layout != LayoutOf(params_.model) || !header.Finite() ||
      !reader.GetValue(&window)) {
    return false;
  }
  // Without contact so far the place is 0.
  const Vec2f last_at(header.last_at[0], header.last_at[1]);
  const bool at_rest = header.last_active == 0 && last_at == Vec2f::Zero();
  if (!IsPlausible(window) || header.last_active > 1 || !(at_rest || field_.sheet().OnSheet(last_at))) return false;
  CellIndex paper_corner;
  std::vector<float> paper_potential(paper_ != nullptr ? paper_->potential().size() : 0);
  if (paper_ != nullptr && (!reader.GetValue(&paper_corner) || !reader.Get(std::span(paper_potential)))) return false;
  TopologyBits bits = topology_.committed();
  if (header.node_bytes != bits.dead_nodes.size() || header.edge_bytes != bits.dead_edges.size() ||
      header.shrink_bytes != bits.shrink.size() || header.sample_count != protected_.samples().size() ||
      header.has_volume != (volume_ != nullptr ? 1u : 0u) ||
      header.structure_count != protected_.alarm_state().size() || header.path_count > kPathCapacity ||
      header.line_count > static_cast<std::uint32_t>(field_.sheet().tile_count()) * kTileCells ||
      !(header.removed.empty() ||
        (field_.sheet().Contains(header.removed.low) && field_.sheet().Contains(header.removed.high))) ||
      header.tile_count > static_cast<std::uint32_t>(field_.sheet().tile_count())) {
    return false;
  }
  std::vector<CellIndex> line(header.line_count);
  std::vector<ToolPath::Point> path(header.path_count);
  if (!reader.Get(std::span(line)) || !reader.Get(std::span(path))) return false;
  std::vector<ProtectedSample> samples(header.sample_count);
  std::vector<std::uint8_t> alarm_state(header.structure_count);
  if (!reader.Get(std::span(samples)) || !reader.Get(std::span(alarm_state)) ||
      !reader.Get(std::span(bits.dead_nodes)) || !reader.Get(std::span(bits.dead_edges)) ||
      !reader.Get(std::span(bits.shrink))) {
    return false;
  }
  const auto finite = [](const ProtectedSample& sample) { return std::isfinite(sample.theta + sample.omega); };
  if (!std::all_of(samples.begin(), samples.end(), finite) || !topology_.Fits(bits)) {
    return false;
  }
  if (!GetTiles(&reader, header.tile_count, &field_)) return false;
  const bool volume_good = volume_ == nullptr || GetVolume(&reader, volume_.get());
  const bool length_good = header.cut_length_m >= 0.0f && header.cut_length_m <= header.measured_length_m;
  if (!volume_good || !length_good ||
      !cut_meter_.Restore(field_, header.measured_length_m, line, path, header.path_end)) {
    field_.Clear();
    if (volume_ != nullptr) volume_->Clear();
    return false;
  }
  frame_ = header.frame;
  topology_.Restore(header.revision, bits);
  field_.RestoreQuarantined(header.quarantined);
  removed_ = header.removed;
  ledger_ = header.ledger;
  figures_ = header.figures;
  crumbs_.Restore(figures_.debris_m2);
  memory_ = header.memory;
  last_tip_ = {};
  last_tip_.active = header.last_active != 0;
  last_tip_.path.to = last_at;
  cut_length_m_ = header.cut_length_m;
  clock_s_ = header.clock_s;
  protected_dt_s_ = header.protected_dt_s;
  source_.Import(window);
  if (paper_ != nullptr) {
    paper_->set_corner(paper_corner);
    std::copy(paper_potential.begin(), paper_potential.end(), paper_->potential().begin());
  }
  std::copy(samples.begin(), samples.end(), protected_.samples().begin());
  std::copy(alarm_state.begin(), alarm_state.end(), protected_.alarm_state().begin());
  protected_.set_warm(header.protected_warm != 0);
  return true;
}

struct SolidSurface::Record {
  std::uint64_t layout;
  std::uint64_t frame, quarantined;
  Ledger ledger;
  float highest_C, power_W;
  BySolid dead_m2, reported_m2;
  std::uint32_t tile_count, used, warned, spare;

  [[nodiscard]] bool Plausible() const {
    constexpr float kMost_m2 = 100;
    return layout == kSolidLayout && used <= 1 && warned >> kMaxSolids == 0 && highest_C >= 0 &&
           std::isfinite(highest_C + power_W) && AllWithin(dead_m2, 0, kMost_m2) &&
           AllWithin(reported_m2, 0, kMost_m2) &&
           std::isfinite(ledger.joule + ledger.generator + ledger.Out() + ledger.hook + ledger.film + ledger.plume);
  }
};

std::size_t SolidSurface::CheckpointCapacity() {
  return kSolidTileCapacity + sizeof(Record) + sizeof(SourceWindow::State);
}

std::size_t SolidSurface::Save(std::span<std::byte> out) const {
  if (frame_ == 0) return SaveNothing(out);
  Writer writer(out);
  Record record{};
  record.layout = kSolidLayout;
  record.frame = frame_;
  record.quarantined = field_.quarantined();
  record.ledger = ledger_;
  record.highest_C = highest_C_;
  record.dead_m2 = dead_m2_;
  record.reported_m2 = reported_m2_;
  record.power_W = power_W_;
  record.warned = warned_;
  record.tile_count = StoredTiles(field_);
  record.used = 1;
  writer.PutValue(record);
  SourceWindow::State window;
  source_.Export(&window);
  writer.PutValue(window);
  PutTiles(field_, &writer);
  return writer.used();
}

std::size_t SolidSurface::SaveNothing(std::span<std::byte> out) {
  Writer writer(out);
  Record record{};
  record.layout = kSolidLayout;
  writer.PutValue(record);
  return writer.used();
}

bool SolidSurface::Restore(std::span<const std::byte> bytes) {
  Reader reader(bytes);
  Record record;
  if (!reader.GetValue(&record) || !record.Plausible()) return false;
  if (record.used == 0) return record.frame == 0 && record.tile_count == 0;
  SourceWindow::State window;
  if (!reader.GetValue(&window) || !IsPlausible(window) ||
      record.tile_count > static_cast<std::uint32_t>(field_.sheet().tile_count()) ||
      !GetTiles(&reader, record.tile_count, &field_)) {
    return false;
  }
  frame_ = record.frame;
  field_.RestoreQuarantined(record.quarantined);
  ledger_ = record.ledger;
  highest_C_ = record.highest_C;
  dead_m2_ = record.dead_m2;
  reported_m2_ = record.reported_m2;
  power_W_ = record.power_W;
  warned_ = record.warned;
  source_.Import(window);
  return true;
}

}  // namespace fulcrum::thermal
