// Cutting and shrinking in place.
#include <gtest/gtest.h>

#include <random>

#include "physics_node/tissue/tissue_model.h"
#include "services/base/core/error.h"
#include "services/base/core/slit_sheet.h"
#include "services/scene/builder/build.h"
#include "tests/support/whole_topology.h"
#include "tests/unit/physics/sheet_scene.h"

namespace fulcrum::physics {
namespace {

class Topology : public testing::Test {
 protected:
  scene::SceneData data_ = SheetScene(12, 17);
  SceneView scene_ = data_.View();
  ParticleStore particles_{scene_};
  TissueModel model_{scene_, &particles_};
  TopologyState state_ = WholeTopology(scene_);

  [[nodiscard]] float Rest(Index node, int direction) const {
    return model_.rest(direction)[particles_.layout().Offset(node / 17, node % 17)];
  }
};

TEST_F(Topology, NothingChangedIsNoEdit) { EXPECT_EQ(model_.Apply(state_, &particles_), 0); }

TEST_F(Topology, ADeadEdgeLetsGoAndItsTrianglesWithIt) {
  const Index node = 5 * 17 + 6;
  SetBit(state_.dead_edges, 3 * node + 2);  // The diagonal of cell (5, 6).
  state_.revision = 3;
  EXPECT_EQ(model_.Apply(state_, &particles_), 1);
  EXPECT_EQ(model_.revision(), 3u);
  EXPECT_EQ(Rest(node, 2), 0.0f);
  EXPECT_GT(Rest(node, 0), 0.0f);
  const Index cell = 5 * 16 + 6;
  EXPECT_FALSE(model_.TriangleAlive(2 * cell));
  EXPECT_FALSE(model_.TriangleAlive(2 * cell + 1));
  EXPECT_TRUE(model_.TriangleAlive(2 * cell + 2));
}

TEST_F(Topology, ADeadNodeTakesItsEdgesTrianglesHingesAndMassAlong) {
  const Index node = 5 * 17 + 5;
  SetBit(state_.dead_nodes, node);
  EXPECT_EQ(model_.Apply(state_, &particles_), 1);
  for (const auto& [n, d] : {std::pair{node, 0}, {node, 1}, {node, 2}, {node - 1, 0}, {node - 17, 1}, {node - 18, 2}}) {
    EXPECT_EQ(Rest(n, d), 0.0f);
    EXPECT_FALSE(model_.EdgeAlive(n, d));
  }
  int dead = 0;
  for (Index t = 0; t < scene_.membrane.triangle_count(); ++t) {
    dead += model_.TriangleAlive(t) ? 0 : 1;
  }
  EXPECT_EQ(dead, 6);
  EXPECT_EQ(particles_.InverseMass(particles_.Ref(node)), 0.0f);
  int off = 0;
  for (const BendingBatch& batch : model_.bending()) {
    off += batch.v[0][0] / 4 + 1 != model_.hinge_particles().size() && batch.active[0] == 0.0f;
  }
  EXPECT_EQ(off, 1);  // Only hinge (5, 5) has the node as a corner.
}

TEST_F(Topology, ShrinkingShortensTheRestLength) {
  const Index edge = 3 * (4 * 17 + 4);
  state_.shrink[edge] = 255;
  EXPECT_EQ(model_.Apply(state_, &particles_), 1);
  EXPECT_FLOAT_EQ(Rest(4 * 17 + 4, 0), (1.0f - 255.0f * kShrinkUnit) * scene_.membrane_rest_length[edge]);
}

TEST_F(Topology, EverythingCanBeUndone) {
  // A thermal node that has lost its checkpoint starts from an uncut sheet, and physics adopts that topology.
  std::mt19937 random(11);
  TopologyState wild = state_;
  for (auto* bytes : {&wild.dead_nodes, &wild.dead_edges, &wild.shrink}) {
    for (auto& byte : *bytes) {
      byte = static_cast<std::uint8_t>(random());
    }
  }
  EXPECT_GT(model_.Apply(wild, &particles_), 0);
  EXPECT_GT(model_.Apply(state_, &particles_), 0);
  ParticleStore fresh_particles(scene_);
  const TissueModel fresh(scene_, &fresh_particles);
  for (int d = 0; d < 3; ++d) {
    for (Index i = 0; i < particles_.layout().plane(); ++i) {
      EXPECT_EQ(model_.rest(d)[i], fresh.rest(d)[i]);
    }
  }
  for (Index t = 0; t < scene_.membrane.triangle_count(); ++t) {
    EXPECT_TRUE(model_.TriangleAlive(t));
  }
  for (std::size_t b = 0; b < fresh.bending().size(); ++b) {
    for (int lane = 0; lane < kLanes; ++lane) {
      EXPECT_EQ(model_.bending()[b].active[lane], fresh.bending()[b].active[lane]);
    }
  }
  for (Index p = 0; p < particles_.particle_count(); ++p) {
    EXPECT_EQ(particles_.InverseMass(particles_.Ref(p)), scene_.inverse_mass[p]);
    EXPECT_FALSE(model_.IsDebris(p));
  }
}

TEST_F(Topology, PiecewiseOrAtOnceIsTheSame) {
  std::mt19937 random(12);
  TopologyState state = state_;
  for (int i = 0; i < 60; ++i) {
    SetBit(state.dead_edges, random() % (3 * scene_.membrane.node_count()));
    if (i % 5 == 0) {
      SetBit(state.dead_nodes, random() % scene_.membrane.node_count());
    }
    (void)model_.Apply(state, &particles_);
  }
  ParticleStore particles(scene_);
  TissueModel at_once(scene_, &particles);
  (void)at_once.Apply(state, &particles);
  for (Index t = 0; t < scene_.membrane.triangle_count(); ++t) {
    EXPECT_EQ(model_.TriangleAlive(t), at_once.TriangleAlive(t)) << t;
  }
  for (std::size_t b = 0; b < at_once.bending().size(); ++b) {
    EXPECT_EQ(model_.bending()[b].active[0], at_once.bending()[b].active[0]);
  }
  for (int d = 0; d < 3; ++d) {
    for (Index i = 0; i < particles.layout().plane(); ++i) {
      EXPECT_EQ(model_.rest(d)[i], at_once.rest(d)[i]);
    }
  }
}

/// Cuts all edges across the outline of rows [r0, r1] x columns [c0, c1].
void CutOut(Index r0, Index r1, Index c0, Index c1, const SceneView& scene, TopologyState* state) {
  const Index cols = scene.membrane.cols;
  const auto inside = [&](Index node) {
    return node / cols >= r0 && node / cols <= r1 && node % cols >= c0 && node % cols <= c1;
  };
  for (Index node = 0; node + cols + 1 < scene.membrane.node_count(); ++node) {
    for (Index d = 0; d < 3; ++d) {
      if (inside(node) != inside(node + std::array<Index, 3>{1, cols, cols + 1}[d])) {
        SetBit(state->dead_edges, 3 * node + d);
      }
    }
  }
}

TEST_F(Topology, APieceThatHangsOnNothingIsDebris) {
  CutOut(4, 7, 5, 9, scene_, &state_);
  EXPECT_GT(model_.Apply(state_, &particles_), 0);
  for (Index node = 0; node < 12 * 17; ++node) {
    const bool piece = node / 17 >= 4 && node / 17 <= 7 && node % 17 >= 5 && node % 17 <= 9;
    EXPECT_EQ(model_.IsDebris(node), piece) << node;
    EXPECT_EQ(particles_.InverseMass(particles_.Ref(node)), piece ? 0.0f : scene_.inverse_mass[node]);
  }
  EXPECT_FALSE(model_.TriangleAlive(2 * (5 * 16 + 6)));
}

TEST_F(Topology, APieceThatThePictureShowsStaysTissue) {
  CutOut(2, 6, 3, 10, scene_, &state_);
  static_assert(5 * 8 == kCrumbNodes);
  (void)model_.Apply(state_, &particles_);
  EXPECT_FALSE(model_.IsDebris(4 * 17 + 6));
  EXPECT_GT(particles_.InverseMass(particles_.Ref(4 * 17 + 6)), 0.0f) << "tools touch it and take it along";
  EXPECT_TRUE(model_.TriangleAlive(2 * (4 * 16 + 6)));
}

TEST_F(Topology, OneEdgeLeftHoldsAPiece) {
  CutOut(4, 7, 5, 9, scene_, &state_);
  const Index bridge = 3 * (3 * 17 + 7) + 1;
  state_.dead_edges[bridge / 8] = static_cast<std::uint8_t>(state_.dead_edges[bridge / 8] & ~(1u << (bridge % 8)));
  (void)model_.Apply(state_, &particles_);
  EXPECT_FALSE(model_.IsDebris(5 * 17 + 6));
  SetBit(state_.dead_nodes, 3 * 17 + 7);  // The bridge is burnt through.
  (void)model_.Apply(state_, &particles_);
  EXPECT_TRUE(model_.IsDebris(5 * 17 + 6));
}

TEST_F(Topology, OfAnotherSizeIsRefusedWhole) {
  TopologyState other = state_;
  other.rows = 11;
  SetBit(other.dead_nodes, 40);
  EXPECT_EQ(model_.Apply(other, &particles_), -1);
  other = state_;
  other.shrink.pop_back();
  EXPECT_EQ(model_.Apply(other, &particles_), -1);
  EXPECT_TRUE(model_.NodeAlive(40));
}

TEST(TissueModel, HasThePapersCounts) {
  const scene::SceneData data = scene::BuildProcedural(scene::BuiltIn());
  ParticleStore particles(data.View());
  const TissueModel model(data.View(), &particles);
  const ConstraintCounts counts = model.counts();
  const auto near = [](std::size_t ours, double paper) {
    return std::abs(static_cast<double>(ours) / paper - 1.0) < 0.02;
  };
  EXPECT_TRUE(near(counts.vertices, 20556)) << counts.vertices;
  EXPECT_TRUE(near(counts.stretch, 65279)) << counts.stretch;
  EXPECT_TRUE(near(counts.volume, 6105)) << counts.volume;
  EXPECT_TRUE(near(counts.bending, 1853)) << counts.bending;
}

TEST(TissueModel, RefusesASceneThatBreaksItsRules) {
  scene::SceneData data = scene::BuildProcedural(scene::Small());
  const auto expect_refused = [](const scene::SceneData& bad, const char* what) {
    ParticleStore particles(bad.View());
    try {
      TissueModel model(bad.View(), &particles);
      ADD_FAILURE() << "accepted: " << what;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(what), std::string::npos) << error.what();
    }
  };
  scene::SceneData bad = data;
  bad.tube_edge_colours = {0, static_cast<Index>(bad.tube_edges.size())};
  expect_refused(bad, "tube edges: two of one colour");
  bad = data;
  bad.tet_colours.pop_back();
  expect_refused(bad, "tetrahedra: colour offsets");
  bad = data;
  bad.binding_colours = {0, static_cast<Index>(bad.bindings.size())};
  expect_refused(bad, "bindings");
}

}  // namespace
}  // namespace fulcrum::physics
