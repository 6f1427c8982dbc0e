#include "tests/integration/render/synthetic_scene.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "render_node/geometry/membrane_mesh.h"
#include "services/base/core/operator_script.h"
#include "tests/support/whole_topology.h"

namespace fulcrum::render {
namespace {

constexpr float kTentReach = 0.013f;     // [m] of material.
constexpr float kSlitOpening = 0.0012f;  // [m], each side.
constexpr float kSlitReach = 0.010f;     // [m]

Index NearestNode(const SceneView& scene, const Vec3f& p_W) {
  Index best = 0;
  float best_distance = std::numeric_limits<float>::max();
  for (Index node = 0; node < scene.membrane.node_count(); ++node) {
    const float d = (scene.rest_position[scene.membrane.first + node] - p_W).squaredNorm();
    if (d < best_distance) {
      best_distance = d;
      best = node;
    }
  }
  return best;
}

struct PathDistance {
  float distance;
  float along;   // [m] from the start of the path.
  Vec2f normal;  // Unit, towards the point.
};

PathDistance DistanceToPath(const std::vector<Vec2f>& path, const Vec2f& p) {
  PathDistance best{std::numeric_limits<float>::max(), 0, Vec2f::Zero()};
  float along = 0;
  for (std::size_t k = 0; k + 1 < path.size(); ++k) {
    const Vec2f ab = path[k + 1] - path[k];
    const float length = ab.norm();
    if (length == 0) {
      continue;
    }
    const float t = std::clamp((p - path[k]).dot(ab) / (length * length), 0.0f, 1.0f);
    const Vec2f off = p - path[k] - t * ab;
    if (off.norm() < best.distance) {
      best = {off.norm(), along + t * length, off.norm() > 0 ? Vec2f(off.normalized()) : Vec2f::Zero()};
    }
    along += length;
  }
  return best;
}

bool Crosses(const Vec2f& a, const Vec2f& b, const std::vector<Vec2f>& path) {
  const auto side = [](const Vec2f& p, const Vec2f& q, const Vec2f& r) {
    return (q - p).x() * (r - p).y() - (q - p).y() * (r - p).x();
  };
  for (std::size_t k = 0; k + 1 < path.size(); ++k) {
    const Vec2f &c = path[k], &d = path[k + 1];
    if (side(a, b, c) * side(a, b, d) < 0 && side(c, d, a) * side(c, d, b) < 0) {
      return true;
    }
  }
  return false;
}

void Cut(const SceneView& scene, SyntheticMoment* moment) {
  const MembraneGrid& grid = scene.membrane;
  TopologyState& topology = moment->topology;
  topology = WholeTopology(scene);
  if (moment->cut_path.size() < 2) {
    return;
  }
  topology.revision = 1;
  for (std::uint32_t row = 0; row + 1 < grid.rows; ++row) {
    for (std::uint32_t col = 0; col + 1 < grid.cols; ++col) {
      for (int half = 0; half < 2; ++half) {
        const MembraneTriangle t = MembraneTriangleAt(grid.cols, row, col, half);
        for (std::size_t k = 0; k < 3; ++k) {
          if (Crosses(scene.membrane_material[t.nodes[k]], scene.membrane_material[t.nodes[(k + 1) % 3]],
                      moment->cut_path)) {
            SetBit(topology.dead_edges, t.edges[k]);
          }
        }
      }
    }
  }
  // Patches along the path, each with the profile of a burn across it.
  Vec2f low = moment->cut_path.front(), high = low;
  for (const Vec2f& p : moment->cut_path) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const float patch_m = kPatchTexels * grid.texel_m, margin = 0.004f;
  for (float t = std::max(0.0f, low.y() - margin); t < high.y() + margin; t += patch_m) {
    for (float s = std::max(0.0f, low.x() - margin); s < high.x() + margin; s += patch_m) {
      TemperaturePatch patch;
      patch.header.origin_x = static_cast<std::uint32_t>(s / grid.texel_m);
      patch.header.origin_y = static_cast<std::uint32_t>(t / grid.texel_m);
      patch.texels.resize(4u * kPatchTexels * kPatchTexels);
      for (std::uint32_t y = 0; y < kPatchTexels; ++y) {
        for (std::uint32_t x = 0; x < kPatchTexels; ++x) {
          const Vec2f p((static_cast<float>(patch.header.origin_x + x) + 0.5f) * grid.texel_m,
                        (static_cast<float>(patch.header.origin_y + y) + 0.5f) * grid.texel_m);
          const float ragged = 0.00006f * std::sin(9000 * p.y()) + 0.00005f * std::sin(21000 * p.y() + 1);
          const float d = DistanceToPath(moment->cut_path, p).distance + ragged;
          std::uint8_t* texel = patch.texels.data() + 4u * (y * kPatchTexels + x);
          const auto gauss = [d](float width) { return std::exp(-d * d / (width * width)); };
          texel[0] = static_cast<std::uint8_t>(34 + 60 * gauss(0.0012f));
          texel[1] = static_cast<std::uint8_t>(255 * std::min(1.0f, 1.6f * gauss(0.0008f)));
          texel[2] = static_cast<std::uint8_t>(255 * std::min(1.0f, 1.1f * gauss(0.0005f)));
          texel[3] = d < 0.00025f ? 0 : 255;
        }
      }
      moment->patches.push_back(std::move(patch));
    }
  }
}

void Deform(const SceneView& scene, const Vec3f& lift, SyntheticMoment* moment) {
  TissueFrame& tissue = moment->tissue;
  tissue.header.scene_hash = scene.hash;
  tissue.header.vertex_count = static_cast<std::uint32_t>(scene.rest_position.size());
  tissue.xyz.resize(3 * scene.rest_position.size());
  const Index first = scene.membrane.first;
  const Vec3f grasp = scene.rest_position[first + NearestNode(scene, moment->tools.tools[0].p_WT - lift)];
  float cut_length = 0;
  for (std::size_t k = 0; k + 1 < moment->cut_path.size(); ++k) {
    cut_length += (moment->cut_path[k + 1] - moment->cut_path[k]).norm();
  }
  for (std::size_t i = 0; i < scene.rest_position.size(); ++i) {
    Vec3f x = scene.rest_position[i];
    if (i < first) {
      const float r = (x - grasp).norm();
      x += 0.12f * lift * std::exp(-r * r / (4 * kTentReach * kTentReach));
    } else {
      const Vec2f m = scene.membrane_material[i - first];
      const float r = (m - moment->grasp_material).norm() / kTentReach;
      // A tent has its peak at the grasp and concave sides.
      x += lift * (0.6f * std::exp(-1.6f * r) + 0.4f * std::exp(-r * r));
      if (cut_length > 0) {
        const PathDistance to_path = DistanceToPath(moment->cut_path, m);
        const float ends = std::clamp(std::min(to_path.along, cut_length - to_path.along) / 0.006f, 0.0f, 1.0f);
        const float open = kSlitOpening * std::sqrt(ends) * std::exp(-to_path.distance / kSlitReach);
        x += open * Vec3f(to_path.normal.x(), to_path.normal.y(), 0.25f);
      }
    }
    Eigen::Map<Vec3f>(tissue.xyz.data() + 3 * i) = x;
  }
}

}  // namespace

Vec2f NearestMaterial(const SceneView& scene, const Vec3f& p_W) {
  return scene.membrane_material[NearestNode(scene, p_W)];
}

SyntheticMoment MakeSyntheticMoment(const SceneView& scene, double time_s) {
  SyntheticMoment moment;
  moment.tissue.header.session_time_s = time_s;
  Vec3f lift = Vec3f::Zero();
  for (std::uint32_t tool = 0; tool < kMaxTools; ++tool) {
    const ScriptPoint now = EvaluateScript(scene.script, tool, time_s);
    if (!now.present) {
      continue;
    }
    ToolSample& sample = moment.tools.tools[tool];
    sample.kind = scene.tools[tool].kind;
    sample.p_WT = now.p_W;
    const Vec3f z = (now.p_W - scene.tools[tool].p_WP).normalized();
    const Vec3f x = (Vec3f::UnitX() - z.x() * z).normalized();
    Mat3f axes;
    axes << x, z.cross(x), z;
    sample.q_WT = Quatf(axes);
    moment.handles.handles[tool] = {true, now.jaw_rad, 0, 1, 0};
    // The tissue is held from the first time the jaws are closed until they open again; it is cut while the pedal is
    // down.
    Vec3f held_from = Vec3f::Zero();
    bool held = false;
    for (double t = 0; t <= time_s; t += 0.02) {
      const ScriptPoint then = EvaluateScript(scene.script, tool, t);
      if (sample.kind == ToolKind::kGrasper) {
        const bool closed = then.jaw_rad < 0.05f;
        if (closed && !held) {
          held_from = then.p_W;
        }
        held = closed;
      } else if (then.pedals != 0) {
        const Vec2f m = NearestMaterial(scene, then.p_W);
        if (moment.cut_path.empty() || (m - moment.cut_path.back()).norm() > 0.002f) {
          // Off the lines of the grid, as on a real path: edges are cut, nodes are not.
          moment.cut_path.push_back(m + Vec2f(0.00031f, 0.00017f));
        }
      }
    }
    if (held) {
      lift = now.p_W - held_from;
      moment.grasp_material = NearestMaterial(scene, held_from);
    }
  }
  Cut(scene, &moment);
  Deform(scene, lift, &moment);
  return moment;
}

}  // namespace fulcrum::render
