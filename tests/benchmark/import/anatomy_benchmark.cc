// From a synthetic pelvis of 256 x 256 x 256 voxels to a scene: time, distance of the meshes from the true surfaces,
// and whether left stays left for every order and sense of the axes.
#include "tests/benchmark/import/anatomy_benchmark.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <thread>

#include "services/base/runtime/child_process.h"
#include "services/scene/builder/geometry.h"
#include "services/scene/readers/mesh_io.h"
#include "services/session/supervisor/scene_cache.h"
#include "tests/benchmark/import/organ_shapes.h"
#include "tests/support/nifti_writer.h"

namespace fulcrum::benchmark {
namespace {

namespace fs = std::filesystem;

constexpr double kVoxel_mm = 0.9;

/// The map in storage of this order and sense of the axes.
scene::LabelMap Voxels(const std::vector<Part>& parts, int n, const Mat3d& ras, Eigen::Affine3d* ras_from_index) {
  *ras_from_index = Eigen::Affine3d::Identity();
  ras_from_index->linear() = ras;
  ras_from_index->translation() = -ras * Vec3d::Constant(0.5 * (n - 1));
  scene::LabelMap map;
  map.size = {n, n, n};
  map.W_from_index = Eigen::Affine3d(testing::WFromRas() * *ras_from_index);
  map.labels.assign(static_cast<std::size_t>(n) * n * n, 0);
  for (int k = 0; k < n; ++k) {
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        const Vec3d p = map.W_from_index * Vec3d(i, j, k);
        for (const Part& part : parts) {
          if (part.shape(p) < 0) map.labels[map.Index(i, j, k)] = static_cast<std::uint16_t>(part.label);
        }
      }
    }
  }
  return map;
}

/// Runs the compiler as a user would. Returns seconds; negative: it failed.
double Import(const fs::path& labels, const fs::path& uses, const fs::path& out, const fs::path& log) {
  const auto start = std::chrono::steady_clock::now();
  runtime::ChildProcess compiler =
      runtime::ChildProcess::Start(fs::path(FULCRUM_BIN_DIR) / "scene_compiler",
                                   {"--anatomy", labels.string(), "--map", uses.string(), "--out", out.string()}, log);
  for (;;) {
    if (const auto end = compiler.Poll()) {
      const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
      return end->signal == 0 && end->exit_code == 0 ? elapsed.count() : -1;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

/// Farthest point of either surface from the other [mm].
double Hausdorff(const scene::MeshFile& mesh, const Part& part) {
  double farthest = 0;
  for (const Vec3d& p : mesh.vertices) farthest = std::max(farthest, std::abs(part.shape(p)));
  for (const Triangle& t : mesh.triangles) {
    const Vec3d middle = (mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]) / 3;
    farthest = std::max(farthest, std::abs(part.shape(middle)));
  }
  const scene::TriangleMesh truth = SurfaceOfShape(part.shape, 112, 160);
  const scene::TriangleLocator locator(mesh.vertices, mesh.triangles);
  for (const Vec3d& p : truth.vertices) {
    // The sampled surface of the shape itself is that much off.
    farthest = std::max(farthest, locator.Closest(p, 20).closest.distance - std::abs(part.shape(p)));
  }
  return farthest;
}

void WriteUses(const fs::path& file, const std::vector<Part>& parts) {
  std::ofstream out(file);
  out << "labels:\n";
  for (const Part& part : parts) {
    out << "  - {label: " << part.label << ", name: " << part.name
        << (part.is_organ ? ", organ: true" : ", role: other") << "}\n";
  }
}

}  // namespace

void MeasureAnatomy(Report* report, const fs::path& folder) {
  const std::vector<Part> parts = Pelvis();
  const fs::path labels = folder / "labels.nii.gz", uses = folder / "uses.yaml", out = folder / "pelvis";
  WriteUses(uses, parts);
  Eigen::Affine3d ras;
  {
    const scene::LabelMap map = Voxels(parts, 256, kVoxel_mm * Mat3d::Identity(), &ras);
    testing::WriteBytes(labels, testing::NiftiBytes(map, testing::NiftiHeader(map, ras, false)));
  }
  const double seconds = Import(labels, uses, out, folder / "anatomy.log");
  double farthest = 0;
  for (const Part& part : parts) {
    if (seconds < 0) break;
    const double distance = Hausdorff(scene::ReadMesh(out / (part.name + ".ply")), part);
    std::fprintf(stderr, "%-14s %.2f voxels off at most\n", part.name.c_str(), distance / kVoxel_mm);
    farthest = std::max(farthest, distance);
  }
  report->Add("import.anatomy_s", seconds, "s");
  report->Add("import.hausdorff_voxels", seconds < 0 ? -1 : farthest / kVoxel_mm, "voxels");

  if (seconds >= 0) {
    const supervisor::SceneRequest request{
        (out / "pelvis.yaml").string(), {}, {}, {}, fs::path(FULCRUM_BIN_DIR) / "scene_compiler", folder / "cache"};
    const auto compile_s = [&] { return TimeMs(0, 1, [&] { (void)supervisor::ResolveScene(request); }).front() / 1e3; };
    report->Add("import.compile_s.pelvis", compile_s(), "s");
    report->Add("import.compile_s.unchanged", compile_s(), "s");
  }

  // Coarse, by its parts' places: each storage must give the same patient.
  int errors = 0;
  std::array<int, 3> order{0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Mat3d axes = Mat3d::Zero();
      for (int a = 0; a < 3; ++a) axes(order[static_cast<std::size_t>(a)], a) = (signs >> a & 1) != 0 ? -3.6 : 3.6;
      const scene::LabelMap map = Voxels(parts, 64, axes, &ras);
      testing::WriteBytes(labels, testing::NiftiBytes(map, testing::NiftiHeader(map, ras, (signs & 1) != 0)));
      const scene::LabelMap read = scene::ReadLabelMap(labels);
      bool same = true;
      for (std::size_t v = 0; v < read.labels.size() && same; v += 37) {
        const int n = 64, i = static_cast<int>(v) % n, j = static_cast<int>(v) / n % n, k = static_cast<int>(v) / n / n;
        int label = 0;
        const Vec3d p = read.W_from_index * Vec3d(i, j, k);
        double nearest = 1e9;
        for (const Part& part : parts) {
          const double distance = part.shape(p);
          nearest = std::min(nearest, std::abs(distance));
          if (distance < 0) label = part.label;
        }
        same = read.labels[v] == label || nearest < 0.01;
      }
      errors += same ? 0 : 1;
    }
  } while (std::next_permutation(order.begin(), order.end()));
  report->Add("import.orientation_errors", errors, "count");
}

}  // namespace fulcrum::benchmark
