// Checkpoint layout of the thermal solver: a header, the potential's start value, the marks of the cut length,
// protected structures, topology, then every tile that is not blank, each with only those arrays that hold anything.
#include <algorithm>
#include <cstring>
#include <type_traits>
#include <utility>

#include "thermal_node/coupling/thermal_solver.h"

namespace fulcrum::thermal {

namespace {

/// Change it with the layout.
constexpr std::uint64_t kLayout = 0x7468726d'00000002ull;
/// A checkpoint of one model is none of another.
constexpr std::uint64_t LayoutOf(ThermalModel model) { return kLayout + (static_cast<std::uint64_t>(model) << 16); }
/// Some hundred tiles with all their arrays; a session that cuts more than half a metre would need more.
constexpr std::size_t kTileCapacity = std::size_t{24} << 20;

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

/// Value of an array of FloatArrays that need not be stored.
float DefaultOf(std::size_t array) { return array == 1 ? 1.0f : 0.0f; }

}  // namespace

struct ThermalSolver::Header {
  std::uint64_t layout;
  std::uint64_t frame, revision, quarantined;
  Ledger ledger;
  SolverFigures figures;
  EventMemory memory;
  float clock_s, protected_dt_s;
  std::uint32_t tile_count, mark_count, sample_count, structure_count;
  std::uint32_t node_bytes, edge_bytes, shrink_bytes, protected_warm;
};

std::size_t ThermalSolver::CheckpointCapacity(const SceneView& scene) {
  const std::size_t nodes = scene.membrane.node_count();
  const std::size_t fixed = (std::size_t{1} << 18) + 64 * scene.protected_points.size() + 4 * nodes;
  const Sheet sheet = MakeSheet(scene);
  const std::size_t paper = scene.thermal.model == ThermalModel::kPaper ? TexturePotential::StateBytes() : 0;
  return fixed + paper + std::min(kTileCapacity, sheet.tile_count() * (sizeof(TileState) + 64));
}

std::size_t ThermalSolver::Save(std::span<std::byte> out) const {
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
  header.mark_count = static_cast<std::uint32_t>(cut_meter_.marks().size());
  header.sample_count = static_cast<std::uint32_t>(protected_.samples().size());
  header.structure_count = static_cast<std::uint32_t>(protected_.alarm_state().size());
  const TopologyBits& bits = topology_.committed();
  header.node_bytes = static_cast<std::uint32_t>(bits.dead_nodes.size());
  header.edge_bytes = static_cast<std::uint32_t>(bits.dead_edges.size());
  header.shrink_bytes = static_cast<std::uint32_t>(bits.shrink.size());
  header.protected_warm = protected_.warm() ? 1 : 0;
  writer.PutValue(header);
  SourceWindow::State window;
  source_.Export(&window);
  writer.PutValue(window);
  if (paper_ != nullptr) {
    writer.PutValue(paper_->corner());
    writer.Put(std::as_const(*paper_).potential());
  }
  writer.Put(std::span<const CutMeter::Mark>(cut_meter_.marks()));
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
  return writer.used();
}

bool ThermalSolver::Restore(std::span<const std::byte> bytes) {
  Reader reader(bytes);
  Header header;
  SourceWindow::State window;
  if (!reader.GetValue(&header) || header.layout != LayoutOf(params_.model) || !reader.GetValue(&window)) return false;
  CellIndex paper_corner;
  std::vector<float> paper_potential(paper_ != nullptr ? paper_->potential().size() : 0);
  if (paper_ != nullptr && (!reader.GetValue(&paper_corner) || !reader.Get(std::span(paper_potential)))) return false;
  TopologyBits bits = topology_.committed();
  if (header.node_bytes != bits.dead_nodes.size() || header.edge_bytes != bits.dead_edges.size() ||
      header.shrink_bytes != bits.shrink.size() || header.sample_count != protected_.samples().size() ||
      header.structure_count != protected_.alarm_state().size() || header.mark_count > (1u << 20) ||
      header.tile_count > static_cast<std::uint32_t>(field_.sheet().tile_count())) {
    return false;
  }
  std::vector<CutMeter::Mark> marks(header.mark_count);
  if (!reader.Get(std::span(marks))) return false;
  std::vector<ProtectedSample> samples(header.sample_count);
  std::vector<std::uint8_t> alarm_state(header.structure_count);
  if (!reader.Get(std::span(samples)) || !reader.Get(std::span(alarm_state)) ||
      !reader.Get(std::span(bits.dead_nodes)) || !reader.Get(std::span(bits.dead_edges)) ||
      !reader.Get(std::span(bits.shrink))) {
    return false;
  }
  TileState state;
  for (std::uint32_t n = 0; n < header.tile_count; ++n) {
    std::array<std::uint32_t, 4> record;
    bool good = reader.GetValue(&record) && record[0] < static_cast<std::uint32_t>(field_.sheet().tile_count());
    const auto arrays = FloatArrays(state);
    for (std::size_t a = 0; good && a < arrays.size(); ++a) {
      arrays[a]->fill(DefaultOf(a));
      if ((record[1] >> a & 1u) != 0) good = reader.Get(std::span<float>(*arrays[a]));
    }
    good = good && reader.Get(std::span<std::uint8_t>(state.flags));
    if (!good) {
      field_.Clear();
      return false;
    }
    state.awake = static_cast<std::uint8_t>(record[2]);
    state.tented = static_cast<std::uint8_t>(record[3]);
    field_.Restore(static_cast<int>(record[0]), state);
  }
  frame_ = header.frame;
  topology_.Restore(header.revision, bits);
  field_.RestoreQuarantined(header.quarantined);
  cut_meter_.Restore(marks);
  ledger_ = header.ledger;
  figures_ = header.figures;
  memory_ = header.memory;
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
