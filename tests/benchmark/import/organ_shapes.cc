#include "tests/benchmark/import/organ_shapes.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include "services/scene/builder/geometry.h"
#include "services/scene/compiler/mesh_repair.h"
#include "services/scene/compiler/tetrahedralise.h"

namespace fulcrum::benchmark {
namespace {

using scene::MeshFile;
using scene::TriangleMesh;

// ------------------------------------------------------------------------------------------------------ shapes

double Smallest(double a, double b, double blend) {
  const double h = std::clamp(0.5 + 0.5 * (b - a) / blend, 0.0, 1.0);
  return std::lerp(b, a, h) - blend * h * (1 - h);
}

Shape Ball(const Vec3d& centre, double radius) {
  return [=](const Vec3d& p) { return (p - centre).norm() - radius; };
}

Shape Ellipsoid(const Vec3d& centre, const Vec3d& radii) {
  return [=](const Vec3d& p) { return ((p - centre).cwiseQuotient(radii).norm() - 1) * radii.minCoeff(); };
}

/// Tube around a curve through points, its radius between `r0` at the first and `r1` at the last.
Shape Tube(const std::vector<Vec3d>& line, double r0, double r1) {
  return [=](const Vec3d& p) {
    double least = 1e9;
    for (std::size_t i = 0; i + 1 < line.size(); ++i) {
      const Vec3d along = line[i + 1] - line[i];
      const double f = std::clamp((p - line[i]).dot(along) / along.squaredNorm(), 0.0, 1.0);
      const double radius = std::lerp(r0, r1, (static_cast<double>(i) + f) / static_cast<double>(line.size() - 1));
      least = std::min(least, (p - line[i] - f * along).norm() - radius);
    }
    return least;
  };
}

std::vector<Vec3d> Curve(double from, double to, const std::function<Vec3d(double)>& at) {
  std::vector<Vec3d> line;
  for (int i = 0; i <= 40; ++i) line.push_back(at(std::lerp(from, to, i / 40.0)));
  return line;
}

Shape Union(const Shape& a, const Shape& b, double blend) {
  return [=](const Vec3d& p) { return Smallest(a(p), b(p), blend); };
}

Shape Without(const Shape& a, const Shape& b) {
  return [=](const Vec3d& p) { return std::max(a(p), -b(p)); };
}

Shape Bumpy(const Shape& a, double height, double wavelength) {
  return [=](const Vec3d& p) {
    const Vec3d q = 2 * M_PI / wavelength * p;
    return a(p) + height * std::sin(q.x()) * std::sin(q.y() + 1) * std::sin(q.z() + 2);
  };
}

struct Named {
  const char* name;
  Shape shape;
  double reach;
};

std::vector<Named> Shapes() {
  const Vec3d o = Vec3d::Zero();
  const Shape colon = [](const Vec3d& p) {
    const double ring = 22 - 4 * std::pow(std::abs(std::cos(M_PI * p.y() / 28)), 6.0);
    return std::max(std::hypot(p.x(), p.z()) - ring, std::abs(p.y()) - 90);
  };
  const Shape liver = [](const Vec3d& p) {
    const double wedge = p.z() * 0.85 + p.x() * 0.45 - 22;
    return std::max(Ellipsoid(Vec3d::Zero(), {95, 60, 50})(p), wedge);
  };
  return {
      {"ball", Ball(o, 30), 36},
      {"bladder", Without(Ellipsoid(o, {45, 35, 28}), Ball({0, 0, 62}, 44)), 52},
      {"prostate", Ellipsoid(o, {20, 16, 13}), 24},
      {"kidney", Without(Ellipsoid(o, {28, 55, 20}), Ball({38, 0, 0}, 18)), 60},
      {"spleen", Without(Ellipsoid(o, {60, 40, 22}), Ball({0, 0, -70}, 62)), 66},
      {"liver", liver, 104},
      {"gallbladder", Tube({{0, -38, 0}, {0, -10, 2}, {0, 18, 8}, {0, 40, 16}}, 17, 4), 58},
      {"uterus",
       Union(Ellipsoid(o, {24, 36, 17}), Tube({{-48, 40, 0}, {-16, 22, 0}, {16, 22, 0}, {48, 40, 0}}, 4, 4), 8), 60},
      {"stomach",
       Union(Tube(Curve(-0.6, 2.2, [](double a) { return Vec3d(55 * std::cos(a), 55 * std::sin(a), 0); }), 34, 14),
             Ball({44, -40, 0}, 38), 14),
       112},
      {"pancreas", Tube({{-70, -18, 0}, {-40, 0, 6}, {0, 6, 0}, {40, 12, -6}, {75, 26, -4}}, 17, 8), 96},
      {"heart", Bumpy(Union(Ellipsoid(o, {38, 48, 36}), Ball({18, 40, 6}, 22), 12), 2.5, 30), 72},
      {"lung", Without(Ellipsoid(o, {50, 90, 60}), Ellipsoid({30, -100, 0}, {80, 70, 80})), 98},
      {"thyroid",
       Union(Union(Ellipsoid({-18, 0, 0}, {10, 26, 9}), Ellipsoid({18, 0, 0}, {10, 26, 9}), 2),
             Tube({{-18, -8, 0}, {18, -8, 0}}, 6, 6), 4),
       32},
      {"rectum", Tube({{0, -80, 30}, {2, -40, 0}, {0, 0, -10}, {4, 40, 0}, {0, 80, 28}}, 17, 19), 108},
      {"colon", colon, 98},
      {"sigmoid", Tube(Curve(-2, 2, [](double t) { return Vec3d(32 * std::sin(1.8 * t), 44 * t, 8 * t); }), 15, 15),
       112},
      {"bowel loop",
       Tube(Curve(0, 3.6, [](double a) { return Vec3d(46 * std::cos(a), 46 * std::sin(a), 6 * a); }), 13, 13), 74},
      {"ureter", Tube(Curve(-1, 1, [](double t) { return Vec3d(12 * std::sin(2 * t), 120 * t, 10 * t * t); }), 3, 3),
       130},
      {"aorta",
       Union(Tube({{0, -90, 0}, {0, 10, 0}}, 11, 11),
             Union(Tube({{0, 8, 0}, {-26, 80, 8}}, 9, 7), Tube({{0, 8, 0}, {26, 80, 8}}, 9, 7), 3), 5),
       106},
      {"ring", [](const Vec3d& p) { return std::hypot(std::hypot(p.x(), p.y()) - 34, p.z()) - 12; }, 52},
      {"plate", [](const Vec3d& p) { return (p.cwiseAbs() - Vec3d(50, 40, 5)).maxCoeff(); }, 58},
      {"cube", [](const Vec3d& p) { return (p.cwiseAbs() - Vec3d(25, 25, 25)).maxCoeff(); }, 32},
      {"hollow bladder", Without(Ball(o, 34), Ball(o, 29)), 40},
  };
}

// ------------------------------------------------------------------------------------------------------ faults

using Random = std::mt19937;

double Uniform(Random* random) { return static_cast<double>((*random)()) / 4294967296.0; }

void Append(const TriangleMesh& more, const Vec3d& shift, TriangleMesh* mesh) {
  const auto first = static_cast<Index>(mesh->vertices.size());
  for (const Vec3d& p : more.vertices) mesh->vertices.push_back(p + shift);
  for (const Triangle& t : more.triangles) mesh->triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
}

/// Each triangle with corners of its own, as STL has it.
TriangleMesh Soup(const TriangleMesh& mesh) {
  TriangleMesh soup;
  for (const Triangle& t : mesh.triangles) {
    const auto first = static_cast<Index>(soup.vertices.size());
    for (const Index v : t) soup.vertices.push_back(mesh.vertices[v]);
    soup.triangles.push_back({first, first + 1, first + 2});
  }
  return soup;
}

using Fault = std::function<void(Random*, TriangleMesh*)>;

struct NamedFault {
  const char* name;
  const char* shape;
  Fault add;
};

std::vector<NamedFault> Faults() {
  return {
      {"turned triangles", "kidney",
       [](Random* r, TriangleMesh* m) {
         for (Triangle& t : m->triangles)
           if (Uniform(r) < 0.3) std::swap(t[1], t[2]);
       }},
      {"inside out", "gallbladder",
       [](Random*, TriangleMesh* m) {
         for (Triangle& t : m->triangles) std::swap(t[1], t[2]);
       }},
      {"noise", "spleen",
       [](Random* r, TriangleMesh* m) {
         for (Vec3d& p : m->vertices) p += 0.8 * Vec3d(Uniform(r) - 0.5, Uniform(r) - 0.5, Uniform(r) - 0.5);
       }},
      {"holes", "bladder",
       [](Random* r, TriangleMesh* m) {
         std::erase_if(m->triangles, [&](const Triangle&) { return Uniform(r) < 0.01; });
       }},
      {"open end", "rectum",
       [](Random*, TriangleMesh* m) {
         std::erase_if(m->triangles, [&](const Triangle& t) { return m->vertices[t[0]].y() > 70; });
       }},
      {"both ends open", "colon",
       [](Random*, TriangleMesh* m) {
         std::erase_if(m->triangles, [&](const Triangle& t) { return std::abs(m->vertices[t[0]].y()) > 80; });
       }},
      {"cracks", "heart",
       [](Random* r, TriangleMesh* m) {
         *m = Soup(*m);
         for (Vec3d& p : m->vertices) p += 0.01 * Vec3d(Uniform(r) - 0.5, Uniform(r) - 0.5, Uniform(r) - 0.5);
       }},
      {"double surface", "liver", [](Random*, TriangleMesh* m) { Append(TriangleMesh(*m), Vec3d(0.3, 0, 0), m); }},
      {"crossing parts", "stomach",
       [](Random*, TriangleMesh* m) {
         Append(SurfaceOfShape(Ball({0, 0, 0}, 30), 36, 30), {55, 0, 0}, m);
       }},
      {"crossing itself", "kidney",
       [](Random* r, TriangleMesh* m) {
         for (Vec3d& p : m->vertices)
           if (Uniform(r) < 0.05) p += 9 * Vec3d(Uniform(r) - 0.5, Uniform(r) - 0.5, Uniform(r) - 0.5);
       }},
      {"crumbs", "pancreas",
       [](Random* r, TriangleMesh* m) {
         const TriangleMesh crumb = SurfaceOfShape(Ball({0, 0, 0}, 2), 3, 6);
         for (int i = 0; i < 20; ++i)
           Append(crumb, 90 * Vec3d(Uniform(r) - 0.5, Uniform(r) - 0.5, Uniform(r) - 0.5), m);
       }},
      {"fin", "prostate",
       [](Random*, TriangleMesh* m) {
         const Triangle t = m->triangles[m->triangles.size() / 2];
         m->vertices.push_back(1.3 * m->vertices[t[0]]);
         const auto tip = static_cast<Index>(m->vertices.size() - 1);
         m->triangles.push_back({t[0], t[1], tip});
         m->triangles.push_back({t[1], t[2], tip});
       }},
      {"needles", "uterus",
       [](Random* r, TriangleMesh* m) {
         const std::size_t count = m->triangles.size();
         for (std::size_t i = 0; i < count; i += 5) {
           const Triangle t = m->triangles[i];
           const double f = 1e-5 * Uniform(r);
           m->vertices.push_back((1 - 2 * f) * m->vertices[t[0]] + f * (m->vertices[t[1]] + m->vertices[t[2]]));
           const auto middle = static_cast<Index>(m->vertices.size() - 1);
           m->triangles[i] = {t[0], t[1], middle};
           m->triangles.push_back({t[1], t[2], middle});
           m->triangles.push_back({t[2], t[0], middle});
         }
       }},
      {"duplicates and empty triangles", "thyroid",
       [](Random*, TriangleMesh* m) {
         const std::size_t count = m->triangles.size();
         for (std::size_t i = 0; i < count; i += 7) {
           m->triangles.push_back(m->triangles[i]);
           m->triangles.push_back({m->triangles[i][0], m->triangles[i][0], m->triangles[i][1]});
         }
       }},
      {"far away", "ball",
       [](Random*, TriangleMesh* m) {
         for (Vec3d& p : m->vertices) p += Vec3d(900, -1400, 300);
       }},
      {"coarse", "bladder", [](Random*, TriangleMesh* m) { *m = scene::Decimate(*m, 120); }},
      {"one sheet", "plate",
       [](Random*, TriangleMesh* m) {
         std::erase_if(m->triangles, [&](const Triangle& t) {
           return (m->vertices[t[0]].z() + m->vertices[t[1]].z() + m->vertices[t[2]].z()) < 10;
         });
       }},
  };
}

/// Steps of whole voxels instead of a smooth surface, as a label map without smoothing.
TriangleMesh Staircase(const Shape& shape, double reach, double voxel) {
  return SurfaceOfShape(
      [=](const Vec3d& p) {
        const Vec3d cell = (p / voxel).array().floor().matrix();
        const double inside = shape(voxel * (cell + Vec3d::Constant(0.5))) < 0 ? -1 : 1;
        return inside * (0.5 - (p / voxel - cell - Vec3d::Constant(0.5)).cwiseAbs().maxCoeff() + 0.01);
      },
      reach, static_cast<int>(4 * reach / voxel));
}

MeshFile Of(TriangleMesh mesh) { return {std::move(mesh.vertices), std::move(mesh.triangles), {}, 0}; }

MeshFile Tetrahedra(const TriangleMesh& surface, int count) {
  scene::TetrahedralMesh mesh = scene::Tetrahedralise(surface, count, "benchmark");
  return {std::move(mesh.vertices), {}, std::move(mesh.tets), 0};
}

/// Splits every twentieth tetrahedron at a point next to its first face, which leaves a flat one.
void AddSlivers(MeshFile* mesh) {
  const std::size_t count = mesh->tets.size();
  for (std::size_t i = 0; i < count; i += 20) {
    const Tetrahedron t = mesh->tets[i];
    const auto& x = mesh->vertices;
    mesh->vertices.push_back(Vec3d((x[t[0]] + x[t[1]] + x[t[2]]) / 3 * 0.999 + 0.001 * x[t[3]]));
    const auto m = static_cast<Index>(mesh->vertices.size() - 1);
    mesh->tets[i] = {t[0], t[1], t[2], m};
    mesh->tets.push_back({t[0], t[3], t[1], m});
    mesh->tets.push_back({t[1], t[3], t[2], m});
    mesh->tets.push_back({t[2], t[3], t[0], m});
  }
}

}  // namespace

scene::TriangleMesh SurfaceOfShape(const Shape& shape, double reach, int cells) {
  const int n = cells + 1;
  const auto id = [&](int x, int y, int z) { return static_cast<Index>((z * n + y) * n + x); };
  const auto place = [&](Index i) {
    const int x = static_cast<int>(i) % n, y = static_cast<int>(i) / n % n, z = static_cast<int>(i) / n / n;
    return Vec3d(reach * (2 * Vec3d(x, y, z) / cells - Vec3d::Ones()));
  };
  std::vector<double> value(static_cast<std::size_t>(n) * n * n);
  for (Index i = 0; i < value.size(); ++i) {
    value[i] = shape(place(i));
    if (value[i] == 0) value[i] = 1e-9;
  }
  TriangleMesh mesh;
  std::map<std::pair<Index, Index>, Index> crossings;
  const auto crossing = [&](Index a, Index b) {
    const auto [entry, is_new] = crossings.try_emplace(std::minmax(a, b), static_cast<Index>(mesh.vertices.size()));
    if (is_new) {
      const auto& [low, high] = entry->first;
      // Not beside a corner: triangles keep an area.
      const double f = std::clamp(value[low] / (value[low] - value[high]), 0.05, 0.95);
      mesh.vertices.push_back((1 - f) * place(low) + f * place(high));
    }
    return entry->second;
  };
  const auto add = [&](Index a, Index b, Index c, const Vec3d& outward) {
    const auto& x = mesh.vertices;
    const bool right = (x[b] - x[a]).cross(x[c] - x[a]).dot(outward) > 0;
    mesh.triangles.push_back(right ? Triangle{a, b, c} : Triangle{a, c, b});
  };
  // Kuhn's six tetrahedra of a cube: paths from corner 000 to 111 along the axes in any order.
  constexpr int kOrders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
  for (int z = 0; z < cells; ++z) {
    for (int y = 0; y < cells; ++y) {
      for (int x = 0; x < cells; ++x) {
        for (const auto& order : kOrders) {
          std::array<int, 3> at{x, y, z};
          std::vector<Index> inside, outside;
          for (int k = 0; k < 4; ++k) {
            if (k > 0) ++at[order[k - 1]];
            const Index i = id(at[0], at[1], at[2]);
            (value[i] < 0 ? inside : outside).push_back(i);
          }
          if (inside.empty() || outside.empty()) continue;
          const Vec3d outward = place(outside[0]) - place(inside[0]);
          if (inside.size() == 2) {
            const Index a = crossing(inside[0], outside[0]), b = crossing(inside[0], outside[1]),
                        c = crossing(inside[1], outside[1]), d = crossing(inside[1], outside[0]);
            add(a, b, c, outward);
            add(a, c, d, outward);
          } else {
            const auto& one = inside.size() == 1 ? inside : outside;
            const auto& three = inside.size() == 1 ? outside : inside;
            add(crossing(one[0], three[0]), crossing(one[0], three[1]), crossing(one[0], three[2]), outward);
          }
        }
      }
    }
  }
  return mesh;
}

std::vector<Part> Pelvis() {
  const Shape rectum = Tube({{0, -80, -20}, {2, -40, -34}, {0, 0, -30}, {6, 40, -18}, {0, 80, -24}}, 16, 16);
  const Shape bladder = Ball({0, -10, 34}, 30), prostate = Ball({0, -52, 14}, 17);
  const Shape left = Tube({{40, 90, -20}, {44, 30, -10}, {30, -10, 4}}, 3, 3),
              right = Tube({{-40, 90, -20}, {-44, 30, -10}, {-30, -10, 4}}, 3, 3);
  const Shape shell = [](const Vec3d& p) { return std::abs(p.norm() - 100) - 5; };
  const Shape back = [=](const Vec3d& p) { return std::max(shell(p), p.z() + 30); };
  // The ureters end in the bladder, the rectum at the wall.
  return {{"rectum", 1, true, Without(rectum, back)},          {"bladder", 2, false, bladder},
          {"prostate", 3, false, Without(prostate, rectum)},   {"left_ureter", 4, false, Without(left, bladder)},
          {"right_ureter", 5, false, Without(right, bladder)}, {"wall", 6, false, back}};
}

std::vector<Organ> Organs() {
  const char* kFormats[] = {"stl", "text.stl", "obj", "ply", "vtk", "vtp", "off"};  // Of surfaces.
  constexpr int kCells = 44;
  std::vector<Organ> organs;
  std::size_t next = 0;
  const auto format = [&] { return kFormats[next++ % std::size(kFormats)]; };
  const std::vector<Named> shapes = Shapes();
  const auto find = [&](const std::string& name) -> const Named& {
    return *std::find_if(shapes.begin(), shapes.end(), [&](const Named& s) { return s.name == name; });
  };
  for (const Named& s : shapes) {
    // A thin one needs cells that see it.
    const int cells = std::string(s.name) == "ureter" ? 4 * kCells : kCells;
    organs.push_back({s.name, Of(SurfaceOfShape(s.shape, s.reach, cells)), format(), ""});
  }
  Random random(1);
  for (const NamedFault& fault : Faults()) {
    const Named& s = find(fault.shape);
    TriangleMesh mesh = SurfaceOfShape(s.shape, s.reach, kCells);
    fault.add(&random, &mesh);
    // What is open needs a word on what it is.
    const bool open = std::string(fault.name).find("open") != std::string::npos || std::string(fault.name) == "holes";
    organs.push_back({std::string(fault.shape) + ", " + fault.name, Of(std::move(mesh)), format(),
                      open ? "cap_openings: true" : "", std::string(fault.name) != "one sheet"});
  }
  const Named& kidney = find("kidney");
  organs.push_back({"kidney, staircase", Of(Staircase(kidney.shape, kidney.reach, 4)), format(), ""});
  TriangleMesh rectum = SurfaceOfShape(find("rectum").shape, find("rectum").reach, kCells);
  organs.push_back({"rectum, tetrahedra", Tetrahedra(rectum, 4000), "vtu", ""});
  TriangleMesh metres = rectum;
  for (Vec3d& p : metres.vertices) p *= 1e-3;
  organs.push_back({"rectum, in metres", Of(metres), "stl", "unit: m"});
  organs.push_back({"rectum, 10 MB", Of(SurfaceOfShape(find("rectum").shape, find("rectum").reach, 220)), "stl", ""});
  MeshFile slivers = Tetrahedra(SurfaceOfShape(find("liver").shape, find("liver").reach, kCells), 5000);
  AddSlivers(&slivers);
  organs.push_back({"liver, tetrahedra with slivers", slivers, "msh", ""});
  MeshFile folded = Tetrahedra(SurfaceOfShape(find("spleen").shape, find("spleen").reach, kCells), 5000);
  for (std::size_t i = 0; i < folded.vertices.size(); i += 50) folded.vertices[i] *= 1.15;
  organs.push_back({"spleen, folded tetrahedra", folded, "vtk", ""});
  return organs;
}

}  // namespace fulcrum::benchmark
