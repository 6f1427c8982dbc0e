// The whole tissue: rest, sleep, determinism, restart, and its outputs to servo and heat.
#include <gtest/gtest.h>

#include <random>

#include "haptics_node/servo/contact_law.h"
#include "haptics_node/servo/model_gate.h"
#include "physics_node/contact_model/elastic_force.h"
#include "physics_node/simulation/script_player.h"
#include "physics_node/simulation/tissue_simulation.h"
#include "services/scene/builder/build.h"
#include "services/transport/bus/gate.h"
#include "tests/support/whole_topology.h"
#include "tests/unit/physics/sheet_scene.h"

namespace fulcrum::physics {
namespace {

class OnSmallScene : public testing::Test {
 protected:
  scene::SceneData data_ = scene::BuildProcedural(scene::Small());
  SceneView scene_ = data_.View();
};

TEST_F(OnSmallScene, FallsAsleepAndIsWokenByATouchOnly) {
  TissueSimulation simulation(scene_);
  const auto far = ScriptedTools(scene_, 0.0);
  int steps = 0;
  while (!simulation.Step(far).asleep && steps < 200) {
    ++steps;
  }
  EXPECT_LT(steps, 100);
  const std::uint64_t version = simulation.state_version(), hash = simulation.StateHash();
  auto moved = far;
  for (int i = 0; i < 50; ++i) {
    moved[0].pose.p_WT.z() += 0.0002f;
    EXPECT_TRUE(simulation.Step(moved).asleep);
  }
  EXPECT_EQ(simulation.state_version(), version);
  EXPECT_EQ(simulation.StateHash(), hash);
  // The scripted touch wakes the tissue.
  bool awake = false;
  for (int i = 0; i < 250 && !awake; ++i) {
    awake = !simulation.Step(ScriptedTools(scene_, 0.01 * i)).asleep;
  }
  EXPECT_TRUE(awake);
}

TEST_F(OnSmallScene, AToolThatHoversLeavesItAsleep) {
  TissueSimulation simulation(scene_);
  const auto at = [&](int i) { return ScriptedTools(scene_, 0.01 * i); };
  for (int i = 0; i < 100; ++i) {
    simulation.Step(at(0));
  }
  int touch = 0;
  while (simulation.Step(at(touch)).asleep) {
    ASSERT_LT(++touch, 1000);
  }
  ASSERT_GT(touch, 1);
  // The script from its start, with a stop just before the touch.
  TissueSimulation again(scene_);
  for (int i = 0; i < 100; ++i) {
    again.Step(at(0));
  }
  for (int i = 0; i < touch; ++i) {
    ASSERT_TRUE(again.Step(at(i)).asleep) << i;
  }
  const std::uint64_t version = again.state_version();
  bool near = false;
  for (int i = 0; i < 40; ++i) {
    auto tools = at(touch - 1);
    for (ToolInput& tool : tools) {
      tool.pose.p_WT.z() += i % 2 == 0 ? 0.00002f : 0.0f;
    }
    EXPECT_TRUE(again.Step(tools).asleep) << i;
    near |= !again.collision().pairs().empty();
  }
  EXPECT_TRUE(near) << "near enough for a contact pair";
  EXPECT_EQ(again.state_version(), version);
  EXPECT_FALSE(again.Step(at(touch)).asleep);
}

TEST_F(OnSmallScene, ATopologyChangeWakes) {
  TissueSimulation simulation(scene_);
  for (int i = 0; i < 100; ++i) {
    simulation.Step({});
  }
  ASSERT_TRUE(simulation.asleep());
  TopologyState state = WholeTopology(scene_);
  EXPECT_EQ(simulation.ApplyTopology(state), 0);
  EXPECT_TRUE(simulation.asleep());
  state.shrink[3 * (30 * 25 + 12)] = 200;
  EXPECT_EQ(simulation.ApplyTopology(state), 1);
  EXPECT_FALSE(simulation.Step({}).asleep);
}

TEST_F(OnSmallScene, ASheetCutInManyPlacesComesToRest) {
  for (const unsigned seed : {1u, 2u, 3u}) {
    TopologyState state = WholeTopology(scene_);
    std::mt19937 random(seed);
    for (Index row = 20; row < 45; ++row) {
      for (Index edge = 3 * (row * state.cols + 6); edge < 3 * (row * state.cols + 18); ++edge) {
        if (random() % 100 < 30) {
          SetBit(state.dead_edges, edge);
        }
      }
    }
    TissueSimulation simulation(scene_);
    EXPECT_GT(simulation.ApplyTopology(state), 100);
    float early = 0, late = 0;
    for (int i = 0; i < 400; ++i) {
      const float step = simulation.Step({}).max_step_m;
      early = i < 50 ? std::max(early, step) : early;
      late = i >= 350 ? std::max(late, step) : late;
    }
    EXPECT_GT(early, 0.0005f) << seed;  // The slits gape.
    EXPECT_LT(early, 0.002f) << seed;   // No shred is thrown about.
    EXPECT_LT(late, 1e-5f) << seed;     // Later no shred swings.
  }
}

TEST_F(OnSmallScene, OneToolFeelsWhatTheOtherDoes) {
  // The hook presses 3 mm deep and stays; the grasper then takes the membrane beside it and lifts it by 6 mm.
  TissueSimulation simulation(scene_);
  const auto node = [&](Index row, Index col) {
    return scene_.rest_position[scene_.membrane.first + row * scene_.membrane.cols + col];
  };
  const Vec3f down = -(node(28, 13) - node(28, 12)).cross(node(29, 12) - node(28, 12)).normalized();
  const Vec3f inwards = down.z() < 0 ? down : Vec3f(-down);
  std::array<ToolInput, kMaxTools> tools;
  for (ToolInput& tool : tools) {
    tool.present = true;
    tool.pose.q_WT = Quatf::FromTwoVectors(Vec3f::UnitZ(), inwards);
  }
  ToolInput &grasper = tools[0], &hook = tools[1];
  ASSERT_EQ(scene_.tools[0].kind, ToolKind::kGrasper);
  const auto smooth = [](float u) { return u * u * (3 - 2 * u); };
  const auto at = [&](float time) { return std::clamp(time, 0.0f, 1.0f); };
  float power = 0, pressed = 0, pulled = 0, jump = 0;
  Vec3f before = Vec3f::Zero();
  for (int i = 0; i < 300; ++i) {
    const float time = 0.01f * static_cast<float>(i);
    hook.pose.p_WT = node(28, 10) + (-0.004f + 0.007f * smooth(at(time))) * inwards;
    // The open jaws come down and close around the membrane.
    grasper.pose.jaw_rad = time < 1.2f ? 0.9f : 0.0f;
    grasper.pose.p_WT =
        node(28, 16) + (-0.006f + 0.006f * smooth(at(time)) - 0.006f * smooth(at(time - 1.5f))) * inwards;
    simulation.Step(tools);
    const DeviceContacts press = simulation.Contacts(1), pull = simulation.Contacts(0);
    ASSERT_LE(press.p_ext_W, 0.05f);
    if (time < 1.5f) {
      pressed = press.count > 0 ? press.contacts[0].f_ref.norm() : 0;
    } else {
      power = std::max(power, press.p_ext_W);
    }
    const Vec3f force = pull.count > 0 ? pull.contacts[0].f_ref : Vec3f(Vec3f::Zero());
    if (time > 2.7f) {
      pulled = force.norm();
      jump = std::max(jump, (force - before).norm());
    }
    before = force;
  }
  EXPECT_GT(simulation.grasp(0).held().size(), 5);
  EXPECT_GT(pressed, 0.02f);
  EXPECT_GT(pulled, 0.1f);
  EXPECT_LT(jump, 0.02f * pulled);  // At rest the force of a grasp is free of noise.
  EXPECT_GT(power, 0.0f);
}

TEST_F(OnSmallScene, FourToolsGraspAtOnce) {
  scene::SceneSettings settings = scene::Small();
  for (std::size_t i = 0; i < kMaxTools; ++i) {
    settings.tools[i] = scene::DefaultTool(ToolKind::kGrasper, Vec3f(0.05f * static_cast<float>(i), -0.05f, 0.1f));
  }
  const scene::SceneData data = scene::BuildProcedural(settings);
  const SceneView scene = data.View();
  TissueSimulation simulation(scene);
  std::array<ToolInput, kMaxTools> tools;
  for (int step = 0; step < 200; ++step) {
    for (std::size_t i = 0; i < kMaxTools; ++i) {
      const Vec3f place = scene.rest_position[scene.membrane.first + (20 + 10 * i) * scene.membrane.cols + 12];
      tools[i].present = true;
      tools[i].pose.q_WT = Quatf::FromTwoVectors(Vec3f::UnitZ(), -Vec3f::UnitZ());
      tools[i].pose.jaw_rad = step < 30 ? 0.8f : 0.0f;
      tools[i].pose.p_WT = place + Vec3f(0, 0, step < 60 ? -0.001f : 5e-5f * static_cast<float>(step - 80));
    }
    simulation.Step(tools);
    for (std::uint32_t i = 0; i < kMaxTools; ++i) ASSERT_LE(simulation.Contacts(i).p_ext_W, 0.05f);
  }
  for (std::uint32_t i = 0; i < kMaxTools; ++i) {
    EXPECT_FALSE(simulation.grasp(i).held().empty()) << i;
    const DeviceContacts contacts = simulation.Contacts(i);
    ASSERT_GT(contacts.count, 0u) << i;
    EXPECT_EQ(contacts.contacts[0].kind, ContactKind::kGrasp) << i;
    EXPECT_GT(contacts.contacts[0].f_ref.norm(), 0.05f) << i;
  }
}

TEST_F(OnSmallScene, TheSameRunGivesTheSameHash) {
  std::vector<std::uint64_t> first, second;
  for (auto* hashes : {&first, &second}) {
    TissueSimulation simulation(scene_);
    for (int i = 0; i < 350; ++i) {
      simulation.Step(ScriptedTools(scene_, 0.01 * i));
      hashes->push_back(simulation.StateHash());
    }
  }
  EXPECT_EQ(first, second);
  EXPECT_NE(first.front(), first.back());
}

TEST_F(OnSmallScene, EveryInstructionSetGivesTheSameHash) {
  if (!Has(InstructionSet::kAvx2)) GTEST_SKIP() << "this CPU has no AVX2";
  TissueSimulation narrow(scene_, 1, InstructionSet::kBaseline), wide(scene_, 1);
  for (int i = 0; i < 300; ++i) {
    narrow.Step(ScriptedTools(scene_, 0.01 * i));
    wide.Step(ScriptedTools(scene_, 0.01 * i));
  }
  EXPECT_EQ(narrow.StateHash(), wide.StateHash());
}

TEST_F(OnSmallScene, ContinuesFromASavedStateWithoutAJump) {
  TissueSimulation one(scene_);
  int i = 0;
  for (; i < 300; ++i) {
    one.Step(ScriptedTools(scene_, 0.01 * i));
  }
  ASSERT_TRUE(one.grasp(0).holding());
  const std::size_t floats = 3 * std::size_t{one.particles().particle_count()};
  std::vector<float> now(floats), previous(floats);
  one.particles().CopyPositions(now);
  one.particles().CopyPrevious(previous);
  TissueSimulation other(scene_);
  ASSERT_TRUE(other.Restore(now, previous, one.Save()));
  EXPECT_EQ(other.grasp(0).held().size(), one.grasp(0).held().size());
  for (; i < 330; ++i) {
    one.Step(ScriptedTools(scene_, 0.01 * i));
    const StepReport report = other.Step(ScriptedTools(scene_, 0.01 * i));
    EXPECT_LT(report.max_step_m, 0.001f);
  }
  float apart = 0;
  for (Index p = 0; p < one.particles().particle_count(); ++p) {
    apart = std::max(
        apart, (one.particles().At(one.particles().Ref(p)) - other.particles().At(other.particles().Ref(p))).norm());
  }
  // The restored velocity is the mean of a whole step, and the sides of contacts are not restored.
  constexpr float kWithoutAJump = 0.001f;
  EXPECT_LT(apart, kWithoutAJump);
}

TEST_F(OnSmallScene, ASavedStateThatDoesNotFitIsRefused) {
  TissueSimulation simulation(scene_);
  const std::uint64_t hash = simulation.StateHash();
  std::vector<float> xyz(3 * std::size_t{simulation.particles().particle_count()});
  simulation.particles().CopyPositions(xyz);
  std::vector<float> bad = xyz;
  bad[100] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(simulation.Restore(bad, xyz, simulation.Save()));
  bad.pop_back();
  EXPECT_FALSE(simulation.Restore(bad, bad, simulation.Save()));
  SimulationMemory memory = simulation.Save();
  memory.held[0].push_back({simulation.particles().particle_count(), Vec3f::Zero()});
  EXPECT_FALSE(simulation.Restore(xyz, xyz, memory));
  EXPECT_EQ(simulation.StateHash(), hash);
}

TEST_F(OnSmallScene, AToolThatJumpsIsFollowedAtALimitedSpeed) {
  TissueSimulation simulation(scene_);
  auto tools = ScriptedTools(scene_, 2.5);
  for (int i = 0; i < 250; ++i) {
    simulation.Step(ScriptedTools(scene_, 0.01 * i));
  }
  ASSERT_TRUE(simulation.grasp(0).holding());
  tools[0].pose.p_WT.x() += 0.03f;
  for (int i = 0; i < 10; ++i) {
    const StepReport report = simulation.Step(tools);
    EXPECT_LE(report.max_step_m, PbdSolver::kMaxStep);
  }
  EXPECT_LT((simulation.Save().pose[0].p_WT - tools[0].pose.p_WT).norm(), 1e-6f);
}

TEST_F(OnSmallScene, ContactModelsPassTheGatesAndPushBack) {
  TissueSimulation simulation(scene_);
  bool announced = false, pressed = false;
  float pulled = 0;
  std::array<Vec3f, kMaxTools> last{Vec3f::Zero(), Vec3f::Zero()};
  for (int i = 0; i < 600; ++i) {
    simulation.Step(ScriptedTools(scene_, 0.01 * i));
    ContactModel model;
    model.stamp = {static_cast<std::uint64_t>(i + 1), 1, i};
    model.tool_stamp_ns = 1;
    for (std::uint32_t tool = 0; tool < kMaxTools; ++tool) {
      model.devices[tool] = simulation.Contacts(tool);
      for (std::uint32_t c = 0; c < model.devices[tool].count; ++c) {
        const Contact& contact = model.devices[tool].contacts[c];
        EXPECT_TRUE(haptics::IsRenderable(contact)) << "step " << i << " tool " << tool;
        if (contact.kind == ContactKind::kSurface) {
          announced |= contact.gap > 0.002f;
          if (contact.gap == 0.0f && tool == 1 && contact.f_ref.norm() > 0.02f) {
            pressed = true;
            EXPECT_GT(contact.f_ref.dot(contact.n), 0.0f) << "step " << i;
          }
        }
        // The reference force must not jump between steps, because the servo would pass the jump on. Of jaws that open
        // it renders no more than they still hold.
        const float most = contact.kind == ContactKind::kGrasp ? contact.slip_force : kLargestFinite;
        const Vec3f force = contact.f_ref * std::min(1.0f, most / std::max(contact.f_ref.norm(), 1e-6f));
        if (contact.kind == ContactKind::kGrasp) pulled = std::max(pulled, force.norm());
        EXPECT_LT((force - last[tool]).norm(), 1.0f) << "step " << i;
        last[tool] = force;
      }
    }
    EXPECT_TRUE(bus::PassesGate(model)) << "step " << i;
  }
  EXPECT_TRUE(announced);
  EXPECT_TRUE(pressed);
  EXPECT_GT(pulled, 0.3f) << "a grasp of which more than nothing is rendered";
}

/// In air, nearer to the surface than physics last saw it, the servo's law gives no force.
TEST_F(OnSmallScene, NoForceStaysInTheModelAfterAContact) {
  for (const PhysicsMode mode : {PhysicsMode::kAccurate, PhysicsMode::kXpbd}) {
    SceneView scene = scene_;
    scene.physics.mode = mode;
    TissueSimulation simulation(scene);
    const MembraneGrid& grid = scene.membrane;
    const Vec3f place = scene.rest_position[grid.first + grid.rows / 2 * grid.cols + grid.cols / 2];
    std::array<ToolInput, kMaxTools> tools;
    DeviceContacts device;
    const auto hold = [&](float height, int steps) {
      for (int i = 0; i < steps; ++i) {
        tools[0] = {true, PoseAtTip(scene.tools[0], place + Vec3f(0, 0, height), 0.35f)};
        simulation.Step(tools);
        device = simulation.Contacts(0);
      }
    };
    for (int i = 0; i < 40; ++i) hold(0.004f - 2e-4f * static_cast<float>(i), 1);
    ASSERT_EQ(device.count, 1u);
    ASSERT_GT(device.contacts[0].f_ref.norm(), 0.05f);
    hold(0.006f, 30);
    ASSERT_EQ(device.count, 1u);
    const Contact& contact = device.contacts[0];
    EXPECT_GT(contact.gap, 0.0015f);
    EXPECT_EQ(contact.f_ref, Vec3f(Vec3f::Zero()));
    haptics::ContactState state;
    const haptics::ContactLaw law = haptics::MakeContactLaw(contact, 0, &state);
    const Vec3d nearer = (contact.x_ref - 0.001f * contact.n).cast<double>();
    EXPECT_EQ(haptics::StepContact(law, nearer, 0, 1e-3, &state).f_W.norm(), 0.0) << "gap " << contact.gap;
  }
}

TEST_F(OnSmallScene, WhoeverAsksForContactsTheTissueIsTheSameAndSoIsTheAnswer) {
  TissueSimulation always(scene_), sometimes(scene_);
  DeviceContacts one, other;
  for (int i = 0; i < 300; ++i) {
    const auto tools = ScriptedTools(scene_, 0.01 * i);
    always.Step(tools);
    sometimes.Step(tools);
    one = always.Contacts(0);
    if (i < 100 || i >= 290) other = sometimes.Contacts(0);
    ASSERT_EQ(always.StateHash(), sometimes.StateHash()) << "step " << i;
  }
  ASSERT_EQ(one.count, 1u);
  ASSERT_EQ(other.count, 1u);
  EXPECT_EQ(one.contacts[0].kind, ContactKind::kGrasp);
  EXPECT_EQ(one.contacts[0].f_ref, other.contacts[0].f_ref);
  EXPECT_EQ(one.contacts[0].x_ref, other.contacts[0].x_ref);
}

TEST_F(OnSmallScene, AGraspPullsBackTowardsRest) {
  TissueSimulation simulation(scene_);
  for (int i = 0; i < 300; ++i) {
    simulation.Step(ScriptedTools(scene_, 0.01 * i));
    (void)simulation.Contacts(0);
  }
  const DeviceContacts device = simulation.Contacts(0);
  ASSERT_EQ(device.count, 1u);
  const Contact& grasp = device.contacts[0];
  EXPECT_EQ(grasp.kind, ContactKind::kGrasp);
  EXPECT_GT(grasp.u_c.norm(), 0.005f);
  EXPECT_LT(grasp.f_ref.normalized().dot(grasp.u_c.normalized()), -0.7f);
  EXPECT_GT(grasp.f_ref.norm(), 0.3f);
  EXPECT_LT(grasp.f_ref.norm(), scene_.physics.grip_force_N);
}

TEST_F(OnSmallScene, CauteryContactFollowsTheHook) {
  TissueSimulation simulation(scene_);
  int touching = 0;
  float first = 0, last = 0, moved = 0;
  for (int i = 0; i < 480; ++i) {
    simulation.Step(ScriptedTools(scene_, 0.01 * i));
    CauteryContact contact = simulation.Cautery(1);
    contact.stamp.stamp_ns = 1;
    ASSERT_TRUE(bus::PassesGate(contact));
    if (i < 230 || !contact.touching) {
      continue;
    }
    first = touching++ == 0 ? contact.material.y() : first;
    last = contact.material.y();
    // The place in the triangle and the material coordinates agree.
    const auto nodes = simulation.model().TriangleNodes(contact.triangle);
    Vec2f place = Vec2f::Zero();
    for (std::size_t k = 0; k < 3; ++k) {
      place += contact.barycentric[k] * scene_.membrane_material[nodes[k]];
    }
    EXPECT_LT((place - contact.material).norm(), 1e-6f);
    moved += 0.01f * contact.material_rate.y();
  }
  EXPECT_GT(touching, 200);
  EXPECT_GT(last - first, 0.006f);  // The script moves 10 mm along the sheet.
  EXPECT_NEAR(moved, last - first, 0.001f) << "the integral of the rate, which is low-passed";
}

TEST(ElasticForce, IsZeroAtRestAndThatOfTheContinuumWhenStretched) {
  const scene::SceneData data = SheetScene(21, 21, 0.002f);
  const SceneView scene = data.View();
  ParticleStore particles(scene);
  const TissueModel model(scene, &particles);
  const ElasticForce elastic(scene, &model, &particles);
  std::vector<Index> half;
  for (Index p = 0; p < particles.particle_count(); ++p) {
    EXPECT_LT(elastic.OnParticle(p).norm(), 1e-4f);
    if (p % 21 >= 10) {
      half.push_back(p);
    }
  }
  // One per cent along x: a strip carries E t * strain per width, here across 40 mm. The springs' Poisson ratio is 1/3
  // and the sides are held: E t / (1 - 1/9).
  constexpr float kStrain = 0.01f;
  for (Index p = 0; p < particles.particle_count(); ++p) {
    const Vec3f x = scene.rest_position[p];
    particles.Set(particles.Ref(p), Vec3f(x.x() * (1 + kStrain), x.y(), x.z()));
  }
  const Vec3f force = elastic.OnSet(half);
  const float expected = scene.physics.membrane_Et_N_per_m * kStrain * 0.040f / (1.0f - 1.0f / 9.0f);
  EXPECT_NEAR(force.x(), -expected, 0.25f * expected);  // A square grid with one diagonal is not isotropic.
  EXPECT_GT(elastic.StiffnessAround(half), 0.0f);
}

}  // namespace
}  // namespace fulcrum::physics
