// The kernels of a substep's linear solve, and of the membrane's linearisation, in OpenCL C, operation by operation
// those of physics_node/implicit (sheet_rows_impl.h, level_kernels_impl.h, organ_patches_impl.h,
// organ_kernels_impl.h), where equations, symbols and layouts are explained. A work item computes one node of the
// membrane, one patch or one vertex of the organ, in the layout of the host's fields. Effects that the host's kernels
// hand on from slot to slot and from row to row are computed again from the neighbours' cells, in the order in which
// the host adds them. Nothing is contracted, so a device whose division is correctly rounded gives the host's bits.
//
// Options: ROWS, SLOTS of the membrane; TUBE floats of the organ in a field; HAT_SLOTS; CONTRACTED: products and sums
// may be fused, as GPU compilers do by default. Planes of `matrix`: kt[3], along[3], coupling[2][3], x*[3], mass of
// nodes that move; of `levels`: inverse blocks[6]. A field is the organ's xyz_, then three planes.
#ifdef CONTRACTED
#pragma OPENCL FP_CONTRACT ON
#else
#pragma OPENCL FP_CONTRACT OFF
#endif
#pragma OPENCL EXTENSION cl_khr_fp64 : enable

#define LANES 8
#define STRIDE (LANES * SLOTS)
#define PLANE (ROWS * STRIDE)
#define WIDTH (LANES * HAT_SLOTS)
#define HAT_SPACING 4
enum { KT = 0, ALONG = 3, COUPLING = 6, POINT = 12, MASS = 15 };

typedef __global const float* In;
typedef __global float* Out;

float Dot3(float3 a, float3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
float3 Cross3(float3 a, float3 b) {
  return (float3)(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}
float3 At(In planes, int i) { return (float3)(planes[i], planes[PLANE + i], planes[2 * PLANE + i]); }
void Put(float3 v, Out planes, int i) {
  planes[i] = v.x;
  planes[PLANE + i] = v.y;
  planes[2 * PLANE + i] = v.z;
}

// Column c is lane c / SLOTS of slot c % SLOTS: the neighbours are a slot away, at an end of a lane in the next lane.
int RightOf(int i) {
  int in_row = i % STRIDE, slot = in_row / LANES, lane = in_row % LANES, row = i - in_row;
  return slot + 1 < SLOTS ? i + LANES : row + (lane + 1) % LANES;
}
int LeftOf(int i) {
  int in_row = i % STRIDE, slot = in_row / LANES, lane = in_row % LANES, row = i - in_row;
  return slot > 0 ? i - LANES : row + STRIDE - LANES + (lane + LANES - 1) % LANES;
}
int Below(int i) { return i / STRIDE + 1 == ROWS ? 0 : STRIDE; }

// Vectors along the edges of the cell at i: right, down, diagonal.
typedef struct {
  float3 of[3];
} Edges;
Edges EdgesAt(In planes, int i) {
  int right = RightOf(i), below = Below(i);
  float3 x = At(planes, i);
  Edges e;
  e.of[0] = At(planes, right) - x;
  e.of[1] = At(planes, i + below) - x;
  e.of[2] = At(planes, right + below) - x;
  return e;
}

// What the edges and triangles of the cell at i pull at the nodes to its right, below and along the diagonal.
typedef struct {
  float3 right, down, diagonal;
} Pull;
Pull PullOfCell(In matrix, In p, int i) {
  Edges d = EdgesAt(matrix + POINT * PLANE, i), dp = EdgesAt(p, i);
  float g[3], factor[3], k[6];
  for (int e = 0; e < 3; ++e) {
    g[e] = Dot3(d.of[e], dp.of[e]);
    factor[e] = matrix[(ALONG + e) * PLANE + i] * g[e];
  }
  for (int e = 0; e < 6; ++e) k[e] = matrix[(COUPLING + e) * PLANE + i];
  float3 far_down = d.of[2] - d.of[0], far_right = d.of[2] - d.of[1];
  float g_down = Dot3(far_down, dp.of[2] - dp.of[0]), g_right = Dot3(far_right, dp.of[2] - dp.of[1]);
  factor[0] = factor[0] + (k[0] * g_down + k[1] * g[2]);
  factor[1] = factor[1] + (k[3] * g_right + k[5] * g[2]);
  factor[2] = factor[2] + ((k[1] * g[0] + k[2] * g_down) + (k[4] * g_right + k[5] * g[1]));
  float3 by_down = far_down * (k[0] * g[0] + k[2] * g[2]), by_right = far_right * (k[3] * g[1] + k[4] * g[2]);
  float3 own[3];
  for (int e = 0; e < 3; ++e) own[e] = dp.of[e] * matrix[(KT + e) * PLANE + i] + d.of[e] * factor[e];
  Pull pull;
  pull.right = own[0] - by_down;
  pull.down = own[1] - by_right;
  pull.diagonal = own[2] + (by_down + by_right);
  return pull;
}

// out <- K p + inertia m p on the membrane; p . out of each node to `dots`.
__kernel void SheetApply(In matrix, In p_field, Out out_field, Out dots, float inertia) {
  int i = (int)get_global_id(0), left = LeftOf(i);
  In p = p_field + TUBE;
  float3 here = At(p, i);
  Pull own = PullOfCell(matrix, p, i), from_left = PullOfCell(matrix, p, left);
  float3 incoming = (float3)(0.0f);
  if (i >= STRIDE) {
    Pull above = PullOfCell(matrix, p, i - STRIDE), across = PullOfCell(matrix, p, left - STRIDE);
    incoming = above.down + across.diagonal;
  }
  float mass = matrix[MASS * PLANE + i] * inertia;
  float3 result = ((from_left.right + incoming) - ((own.right + own.down) + own.diagonal)) + here * mass;
  Put(result, out_field + TUBE, i);
  dots[i] = Dot3(here, result);
}

// The same in two launches: the pulls of each cell once, nine planes of `pulls`; then each node adds its four.
__kernel void SheetPulls(In matrix, In p_field, Out pulls) {
  int i = (int)get_global_id(0);
  Pull own = PullOfCell(matrix, p_field + TUBE, i);
  Put(own.right, pulls, i);
  Put(own.down, pulls + 3 * PLANE, i);
  Put(own.diagonal, pulls + 6 * PLANE, i);
}
__kernel void SheetGather(In matrix, In pulls, In p_field, Out out_field, Out dots, float inertia) {
  int i = (int)get_global_id(0), left = LeftOf(i);
  In down = pulls + 3 * PLANE, diagonal = pulls + 6 * PLANE;
  float3 here = At(p_field + TUBE, i), incoming = (float3)(0.0f);
  if (i >= STRIDE) incoming = At(down, i - STRIDE) + At(diagonal, left - STRIDE);
  float3 own = (At(pulls, i) + At(down, i)) + At(diagonal, i);
  float3 result = ((At(pulls, left) + incoming) - own) + here * (matrix[MASS * PLANE + i] * inertia);
  Put(result, out_field + TUBE, i);
  dots[i] = Dot3(here, result);
}

// p . A p of the edges and the cell that a node owns, to `dots`.
__kernel void SheetCurvature(In matrix, In p_field, Out dots, float inertia) {
  const int pairs[3][2] = {{0, 1}, {0, 2}, {1, 2}};
  int i = (int)get_global_id(0);
  In p = p_field + TUBE;
  Edges d = EdgesAt(matrix + POINT * PLANE, i), dp = EdgesAt(p, i);
  float3 here = At(p, i);
  float of_edge[3];
  for (int e = 0; e < 3; ++e) {
    float along = Dot3(d.of[e], dp.of[e]);
    of_edge[e] =
        Dot3(dp.of[e], dp.of[e]) * matrix[(KT + e) * PLANE + i] + along * along * matrix[(ALONG + e) * PLANE + i];
  }
  float sum = 0.0f;
  for (int half_of = 0; half_of < 2; ++half_of) {
    // Edges R, B', D of the first triangle, R', B, D of the second.
    float3 a[3] = {d.of[0], d.of[2] - d.of[0], d.of[2]}, b[3] = {dp.of[0], dp.of[2] - dp.of[0], dp.of[2]};
    if (half_of == 1) {
      a[0] = d.of[2] - d.of[1];
      a[1] = d.of[1];
      b[0] = dp.of[2] - dp.of[1];
      b[1] = dp.of[1];
    }
    float g[3];
    for (int k = 0; k < 3; ++k) g[k] = Dot3(a[k], b[k]);
    for (int k = 0; k < 3; ++k) {
      sum = sum + matrix[(COUPLING + 3 * half_of + k) * PLANE + i] * (g[pairs[k][0]] * g[pairs[k][1]]);
    }
  }
  float of_node = (of_edge[1] + of_edge[2]) + 2.0f * sum;
  dots[i] = (of_node + of_edge[0]) + Dot3(here, here) * (matrix[MASS * PLANE + i] * inertia);
}

// Sums of a row by lane, over its slots in order; `parity`: of even and of odd slots apart, then both.
__kernel void LaneSums(In dots, Out lanes, int parity) {
  int i = (int)get_global_id(0), first = i / LANES * STRIDE + i % LANES;
  float even = 0.0f, odd = 0.0f;
  for (int s = 0; s < SLOTS; ++s) {
    float v = dots[first + LANES * s];
    if (parity != 0 && s % 2 == 1) {
      odd = odd + v;
    } else {
      even = even + v;
    }
  }
  lanes[i] = parity != 0 ? even + odd : even;
}
// By task, the rows or vertices one after the other in double: the host's order.
__kernel void RowTaskSums(In lanes, __global const int* bounds, __global double* sums) {
  int task = (int)get_global_id(0);
  double sum = 0.0;
  for (int row = bounds[2 * task]; row < bounds[2 * task + 1]; ++row) {
    In f = lanes + LANES * row;
    sum += (double)(((f[0] + f[1]) + (f[2] + f[3])) + ((f[4] + f[5]) + (f[6] + f[7])));
  }
  sums[task] = sum;
}
__kernel void VertexTaskSums(In dots, __global const int* bounds, __global double* sums) {
  int task = (int)get_global_id(0);
  double sum = 0.0;
  for (int v = bounds[2 * task]; v < bounds[2 * task + 1]; ++v) sum += (double)dots[v];
  sums[task] = sum;
}

float3 Column(In c, int at) { return (float3)(c[at], c[at + 1], c[at + 2]); }
// V dP of patch n whose vertices move with gradients d, to its line of `lines`; with p of its own vertex.
void StressAlong(In c, In f, const float3* d, int n, float3 stress[3]) {
  int at = 12 * n;
  float3 cc[3] = {Column(c, at), Column(c, at + 4), Column(c, at + 8)};
  float3 ff[3] = {Column(f, at), Column(f, at + 4), Column(f, at + 8)};
  float shear = c[at + 3];
  float along = (cc[0].x * d[0].x + cc[1].x * d[1].x + cc[2].x * d[2].x) +
                (cc[0].y * d[0].y + cc[1].y * d[1].y + cc[2].y * d[2].y) +
                (cc[0].z * d[0].z + cc[1].z * d[1].z + cc[2].z * d[2].z);
  for (int k = 0; k < 3; ++k) {
    int a = (k + 1) % 3, b = (k + 2) % 3;
    stress[k] = (d[k] * shear + cc[k] * along) + (Cross3(d[a], ff[b]) + Cross3(ff[a], d[b]));
  }
}
void StoreLine(const float3* stress, float4 own, __global float4* lines, int n) {
  for (int k = 0; k < 3; ++k) lines[4 * n + k] = (float4)(stress[k], 0.0f);
  lines[4 * n + 3] = own;
}
__kernel void OrganStress(__global const int* start, __global const int* vertex, __global const float4* gradient,
                          In c, In f, __global const float4* p, __global float4* lines) {
  int n = (int)get_global_id(0);
  float3 d[3] = {(float3)(0.0f), (float3)(0.0f), (float3)(0.0f)}, stress[3];
  for (int i = start[n]; i < start[n + 1]; ++i) {
    float3 x = p[vertex[i]].xyz;
    float4 g = gradient[i];
    d[0] = d[0] + x * g.x;
    d[1] = d[1] + x * g.y;
    d[2] = d[2] + x * g.z;
  }
  StressAlong(c, f, d, n, stress);
  StoreLine(stress, p[n], lines, n);
}
__kernel void OrganApply(__global const int* start, __global const int* patch, __global const float4* gradient,
                         __global const float4* lines, In mass, __global const float4* p, __global float4* out,
                         Out dots, float inertia) {
  int v = (int)get_global_id(0);
  float4 here = p[v], sum[4] = {(float4)(0.0f), (float4)(0.0f), (float4)(0.0f), (float4)(0.0f)};
  for (int i = start[v]; i < start[v + 1]; ++i) {
    __global const float4* line = lines + 4 * patch[i];
    float4 g = gradient[i];
    sum[0] = sum[0] + line[0] * g.x;
    sum[1] = sum[1] + line[1] * g.y;
    sum[2] = sum[2] + line[2] * g.z;
    sum[3] = sum[3] + (line[3] - here) * g.w;
  }
  float4 gathered = ((sum[0] + sum[1]) + sum[2]) - sum[3];
  gathered.w = 0.0f;
  float4 result = gathered + here * (mass[v] * inertia);
  out[v] = result;
  dots[v] = (here.x * result.x + here.y * result.y) + here.z * result.z;
}
// p . A p of each patch and its own vertex, to `dots`.
__kernel void OrganCurvature(__global const int* start, __global const int* vertex, __global const float4* gradient,
                             In c, In f, In mass, __global const float4* p, __global float4* lines, Out dots,
                             float inertia) {
  int n = (int)get_global_id(0);
  float3 d[3] = {(float3)(0.0f), (float3)(0.0f), (float3)(0.0f)}, stress[3], edges = (float3)(0.0f);
  float3 here = p[n].xyz;
  for (int i = start[n]; i < start[n + 1]; ++i) {
    float3 x = p[vertex[i]].xyz - here;
    float4 g = gradient[i];
    d[0] = d[0] + x * g.x;
    d[1] = d[1] + x * g.y;
    d[2] = d[2] + x * g.z;
    edges = edges + x * g.w;
  }
  StressAlong(c, f, d, n, stress);
  StoreLine(stress, p[n], lines, n);
  float3 own = here * (mass[n] * inertia) - edges;
  float of_matrix = (stress[0].x * d[0].x + stress[1].x * d[1].x + stress[2].x * d[2].x) +
                    (stress[0].y * d[0].y + stress[1].y * d[1].y + stress[2].y * d[2].y) +
                    (stress[0].z * d[0].z + stress[1].z * d[1].z + stress[2].z * d[2].z);
  dots[n] = of_matrix + Dot3(here, own);
}

// field += alpha p.
__kernel void Add(Out field, In p, float alpha) {
  int i = (int)get_global_id(0);
  field[i] = field[i] + p[i] * alpha;
}
// d <- a p + b z.
__kernel void Step(Out d, In p, In z, float a, float b) {
  int i = (int)get_global_id(0);
  d[i] = p[i] * a + z[i] * b;
}

// Sums [row][3][WIDTH] of what a row's residual gives to the slots of the hats; an item per float of a row of hats.
__kernel void Restrict(In matrix, In hat_weights, In r_field, Out sums) {
  int i = (int)get_global_id(0), row = i / WIDTH, place = i % WIDTH, group = place / LANES, lane = place % LANES;
  In r = r_field + TUBE, own = hat_weights, next = hat_weights + STRIDE;
  // The group before hands on its part; the first one gets that of the last, one lane before.
  int before = group > 0 ? group - 1 : HAT_SLOTS - 1, lane_before = group > 0 ? lane : (lane + LANES - 1) % LANES;
  float3 carried = (float3)(0.0f);
  for (int s = HAT_SPACING * before; s < min(HAT_SPACING * (before + 1), SLOTS); ++s) {
    int i_s = LANES * s + lane_before, node = row * STRIDE + i_s;
    float3 v = matrix[MASS * PLANE + node] > 0.0f ? At(r, node) : (float3)(0.0f);
    carried = carried + v * next[i_s];
  }
  float3 sum = group > 0 ? carried : (float3)(0.0f);
  for (int s = HAT_SPACING * group; s < min(HAT_SPACING * (group + 1), SLOTS); ++s) {
    int i_s = LANES * s + lane, node = row * STRIDE + i_s;
    float3 v = matrix[MASS * PLANE + node] > 0.0f ? At(r, node) : (float3)(0.0f);
    sum = sum + v * own[i_s];
  }
  if (group == 0) sum = sum + carried;
  Out out = sums + 3 * WIDTH * row + place;
  out[0] = sum.x;
  out[WIDTH] = sum.y;
  out[2 * WIDTH] = sum.z;
}

float3 HatValue(In value, __global const int* cell, In fraction, int row, int place) {
  In low = value + 3 * WIDTH * cell[row] + place;
  In high = fraction[row] > 0.0f ? low + 3 * WIDTH : low;
  float up = fraction[row], down = 1.0f - fraction[row];
  return (float3)(low[0] * down + high[0] * up, low[WIDTH] * down + high[WIDTH] * up,
                  low[2 * WIDTH] * down + high[2 * WIDTH] * up);
}
// z <- D^-1 r + the hats' correction where a node moves; r . z of each node to `dots`.
__kernel void Precondition(In matrix, In levels, In hat_weights, In value, __global const int* cell, In fraction,
                           In r_field, Out z_field, Out dots) {
  int i = (int)get_global_id(0), row = i / STRIDE, in_row = i % STRIDE, slot = in_row / LANES, lane = in_row % LANES;
  int group = slot / HAT_SPACING;
  int after = group + 1 < HAT_SLOTS ? LANES * (group + 1) + lane : (lane + 1) % LANES;
  float3 here = HatValue(value, cell, fraction, row, LANES * group + lane);
  float3 following = HatValue(value, cell, fraction, row, after);
  float3 from_hats = here * hat_weights[in_row] + following * hat_weights[STRIDE + in_row];
  if (!(matrix[MASS * PLANE + i] > 0.0f)) from_hats = (float3)(0.0f);
  float3 b = At(r_field + TUBE, i);
  float k[6];
  for (int e = 0; e < 6; ++e) k[e] = levels[e * PLANE + i];
  float3 own = (float3)(k[0] * b.x + k[3] * b.y + k[4] * b.z, k[3] * b.x + k[1] * b.y + k[5] * b.z,
                        k[4] * b.x + k[5] * b.y + k[2] * b.z);
  float3 result = own + from_hats;
  Put(result, z_field + TUBE, i);
  dots[i] = Dot3(b, result);
}

// Linearisation of the membrane as a continuum without springs, in two launches. First each cell's triangles
// (sheet_triangles_impl.h): planes tension[2][3], along[2][3], coupling[2][3] from `law`, planes a[2], alpha[2][3].
enum { T_ALONG = 6, T_COUPLING = 12 };
__kernel void SheetTriangles(In matrix, In law, Out t, float stiffening, float least_determinant) {
  const int pairs[3][2] = {{0, 1}, {0, 2}, {1, 2}};
  int i = (int)get_global_id(0);
  Edges d = EdgesAt(matrix + POINT * PLANE, i);
  for (int half_of = 0; half_of < 2; ++half_of) {
    float3 edge[3] = {d.of[0], d.of[2] - d.of[0], d.of[2]};
    if (half_of == 1) {
      edge[0] = d.of[2] - d.of[1];
      edge[1] = d.of[1];
    }
    float a = law[half_of * PLANE + i], alpha[3], l[3], slope[3], first[3];
    for (int k = 0; k < 3; ++k) {
      alpha[k] = law[(2 + 3 * half_of + k) * PLANE + i];
      l[k] = Dot3(edge[k], edge[k]);
    }
    float half_g = 0.5f * (alpha[0] * alpha[1] + alpha[1] * alpha[2] + alpha[2] * alpha[0]);
    float sum = l[0] + l[1] + l[2], twice = 0.0f, trace = 0.0f;
    for (int k = 0; k < 3; ++k) {
      slope[k] = half_g * (sum - 2.0f * l[k]);
      twice = twice + slope[k] * l[k];
      trace = trace + alpha[k] * l[k];
    }
    float determinant = 0.5f * twice, at = determinant > least_determinant ? determinant : least_determinant;
    bool crushed = determinant < least_determinant;
    float inverse = 1.0f / at, f1 = 0.0f - inverse * inverse;
    float invariant = trace + inverse + f1 * (determinant - at) - 3.0f;
    float weight = 1.0f + (2.0f * stiffening) * invariant;
    for (int k = 0; k < 3; ++k) first[k] = alpha[k] + f1 * slope[k];
    float f2 = crushed ? 0.0f : 2.0f * inverse * inverse * inverse, bent = f1 * half_g;
    float curve = crushed ? 0.0f : bent, curve_own = crushed ? 0.0f - 2.0f * bent : 0.0f - bent;
    float four = 4.0f * a, bend = 2.0f * stiffening;
    for (int k = 0; k < 3; ++k) {
      int m = pairs[k][0], n = pairs[k][1], to = 3 * half_of + k;
      t[to * PLANE + i] = 2.0f * a * weight * first[k];
      t[(T_ALONG + to) * PLANE + i] =
          four * (weight * (f2 * (slope[k] * slope[k]) + curve_own) + bend * (first[k] * first[k]));
      t[(T_COUPLING + to) * PLANE + i] =
          four * (weight * (f2 * (slope[m] * slope[n]) + curve) + bend * (first[m] * first[n]));
    }
  }
}

// What an edge does to its first node: force, and xx yy zz xy xz yz of its stiffness.
typedef struct {
  float v[9], kt, along;
} Terms;
Terms ActingOnEnds(float3 d, float tension, float along) {
  Terms e;
  e.along = 0.0f + along;
  tension = 0.0f + tension;
  e.kt = tension > 0.0f ? tension : 0.0f;
  float3 f = d * tension, a = d * e.along;
  e.v[0] = f.x;
  e.v[1] = f.y;
  e.v[2] = f.z;
  e.v[3] = e.kt + a.x * d.x;
  e.v[4] = e.kt + a.y * d.y;
  e.v[5] = e.kt + a.z * d.z;
  e.v[6] = a.x * d.y;
  e.v[7] = a.x * d.z;
  e.v[8] = a.y * d.z;
  return e;
}
// The edges that the node at i owns. Triangles: 0 R, B', D; 1 R', B, D (edges 0, 1, 2 of each).
Terms RightEdge(In point, In t, int i) {
  int above = i - STRIDE;
  float tension = i >= STRIDE ? t[3 * PLANE + above] : 0.0f;
  float along = i >= STRIDE ? t[(T_ALONG + 3) * PLANE + above] : 0.0f;
  return ActingOnEnds(At(point, RightOf(i)) - At(point, i), t[i] + tension, t[T_ALONG * PLANE + i] + along);
}
Terms DownEdge(In point, In t, int i) {
  int left = LeftOf(i);
  return ActingOnEnds(At(point, i + Below(i)) - At(point, i), t[4 * PLANE + i] + t[PLANE + left],
                      t[(T_ALONG + 4) * PLANE + i] + t[(T_ALONG + 1) * PLANE + left]);
}
Terms DiagonalEdge(In point, In t, int i) {
  return ActingOnEnds(At(point, RightOf(i) + Below(i)) - At(point, i), t[2 * PLANE + i] + t[5 * PLANE + i],
                      t[(T_ALONG + 2) * PLANE + i] + t[(T_ALONG + 5) * PLANE + i]);
}
// Then edges, residual and diagonal blocks of each node. `fields`: planes x_n[3], v_n[3], load[3], k_e; `out`: planes
// kt[3], along[3], residual[3], inverse blocks[6].
__kernel void SheetLinearise(In matrix, In t, In fields, Out out, float inertia, float inverse_h, float gx, float gy,
                             float gz) {
  int i = (int)get_global_id(0), left = LeftOf(i);
  In point = matrix + POINT * PLANE;
  Terms right = RightEdge(point, t, i), down = DownEdge(point, t, i), across = DiagonalEdge(point, t, i);
  Terms from_left = RightEdge(point, t, left), from_above, from_across;
  bool first_row = i < STRIDE;
  if (!first_row) {
    from_above = DownEdge(point, t, i - STRIDE);
    from_across = DiagonalEdge(point, t, left - STRIDE);
  }
  float sum[9];
  for (int c = 0; c < 9; ++c) {
    float incoming = first_row ? 0.0f : from_above.v[c] + from_across.v[c];
    sum[c] = (c < 3 ? down.v[c] - incoming : down.v[c] + incoming) + across.v[c];
    sum[c] = (c < 3 ? sum[c] - from_left.v[c] : sum[c] + from_left.v[c]) + right.v[c];
  }
  out[i] = right.kt;
  out[PLANE + i] = down.kt;
  out[2 * PLANE + i] = across.kt;
  out[3 * PLANE + i] = right.along;
  out[4 * PLANE + i] = down.along;
  out[5 * PLANE + i] = across.along;
  float mass = matrix[MASS * PLANE + i];
  float3 momentum = (At(point, i) - At(fields, i)) * inertia - At(fields + 3 * PLANE, i) * inverse_h;
  float3 elastic = (float3)(sum[0], sum[1], sum[2]);
  Put(elastic + At(fields + 6 * PLANE, i) + ((float3)(gx, gy, gz) - momentum) * mass, out + 6 * PLANE, i);
  float own = fields[9 * PLANE + i] + mass * inertia;
  float xx = sum[3] + own, yy = sum[4] + own, zz = sum[5] + own, xy = sum[6], xz = sum[7], yz = sum[8];
  float c00 = yy * zz - yz * yz, c01 = xz * yz - xy * zz, c02 = xy * yz - xz * yy;
  float c11 = xx * zz - xz * xz, c12 = xy * xz - xx * yz, c22 = xx * yy - xy * xy;
  float scale = mass > 0.0f ? 1.0f / (xx * c00 + xy * c01 + xz * c02) : 0.0f;
  float inverse[6] = {c00, c11, c22, c01, c02, c12};
  for (int k = 0; k < 6; ++k) out[(9 + k) * PLANE + i] = mass > 0.0f ? inverse[k] * scale : 0.0f;
}
