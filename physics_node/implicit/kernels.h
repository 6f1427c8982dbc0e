// The hot loops of the accurate solver as plain functions on plain arrays, compiled once per instruction set from
// kernels_impl.h. All sets give the same bits. As in tissue/kernels.h this header has no inline functions, so that no
// copy of one for AVX2 is linked into the rest of the program.
//
// A field is an array of the particle pool's size and layout (tissue/particle_store.h, field_layout.h):
//
//   organ      x y z _ per vertex
//   membrane   three planes x, y, z of rows * slots * kLanes floats: column c is lane c / slots of slot c % slots
//
// A kernel works on a range of rows of the membrane or of vertices of the organ and writes nothing outside of it, so
// any number of threads gives the same bits.
#pragma once

#include "physics_node/simd/instruction_set.h"

namespace fulcrum::physics::implicit {

/// Floats of a cache line: memory of two threads is at least so far apart.
inline constexpr std::size_t kCacheLineFloats = 16;

/// Squares from here on, NaN among them, count as not finite. Far above any square of a sound state (10 m, 5 m/s),
/// far below what overflows when three are added.
inline constexpr float kFiniteSquare = 1e30f;
/// Least square that lengths of edges and steps are divided by [m^2]: a length of 1e-12 m, below the rounding of a
/// coordinate (1e-9 m), keeps coincident nodes finite.
inline constexpr float kLeastSquare_m2 = 1e-24f;

/// As kLeastDeterminant of energy/triangle_energy.h.
inline constexpr float kLeastSheetDeterminant = 0.5f;

/// The membrane. Edges of a node lead to (r, c+1), (r+1, c), (r+1, c+1), as in TopologyState.
struct Sheet {
  int rows;
  int slots;                     ///< Vectors of a row.
  const float* inverse_rest[3];  ///< 1 / L [1/m]
  const float* axial[3];         ///< A of the edge as a spring: tension per strain [N]; 0: none.
  const float* whole[3];         ///< A of an edge that no triangle carries [N]; 0: no such edge.
  float stiffening;              ///< c of tension = A (e + c e^3).
  /// Model continuum: a and alpha of a cell's triangles (energy/triangle_energy.h) [J], [1/m^2]; null: springs alone.
  const float* triangle[2];
  const float* trace[2][3];
  float triangle_stiffening;  ///< b
  const int* springs_in_row;  ///< [rows] Edges that are springs.
  const float* w;             ///< Inverse mass in effect [1/kg]; 0: the node does not move.
  const float* mass;          ///< [kg]
};

/// One substep's constants. Backward Euler with drag: a particle resists a correction d with mass * inertia * d.
struct Inertia {
  float h;           ///< [s]
  float inertia;     ///< (1 + damping h) / h^2 [1/s^2]
  float gravity[3];  ///< [m/s^2]
};

/// What a linearisation of the sheet leaves behind for the products with its matrix. An edge's stiffness is
/// kt I + along e e^T with e from its first node to its second at `point`; two edges i, j of a triangle are coupled by
/// coupling e_i e_j^T. Positive semi-definite by construction.
struct SheetMatrix {
  float* kt[3];           ///< Transverse stiffness [N/m].
  float* along[3];        ///< Axial stiffness less the transverse one, over the squared length [N/m^3].
  float* coupling[2][3];  ///< By half of a cell: edges 0 1, 0 2, 1 2 of the triangle [N/m^3].
  /// Inverse of the diagonal blocks of edges, elements and masses, without `coupling`: xx, yy, zz, xy, xz, yz; 0 where
  /// a node stays [m/N].
  float* block[6];
  const float* point[3];  ///< The linearisation point [m].
};

/// What an edge does to one of its ends in a linearisation: the force (3) and the entries of its stiffness (6).
inline constexpr int kEdgeTerms = 9;
/// What a cell hands to the row below, in planes of a row: the terms of its edges there, and tension and `along` of the
/// lower triangle's edge that the row below owns.
inline constexpr int kRowTerms = kEdgeTerms + 2;
/// Rows that a thread needs for that: those from above and those for below.
inline constexpr int kCarryPlanes = 2 * kRowTerms;

/// Rows and columns of the membrane from one hat to the next, and from its middle to its rim. Assumed.
inline constexpr int kHatSpacing = 4;
/// Sum of hat^2 over the nodes of a hat: (sum over |k| < 4 of (1 - |k|/4)^2)^2 = (11/4)^2.
inline constexpr float kHatMass = 7.5625f;
/// Sum of (difference of the hat along an edge)^2 over the edges of one direction: 11/4 * 1/2 along rows and along
/// columns. Along diagonals it is 21/8; 11/4 is taken, a bound from above, because too soft a block overshoots.
inline constexpr float kHatStraightEdges = 1.375f, kHatDiagonalEdges = 2.75f;
/// Nodes around the middle of a hat at which its edges are sampled.
inline constexpr int kHatSamples = 4;

/// The hats: bilinear functions of +-4 rows and columns, lane-blocked as the sheet is, every fourth slot of it.
struct HatLevel {
  int rows, slots;
  const int* centre;      ///< [rows] row of the sheet.
  const float* own;       ///< [sheet slots][8] weight of a column in its own function ...
  const float* next;      ///< ... and in the next one; at the end of a lane the next lane's first.
  const int* cell;        ///< [sheet rows] the row of hats at or before a row ...
  const float* fraction;  ///< ... and how far on towards the one after it, 0 to 1.
  const float* scale;  ///< [rows][slots * 8] of the sampled blocks, where cuts make the samples no measure; 0: no hat.
  float* block[6];     ///< Inverse of the diagonal blocks, [rows][slots * 8] [m/N].
  const float* value;  ///< Correction of the level, [rows][3][slots * 8] [m].
};

/// Fields that residual and energy of the sheet are computed from, planes of the membrane.
struct SheetFields {
  const float* point[3];          ///< x*: the linearisation point, or where the energy is wanted [m].
  const float* start[3];          ///< At the beginning of the substep [m].
  const float* velocity[3];       ///< At the beginning of the substep [m/s].
  const float* load[3];           ///< Dead load [N].
  const float* element_diagonal;  ///< Stiffness of bindings, hinges and contacts on a node's diagonal [N/m].
  float* residual[3];             ///< Out: elastic force + load + gravity - inertia [N].
};

/// Kernels read the organ's patches in groups of so many: arrays by patch go on for one group beyond the last patch.
inline constexpr std::uint32_t kPatchGroup = 16;
/// Floats of a vertex x y z _; of a 3 x 3 matrix as three columns xyz_; of what a patch leaves for its vertices, three
/// columns of stress and a position.
inline constexpr std::size_t kVertexFloats = 4, kMatrixFloats = 12, kStressFloats = 16;

/// The organ: one patch per vertex (energy/elastic_model.h), links in compressed rows.
struct Organ {
  std::uint32_t vertices;
  /// Vertices of a patch: start[vertices + 1], the vertex, and g xyz_ with F = sum x_j (x) g [1/m]; in w the stiffness
  /// of the edge between that vertex and the patch's [N/m].
  const std::uint32_t* start;
  const std::uint32_t* vertex;
  const float* gradient;
  /// The patches of a vertex: the same links by vertex.
  const std::uint32_t* patch_start;
  const std::uint32_t* patch;
  const float* patch_gradient;
  const float* volume;  ///< Of a patch [m^3].
  const float* shear;   ///< mu (1 - a_n) of a patch [Pa].
  float mu, lambda;     ///< lambda of the stable neo-Hookean energy: Lamé's + mu [Pa].
  const float* mass;    ///< [kg]
};

/// V dP = k dF + c (c : dF) + d(cof F)[dF] q, c = sqrt(lambda V) cof F with k in its fourth lanes, q folded into `f`.
/// Three columns xyz_ of each per patch.
struct OrganMatrix {
  float* c;       ///< [sqrt(J)], k [J]
  float* f;       ///< q V F [J]
  float* stress;  ///< Between the two halves of a product, per patch: three columns of V P or V dP, and x or dx.
  float* block;   ///< Inverse of the diagonal blocks, three columns xyz_; 0 where a vertex does not move [m/N].
};

/// Tube parts of fields, xyz_ per vertex; `start` with w.
struct OrganFields {
  const float* point;     ///< x*: the linearisation point, or where the energy is wanted [m].
  const float* start;     ///< At the beginning of the substep [m].
  const float* velocity;  ///< At the beginning of the substep [m/s].
  const float* load;      ///< Dead load [N].
  float* residual;        ///< Out: elastic force + load + gravity - inertia [N].
};

struct PredictionCount {
  float largest_sq;      ///< |h velocity|^2 [m^2].
  std::uint32_t resets;  ///< Velocities that were not finite.
};
struct FinishCount {
  float largest_speed_sq;  ///< Of particles that move [m^2/s^2].
  std::uint32_t resets;    ///< Velocities that were not finite.
};

/// Rows of a block of the coarse factor: a column of a block is one register of AVX-512.
inline constexpr int kFactorBlock = 16;
inline constexpr std::size_t kFactorBlockFloats = std::size_t{kFactorBlock} * kFactorBlock;
/// A triangular matrix in blocks of kFactorBlock rows, by columns of blocks in the order in which a substitution takes
/// them. `block[i]` for i from `start[step]` to `start[step + 1]` are the rows of blocks: first that on the diagonal,
/// whose inverse is stored, then those not zero among the ones that come later. Each block is stored by columns.
struct Substitution {
  int steps;
  const std::uint32_t* start;
  const std::uint32_t* block;
};

/// Over rows [row0, row1) of the membrane.
struct SheetKernels {
  /// point <- start + h * velocity, at most `limit` from start [m], for nodes that move and have a finite velocity,
  /// start for the others.
  PredictionCount (*predict)(const Sheet& sheet, float h, float limit, const float* const start[3],
                             const float* const velocity[3], float* const point[3], int row0, int row1);
  /// With `above` also the matrix of the row before row0: its triangles reach into row0, and its region is not
  /// computed.
  void (*linearise)(const Sheet& sheet, const Inertia& inertia, const SheetFields& fields, const SheetMatrix& matrix,
                    float* carry, bool above, int row0, int row1);
  /// out <- K p + mass * inertia * p. Returns p . out.
  double (*apply)(const Sheet& sheet, float inertia, const SheetMatrix& matrix, const float* const p[3],
                  float* const out[3], float* carry, int row0, int row1);
  /// p . (K p + mass * inertia * p) of the nodes of these rows and of the edges that begin there or, with `above`, end
  /// there.
  double (*curvature)(const Sheet& sheet, float inertia, const SheetMatrix& matrix, const float* const p[3], bool above,
                      int row0, int row1);
  /// Elastic and inertial energy at `fields.point` of the edges and nodes that these rows own [J].
  double (*energy)(const Sheet& sheet, const Inertia& inertia, const SheetFields& fields, int row0, int row1);
  /// Inverse blocks of rows [first, end) of the hats.
  void (*hat_blocks)(const Sheet& sheet, const HatLevel& hats, const SheetMatrix& matrix, float inertia, int first,
                     int end);
  /// sums [row][3][hat slots * 8] <- what a row's residual of nodes that move gives to the slots of the hats.
  void (*restrict_rows)(const Sheet& sheet, const HatLevel& hats, const float* const r[3], float* sums, int row0,
                        int row1);
  /// z <- D^-1 r + the hats' correction where a node moves. Returns r . z.
  double (*precondition)(const Sheet& sheet, const HatLevel& hats, const SheetMatrix& matrix, const float* const r[3],
                         float* const z[3], int row0, int row1);
  /// z <- D^-1 r. Returns r . z.
  double (*block_solve)(const Sheet& sheet, const SheetMatrix& matrix, const float* const r[3], float* const z[3],
                        int row0, int row1);
  /// Positions and velocities of nodes: point + d, at most `speed` fast; what is not finite stays, at rest.
  FinishCount (*finish)(const Sheet& sheet, const float* const point[3], const float* const d[3], float h, float speed,
                        float* const x[3], float* const velocity[3], int row0, int row1);
  /// d <- a p + b z, or d += that if it `adds`. Returns the largest |d|^2.
  float (*step)(const Sheet& sheet, float a, const float* const p[3], float b, const float* const z[3], bool adds,
                float* const d[3], int row0, int row1);
  /// Largest |d|^2 of nodes.
  float (*largest)(const Sheet& sheet, const float* const d[3], int row0, int row1);
};

/// Over vertices [first, last) of the organ, or over their patches.
struct OrganKernels {
  /// As that of the sheet; w of `start` tells which vertices move.
  PredictionCount (*predict)(float h, float limit, const float* start, const float* velocity, float* point,
                             std::uint32_t first, std::uint32_t last);
  /// Stress and its derivative of patches.
  void (*linearise)(const Organ& organ, const OrganMatrix& matrix, const float* point, std::uint32_t first,
                    std::uint32_t last);
  /// Residual of vertices. After `linearise` of their patches.
  void (*residual)(const Organ& organ, const OrganMatrix& matrix, const Inertia& inertia, const OrganFields& fields,
                   std::uint32_t first, std::uint32_t last);
  /// Inverse diagonal blocks of vertices; w of `pool` tells which move. After `linearise` of their patches.
  void (*blocks)(const Organ& organ, const OrganMatrix& matrix, const float* pool, const float* element_diagonal,
                 float inertia, std::uint32_t first, std::uint32_t last);
  /// V dP of patches.
  void (*stress)(const Organ& organ, const OrganMatrix& matrix, const float* p, std::uint32_t first,
                 std::uint32_t last);
  /// out <- K p + mass * inertia * p on vertices, after `stress` of their patches. Returns p . out.
  double (*apply)(const Organ& organ, const OrganMatrix& matrix, float inertia, const float* p, float* out,
                  std::uint32_t first, std::uint32_t last);
  /// As `stress`; returns what these patches and their own vertices have of p . (K p + mass * inertia * p).
  double (*curvature)(const Organ& organ, const OrganMatrix& matrix, float inertia, const float* p, std::uint32_t first,
                      std::uint32_t last);
  /// z <- D^-1 r. Returns r . z.
  double (*block_solve)(const OrganMatrix& matrix, const float* r, float* z, std::uint32_t first, std::uint32_t last);
  /// Elastic and inertial energy at `fields.point` [J].
  double (*energy)(const Organ& organ, const Inertia& inertia, const OrganFields& fields, std::uint32_t first,
                   std::uint32_t last);
  /// As that of the sheet; `pool` xyzw.
  FinishCount (*finish)(const float* point, const float* d, float h, float speed, float* pool, float* velocity,
                        std::uint32_t first, std::uint32_t last);
  /// As that of the sheet.
  float (*step)(float a, const float* p, float b, const float* z, bool adds, float* d, std::uint32_t first,
                std::uint32_t last);
  float (*largest)(const float* d, std::uint32_t first, std::uint32_t last);
};

/// On `count` floats of fields, a multiple of eight.
struct FieldKernels {
  /// p <- z + beta p.
  void (*combine)(const float* z, float beta, float* p, std::size_t count);
  /// d <- alpha p; r -= alpha q.
  void (*start)(float alpha, const float* p, const float* q, float* d, float* r, std::size_t count);
  /// d += alpha p; r -= alpha q.
  void (*advance)(float alpha, const float* p, const float* q, float* d, float* r, std::size_t count);
  /// d += alpha p.
  void (*add)(float alpha, const float* p, float* d, std::size_t count);
  /// True while all floats, of xyzw ones all but w, are between -limit and limit.
  bool (*within)(const float* p, float limit, std::size_t count, bool xyzw);
};

/// On blocks of the coarse factor.
struct FactorKernels {
  /// a <- b c^T, or a - b c^T, of blocks of kFactorBlock rows, stored by columns and aligned to 64 bytes; a is neither
  /// b nor c.
  void (*block_product)(const float* b, const float* c, bool subtract, float* a);
  /// x <- T^-1 x for the triangular T that `order` and `blocks` describe.
  void (*substitute)(const Substitution& order, const float* blocks, float* x);
};

struct Kernels {
  const char* name;
  SheetKernels sheet;
  OrganKernels organ;
  FieldKernels field;
  FactorKernels factor;
};

/// Those of an instruction set that this CPU has.
const Kernels& KernelsFor(InstructionSet set = BestInstructionSet());

}  // namespace fulcrum::physics::implicit
