// Checkpoint layout of the thermal solver: a header, the potential's start value, the cut's centre line and tool path,
// protected structures, topology, then every tile that is not blank, each with only those arrays that differ from their
// defaults, then the bricks of the volume with the rows that differ from 0.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <type_traits>
#include <utility>

#include "thermal_node/coupling/thermal_solver.h"

namespace fulcrum::thermal {

namespace {

/// Identifies the layout; must change with it.
constexpr std::uint64_t kLayout = 0x7468726d'00000007ull;
/// A checkpoint of one model cannot be restored by another, so the model is part of the layout.
constexpr std::uint64_t LayoutOf(ThermalModel model) { return kLayout + (static_cast<std::uint64_t>(model) << 16); }
/// Bytes for tiles: about 1100 with all their arrays, enough for half a metre of cut; a checkpoint that needs
/// more is not written and Health reports it.
constexpr std::size_t kTileCapacity = std::size_t{24} << 20;
/// Bytes for the centre line of three metres of cut and for the tool path.
constexpr std::size_t kCutCapacity =
    (std::size_t{1} << 15) * sizeof(CellIndex) + kPathCapacity * sizeof(ToolPath::Point);
/// Bytes for bricks: about thirty that are damaged down to the bottom.
constexpr std::size_t kVolumeCapacity = std::size_t{32} << 20;

class Writer {
 public:
  explicit Writer(std::span<std::byte> out) : out_(out) {}
  template <class T>
  void Put(std::span<const T> values) {
    static_assert(std::is_trivially_copyable_v<T>);
    const std::span<const std::byte> bytes = std::as_bytes(values);
    if (at_ + bytes.size() > out_.size()) full_ = true;
    if (full_) return;
    std::copy(bytes.begin(), bytes.end(), out_.begin() + static_cast<std::ptrdiff_t>(at_));
    at_ += bytes.size();
  }
  template <class T>
  void PutValue(const T& value) {
    Put(std::span<const T>(&value, 1));
  }
  [[nodiscard]] std::size_t used() const { return full_ ? 0 : at_; }

 private:
  std::span<std::byte> out_;
  std::size_t at_ = 0;
  bool full_ = false;
};

class Reader {
 public:
  explicit Reader(std::span<const std::byte> in) : in_(in) {}
  template <class T>
  bool Get(std::span<T> values) {
    const std::size_t bytes = values.size_bytes();
    if (at_ + bytes > in_.size()) return false;
    if (bytes > 0) std::memcpy(values.data(), in_.data() + at_, bytes);
    at_ += bytes;
    return true;
  }
  template <class T>
  bool GetValue(T* value) {
    return Get(std::span<T>(value, 1));
  }
  [[nodiscard]] bool at_end() const { return at_ == in_.size(); }

 private:
  std::span<const std::byte> in_;
  std::size_t at_ = 0;
};

auto FloatArrays(auto& s) { return std::array{&s.enthalpy, &s.water, &s.omega_cell, &s.omega_collagen, &s.charred}; }

template <class Values>
bool AllWithin(const Values& values, float low, float high) {
  return std::all_of(values.begin(), values.end(), [&](float v) { return v >= low && v <= high; });  // false for NaN
}

/// Accepts only values that the solver can have written into a tile.
bool Plausible(const TileState& s, int index, const HeatField& field) {
  if (!AllWithin(s.water, 0.0f, 1.0f) || !AllWithin(s.omega_cell, 0.0f, kOmegaMax) ||
      !AllWithin(s.omega_collagen, 0.0f, kOmegaMax) || !AllWithin(s.charred, 0.0f, 1.0f)) {
    return false;
  }
  const Sheet& sheet = field.sheet();
  const int x0 = index % sheet.tiles_x * kTile, y0 = index / sheet.tiles_x * kTile;
  for (int k = 0; k < kTileCells; ++k) {
    const bool outside = (s.flags[k] & kOutside) != 0;
    if (outside != sheet.IsOutside(x0 + k % kTile, y0 + k / kTile)) return false;
    const float limit = kThetaPlausible * field.material().HeatCapacity(s.water[k]);
    if (!(std::abs(s.enthalpy[k]) <= limit)) return false;
  }
  return true;
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

/// Default of an array of FloatArrays; an array that holds nothing else is not stored.
float DefaultOf(std::size_t array) { return array == 1 ? 1.0f : 0.0f; }

}  // namespace

struct ThermalSolver::Header {
  std::uint64_t layout;
  std::uint64_t frame, revision, quarantined;
  Ledger ledger;
  SolverFigures figures;
  EventMemory memory;
  RemovedBox removed;
  ToolPath::End path_end;
  float measured_length_m, cut_length_m, clock_s, protected_dt_s;
  std::uint32_t tile_count, line_count, path_count, sample_count, structure_count;
  std::uint32_t node_bytes, edge_bytes, shrink_bytes, protected_warm, has_volume;

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
  if (scene.thermal.volume == 0) return fixed + tiles;
  const std::size_t bricks = VolumeField(sheet, scene.thermal).brick_count();
  constexpr std::size_t kBrickBytes = 2 * sizeof(float) * kBrickCells + 64;
  return fixed + tiles + std::min(kVolumeCapacity, bricks * kBrickBytes + 128);
}

std::size_t ThermalSolver::Save(std::span<std::byte> out) const {
  if (topology_.staged()) return 0;
  const std::vector<const Tile*> tiles = field_.Existing();
  Writer writer(out);
  Header header{};
  header.layout = LayoutOf(params_.model);
  header.frame = frame_;
  header.revision = topology_.revision();
  header.quarantined = field_.quarantined();
  header.ledger = ledger_;
  header.figures = figures_;
  header.memory = memory_;
  header.clock_s = clock_s_;
  header.protected_dt_s = protected_dt_s_;
  const auto blank = [](const Tile* tile) { return IsBlank(tile->state); };
  header.tile_count = static_cast<std::uint32_t>(tiles.size() - std::count_if(tiles.begin(), tiles.end(), blank));
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
  for (const Tile* tile : tiles) {
    const TileState& s = tile->state;
    if (IsBlank(s)) continue;
    const auto arrays = FloatArrays(s);
    std::array<std::uint32_t, 4> record{static_cast<std::uint32_t>(tile->index), 0, s.awake, s.tented};
    for (std::size_t a = 0; a < arrays.size(); ++a) {
      const float usual = DefaultOf(a);
      const bool worth = std::any_of(arrays[a]->begin(), arrays[a]->end(), [&](float v) { return v != usual; });
      record[1] |= worth ? 1u << a : 0u;
    }
    writer.PutValue(record);
    for (std::size_t a = 0; a < arrays.size(); ++a) {
      if ((record[1] >> a & 1u) != 0) writer.Put(std::span<const float>(*arrays[a]));
    }
    writer.Put(std::span<const std::uint8_t>(s.flags));
  }
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
  // A start value: any finite number is valid. It lies between 0 and 1 where the last solve converged.
  if (!AllWithin(window.start, -1e3f, 1e3f) || std::abs(window.corner.ix) > -kNowhere.ix ||
      std::abs(window.corner.iy) > -kNowhere.iy || !(window.step_s >= 0.0f && std::isfinite(window.step_s)) ||
      !window.interface.IsPlausible()) {
    return false;
  }
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
  TileState state;
  std::int64_t last = -1;
  for (std::uint32_t n = 0; n < header.tile_count; ++n) {
    std::array<std::uint32_t, 4> record;
    bool good = reader.GetValue(&record) && record[0] > last && record[2] <= 1 && record[3] <= 1 &&
                record[0] < static_cast<std::uint32_t>(field_.sheet().tile_count());
    last = record[0];
    const auto arrays = FloatArrays(state);
    for (std::size_t a = 0; good && a < arrays.size(); ++a) {
      arrays[a]->fill(DefaultOf(a));
      if ((record[1] >> a & 1u) != 0) good = reader.Get(std::span<float>(*arrays[a]));
    }
    good = good && reader.Get(std::span<std::uint8_t>(state.flags)) &&
           Plausible(state, static_cast<int>(record[0]), field_);
    if (!good) {
      field_.Clear();
      return false;
    }
    state.awake = static_cast<std::uint8_t>(record[2]);
    state.tented = static_cast<std::uint8_t>(record[3]);
    field_.Restore(static_cast<int>(record[0]), state);
  }
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

}  // namespace fulcrum::thermal
