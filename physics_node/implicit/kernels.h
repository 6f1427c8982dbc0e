// The hot loops of the accurate solver as plain functions on plain arrays, compiled once per instruction set from
// kernels_impl.h. All give the same bits. As in pbd/kernels.h nothing here includes inline functions of its own.
//
// A "field" is an array of the particle pool's size and layout (pbd/particle_store.h): tube xyz_ per vertex, then the
// membrane's planes with lane-blocked rows. Sheet kernels work on a range of rows and write nothing outside it, so that
// any number of threads gives the same bits.
#pragma once

#include "physics_node/simd/instruction_set.h"

namespace fulcrum::physics::implicit {

/// The membrane. Edges of a node lead to (r, c+1), (r+1, c), (r+1, c+1), as in TopologyState.
struct Sheet {
  int rows;
  int slots;                     ///< Vectors of a row.
  const float* inverse_rest[3];  ///< [1/m]
  const float* axial[3];         ///< Tension per strain [N]; 0: no such edge.
  float stiffening;              ///< c of tension = axial (e + c e^3).
  const float* w;                ///< 0: the node does not move.
  const float* mass;             ///< [kg]
};

/// One substep's constants. Backward Euler with drag: a particle resists d with mass * inertia * d.
struct Inertia {
  float h;           ///< [s]
  float inertia;     ///< (1 + damping h) / h^2 [1/s^2]
  float gravity[3];  ///< [m/s^2]
};

/// What a linearisation of the sheet leaves behind for the products with its matrix. An edge's stiffness is
/// kt I + along d d^T with d from its first node to its second at `place`; positive semi-definite by construction.
struct SheetMatrix {
  float* kt[3];           ///< [N/m]
  float* along[3];        ///< [N/m^3]
  float* block[6];        ///< Inverse of the diagonal blocks: xx, yy, zz, xy, xz, yz; 0 where a node stays [m/N].
  const float* place[3];  ///< Where it was linearised.
};

/// Memory of a thread for the rows in work: kCarry * stride floats.
inline constexpr int kCarry = 18;

/// The middle level: hats of +-4 rows and 4 columns, lane-blocked as the sheet is, every fourth slot of it.
struct Middle {
  int rows, slots;
  const int* centre;      ///< [rows] row of the sheet.
  const float* own;       ///< [sheet slots][8] weight of a column in its own function ...
  const float* next;      ///< ... and in the next one; at the end of a lane the next lane's first.
  const int* cell;        ///< [sheet rows] the middle row at or before a row ...
  const float* fraction;  ///< ... and how far on towards the one after it.
  const float* scale;  ///< [rows][slots * 8] of the sampled blocks, where cuts make the samples no measure; 0: no hat.
  float* block[6];     ///< Inverse of the diagonal blocks, [rows][slots * 8].
  const float* value;  ///< The solution, [rows][3][slots * 8].
};
/// Sum of hat^2 over the nodes of a hat: (11/4)^2.
inline constexpr float kHatMass = 7.5625f;

struct SheetLinearise {
  const float* place[3];     ///< Where to linearise.
  const float* start[3];     ///< At the beginning of the substep.
  const float* velocity[3];  ///< At the beginning of the substep.
  const float* load[3];      ///< Dead load [N].
  const float* extra;        ///< Stiffness of other elements on a node's diagonal [N/m].
  float* residual[3];        ///< Out: elastic force + load + gravity - inertia.
};

/// Kernels read the organ's patches in groups of so many: what there is of one by patch goes on for so many more.
inline constexpr std::uint32_t kPatchGroup = 16;

/// The organ: one patch per vertex (energy/elastic_model.h), links in compressed rows.
struct Organ {
  std::uint32_t vertices;
  /// Vertices of a patch: start[vertices + 1], the vertex, and g xyz_ with F = sum x_j (x) g; in w the stiffness of the
  /// edge between that vertex and the patch's [N/m].
  const std::uint32_t* start;
  const std::uint32_t* vertex;
  const float* gradient;
  /// The patches of a vertex: the same links by vertex.
  const std::uint32_t* patch_start;
  const std::uint32_t* patch;
  const float* patch_gradient;
  const float* volume;  ///< Of a patch [m^3].
  float mu, lambda;     ///< lambda of the stable neo-Hookean energy: Lamé's + mu [Pa].
  float variance;       ///< Part of mu that is taken off |F|^2, kPatchVariance.
  const float* mass;    ///< [kg]
};
/// V dP = k dF + c (c : dF) + d(cof F)[dF] q, c = sqrt(lambda V) cof F with k in its fourth lanes, q folded into `f`.
/// Three columns xyz_ of each per patch.
struct OrganMatrix {
  float* c;
  float* f;
  float* stress;  ///< Between the two halves of a product, per patch: three columns of V P or V dP, and x or dx.
  float* block;   ///< Inverse of the diagonal blocks, three columns xyz_; 0 where a vertex does not move.
};
/// Tube parts of fields, xyz_ per vertex; `start` with w.
struct OrganLinearisation {
  const float* place;     ///< Where to linearise.
  const float* start;     ///< At the beginning of the substep.
  const float* velocity;  ///< At the beginning of the substep.
  const float* load;      ///< Dead load [N].
  float* residual;        ///< Out: elastic force + load + gravity - inertia.
};

struct GuessCount {
  float largest_sq;      ///< |h velocity|^2 [m^2].
  std::uint32_t resets;  ///< Velocities that were not finite.
};
struct FinishCount {
  float largest_speed_sq;  ///< Of nodes that move [m^2/s^2].
  std::uint32_t resets;
};

/// Rows of a block of the coarse factor.
inline constexpr int kFactorBlock = 16;
/// A triangular matrix in blocks of kFactorBlock rows, by columns of blocks in the order in which a substitution takes
/// them. `block[i]` for i from `start[step]` to `start[step + 1]` are the rows of blocks: first that on the diagonal,
/// whose inverse is stored, then those not zero among the ones that come later. Each block is stored by columns.
struct Substitution {
  int steps;
  const std::uint32_t* start;
  const std::uint32_t* block;
};

struct Kernels {
  const char* name;

  /// place <- start + h * velocity, at most `limit` from start, for nodes that move and have a sound velocity, start
  /// for the others.
  GuessCount (*sheet_guess)(const Sheet& sheet, float h, float limit, const float* const start[3],
                            const float* const velocity[3], float* const place[3], int row0, int row1);
  void (*sheet_linearise)(const Sheet& sheet, const Inertia& inertia, const SheetLinearise& at,
                          const SheetMatrix& matrix, float* carry, int row0, int row1);
  /// out <- K p + mass * inertia * p. Returns p . out.
  double (*sheet_apply)(const Sheet& sheet, float inertia, const SheetMatrix& matrix, const float* const p[3],
                        float* const out[3], float* carry, int row0, int row1);
  /// p . (K p + mass * inertia * p) of the nodes of rows [row0, row1) and of the edges that begin there or, with
  /// `above`, end there.
  double (*sheet_curvature)(const Sheet& sheet, float inertia, const SheetMatrix& matrix, const float* const p[3],
                            bool above, int row0, int row1);
  /// Elastic and inertial energy at `place` of the edges and nodes that rows [row0, row1) own [J].
  double (*sheet_energy)(const Sheet& sheet, const Inertia& inertia, const SheetLinearise& at, int row0, int row1);

  /// Blocks of middle rows [first, end).
  void (*middle_blocks)(const Sheet& sheet, const Middle& middle, const SheetMatrix& matrix, float inertia, int first,
                        int end);
  /// sums [row][3][middle slots * 8] <- what a row's residual of nodes that move gives to the middle level's slots.
  void (*sheet_restrict)(const Sheet& sheet, const Middle& middle, const float* const r[3], float* sums, int row0,
                         int row1);
  /// z <- D^-1 r + the middle level's value where a node moves. Returns r . z.
  double (*sheet_precondition)(const Sheet& sheet, const Middle& middle, const SheetMatrix& matrix,
                               const float* const r[3], float* const z[3], int row0, int row1);
  /// z <- D^-1 r. Returns r . z.
  double (*sheet_block_solve)(const Sheet& sheet, const SheetMatrix& matrix, const float* const r[3], float* const z[3],
                              int row0, int row1);
  /// Positions and velocities of nodes: place + d, at most `speed` fast; what is not finite stays, at rest.
  FinishCount (*sheet_finish)(const Sheet& sheet, const float* const place[3], const float* const d[3], float h,
                              float speed, float* const x[3], float* const velocity[3], int row0, int row1);
  /// d <- a p + b z, or d += that if it `adds`. Returns the largest |d|^2.
  float (*sheet_step)(const Sheet& sheet, float a, const float* const p[3], float b, const float* const z[3], bool adds,
                      float* const d[3], int row0, int row1);
  /// Largest |d|^2 of nodes.
  float (*sheet_largest)(const Sheet& sheet, const float* const d[3], int row0, int row1);

  /// a <- b c^T, or a - b c^T, of blocks of kFactorBlock rows, stored by columns and aligned to 64 bytes; a is neither
  /// of the others.
  void (*block_product)(const float* b, const float* c, bool take_off, float* a);
  /// x <- T^-1 x for the triangular T that `order` and `blocks` describe.
  void (*substitute)(const Substitution& order, const float* blocks, float* x);

  /// p <- z + beta p on `count` floats.
  void (*combine)(const float* z, float beta, float* p, std::size_t count);
  /// d <- alpha p, or d += alpha p; r -= alpha q.
  void (*start)(float alpha, const float* p, const float* q, float* d, float* r, std::size_t count);
  void (*advance)(float alpha, const float* p, const float* q, float* d, float* r, std::size_t count);
  /// d += alpha p.
  void (*add)(float alpha, const float* p, float* d, std::size_t count);
  /// True while all of `count` floats, of xyzw ones all but w, are between -limit and limit.
  bool (*within)(const float* p, float limit, std::size_t count, bool xyzw);

  /// As sheet_guess, for vertices [first, last) of xyz_ arrays; w of `start` tells which move.
  GuessCount (*organ_guess)(float h, float limit, const float* start, const float* velocity, float* place,
                            std::uint32_t first, std::uint32_t last);
  /// Stress and its derivative of patches [first, last).
  void (*organ_linearise)(const Organ& organ, const OrganMatrix& matrix, const float* place, std::uint32_t first,
                          std::uint32_t last);
  /// Residual of vertices. After organ_linearise of their patches.
  void (*organ_residual)(const Organ& organ, const OrganMatrix& matrix, const Inertia& inertia,
                         const OrganLinearisation& at, std::uint32_t first, std::uint32_t last);
  /// Inverse diagonal blocks of vertices; w of `pool` tells which move. After organ_linearise of their patches.
  void (*organ_blocks)(const Organ& organ, const OrganMatrix& matrix, const float* pool, const float* extra,
                       float inertia, std::uint32_t first, std::uint32_t last);
  /// V dP of patches.
  void (*organ_stress)(const Organ& organ, const OrganMatrix& matrix, const float* p, std::uint32_t first,
                       std::uint32_t last);
  /// out <- K p + mass * inertia * p on vertices, after organ_stress of their patches. Returns p . out.
  double (*organ_apply)(const Organ& organ, const OrganMatrix& matrix, float inertia, const float* p, float* out,
                        std::uint32_t first, std::uint32_t last);
  /// As organ_stress; returns what these patches and their own vertices have of p . (K p + mass * inertia * p).
  double (*organ_curvature)(const Organ& organ, const OrganMatrix& matrix, float inertia, const float* p,
                            std::uint32_t first, std::uint32_t last);
  /// z <- D^-1 r. Returns r . z.
  double (*organ_block_solve)(const OrganMatrix& matrix, const float* r, float* z, std::uint32_t first,
                              std::uint32_t last);
  double (*organ_energy)(const Organ& organ, const Inertia& inertia, const OrganLinearisation& at, std::uint32_t first,
                         std::uint32_t last);
  /// As sheet_finish; `pool` xyzw.
  FinishCount (*organ_finish)(const float* place, const float* d, float h, float speed, float* pool, float* velocity,
                              std::uint32_t first, std::uint32_t last);
  /// As sheet_step.
  float (*organ_step)(float a, const float* p, float b, const float* z, bool adds, float* d, std::uint32_t first,
                      std::uint32_t last);
  float (*organ_largest)(const float* d, std::uint32_t first, std::uint32_t last);
};

/// Those of an instruction set that this CPU has.
const Kernels& KernelsFor(InstructionSet set = BestInstructionSet());

}  // namespace fulcrum::physics::implicit
