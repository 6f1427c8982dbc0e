// Segmentations: orientation, surfaces between labels, refusals, up to a scene.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <random>
#include <set>

#include "services/base/core/error.h"
#include "services/scene/anatomy/import_anatomy.h"
#include "services/scene/anatomy/surface_nets.h"
#include "services/scene/compiler/compile.h"
#include "services/scene/format/validate.h"
#include "tests/support/nifti_writer.h"
#include "tests/unit/anatomy/phantom.h"

namespace fulcrum::scene {
namespace {

namespace fs = std::filesystem;

TEST_F(Segmentation, LeftStaysLeftForEveryOrderAndSenseOfTheAxes) {
  // All 48 orders and senses, mirrored storage included, and an oblique one; by either way that a header has.
  std::vector<Mat3d> frames;
  std::array<int, 3> order{0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Mat3d m = Mat3d::Zero();
      for (int a = 0; a < 3; ++a) m(order[a], a) = (signs >> a & 1) != 0 ? -1 : 1;
      frames.push_back(m);
    }
  } while (std::next_permutation(order.begin(), order.end()));
  frames.emplace_back(Eigen::AngleAxisd(0.7, Vec3d(1, 2, -1).normalized()).toRotationMatrix());
  ASSERT_EQ(frames.size(), 49u);
  for (std::size_t f = 0; f < frames.size(); ++f) {
    const Mat3d ras = frames[f] * Vec3d(1.0, 1.25, 1.5).asDiagonal();
    const std::array<int, 3> size{52, 42, 36};
    const Eigen::Affine3d ras_from_index = Around(ras, size);
    const LabelMap map = Fill(size, Eigen::Affine3d(fulcrum::testing::WFromRas() * ras_from_index), Mark);
    for (const bool by_quaternion : {false, true}) {
      const fs::path file =
          Write("marks.nii.gz",
                fulcrum::testing::NiftiBytes(map, fulcrum::testing::NiftiHeader(map, ras_from_index, by_quaternion)));
      const LabelMap read = ReadLabelMap(file);
      const auto surfaces = SurfacesOf(read, {1, 2, 3});
      ASSERT_EQ(surfaces.size(), 3u);
      for (int m = 0; m < 3; ++m) {
        Vec3d middle = Vec3d::Zero();
        double volume = 0;
        const TriangleMesh& mesh = surfaces.at(m + 1);
        for (const Vec3d& p : mesh.vertices) middle += p / static_cast<double>(mesh.vertices.size());
        for (const Triangle& t : mesh.triangles) {
          volume += mesh.vertices[t[0]].dot(mesh.vertices[t[1]].cross(mesh.vertices[t[2]])) / 6;
        }
        EXPECT_LT((middle - 14 * Vec3d::Unit(m)).norm(), 0.7) << "frame " << f << ", mark " << m;
        EXPECT_NEAR(volume, 268, 40) << "outward, frame " << f;
      }
    }
  }
}

TEST_F(Segmentation, SurfacesAreClosedSharedAndWithinAVoxel) {
  // Two boxes that touch, and a ball of three voxels that smoothing must not lose.
  const auto label = [](const Vec3d& p) {
    if ((p - Vec3d(24, 24, 24)).norm() < 2.2) return 7;
    if (p.x() < 4 || p.y() < 4 || p.z() < 4 || p.y() > 20 || p.z() > 20) return 0;
    return p.x() < 12 ? 2 : p.x() < 20 ? 5 : 0;
  };
  const LabelMap map = Fill({32, 32, 32}, Eigen::Affine3d::Identity(), label);
  const auto surfaces = SurfacesOf(map, {2, 5, 7});
  for (const auto& [number, mesh] : surfaces) {
    std::map<std::pair<Index, Index>, int> edges;
    for (const Triangle& t : mesh.triangles) {
      for (std::size_t k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
    }
    for (const auto& [edge, count] : edges) {
      ASSERT_EQ(count, (edges[{edge.second, edge.first}])) << "closed, neighbours of one sense";
    }
    for (const Vec3d& p : mesh.vertices) {
      // A voxel of this label and one of another touch the cube in which the vertex lies.
      const Vec3d low = p.array().floor().matrix();
      bool has_own = false, has_other = false;
      for (int corner = 0; corner < 8; ++corner) {
        const int found = label(low + Vec3d(corner & 1, corner >> 1 & 1, corner >> 2));
        (found == number ? has_own : has_other) = true;
      }
      EXPECT_TRUE(has_own && has_other) << p.transpose();
    }
  }
  std::set<std::array<double, 3>> of_two;
  for (const Vec3d& p : surfaces.at(2).vertices) of_two.insert({p.x(), p.y(), p.z()});
  std::size_t shared = 0;
  for (const Vec3d& p : surfaces.at(5).vertices) shared += of_two.count({p.x(), p.y(), p.z()});
  EXPECT_GE(shared, 17u * 17u) << "the whole wall between them";
  EXPECT_GT(surfaces.at(7).vertices.size(), 20u);
}

TEST_F(Segmentation, WhatIsNoLabelMapIsRefused) {
  const LabelMap map =
      Fill({12, 12, 12}, Eigen::Affine3d::Identity(), [](const Vec3d& p) { return p.x() > 5 ? 1 : 0; });
  const nifti_1_header header = fulcrum::testing::NiftiHeader(map, Eigen::Affine3d::Identity(), false);
  const std::string bytes = fulcrum::testing::NiftiBytes(map, header);
  const auto refusal = [&](const std::string& content) {
    const fs::path file = Write("x.nii", content);
    return Refusal([&] { (void)ReadLabelMap(file); });
  };
  EXPECT_EQ(refusal(bytes), "");
  EXPECT_NE(refusal(bytes.substr(0, 1000)).find("cut short"), std::string::npos) << refusal(bytes.substr(0, 1000));
  EXPECT_NE(refusal("no image at all").find("is no NIfTI file"), std::string::npos);
  nifti_1_header bad = header;
  bad.sform_code = 0;
  EXPECT_NE(refusal(fulcrum::testing::NiftiBytes(map, bad)).find("neither sform nor qform"), std::string::npos);
  bad = header;
  bad.scl_slope = 0.5f;
  EXPECT_NE(refusal(fulcrum::testing::NiftiBytes(map, bad)).find("whole numbers 0 to 65535"), std::string::npos);
  bad = header;
  bad.srow_x[0] = 0;
  EXPECT_NE(refusal(fulcrum::testing::NiftiBytes(map, bad)).find("voxels have a volume"), std::string::npos);
  bad = header;
  bad.scl_slope = 1;
  bad.scl_inter = -1024;
  EXPECT_NE(refusal(fulcrum::testing::NiftiBytes(map, bad)).find("whole numbers 0 to 65535"), std::string::npos);
  bad = header;
  bad.dim[1] = 30000;
  EXPECT_NE(refusal(fulcrum::testing::NiftiBytes(map, bad)).find("valid: 2 to 4096"), std::string::npos);
  EXPECT_NE(Refusal([&] { (void)ReadLabelMap(folder_ / "none.nii"); }).find("is no file"), std::string::npos);
}

TEST_F(Segmentation, MetresAndMicrometresAreRead) {
  const LabelMap map = Fill({6, 6, 6}, Eigen::Affine3d::Identity(), [](const Vec3d& p) { return p.x() > 2 ? 1 : 0; });
  for (const auto& [unit, per_mm] : {std::pair{NIFTI_UNITS_METER, 1e-3}, {NIFTI_UNITS_MICRON, 1e3}}) {
    Eigen::Affine3d ras = Eigen::Affine3d::Identity();
    ras.linear() *= 1.5 * per_mm;
    nifti_1_header header = fulcrum::testing::NiftiHeader(map, ras, false);
    header.xyzt_units = static_cast<char>(unit);
    const LabelMap read = ReadLabelMap(Write("x.nii", fulcrum::testing::NiftiBytes(map, header)));
    EXPECT_NEAR(read.W_from_index.linear().col(0).norm(), 1.5, 1e-5);
  }
}

TEST_F(Segmentation, MoreLabelsThanASceneHoldsAreSuggestedAsComments) {
  const LabelMap map = Fill({40, 6, 6}, Eigen::Affine3d::Identity(), [](const Vec3d& p) { return p.x() + 1; });
  const Eigen::Affine3d ras = Eigen::Affine3d::Identity();
  const fs::path file =
      Write("x.nii", fulcrum::testing::NiftiBytes(map, fulcrum::testing::NiftiHeader(map, ras, false)));
  const std::string suggested = SuggestLabelUses(file);
  std::ofstream(folder_ / "labels.yaml") << suggested;
  EXPECT_EQ(ReadLabelUses(folder_ / "labels.yaml").uses.size(), 17u) << suggested;
  EXPECT_NE(suggested.find("# - {label: "), std::string::npos);
}

TEST_F(Segmentation, AlteredBytesAreReadOrRefused) {
  const LabelMap map = Fill({6, 6, 6}, Eigen::Affine3d::Identity(), [](const Vec3d& p) { return p.x() > 2 ? 1 : 0; });
  const std::string bytes =
      fulcrum::testing::NiftiBytes(map, fulcrum::testing::NiftiHeader(map, Eigen::Affine3d::Identity(), false));
  std::mt19937 random(3);
  for (int round = 0; round < 3000; ++round) {
    std::string altered = bytes;
    for (int k = 0; k < 3; ++k) altered[random() % 352] = static_cast<char>(random());
    if (round % 5 == 0) altered.resize(random() % altered.size());
    const fs::path file = Write("altered.nii", altered);
    try {
      EXPECT_LE(ReadLabelMap(file).labels.size(), kMostVoxels);
    } catch (const InputError&) {
    }
  }
}

TEST_F(Segmentation, UsesOfLabelsAreChecked) {
  const auto refusal = [&](const std::string& text) {
    std::ofstream(folder_ / "labels.yaml") << text;
    return Refusal([&] { (void)ReadLabelUses(folder_ / "labels.yaml"); });
  };
  EXPECT_EQ(
      refusal("labels:\n  - {label: 1, name: rectum, organ: true}\n  - {label: 2, name: bladder, role: bladder}\n"),
      "");
  EXPECT_NE(refusal("labels:\n  - {label: 1, name: a}\n").find("one entry must have `organ: true`"), std::string::npos);
  EXPECT_NE(refusal("labels:\n  - {label: 1, name: a, organ: true}\n  - {label: 2, name: b, organ: true}\n")
                .find("there is one already"),
            std::string::npos);
  EXPECT_NE(refusal("labels:\n  - {label: 1, name: a, organ: true}\n  - {label: 2, name: b, material: cheese}\n")
                .find("artery, bile_duct"),
            std::string::npos);
  EXPECT_NE(refusal("labels:\n  - {label: 1, name: a, organ: true}\n  - {label: 2, name: organ, material: fat}\n")
                .find("another name"),
            std::string::npos);
  EXPECT_NE(refusal("labels:\n  - {label: 1, name: a, organ: true, material: liver}\n").find("is for the others"),
            std::string::npos);
  EXPECT_NE(refusal("labels:\n  - {label: 1, name: ../a, organ: true}\n").find("it names a file"), std::string::npos);
  EXPECT_NE(refusal("labels:\n  - {label: 1, name: a, organ: true}\n  - {label: 1, name: b}\n").find("is there twice"),
            std::string::npos);
  EXPECT_NE(
      refusal("labels:\n  - {label: 1, name: a, organ: true}\n  - {file: b.stl, name: b}\n").find("or all `file`"),
      std::string::npos);
  const std::string files = "labels:\n  - {file: a.stl, name: a, organ: true}\n";
  EXPECT_NE(refusal(files).find("axes"), std::string::npos) << "no default: a wrong guess would mirror";
  for (const char* axes : {"LAS", "LLS", "XYZ", "LP"}) {
    EXPECT_NE(refusal("axes: " + std::string(axes) + "\n" + files).find("do not mirror"), std::string::npos) << axes;
  }
  for (const char* axes : {"LPS", "RAS", "LSA", "PIR"})
    EXPECT_EQ(refusal("axes: " + std::string(axes) + "\n" + files), "");
}

TEST_F(Segmentation, ASegmentationBecomesAScene) {
  Eigen::Affine3d ras = Around(Vec3d(-1.5, -1.5, 2).asDiagonal(), {64, 64, 64});
  const LabelMap map = Fill({64, 64, 64}, Eigen::Affine3d(fulcrum::testing::WFromRas() * ras), [](const Vec3d& p) {
    if (std::hypot(p.x(), p.z()) < 15 && std::abs(p.y()) < 50) return 3;
    return (p - Vec3d(0, 10, 32)).norm() < 15 ? 9 : 0;
  });
  const fs::path file =
      Write("labels.nii.gz", fulcrum::testing::NiftiBytes(map, fulcrum::testing::NiftiHeader(map, ras, false)));
  EXPECT_NE(SuggestLabelUses(file).find("{label: 3, name: label3, organ: true}"), std::string::npos);
  std::ofstream(folder_ / "labels.yaml")
      << "labels:\n  - {label: 3, name: rectum, organ: true}\n  - {label: 9, name: bladder, role: bladder}\n";
  const auto reports = ImportAnatomyFiles({"patient", file, folder_ / "labels.yaml", folder_ / "patient"}, {});
  ASSERT_EQ(reports.size(), 2u);
  for (const LabelReport& r : reports) {
    EXPECT_NEAR(r.volume_ml, r.voxel_volume_ml, 0.06 * r.voxel_volume_ml);
    EXPECT_EQ(r.pieces, 1);
  }
  for (const char* name : {"patient.yaml", "patient.png", "report.html", "rectum.ply", "bladder.ply"}) {
    EXPECT_TRUE(fs::exists(folder_ / "patient" / name)) << name;
  }
  const SceneData data = CompileScene(folder_ / "patient" / "patient.yaml", {}, {}).data;
  const auto fault = FindFault(data.View());
  EXPECT_FALSE(fault) << fault->section << ": " << fault->reason;
  EXPECT_EQ(std::string(data.View().static_surfaces.back().name), "bladder");
  std::ofstream(folder_ / "labels.yaml") << "labels:\n  - {label: 4, name: rectum, organ: true}\n";
  const auto again = [&](const char* out) {
    return Refusal([&] { (void)ImportAnatomyFiles({"patient", file, folder_ / "labels.yaml", folder_ / out}, {}); });
  };
  EXPECT_NE(again("patient").find("is there already and not empty"), std::string::npos) << "edited files stay";
  EXPECT_NE(again("other").find("label 4 (rectum) has 0 voxels"), std::string::npos);
}

TEST_F(Segmentation, LabelsWithAMaterialDeform) {
  Eigen::Affine3d ras = Around(Vec3d(-1.5, -1.5, 2).asDiagonal(), {64, 64, 64});
  // Two balls that touch the tube and one that does not.
  const LabelMap map = Fill({64, 64, 64}, Eigen::Affine3d(fulcrum::testing::WFromRas() * ras), [](const Vec3d& p) {
    if (std::hypot(p.x(), p.z()) < 15 && std::abs(p.y()) < 50) return 3;
    if ((p - Vec3d(28, 10, 0)).norm() < 14) return 4;
    if ((p - Vec3d(-28, -20, 0)).norm() < 14) return 5;
    return (p - Vec3d(28, -35, 0)).norm() < 9 ? 6 : 0;
  });
  const fs::path file =
      Write("labels.nii.gz", fulcrum::testing::NiftiBytes(map, fulcrum::testing::NiftiHeader(map, ras, false)));
  std::ofstream(folder_ / "labels.yaml")
      << "labels:\n  - {label: 3, name: rectum, organ: true}\n  - {label: 4, name: ovary, material: liver}\n"
         "  - {label: 5, name: lump, material: fat}\n  - {label: 6, name: bone}\n";
  (void)ImportAnatomyFiles({"patient", file, folder_ / "labels.yaml", folder_ / "patient"}, {});
  const SceneData data = CompileScene(folder_ / "patient" / "patient.yaml", {}, {}).data;
  const auto fault = FindFault(data.View());
  EXPECT_FALSE(fault) << fault->section << ": " << fault->reason;
  ASSERT_EQ(data.solids.size(), 3u);
  EXPECT_STREQ(data.solids[1].name, "ovary");
  EXPECT_EQ(data.solids[2].look, SolidLook::kFat);
  EXPECT_EQ(std::string(data.static_surfaces.back().name), "bone");
  std::array<int, 3> joined{}, held{}, count{};
  for (const Attachment& a : data.attachments) {
    for (std::size_t k = 1; k < 3; ++k) {
      const Solid& s = data.solids[k];
      joined[k] += a.vertex >= s.first_vertex && a.vertex < s.first_vertex + s.vertex_count ? 1 : 0;
    }
  }
  for (std::size_t k = 1; k < 3; ++k) {
    const Solid& s = data.solids[k];
    count[k] = static_cast<int>(s.vertex_count);
    for (Index v = s.first_vertex; v < s.first_vertex + s.vertex_count; ++v)
      held[k] += data.inverse_mass[v] == 0 ? 1 : 0;
    EXPECT_GT(joined[k], 2) << k;
    EXPECT_GT(count[k], 300);
    EXPECT_GT(held[k], count[k] / 8);
    EXPECT_LT(held[k], count[k] / 2);
  }
}

TEST_F(Segmentation, AFolderOfSurfacesBecomesAScene) {
  const auto label = [](const Vec3d& p) {
    if (std::hypot(p.x(), p.z()) < 15 && std::abs(p.y()) < 50) return 1;
    return (p - Vec3d(30, 10, 0)).norm() < 12 ? 2 : 0;  // To the left.
  };
  Eigen::Affine3d W = Eigen::Affine3d::Identity();
  W.linear() *= 2;
  W.translation().setConstant(-64);
  const auto surfaces = SurfacesOf(Fill({64, 64, 64}, W, label), {1, 2});
  fs::create_directories(folder_ / "surfaces");
  for (const auto& [number, mesh] : surfaces) {
    std::ofstream obj(folder_ / "surfaces" / (number == 1 ? "Rectum 1.obj" : "ball.obj"));
    // Left, posterior, superior, in metres.
    for (const Vec3d& p : mesh.vertices)
      obj << "v " << 1e-3 * p.x() << " " << -1e-3 * p.z() << " " << 1e-3 * p.y() << "\n";
    for (const Triangle& t : mesh.triangles) obj << "f " << t[0] + 1 << " " << t[1] + 1 << " " << t[2] + 1 << "\n";
  }
  const std::string suggested = SuggestLabelUses(folder_ / "surfaces");
  EXPECT_NE(suggested.find("{file: \"Rectum 1.obj\", name: Rectum_1, organ: true}"), std::string::npos) << suggested;
  std::ofstream(folder_ / "labels.yaml") << suggested;
  const fs::path out = folder_ / "patient";
  const AnatomyImport import{"patient", folder_ / "surfaces", folder_ / "labels.yaml", out};
  EXPECT_NE(Refusal([&] { (void)ImportAnatomyFiles(import, {}); }).find("with `unit: m`"), std::string::npos);
  EXPECT_FALSE(fs::exists(out)) << "else the corrected command would be refused";
  std::string metres = suggested;
  metres.replace(metres.find("unit: mm"), 8, "unit: m ");
  std::ofstream(folder_ / "labels.yaml") << metres;
  const auto reports = ImportAnatomyFiles(import, {});
  ASSERT_EQ(reports.size(), 2u);
  const MeshFile ball = ReadMesh(out / "ball.ply");
  Vec3d middle = Vec3d::Zero();
  for (const Vec3d& p : ball.vertices) middle += p / static_cast<double>(ball.vertices.size());
  EXPECT_LT((middle - Vec3d(30, 10, 0)).norm(), 1) << "left stays left";
  EXPECT_TRUE(fs::exists(out / "report.html"));
}

/// As programs write what they have mirrored; one of them open.
TEST_F(Segmentation, ASurfaceThatIsInsideOutIsTurned) {
  const auto label = [](const Vec3d& p) {
    if (std::hypot(p.x(), p.z()) < 15 && std::abs(p.y()) < 50) return 1;
    if ((p - Vec3d(28, 10, 0)).norm() < 13) return 2;
    if ((p - Vec3d(-28, 10, 0)).norm() < 13) return 4;
    return (p - Vec3d(28, -25, 0)).norm() < 12 ? 3 : 0;
  };
  Eigen::Affine3d W = Eigen::Affine3d::Identity();
  W.linear() *= 2;
  W.translation().setConstant(-64);
  const auto surfaces = SurfacesOf(Fill({64, 64, 64}, W, label), {1, 2, 3, 4});
  fs::create_directories(folder_ / "surfaces");
  for (const auto& [number, mesh] : surfaces) {
    std::ofstream obj(folder_ / "surfaces" / (std::to_string(number) + ".obj"));
    for (const Vec3d& p : mesh.vertices) obj << "v " << p.x() << " " << p.y() << " " << p.z() << "\n";
    for (std::size_t i = number == 4 ? 30 : 0; i < mesh.triangles.size(); ++i) {
      const Triangle& t = mesh.triangles[i];
      obj << "f " << t[0] + 1 << " " << t[2] + 1 << " " << t[1] + 1 << "\n";
    }
  }
  std::ofstream(folder_ / "labels.yaml")
      << "axes: LSA\nlabels:\n  - {file: 1.obj, name: rectum, organ: true}\n"
         "  - {file: 2.obj, name: ovary, material: liver}\n  - {file: 3.obj, name: bone}\n"
         "  - {file: 4.obj, name: lump, material: fat}\n";
  const fs::path out = folder_ / "patient";
  std::string said;
  const auto reports = ImportAnatomyFiles({"patient", folder_ / "surfaces", folder_ / "labels.yaml", out},
                                          [&](const std::string& text) { said += text + "\n"; });
  ASSERT_EQ(reports.size(), 4u);
  EXPECT_NE(said.find("3.obj: is inside out and turned"), std::string::npos) << said;
  for (const LabelReport& report : reports) {
    double volume = 0;
    const MeshFile mesh = ReadMesh(out / (report.use.name + ".ply"));
    for (const Triangle& t : mesh.triangles) {
      volume += mesh.vertices[t[0]].dot(mesh.vertices[t[1]].cross(mesh.vertices[t[2]])) / 6;
    }
    EXPECT_GT(report.volume_ml, 5) << report.use.name;
    if (report.use.name == "lump") continue;  // Open: the volume depends on the origin.
    EXPECT_NEAR(1e-3 * volume, report.volume_ml, 0.01) << report.use.name;
  }
  const SceneData data = CompileScene(out / "patient.yaml", {}, {}).data;
  ASSERT_EQ(data.solids.size(), 3u) << "the open one is capped";
}

}  // namespace
}  // namespace fulcrum::scene
