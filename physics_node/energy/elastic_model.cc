#include "physics_node/energy/elastic_model.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>

#include "services/base/core/sheets.h"
#include "services/base/core/solids.h"

namespace fulcrum::physics {
namespace {

/// Shear modulus of the sheet over Young's: between that of an incompressible sheet (1/3) and of a woven one.
/// Assumed.
constexpr double kShearPart = 0.25;
/// Least area of a cell over its squared diagonal, 1/2 for a square. In a thinner cell the diagonal would be extremely
/// stiff along itself for the little shear that it carries.
constexpr double kLeastCell = 0.1;
/// An edge shorter than this share of the mean of its direction carries less tension, in proportion: a node on its
/// neighbour would be tied to it by a spring whose frequency no time step resolves.
constexpr double kLeastEdge = 0.05;
/// Least mean length of a binding in the stiffness of the fat [m]: it bounds E A / length where membrane and organ
/// touch. Below any layer of fat that a scene has.
constexpr double kLeastBindingLength = 1e-3;

Vec3d Rest(const TissueScene& scene, Index particle) { return scene.rest_position[particle].cast<double>(); }

double Cotangent(const Vec3d& at, const Vec3d& p, const Vec3d& q) {
  const Vec3d u = p - at, v = q - at;
  return u.dot(v) / u.cross(v).norm();
}

/// Springs of the membrane, axial stiffness A [N]:
///
///   rows, columns   A = E t b                             b: width of the strip that the edge stands for [m]
///   diagonals       A = kShearPart E t l^3 / (l_c l_r)    l: lengths of the diagonal, the row and the column edge [m]
///
/// with l_c l_r >= kLeastCell l^2, and less for edges below kLeastEdge of the mean length.
void AddSprings(const TissueScene& scene, ElasticModel* model) {
  const Index first = scene.membrane.first, rows = scene.membrane.rows, cols = scene.membrane.cols;
  const double shrink = 1.0 / (1.0 + scene.physics.membrane_prestrain);
  model->springs.assign(scene.membrane_rest_length.size(), {});
  // Rest length of the edge of a node in a direction, and the width of the strip of sheet that an edge stands for.
  const auto length = [&](Index row, Index col, int direction) {
    return static_cast<double>(scene.membrane_rest_length[3 * (row * cols + col) + static_cast<Index>(direction)]);
  };
  const auto share = [&](Index row, Index col, int direction) {
    // Mean over the two ends of half an edge to either side: a quarter of each of the four edges across.
    const int across = 1 - direction;
    double width = 0;
    for (int end = 0; end < 2; ++end) {
      const Index r = row + (direction == 1 && end ? 1 : 0), c = col + (direction == 0 && end ? 1 : 0);
      if (across == 0 ? c + 1 < cols : r + 1 < rows) {
        width += 0.25 * length(r, c, across);
      }
      if (across == 0 ? c > 0 : r > 0) {
        width += 0.25 * (across == 0 ? length(r, c - 1, 0) : length(r - 1, c, 1));
      }
    }
    return width;
  };
  const std::vector<std::size_t> sheet = SheetOfRows(scene);
  std::vector<std::array<double, 3>> means(sheet.empty() ? 0 : sheet.back() + 1), counts(means.size());
  for (std::size_t i = 0; i < scene.membrane_rest_length.size(); ++i) {
    const std::size_t of = sheet[i / 3 / cols];
    means[of][i % 3] += static_cast<double>(scene.membrane_rest_length[i]);
    counts[of][i % 3] += scene.membrane_rest_length[i] > 0.0f ? 1 : 0;
  }
  for (std::size_t of = 0; of < means.size(); ++of) {
    for (std::size_t d = 0; d < 3; ++d) means[of][d] /= std::max(counts[of][d], 1.0);
  }
  const std::vector<SheetProperties> properties = PropertiesOfRows(scene);
  for (Index row = 0; row < rows; ++row) {
    const double Et = properties[row].Et_N_per_m;
    for (Index col = 0; col < cols; ++col) {
      const Index node = row * cols + col;
      for (int d = 0; d < 3; ++d) {
        const double rest = length(row, col, d);
        if (!(rest > 0)) {
          continue;
        }
        const double whole = kLeastEdge * means[sheet[row]][static_cast<std::size_t>(d)];
        ElasticSpring& spring = model->springs[3 * node + static_cast<Index>(d)];
        spring.a = first + node;
        spring.b = first + node + (d == 0 ? 1 : d == 1 ? cols : cols + 1);
        spring.rest_length = rest * shrink;
        spring.axial = d < 2 ? Et * share(row, col, d)
                             : kShearPart * Et * rest * rest * rest /
                                   std::max(length(row, col, 0) * length(row, col, 1), kLeastCell * rest * rest);
        spring.axial *= std::min(1.0, rest / whole);
      }
    }
  }
}

void AddTriangles(const TissueScene& scene, ElasticModel* model) {
  const Index rows = scene.membrane.rows, cols = scene.membrane.cols;
  const std::vector<SheetProperties> properties = PropertiesOfRows(scene);
  for (Index row = 0; row + 1 < rows; ++row) {
    for (Index col = 0; col + 1 < cols; ++col) {
      if (!HasCell(scene, row, col)) continue;
      const std::size_t n = row * cols + col;
      for (const bool lower : {false, true}) {
        ElasticTriangle triangle;
        triangle.edges = {3 * (lower ? n + cols : n), 3 * (lower ? n : n + 1) + 1, 3 * n + 2};
        std::array<double, 3> lengths{};
        for (std::size_t i = 0; i < 3; ++i) {
          lengths[i] = model->springs[triangle.edges[i]].rest_length;
        }
        triangle.rest = RestOfTriangle(lengths, properties[row].Et_N_per_m);
        model->triangles.push_back(triangle);
      }
    }
  }
}

/// Hinge of quadratic bending (Bergou et al. 2006) over the edge x0 x1 of the triangles (x0, x1, x2) and (x1, x0, x3):
///
///   k = 3 B / (A0 + A1) [N/m],   c = (c12 + c13, c02 + c03, -c02 - c12, -c03 - c13)
///
/// with the flexural rigidity B [N m], the areas A [m^2] and c_ij the cotangent of the angle at x_i in the triangle of
/// x_j.
void AddHinges(const TissueScene& scene, ElasticModel* model) {
  const std::vector<SheetProperties> properties = PropertiesOfRows(scene);
  for (const BendingConstraint& bend : scene.bending) {
    std::array<Vec3d, 4> x;
    for (std::size_t i = 0; i < 4; ++i) {
      x[i] = Rest(scene, bend.v[i]);
    }
    ElasticHinge hinge;
    hinge.v = bend.v;
    const double a0 = 0.5 * (x[1] - x[0]).cross(x[2] - x[0]).norm(), a1 = 0.5 * (x[1] - x[0]).cross(x[3] - x[0]).norm();
    const double c02 = Cotangent(x[0], x[1], x[2]), c12 = Cotangent(x[1], x[0], x[2]);
    const double c03 = Cotangent(x[0], x[1], x[3]), c13 = Cotangent(x[1], x[0], x[3]);
    hinge.c = {c12 + c13, c02 + c03, -c02 - c12, -c03 - c13};
    hinge.stiffness = 3.0 * properties[(bend.v[0] - scene.membrane.first) / scene.membrane.cols].bending_Nm / (a0 + a1);
    // One hinge per constraint of the scene; it is inactive where its triangles have no area.
    const bool sound = std::isfinite(hinge.stiffness) &&
                       std::all_of(hinge.c.begin(), hinge.c.end(), [](double c) { return std::isfinite(c); });
    if (!sound) {
      hinge.c = {0, 0, 0, 0};
      hinge.stiffness = 0;
    }
    model->hinges.push_back(hinge);
  }
}

void AddTets(const TissueScene& scene, ElasticModel* model) {
  const double E = scene.physics.tube_youngs_modulus_Pa, nu = scene.physics.tube_poisson;
  model->mu_Pa = E / (2 * (1 + nu));
  model->lambda_Pa = E * nu / ((1 + nu) * (1 - 2 * nu));
  const std::vector<Index> solid = SolidOfVertices(scene);
  model->tets.reserve(scene.tets.size());
  for (const Tetrahedron& v : scene.tets) {
    Mat3d edges;
    for (int i = 0; i < 3; ++i) {
      edges.col(i) = Rest(scene, v[static_cast<std::size_t>(i) + 1]) - Rest(scene, v[0]);
    }
    const double scale = static_cast<double>(YoungsModulusOf(scene, solid[v[0]])) / E;
    model->tets.push_back({v, edges.determinant() / 6.0, edges.inverse(), scale});
  }
  AddOrganPatches(model);
}

void AddBindings(const TissueScene& scene, ElasticModel* model) {
  if (scene.bindings.empty()) {
    return;
  }
  const std::vector<double> stiffness = BindingStiffness(scene);
  const std::vector<std::size_t> sheet = SheetOfRows(scene);
  for (const Binding& binding : scene.bindings) {
    ElasticBinding b;
    b.membrane = binding.membrane;
    b.surface = binding.surface;
    for (std::size_t i = 0; i < 3; ++i) {
      b.barycentric[i] = binding.barycentric[i];
    }
    b.rest_length = binding.rest_length;
    b.stiffness = stiffness[sheet[(binding.membrane - scene.membrane.first) / scene.membrane.cols]];
    model->bindings.push_back(b);
  }
}

/// The surface of a solid that something slides on: its triangles in ElasticModel::slide_surface.
struct SlideSurface {
  Index first = 0, end = 0;
};

std::map<Index, SlideSurface> AddSlideSurfaces(const TissueScene& scene, const std::vector<Index>& solid,
                                               ElasticModel* model) {
  std::map<Index, SlideSurface> surfaces;
  for (const Attachment& a : scene.attachments) {
    if (!a.normal.isZero(0.0f)) surfaces.try_emplace(solid[a.surface[0]]);
  }
  for (auto& [of, surface] : surfaces) {
    surface.first = static_cast<Index>(model->slide_surface.size());
    std::copy_if(scene.tube_surface.begin(), scene.tube_surface.end(), std::back_inserter(model->slide_surface),
                 [&, wanted = of](const Triangle& t) { return solid[t[0]] == wanted; });
    surface.end = static_cast<Index>(model->slide_surface.size());
  }
  return surfaces;
}

void AddSlide(const TissueScene& scene, const Attachment& attachment, const SlideSurface& surface,
              ElasticModel* model) {
  Vec3d from_surface = Rest(scene, attachment.vertex);
  for (std::size_t i = 0; i < 3; ++i) {
    from_surface -= static_cast<double>(attachment.barycentric[i]) * Rest(scene, attachment.surface[i]);
  }
  const auto begin = model->slide_surface.begin();
  const auto at = std::find(begin + surface.first, begin + surface.end, attachment.surface);
  // The normal leads to the side on which the gap is positive.
  const double gap_m = std::copysign(from_surface.norm(), attachment.normal.cast<double>().dot(from_surface));
  model->slides.push_back({attachment.vertex, surface.first, surface.end, static_cast<Index>(at - begin), gap_m,
                           attachment.stiffness_N_per_m, attachment.normal.cast<double>()});
}

void AddAttachments(const TissueScene& scene, ElasticModel* model) {
  const std::vector<Index> solid = SolidOfVertices(scene);
  const std::map<Index, SlideSurface> slide_surfaces = AddSlideSurfaces(scene, solid, model);
  for (const Attachment& attachment : scene.attachments) {
    if (!attachment.normal.isZero(0.0f)) {
      AddSlide(scene, attachment, slide_surfaces.at(solid[attachment.surface[0]]), model);
      continue;
    }
    const Triangle& s = attachment.surface;
    const std::array<float, 3>& b = attachment.barycentric;
    ElasticHinge& hinge = model->attachments.emplace_back();
    hinge.v = {attachment.vertex, s[0], s[1], s[2]};
    hinge.c = {1, -static_cast<double>(b[0]), -static_cast<double>(b[1]), -static_cast<double>(b[2])};
    hinge.stiffness = attachment.stiffness_N_per_m;
  }
}

/// The load balances the membrane in the rest shape; organ, hinges and bindings are free of force there.
void AddLoad(ElasticModel* model) {
  model->load.assign(model->rest_position.size(), Vec3d::Zero());
  const auto pull = [&](const ElasticSpring& spring, const Vec3d& force) {
    model->load[spring.a] -= force;
    model->load[spring.b] += force;
  };
  const auto along = [&](const ElasticSpring& spring) {
    return Vec3d(model->rest_position[spring.b] - model->rest_position[spring.a]);
  };
  const std::vector<std::vector<std::size_t>> triangles = TrianglesOfEdges(*model);
  for (std::size_t edge = 0; edge < model->springs.size(); ++edge) {
    const ElasticSpring& spring = model->springs[edge];
    const double axial = spring.axial * ShareOfSprings(*model, triangles[edge]);
    if (axial > 0) {
      const Vec3d d = along(spring);
      const double strain = d.norm() / spring.rest_length - 1;
      pull(spring, axial * (strain + model->spring_stiffening() * strain * strain * strain) * d.normalized());
    }
  }
  for (const ElasticTriangle& triangle : model->triangles) {
    std::array<double, 3> squares{};
    for (std::size_t i = 0; i < 3; ++i) {
      squares[i] = along(model->springs[triangle.edges[i]]).squaredNorm();
    }
    const TriangleTerms terms =
        EvaluateTriangle(triangle.rest, model->triangle_stiffening(), squares, TriangleCoupling::kForce);
    for (std::size_t i = 0; i < 3 && triangle.rest.stiffness > 0; ++i) {
      const ElasticSpring& spring = model->springs[triangle.edges[i]];
      pull(spring, terms.tension[static_cast<Eigen::Index>(i)] * along(spring));
    }
  }
}

}  // namespace

std::vector<double> BindingStiffness(const TissueScene& scene) {
  const std::vector<std::size_t> sheet = SheetOfRows(scene);
  const std::size_t sheets = sheet.empty() ? 0 : sheet.back() + 1;
  std::vector<double> area(sheets), length(sheets), count(sheets), stiffness;
  const Index first = scene.membrane.first, cols = scene.membrane.cols;
  for (Index row = 0; row + 1 < scene.membrane.rows; ++row) {
    for (Index col = 0; col + 1 < cols; ++col) {
      if (!HasCell(scene, row, col)) continue;
      const Index n = first + row * cols + col;
      const Vec3d diagonal = Rest(scene, n + cols + 1) - Rest(scene, n);
      area[sheet[row]] += 0.5 * diagonal.cross(Rest(scene, n + 1) - Rest(scene, n)).norm() +
                          0.5 * diagonal.cross(Rest(scene, n + cols) - Rest(scene, n)).norm();
    }
  }
  for (const Binding& binding : scene.bindings) {
    const std::size_t of = sheet[(binding.membrane - first) / cols];
    length[of] += binding.rest_length;
    count[of] += 1;
  }
  const std::vector<SheetPart> parts = SheetsOf(scene);
  for (std::size_t of = 0; of < sheets; ++of) {
    const double n = std::max(count[of], 1.0);
    stiffness.push_back(PropertiesOf(parts[of], scene.physics).fat_youngs_modulus_Pa * (area[of] / n) /
                        std::max(length[of] / n, kLeastBindingLength));
  }
  return stiffness;
}

std::vector<std::vector<std::size_t>> TrianglesOfEdges(const ElasticModel& model) {
  std::vector<std::vector<std::size_t>> of(model.springs.size());
  for (std::size_t t = 0; t < model.triangles.size(); ++t) {
    for (const std::size_t edge : model.triangles[t].edges) {
      of[edge].push_back(t);
    }
  }
  return of;
}

double ShareOfSprings(const ElasticModel& model, const std::vector<std::size_t>& triangles) {
  const auto open = [&](std::size_t t) { return !(model.triangles[t].rest.stiffness > 0); };
  return triangles.empty() ? 1.0
                           : static_cast<double>(std::count_if(triangles.begin(), triangles.end(), open)) /
                                 static_cast<double>(triangles.size());
}

ElasticModel BuildElasticModel(const TissueScene& scene) {
  ElasticModel model;
  for (Index p = 0; p < scene.rest_position.size(); ++p) {
    model.rest_position.push_back(Rest(scene, p));
    model.mass.push_back(scene.inverse_mass[p] > 0 ? 1.0 / static_cast<double>(scene.inverse_mass[p]) : 0.0);
  }
  model.stiffening = scene.physics.membrane_stiffening;
  model.damping_per_s = scene.physics.damping_per_s;
  model.gravity = scene.physics.gravity.cast<double>();
  AddSprings(scene, &model);
  if (scene.physics.membrane_model == MembraneModel::kContinuum) {
    AddTriangles(scene, &model);
  }
  AddHinges(scene, &model);
  AddTets(scene, &model);
  AddBindings(scene, &model);
  AddAttachments(scene, &model);
  AddLoad(&model);
  return model;
}

}  // namespace fulcrum::physics
