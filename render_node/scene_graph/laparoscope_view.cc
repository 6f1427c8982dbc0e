#include "render_node/scene_graph/laparoscope_view.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <numbers>
#include <osg/BlendFunc>
#include <osg/ColorMask>
#include <osg/CullFace>
#include <osg/Depth>
#include <osg/Geode>

#include "render_node/geometry/atlas.h"
#include "render_node/geometry/fat_layer.h"
#include "render_node/geometry/membrane_mesh.h"
#include "render_node/geometry/surface.h"
#include "render_node/geometry/tissue_pattern.h"
#include "render_node/scene_graph/atlas_texture.h"
#include "render_node/scene_graph/instruments.h"
#include "render_node/scene_graph/mesh.h"
#include "render_node/scene_graph/program.h"
#include "render_node/scene_graph/smoke.h"
#include "services/core/breathing.h"

namespace fulcrum::render {
namespace {

using Float4 = std::array<float, 4>;

// Near to far among the opaque ones, so that hidden fragments are not shaded; then the layers that let light through,
// from the inside out.
enum Order { kMask, kInstruments, kRectum, kSurroundings, kFat, kMembraneDepth, kMembrane, kSmoke, kOverlay };

// Texture units; the samplers of all programs are bound once at the root.
enum Unit { kAtlasUnit, kNoiseUnit, kVesselUnit, kStructureUnit };

constexpr int kNoiseTexels = 256;
constexpr int kVesselTexels = 512;
constexpr std::uint32_t kFatStride = 2;
// Layers of tissue that press on each other overlap by a millimetre in the simulation: the inner one gives way.
constexpr float kFatBehind = 0.0015f;     // [m]
constexpr float kRectumBehind = 0.0025f;  // [m]

void DrawIn(Order order, osg::StateSet* state) { state->setRenderBinDetails(order, "RenderBin"); }

void Blend(osg::StateSet* state) {
  state->setMode(GL_BLEND, osg::StateAttribute::ON);
  state->setAttributeAndModes(new osg::BlendFunc(osg::BlendFunc::SRC_ALPHA, osg::BlendFunc::ONE_MINUS_SRC_ALPHA));
}

Float4 SurroundingColour(SurfaceRole role) {
  switch (role) {  // Linear colour; the last is how much fat shows.
    case SurfaceRole::kAbdominalWall:
      return {0.66f, 0.20f, 0.15f, 0.25f};
    case SurfaceRole::kRetroperitoneum:
      return {0.62f, 0.15f, 0.11f, 0.55f};
    case SurfaceRole::kPelvis:
      return {0.50f, 0.09f, 0.07f, 0.3f};
    case SurfaceRole::kBladder:
      return {0.70f, 0.33f, 0.25f, 0.1f};
    case SurfaceRole::kOther:
      break;
  }
  return {0.5f, 0.2f, 0.16f, 0.3f};
}

/// A sphere of tissue round everything, seen from inside: where the scene's surfaces end the picture does not.
void AppendCavity(const SceneView& scene, std::vector<Vec3f>* positions, std::vector<Vec3f>* normals,
                  std::vector<Triangle>* triangles) {
  constexpr Index kMeridians = 48, kParallels = 24;
  const Vec3f centre = scene.render.scope_target_W;
  float radius = (scene.render.scope_tip_W - centre).norm();
  for (const auto& points : {scene.rest_position, scene.static_vertices}) {
    for (const Vec3f& p : points) {
      radius = std::max(radius, (p - centre).norm());
    }
  }
  radius += scene.breathing.amplitude_m;
  radius *= 1.02f;  // Just outside, also between the corners of its facets.
  const auto first = static_cast<Index>(positions->size());
  for (Index i = 0; i <= kParallels; ++i) {
    const float polar = std::numbers::pi_v<float> * static_cast<float>(i) / kParallels;
    for (Index k = 0; k <= kMeridians; ++k) {
      const float turn = 2 * std::numbers::pi_v<float> * static_cast<float>(k) / kMeridians;
      const Vec3f outward(std::sin(polar) * std::cos(turn), std::sin(polar) * std::sin(turn), std::cos(polar));
      positions->push_back(centre + radius * outward);
      normals->push_back(-outward);
    }
  }
  for (Index i = 0; i < kParallels; ++i) {
    for (Index k = 0; k < kMeridians; ++k) {
      const Index a = first + i * (kMeridians + 1) + k, b = a + kMeridians + 1;
      triangles->push_back({a, b + 1, b});
      triangles->push_back({a, a + 1, b + 1});
    }
  }
}

}  // namespace

struct LaparoscopeView::Impl {
  explicit Impl(const SceneView& view);
  void AddMask();
  void AddSurroundings();
  void AddSurfaces(const char* name, bool breathing);
  void AddRectum();
  void AddSheets();
  void BindTextures();
  void UpdateRectum();
  void UpdateMembrane();
  Mesh* Add(std::unique_ptr<Mesh>* mesh, const char* name, bool dynamic, Order order, const char* fragment);

  SceneView scene;
  Laparoscope scope;
  Atlas atlas;
  MembraneMesh membrane;
  FatLayer fat;
  std::vector<float> xyz;
  std::vector<Vec3f> rectum_positions, rectum_normals;
  std::vector<Float4> membrane_coordinates;
  Vec3f breath = Vec3f::Zero();
  osg::ref_ptr<osg::Uniform> breath_shift = new osg::Uniform("shift", osg::Vec3(0, 0, 0));
  bool tissue_changed = true;
  bool topology_changed = true;

  osg::ref_ptr<osg::Group> root = new osg::Group;
  osg::ref_ptr<osg::Geode> geode = new osg::Geode;
  AtlasTexture atlas_texture;
  Instruments instruments;
  Smoke smoke;
  Overlay overlay;
  std::unique_ptr<Mesh> rectum_mesh, fat_mesh, membrane_mesh;
};

LaparoscopeView::Impl::Impl(const SceneView& view)
    : scene(view),
      scope(MakeLaparoscope(view.render)),
      atlas(view),
      membrane(view),
      fat(view, kFatStride),
      atlas_texture(atlas),
      instruments(view),
      overlay(static_cast<int>(view.render.width), static_cast<int>(view.render.height)) {
  xyz.resize(3 * view.rest_position.size());
  for (std::size_t i = 0; i < view.rest_position.size(); ++i) {
    Eigen::Map<Vec3f>(xyz.data() + 3 * i) = view.rest_position[i];
  }
  root->addChild(geode);
  root->addChild(instruments.node());
  DrawIn(kInstruments, instruments.node()->getOrCreateStateSet());
  AddMask();
  AddRectum();
  AddSurroundings();
  AddSheets();
  Blend(smoke.state());
  smoke.state()->setAttributeAndModes(new osg::Depth(osg::Depth::LESS, 0, 1, false));
  DrawIn(kSmoke, smoke.state());
  geode->addDrawable(smoke.geometry());
  Blend(overlay.state());
  DrawIn(kOverlay, overlay.state());
  geode->addDrawable(overlay.geometry());
  BindTextures();
}

Mesh* LaparoscopeView::Impl::Add(std::unique_ptr<Mesh>* mesh, const char* name, bool dynamic, Order order,
                                 const char* fragment) {
  *mesh = std::make_unique<Mesh>(name, dynamic);
  (*mesh)->state()->setAttributeAndModes(MakeProgram("surface.vert", fragment));
  DrawIn(order, (*mesh)->state());
  geode->addDrawable((*mesh)->geometry());
  return mesh->get();
}

void LaparoscopeView::Impl::AddMask() {
  Mesh mask("mask", false);
  mask.state()->setAttributeAndModes(MakeProgram("mask.vert", "mask.frag"));
  DrawIn(kMask, mask.state());
  constexpr Index kSides = 128;
  std::vector<Vec3f> positions;
  std::vector<Triangle> triangles;
  for (Index k = 0; k < kSides; ++k) {
    const float angle = 2 * std::numbers::pi_v<float> * static_cast<float>(k) / kSides;
    for (const float radius : {scope.circle_radius, 4 * scope.picture_centre.maxCoeff()}) {
      positions.emplace_back(radius * std::cos(angle) / scope.picture_centre.x(),
                             radius * std::sin(angle) / scope.picture_centre.y(), 0.0f);
    }
    const Index a = 2 * k, b = 2 * ((k + 1) % kSides);
    triangles.push_back({a, a + 1, b + 1});
    triangles.push_back({a, b + 1, b});
  }
  mask.SetPositions(positions);
  mask.SetTriangles(triangles);
  geode->addDrawable(mask.geometry());
}

void LaparoscopeView::Impl::AddSurroundings() {
  AddSurfaces("surroundings", false);
  if (scene.breathing.amplitude_m > 0) {
    AddSurfaces("breathing", true);
  }
}

/// Those of the fixed surfaces that breathe, or the others and the cavity around everything.
void LaparoscopeView::Impl::AddSurfaces(const char* name, bool breathing) {
  std::vector<Vec3f> positions, normals;
  std::vector<Float4> colours, coordinates;
  std::vector<Triangle> triangles;
  for (const StaticSurface& surface : scene.static_surfaces) {
    if ((scene.breathing.amplitude_m > 0 && Breathes(surface.role)) != breathing) {
      continue;
    }
    const auto first = static_cast<Index>(positions.size());
    for (Index k = 0; k < surface.vertex_count; ++k) {
      const Vec3f& p = scene.static_vertices[surface.first_vertex + k];
      positions.push_back(p);
      coordinates.push_back({p.x(), p.y(), p.z(), 0});
      colours.push_back(SurroundingColour(surface.role));
    }
    for (Index k = 0; k < surface.triangle_count; ++k) {
      Triangle t = scene.static_triangles[surface.first_triangle + k];
      for (Index& corner : t) {
        corner = corner - surface.first_vertex + first;
      }
      triangles.push_back(t);
    }
  }
  normals.resize(positions.size());
  ComputeNormals(positions, triangles, normals);
  if (!breathing) {
    AppendCavity(scene, &positions, &normals, &triangles);
  }
  for (std::size_t k = coordinates.size(); k < positions.size(); ++k) {
    coordinates.push_back({positions[k].x(), positions[k].y(), positions[k].z(), 1});
    colours.push_back({0.60f, 0.11f, 0.085f, 0.4f});
  }
  std::unique_ptr<Mesh> mesh;
  Add(&mesh, name, false, kSurroundings, "surroundings.frag");
  if (breathing) {
    mesh->state()->addUniform(breath_shift);
  }
  // Seen from behind a wall is not there: the scope may look in through it.
  mesh->state()->setAttributeAndModes(new osg::CullFace(osg::CullFace::BACK));
  mesh->SetPositions(positions);
  mesh->SetNormals(normals);
  mesh->SetColours(colours);
  mesh->SetCoordinates(coordinates);
  mesh->SetTriangles(triangles);
}

void LaparoscopeView::Impl::AddRectum() {
  const std::size_t count = scene.surface_vertices.size();
  rectum_positions.resize(count);
  rectum_normals.resize(count);
  UpdateRectum();
  // The pattern sticks to the tissue: coordinates at rest along the organ's three principal directions.
  Vec3f mean = Vec3f::Zero();
  for (const Vec3f& p : rectum_positions) {
    mean += p / static_cast<float>(count);
  }
  Mat3f spread = Mat3f::Zero();
  for (const Vec3f& p : rectum_positions) {
    spread += (p - mean) * (p - mean).transpose();
  }
  const Mat3f axes = Eigen::SelfAdjointEigenSolver<Mat3f>(spread).eigenvectors();  // Ascending: the long axis is last.
  std::vector<Float4> coordinates(count);
  for (std::size_t k = 0; k < count; ++k) {
    const Vec3f place = axes.transpose() * (rectum_positions[k] - mean);
    const Vec3f facing = axes.transpose() * rectum_normals[k];
    const float front = facing[0] * facing[0], side = facing[1] * facing[1];
    coordinates[k] = {place[2], place[1], place[0], front + side > 0 ? front / (front + side) : 0.5f};
  }
  Add(&rectum_mesh, "rectum", true, kRectum, "rectum.frag");
  rectum_mesh->state()->setAttributeAndModes(new osg::CullFace(osg::CullFace::BACK));
  rectum_mesh->state()->addUniform(new osg::Uniform("behind", kRectumBehind));
  rectum_mesh->SetCoordinates(coordinates);
  rectum_mesh->SetTriangles(scene.surface_triangles);
}

void LaparoscopeView::Impl::AddSheets() {
  Add(&fat_mesh, "fat", true, kFat, "fat.frag");
  Blend(fat_mesh->state());
  fat_mesh->state()->addUniform(new osg::Uniform("behind", kFatBehind));
  std::vector<Float4> coordinates;
  for (std::size_t k = 0; k < fat.materials().size(); ++k) {
    const Vec2f& m = fat.materials()[k];
    coordinates.push_back({m.x(), m.y(), fat.thickness()[k], 0});
  }
  fat_mesh->SetCoordinates(coordinates);
  fat_mesh->SetTriangles(fat.triangles());

  Add(&membrane_mesh, "membrane", true, kMembrane, "membrane.frag");
  Blend(membrane_mesh->state());
  membrane_mesh->state()->setAttributeAndModes(new osg::Depth(osg::Depth::EQUAL, 0, 1, false));
  // The same mesh once more, before: depth only.
  osg::ref_ptr<osg::Geode> depth_pass = new osg::Geode;
  depth_pass->addDrawable(membrane_mesh->geometry());
  osg::StateSet* state = depth_pass->getOrCreateStateSet();
  const auto override_on = osg::StateAttribute::ON | osg::StateAttribute::OVERRIDE;
  state->setAttributeAndModes(MakeProgram("surface.vert", "membrane_depth.frag"), override_on);
  state->setAttributeAndModes(new osg::ColorMask(false, false, false, false), override_on);
  state->setAttributeAndModes(new osg::Depth(osg::Depth::LESS, 0, 1, true), override_on);
  state->setMode(GL_BLEND, osg::StateAttribute::OFF | osg::StateAttribute::OVERRIDE);
  state->setRenderBinDetails(kMembraneDepth, "RenderBin", osg::StateSet::OVERRIDE_RENDERBIN_DETAILS);
  root->addChild(depth_pass);
}

void LaparoscopeView::Impl::BindTextures() {
  osg::StateSet* state = root->getOrCreateStateSet();
  const Vec2f size(static_cast<float>(atlas.width()) * atlas.texel_m(),
                   static_cast<float>(atlas.height()) * atlas.texel_m());
  const StructureMap map = MakeStructureMap(scene, size.x(), size.y());
  const auto bind = [state](Unit unit, const char* name, osg::Texture2D* texture) {
    state->setTextureAttribute(static_cast<unsigned>(unit), texture);
    state->addUniform(new osg::Uniform(name, static_cast<int>(unit)));
  };
  bind(kAtlasUnit, "atlas", atlas_texture.texture());
  bind(kNoiseUnit, "noise_pattern", MakeTexture(kNoiseTexels, kNoiseTexels, 4, MakeNoisePattern(kNoiseTexels), true));
  bind(kVesselUnit, "vessel_pattern",
       MakeTexture(kVesselTexels, kVesselTexels, 1, MakeVesselPattern(kVesselTexels), true));
  bind(kStructureUnit, "structures", MakeTexture(map.width, map.height, 2, map.texels, false));
  const auto vec3 = [](const Vec3f& v) { return osg::Vec3(v.x(), v.y(), v.z()); };
  state->addUniform(new osg::Uniform("behind", 0.0f));
  state->addUniform(new osg::Uniform("shift", osg::Vec3(0, 0, 0)));
  state->addUniform(new osg::Uniform("atlas_per_metre", osg::Vec2(1 / size.x(), 1 / size.y())));
  state->addUniform(new osg::Uniform("light_position", vec3(scope.light_position)));
  state->addUniform(new osg::Uniform("light_axis", vec3(scope.light_axis)));
  state->addUniform(new osg::Uniform("wall_direction", vec3(scope.wall_direction)));
  state->addUniform(new osg::Uniform("light_power", scope.light_power));
  state->addUniform(new osg::Uniform("circle_radius", scope.circle_radius));
  state->addUniform(new osg::Uniform("picture_centre", osg::Vec2(scope.picture_centre.x(), scope.picture_centre.y())));
  state->setMode(GL_LIGHTING, osg::StateAttribute::OFF);
}

void LaparoscopeView::Impl::UpdateRectum() {
  MapEmbedded(scene.tets, scene.surface_vertices, xyz, rectum_positions);
  ComputeNormals(rectum_positions, scene.surface_triangles, rectum_normals);
}

void LaparoscopeView::Impl::UpdateMembrane() {
  membrane.Update(xyz);
  membrane_mesh->SetPositions(membrane.positions());
  membrane_mesh->SetNormals(membrane.normals());
  if (topology_changed) {
    membrane_coordinates.resize(membrane.positions().size());
    for (std::size_t k = 0; k < membrane_coordinates.size(); ++k) {
      membrane_coordinates[k] = {membrane.materials()[k].x(), membrane.materials()[k].y(), membrane.sides()[k], 0};
    }
    membrane_mesh->SetCoordinates(membrane_coordinates);
    membrane_mesh->SetTriangles(membrane.triangles());
  }
}

LaparoscopeView::LaparoscopeView(const SceneView& scene) : impl_(std::make_unique<Impl>(scene)) { Update(); }
LaparoscopeView::~LaparoscopeView() = default;

void LaparoscopeView::SetTissue(std::span<const float> xyz) {
  std::copy(xyz.begin(), xyz.end(), impl_->xyz.begin());
  impl_->tissue_changed = true;
}

bool LaparoscopeView::SetBreath(double simulated_time_s) {
  const Vec3f breath = BreathingOffset(impl_->scene.breathing, simulated_time_s);
  if (breath == impl_->breath) {
    return false;
  }
  impl_->breath = breath;
  impl_->breath_shift->set(osg::Vec3(breath.x(), breath.y(), breath.z()));
  return true;
}

bool LaparoscopeView::SetTopology(const TopologyState& topology) {
  if (!impl_->membrane.SetTopology(topology)) {
    return false;
  }
  impl_->atlas_texture.Update(impl_->atlas.PaintCuts(impl_->scene, topology));
  impl_->topology_changed = true;
  return true;
}

bool LaparoscopeView::ApplyPatch(const TemperaturePatch& patch) {
  const AtlasRect rect = impl_->atlas.Apply(patch);
  impl_->atlas_texture.Update(rect);
  return !rect.empty();
}

void LaparoscopeView::SetTool(int tool, const ToolSample& sample) { impl_->instruments.SetPose(tool, sample); }
void LaparoscopeView::SetJaw(int tool, float angle_rad) { impl_->instruments.SetJaw(tool, angle_rad); }

void LaparoscopeView::Update() {
  Impl& impl = *impl_;
  if (impl.tissue_changed || impl.topology_changed) {
    impl.UpdateMembrane();
    impl.fat.Update(impl.xyz, impl.membrane);
    impl.fat_mesh->SetPositions(impl.fat.positions());
    impl.fat_mesh->SetNormals(impl.fat.normals());
  }
  if (impl.tissue_changed) {
    impl.UpdateRectum();
    impl.rectum_mesh->SetPositions(impl.rectum_positions);
    impl.rectum_mesh->SetNormals(impl.rectum_normals);
  }
  impl.tissue_changed = impl.topology_changed = false;
}

void LaparoscopeView::SetTexts(std::span<const OverlayText> texts) { impl_->overlay.Set(texts); }

void LaparoscopeView::AddSmoke(const Vec2f& material, double session_time_s) {
  impl_->smoke.Add(OnMembrane(material), session_time_s);
}

bool LaparoscopeView::UpdateSmoke(double session_time_s) { return impl_->smoke.Update(session_time_s); }

osg::Group* LaparoscopeView::root() const { return impl_->root; }
const Laparoscope& LaparoscopeView::laparoscope() const { return impl_->scope; }

Vec3f LaparoscopeView::OnMembrane(const Vec2f& material) const {
  const auto materials = impl_->scene.membrane_material;
  std::size_t best = 0;
  for (std::size_t k = 1; k < materials.size(); ++k) {
    if ((materials[k] - material).squaredNorm() < (materials[best] - material).squaredNorm()) {
      best = k;
    }
  }
  return materials.empty() ? Vec3f::Zero() : impl_->membrane.positions()[best];
}

}  // namespace fulcrum::render
