// The levels above the particles: one product carries a correction over a distance for which sweeps over neighbours
// would take hundreds of iterations. The preconditioner is the sum
//
//   z = D^-1 r + H B^-1 H^T r + P (P^T A P)^-1 P^T r
//
//   D  blocks of the diagonal (kernels)
//   H  hats: bilinear functions on every fourth row and column of the membrane, B blocks of H^T A H
//   P  coarse nodes: bilinear in the rows and columns of the membrane, trilinear on a lattice over each solid. Over the
//      membrane P = H P_hats, so the coarse nodes work on the hats' residual and correction
//
// The Galerkin matrix P^T A P is factored (coarse_factor.h). Hats and coarse nodes follow cuts, sleep and contacts.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "physics_node/energy/elastic_model.h"
#include "physics_node/implicit/coarse_factor.h"
#include "physics_node/implicit/elements.h"
#include "physics_node/implicit/kernels.h"
#include "physics_node/implicit/regions.h"
#include "physics_node/implicit/workers.h"
#include "physics_node/tissue/particle_store.h"

namespace fulcrum::physics::implicit {

class CoarseSpace {
 public:
  CoarseSpace(const TissueScene& scene, const ElasticModel& model, const ParticleStore& particles,
              const Kernels& kernels);

  /// A new coarse matrix, in force at once.
  void Assemble(const Sheet& sheet, const SheetMatrix& matrix, float inertia, const Slides& slides);
  /// The next part of the next matrix: slides as they are now and rows of the membrane, and when all of them are in it
  /// columns of its factor, with the last of which it is in force. So no step pays for all of it.
  void AssembleNextPart(const Sheet& sheet, const SheetMatrix& matrix, float inertia, const Slides& slides);

  /// The hats as the kernels read them.
  [[nodiscard]] HatLevel hats();
  /// Floats of a row in the sums of SheetKernels::restrict_rows.
  [[nodiscard]] std::size_t row_width() const { return 3 * hats_.width; }
  /// Rows of hats whose middle is one of the sheet's rows [first, end): first and end of them.
  [[nodiscard]] std::pair<int, int> HatRows(int first, int end) const;

  /// Coarse nodes of a sheet, or of solids that slide, are in use: the matrix follows these.
  [[nodiscard]] bool FollowsComputed(const Regions& regions, const Slides& slides) const;
  /// Memory of the matrix and time of a solve grow with the square of their number.
  [[nodiscard]] int nodes() const { return grid_.nodes; }
  /// The edge from a node of the sheet in direction `d` is cut or whole again; in force after ScaleHats.
  void MarkEdit(std::uint32_t row, std::uint32_t col, std::size_t d);
  /// Blocks of hats are sampled at their middle. Where a cut goes through the samples they are scaled to the edges that
  /// are left to the whole hat; too soft a block would overshoot.
  void ScaleHats(const Sheet& sheet);
  /// Coarse nodes of a body that is not computed as a whole are off, and so are hats that reach into what is not: cut
  /// off at the border they would cost far more energy than their blocks contain. They stay in the matrix: in the
  /// preconditioner such a body yields to the others as if it were awake.
  void UpdateRegions(const Regions& regions);
  /// While a solid is folded its coarse nodes are off: their matrix is that of the solid at rest, and in folds it is a
  /// hundred times as stiff.
  void ExcludeSolids(std::span<const Index> folded);

  /// Before the contacts of a substep: removes those of the last one.
  void ClearContacts();
  /// Adds the stiffness of a contact to the blocks of the hats that move it, for this substep: without it they would
  /// move it as easily as the sheet.
  void AddContact(const Element& contact);
  /// The same of a clip on these particles: the stiffness of its rigid frame against translations that differ.
  void AddClip(std::span<const ParticleRef> clipped, float stiffness);
  /// After the last contact and clip: lets the coarse nodes' part fade out around the contacts.
  void FadeAtContacts();

  /// From the residual of what is computed - `row_sums` [rows][row_width()] by SheetKernels::restrict_rows, tube xyz_ -
  /// to HatLevel::value and the correction of the coarse nodes.
  void Solve(std::span<const Task> tasks, const float* row_sums, const float* tube_residual, const float* tube,
             Workers* workers);
  /// tube_z += P y for vertices [first, end) that move (w of `tube` > 0). Returns tube_residual . tube_z.
  double Prolong(const float* tube, const float* tube_residual, float* tube_z, int first, int end) const;

 private:
  /// Particles of a contact times hats around a particle.
  static constexpr std::size_t kHatsPerContact = 16;
  /// Hats around the particles of a clip.
  static constexpr std::size_t kHatsPerClip = 64;
  /// Nodes around a cell of the lattice.
  static constexpr std::size_t kCellCorners = 8;
  /// Where the hats are. Built once.
  struct HatGeometry {
    int rows = 0, slots = 0;
    std::size_t width = 0;          ///< Floats of a plane of a row of hats.
    std::vector<int> centre, cell;  ///< As in HatLevel.
    std::vector<float> fraction;
    FloatArray own, next;
  };
  /// Blocks of the hats, and what cuts and sleep do to them. A hat is r * width + place in its row.
  struct HatBlocks {
    std::array<FloatArray, 6> inverse;  ///< [m/N]
    FloatArray scale;
    std::vector<std::uint32_t> edited;  ///< Hats around edits since the last ScaleHats.
    std::vector<std::uint8_t> off;      ///< By row of hats.
  };
  /// Hats around stiff contacts.
  struct HatContacts {
    std::vector<float> coarse_weight;                  ///< By hat: part of the coarse nodes' correction, 0 to 1.
    std::vector<std::pair<std::size_t, float>> stiff;  ///< Hats that move contacts, and 1 - weight there.
  };
  /// A place between coarse nodes: after node `cell`, by a fraction of the distance to the next one.
  struct CellPlace {
    int cell;
    float fraction;
  };
  /// A vertex of the organ in its cell of the lattice.
  struct alignas(16) LatticePlace {
    std::array<std::uint16_t, kCellCorners> node;
    std::array<float, kCellCorners> weight;
    bool new_cell = true;  ///< Not in the cell of the vertex before.
  };
  /// Where the coarse nodes are: those of the membrane by rows, then those of the lattice. Built once.
  struct CoarseGrid {
    int columns = 0, rows = 0, nodes = 0;
    std::vector<CellPlace> row_place;  ///< By row of the membrane.
    /// Of a sheet, whose columns may be fewer than those of the membrane; beyond them they are continued.
    struct Columns {
      std::vector<CellPlace> place;  ///< By column of the membrane.
      float step;                    ///< The part of a coarse cell between two columns.
      std::vector<int> at;           ///< By coarse column: its column of the membrane.
      FloatArray share;              ///< [columns][width], part of a coarse column in a float of a row of hats.
    };
    std::vector<Columns> sheets;
    std::vector<std::size_t> sheet_of;  ///< By row: the number of its sheet.
    std::vector<float> row_step;        ///< By row: the part of a coarse cell between it and the next row.
    std::vector<int> row_at;            ///< By coarse row: its row of the membrane.
    std::vector<LatticePlace> tube_weights;
    std::vector<int> body;                            ///< By node, as Partition::BodyOf.
    std::vector<int> off;                             ///< Nodes that are off.
    std::vector<std::vector<std::uint32_t>> lattice;  ///< By solid: its nodes.
    std::vector<std::uint32_t> folded;                ///< Nodes of solids that are folded.

    /// Nodes around a cell of the membrane, -1 where there is none.
    [[nodiscard]] std::array<int, 4> NodesOf(int row_cell, int column_cell) const;
  };
  /// The Galerkin matrix in force and the next one.
  struct CoarseMatrix {
    Eigen::MatrixXf constant, tube_mass;  ///< Parts that do not change: organ and bindings at rest; mass of the organ.
    Eigen::MatrixXf next;
    CoarseFactor factor;
    std::vector<std::uint8_t> left_out;  ///< By group of the factor: of bodies that are off.
    int next_row = 0;                    ///< Of the membrane, to be added to `next`.
    bool complete = false;               ///< `next` waits to be factored.
  };
  /// Memory of a solve.
  struct Scratch {
    FloatArray residual, value;  ///< Of the hats, [row][3][width].
    FloatArray nodes4;           ///< Right side, then correction, xyz_ per coarse node.
    FloatArray tube_nodes4;      ///< The organ's part of the right side.
  };

  /// Of the factor, for the nodes of a body: the membrane with the organ are the last group, since most other solids
  /// are joined to nothing else, and little fills in.
  static std::size_t GroupOf(int body, std::size_t bodies) {
    return body > 0 ? static_cast<std::size_t>(body) - 1 : bodies - 1;
  }
  void PlaceCoarseNodes(const TissueScene& scene);
  void ShareColumns();
  void BuildHats();
  void MarkSteepHats();
  struct Lattice;
  static Lattice LatticeOf(const Solid& solid, std::size_t solids, const ElasticModel& model);
  void BuildLattice(const TissueScene& scene, const ElasticModel& model);
  void AddTubeMass(const ElasticModel& model);
  void AddTube(const ElasticModel& model);
  void AddBindings(const ElasticModel& model, const ParticleStore& particles);
  void AddWeights(const ElasticModel& model, const ParticleStore& particles, Index particle, double share,
                  std::vector<std::pair<int, double>>* weights) const;
  void AddRows(const Sheet& sheet, const SheetMatrix& matrix, float inertia, const Slides& slides, int rows);
  void AddSlide(const Element& slide, float turned);
  void AddSheetRow(const Sheet& sheet, const SheetMatrix& matrix, float inertia, int row);
  [[nodiscard]] std::array<std::uint32_t, 2> HatsOf(std::uint32_t col) const;
  /// body(hat, scale * its weight there), for the hats at a node of the membrane.
  template <class Body>
  void ForHatsAt(ParticleRef particle, float scale, const Body& body) const;
  [[nodiscard]] float HatAt(std::uint32_t hat, int row, int col) const;
  void RestrictTube(int first, int end, const float* tube_residual, const float* tube);
  void SumRows(std::span<const Task> tasks, const float* row_sums);
  void RestrictHats();
  void ProlongToHats(int first, int end);

  const Kernels& kernels_;
  GridLayout layout_;
  std::size_t tube_floats_;
  int sheet_rows_;
  HatGeometry hats_;
  HatBlocks blocks_;
  HatContacts contacts_;
  CoarseGrid grid_;
  CoarseMatrix matrix_;
  Scratch scratch_;
  bool coarse_off_ = false;
};

}  // namespace fulcrum::physics::implicit
