#include "tests/unit/scene/mesh_samples.h"

#include "tests/unit/scene/mesh_writers.h"

namespace fulcrum::scene {

MeshFile SampleTets() {
  MeshFile mesh;
  mesh.vertices = {{0, 0, 0}, {1.5, 0, -0.125}, {0, 2.25, 0}, {0.5, 0.5, 3}, {0.25, 0.5, -2.75}};
  mesh.tets = {{0, 1, 2, 3}, {0, 1, 2, 4}};
  return mesh;
}

TriangleMesh SampleSurface() {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1.5, 0, -0.125}, {0, 2.25, 0}, {0.5, 0.5, 3}, {0.25, 0.5, -2.75}};
  mesh.triangles = {{0, 1, 3}, {1, 2, 3}, {2, 0, 3}, {1, 0, 4}, {2, 1, 4}, {0, 2, 4}};
  return mesh;
}

std::vector<MeshSample> MeshSamples() {
  using namespace writers;
  const MeshFile tets = SampleTets();
  const TriangleMesh surface = SampleSurface();
  std::vector<MeshSample> samples;
  const auto add = [&](const char* label, const char* name, std::string bytes, bool has_tets) {
    samples.push_back({label, name, std::move(bytes), {}, has_tets});
  };
  add("gmsh1", "a.msh", Gmsh1(tets), true);
  add("gmsh22_ascii", "a.msh", Gmsh22(tets, Out::kText), true);
  add("gmsh22_binary", "a.msh", Gmsh22(tets, Out::kBinary), true);
  add("gmsh22_binary_swapped", "a.msh", Gmsh22(tets, Out::kSwapped), true);
  add("gmsh41_ascii", "a.msh", Gmsh41(tets, Out::kText), true);
  add("gmsh41_binary", "a.msh", Gmsh41(tets, Out::kBinary), true);
  add("gmsh41_binary_swapped", "a.msh", Gmsh41(tets, Out::kSwapped), true);
  // VTK's legacy files hold the most significant byte first.
  add("vtk_grid_ascii", "a.vtk", VtkGrid(tets, false, Out::kText), true);
  add("vtk_grid_binary", "a.vtk", VtkGrid(tets, false, Out::kSwapped), true);
  add("vtk5_grid_ascii", "a.vtk", VtkGrid(tets, true, Out::kText), true);
  add("vtk5_grid_binary", "a.vtk", VtkGrid(tets, true, Out::kSwapped), true);
  add("vtk_poly_ascii", "a.vtk", VtkPoly(surface, false, Out::kText), false);
  add("vtk_poly_binary", "a.vtk", VtkPoly(surface, false, Out::kSwapped), false);
  add("vtk5_poly_ascii", "a.vtk", VtkPoly(surface, true, Out::kText), false);
  add("vtk5_poly_binary", "a.vtk", VtkPoly(surface, true, Out::kSwapped), false);
  VtuVariant v;
  v.inline_text = true;
  add("vtu_ascii", "a.vtu", Vtu(tets, v), true);
  v.inline_text = false;
  add("vtu_base64", "a.vtu", Vtu(tets, v), true);
  v.long_header = true;
  add("vtu_base64_long_header", "a.vtu", Vtu(tets, v), true);
  v.compressed = true;
  add("vtu_base64_zlib", "a.vtu", Vtu(tets, v), true);
  v.appended = true;
  add("vtu_appended_base64_zlib", "a.vtu", Vtu(tets, v), true);
  v.raw = true;
  add("vtu_appended_raw_zlib", "a.vtu", Vtu(tets, v), true);
  v.compressed = false;
  add("vtu_appended_raw", "a.vtu", Vtu(tets, v), true);
  v.swapped = true;
  add("vtu_appended_raw_swapped", "a.vtu", Vtu(tets, v), true);
  v.raw = v.long_header = false;
  add("vtu_appended_base64", "a.vtu", Vtu(tets, v), true);
  for (const int first : {0, 1}) {
    add(first == 0 ? "tetgen_ele_0" : "tetgen_ele_1", "a.ele", TetgenElements(tets.tets, first, " 4 1"), true);
    samples.back().beside["a.node"] = TetgenNodes(tets.vertices, first);
  }
  add("tetgen_face", "a.face", TetgenElements(surface.triangles, 1, " 1"), false);
  samples.back().beside["a.node"] = TetgenNodes(surface.vertices, 1);
  add("tetgen_node", "a.node", TetgenNodes(tets.vertices, 0), true);
  samples.back().beside["a.ele"] = TetgenElements(tets.tets, 0, " 4 0");
  add("stl_ascii", "a.stl", Stl(surface, true), false);
  add("stl_binary", "a.stl", Stl(surface, false), false);
  add("obj", "a.obj", Obj(surface), false);
  add("off", "a.off", Off(surface), false);
  add("vtp", "a.vtp", Vtp(surface), false);
  add("vtp_named_vtk", "a.vtk", Vtp(surface), false);
  add("ply_ascii", "a.ply", Ply(surface, Out::kText), false);
  add("ply_binary", "a.ply", Ply(surface, Out::kBinary), false);
  add("ply_binary_swapped", "a.ply", Ply(surface, Out::kSwapped), false);
  return samples;
}

MeshFile ParseSample(const MeshSample& sample, const std::string& bytes) {
  return ParseMesh(bytes, sample.name, [&](const std::filesystem::path& other) -> std::optional<std::string> {
    const auto entry = sample.beside.find(other.string());
    return entry == sample.beside.end() ? std::nullopt : std::optional<std::string>(entry->second);
  });
}

}  // namespace fulcrum::scene
