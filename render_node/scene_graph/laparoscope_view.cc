#include "render_node/scene_graph/laparoscope_view.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <osg/BlendFunc>
#include <osg/Depth>
#include <osg/Geode>
#include <vector>

#include "render_node/geometry/atlas.h"
#include "render_node/geometry/bleeding.h"
#include "render_node/geometry/paper_colour.h"
#include "render_node/geometry/texel.h"
#include "render_node/geometry/tissue_pattern.h"
#include "render_node/geometry/tool_shadow.h"
#include "render_node/scene_graph/atlas_texture.h"
#include "render_node/scene_graph/clips.h"
#include "render_node/scene_graph/instruments.h"
#include "render_node/scene_graph/optics.h"
#include "render_node/scene_graph/order.h"
#include "render_node/scene_graph/program.h"
#include "render_node/scene_graph/smoke.h"
#include "render_node/scene_graph/surroundings.h"
#include "render_node/scene_graph/tissue_layers.h"
#include "services/base/core/breathing.h"

namespace fulcrum::render {
namespace {

constexpr int kNoiseTexels = 256;
constexpr int kSerosaTexels = 512;
constexpr float kSerosaPerMetre = 16;  // As in membrane.frag.
// Of the camera: with these the mean colour of pictures lies among those of published laparoscopic frames
// (deploy/docs/measurements/picture/look.md). The albedos of the shaders were chosen by eye, and lacked blue.
constexpr float kExposure = 0.86f;
const Vec3f kTissueTint(0.96f, 0.92f, 1.14f);
constexpr float kFatCover = 0.48f;  // fat.frag begins at 0.51.

/// The numbers of the paper's eq. 15 for membrane.frag.
void AddPrintedColour(float ambient_C, osg::StateSet* state) {
  PaperColour colour;
  colour.ambient_C = ambient_C;
  const auto vec4 = [](const Eigen::Vector4f& v) { return osg::Vec4(v.x(), v.y(), v.z(), v.w()); };
  state->addUniform(new osg::Uniform(
      "printed_limits", osg::Vec4(colour.ambient_C, colour.vaporisation_C, colour.vaporisation, colour.brown)));
  const osg::ref_ptr<osg::Uniform> colours = new osg::Uniform(osg::Uniform::FLOAT_VEC4, "printed_colours", 3);
  colours->setElement(0, vec4(colour.c1));
  colours->setElement(1, vec4(colour.c2));
  colours->setElement(2, vec4(colour.c3));
  state->addUniform(colours);
}

}  // namespace

void Blend(osg::StateSet* state) {
  state->setMode(GL_BLEND, osg::StateAttribute::ON);
  state->setAttributeAndModes(new osg::BlendFunc(osg::BlendFunc::SRC_ALPHA, osg::BlendFunc::ONE_MINUS_SRC_ALPHA));
}

struct LaparoscopeView::Impl {
  Impl(const SceneView& view, const Look& given);
  void BindTextures();
  void ShowFat();
  void CastShadows();
  void FollowClips();
  void PlaceEyes();
  void ShineFrom(const Laparoscope& from);
  [[nodiscard]] std::vector<WorkingTube> Tubes() const;

  SceneView scene;
  const Look look;
  Laparoscope scope;  // With stereo in the middle of the eyes.
  std::vector<Laparoscope> eyes;
  Atlas atlas;
  AtlasTexture atlas_texture, film_texture;
  TissueLayers layers;
  Surroundings surroundings;
  Instruments instruments;
  Clips clips;
  ToolShadow shadow;
  Mesh shadow_mesh{"shadow", true};
  std::array<ToolSample, kMaxTools> tools{};
  bool tools_moved = true;
  bool smooths_edges = false;
  std::array<TubeFlow, kMaxTools> flows{};
  Smoke smoke;
  float haze = 0;        // As drawn.
  double effects_s = 0;  // Session time of the last UpdateEffects.
  std::vector<std::uint8_t> serosa = MakeSerosaPattern(kSerosaTexels, look.patterns);
  Bleeding bleeding;
  Overlay overlay;
  osg::ref_ptr<osg::Group> scene_root = new osg::Group;
  Optics optics;
  osg::ref_ptr<osg::Group> root = new osg::Group;
  std::vector<std::uint8_t> noise;
  StructureMap structures;
  Vec2f size = Vec2f::Ones();  // Of the atlas [m].
  // Value of Atlas::touches() at the last choice of the fat's triangles.
  std::uint64_t fat_touches = ~std::uint64_t{0};
  osg::ref_ptr<osg::Uniform> wall_direction = new osg::Uniform("wall_direction", osg::Vec3());
  osg::ref_ptr<osg::Uniform> light_power = new osg::Uniform("light_power", 1.0f);
  Vec3f breath = Vec3f::Zero();
};

LaparoscopeView::Impl::Impl(const SceneView& view, const Look& given)
    : scene(view),
      look(given),
      scope(MakeLaparoscope(view.render)),
      eyes(MakeEyes(view.render, view.stereo)),
      atlas(view),
      atlas_texture(atlas),
      film_texture(atlas.film_width(), atlas.film_height(), atlas.film(), Atlas::kFilmBytes),
      layers(view, eyes),
      surroundings(view, scope, look),
      instruments(view),
      clips(view),
      shadow(view),
      bleeding(view, serosa, kSerosaTexels, kSerosaPerMetre, layers.rim()),
      overlay(view.stereo.layout, static_cast<int>(view.render.width), static_cast<int>(view.render.height)),
      optics(view.stereo.layout, eyes, static_cast<int>(view.render.width), static_cast<int>(view.render.height),
             surroundings.fixed(), scene_root) {
  instruments.node()->addChild(clips.node());
  DrawIn(Order::kInstruments, instruments.node()->getOrCreateStateSet());
  shadow_mesh.state()->setAttributeAndModes(MakeProgram("shadow.vert", "shadow.frag"));
  DrawIn(Order::kShadow, shadow_mesh.state());
  DrawIn(Order::kSmoke, smoke.state());
  for (osg::StateSet* state : {shadow_mesh.state(), smoke.state()}) {
    Blend(state);
    state->setAttributeAndModes(new osg::Depth(osg::Depth::LESS, 0, 1, false));
  }
  const osg::ref_ptr<osg::Geode> effects = new osg::Geode;
  effects->addDrawable(shadow_mesh.geometry());
  effects->addDrawable(smoke.geometry());
  for (osg::Node* node :
       std::initializer_list<osg::Node*>{surroundings.breathing(), layers.node(), instruments.node(), effects.get()}) {
    scene_root->addChild(node);
  }
  BindTextures();

  Blend(overlay.state());
  overlay.state()->setRenderBinDetails(2, "RenderBin");
  const osg::ref_ptr<osg::Geode> text = new osg::Geode;
  text->addDrawable(overlay.geometry());
  root->addChild(optics.node());
  root->addChild(text);
}

void LaparoscopeView::Impl::BindTextures() {
  osg::StateSet* state = optics.node()->getOrCreateStateSet();
  size =
      Vec2f(static_cast<float>(atlas.width()) * atlas.texel_m(), static_cast<float>(atlas.height()) * atlas.texel_m());
  const StructureMap map = MakeStructureMap(scene, size.x(), size.y());
  const auto bind = [state](TextureUnit unit, const char* name, osg::Texture2D* texture) {
    state->setTextureAttribute(static_cast<unsigned>(unit), texture);
    state->addUniform(new osg::Uniform(name, static_cast<int>(unit)));
  };
  bind(kAtlasUnit, "atlas", atlas_texture.texture());
  bind(kFilmUnit, "film_map", film_texture.texture());
  bind(kFatUnit, "fat_pattern",
       MakeTexture(kNoiseTexels, kNoiseTexels, 4, MakeFatPattern(kNoiseTexels, look.patterns), true));
  noise = MakeNoisePattern(kNoiseTexels, look.patterns);
  structures = map;
  bind(kNoiseUnit, "noise_pattern", MakeTexture(kNoiseTexels, kNoiseTexels, 4, noise, true));
  bind(kSerosaUnit, "serosa_pattern", MakeTexture(kSerosaTexels, kSerosaTexels, 4, serosa, true));
  bind(kStructureUnit, "structures", MakeTexture(map.width, map.height, 2, map.texels, false));
  const auto vec3 = [](const Vec3f& v) { return osg::Vec3(v.x(), v.y(), v.z()); };
  state->addUniform(new osg::Uniform("behind", 0.0f));
  state->addUniform(new osg::Uniform("shift", osg::Vec3(0, 0, 0)));
  state->addUniform(new osg::Uniform("atlas_per_metre", osg::Vec2(1 / size.x(), 1 / size.y())));
  const float film_texel = 2 * atlas.texel_m();
  state->addUniform(
      new osg::Uniform("film_per_metre", osg::Vec2(1 / (film_texel * static_cast<float>(atlas.film_width())),
                                                   1 / (film_texel * static_cast<float>(atlas.film_height())))));
  state->addUniform(new osg::Uniform("light_axis", vec3(scope.light_axis)));
  const Vec3f light = kExposure * look.light;
  optics.SetLight(light);
  state->addUniform(new osg::Uniform("light_colour", vec3(light)));
  state->addUniform(new osg::Uniform("tissue_tint", vec3(look.tissue.cwiseProduct(kTissueTint))));
  state->addUniform(wall_direction);
  state->addUniform(light_power);
  // Patches of the paper's model carry no damage.
  const bool by_temperature = scene.thermal.model == ThermalModel::kPaper;
  const bool printed = by_temperature && scene.thermal.as == PaperForm::kPrinted;
  state->addUniform(new osg::Uniform("colour_by_temperature", by_temperature && !printed ? 1.0f : 0.0f));
  if (printed) AddPrintedColour(scene.thermal.body_temperature_C, state);
  ShineFrom(scope);
  state->setMode(GL_LIGHTING, osg::StateAttribute::OFF);
}

void LaparoscopeView::Impl::ShineFrom(const Laparoscope& from) {
  wall_direction->set(osg::Vec3(from.wall_direction.x(), from.wall_direction.y(), from.wall_direction.z()));
  light_power->set(from.light_power);
}

void LaparoscopeView::Impl::PlaceEyes() {
  scope = MakeLaparoscope(scene.render);
  eyes = MakeEyes(scene.render, scene.stereo);
  layers.SetEyes(eyes);
}

// Chooses the visible triangles of the fat: those that meet the condition of fat.frag with a margin.
void LaparoscopeView::Impl::ShowFat() {
  if (fat_touches == atlas.touches()) {
    return;
  }
  fat_touches = atlas.touches();
  const auto wrapped = [](float value) {
    return static_cast<int>(std::floor(value * kNoiseTexels)) & (kNoiseTexels - 1);
  };
  const auto visible = [&](const Vec2f& m, float thickness) {
    const std::size_t texel = TexelIndex(wrapped(9 * m.x()), wrapped(9 * m.y()), kNoiseTexels);
    const float cover = 0.8f * static_cast<float>(noise[4 * texel]) / 255 + 0.45f * thickness;
    const Vec2f place = m.cwiseProduct(Vec2f(1 / size.x(), 1 / size.y()));
    const int x = std::min(structures.width - 1, static_cast<int>(place.x() * static_cast<float>(structures.width)));
    const int y = std::min(structures.height - 1, static_cast<int>(place.y() * static_cast<float>(structures.height)));
    const std::uint8_t* structure = structures.texels.data() + 2 * TexelIndex(x, y, structures.width);
    return cover > kFatCover || structure[0] > 0 || structure[1] > 0;
  };
  layers.ShowFat(visible, [&](const Vec2f& m) { return atlas.Touched(m); });
}

void LaparoscopeView::Impl::CastShadows() {
  tools_moved = false;
  shadow.Update(scope, layers.particles(), tools);
  shadow_mesh.SetPositions(shadow.positions());
  shadow_mesh.SetCoordinates(shadow.coordinates());
  shadow_mesh.SetTriangles(shadow.triangles());
}

void LaparoscopeView::Impl::FollowClips() {
  if (clips.Follow(layers.particles(), layers.seen())) layers.Gather(clips.footprints());
}

LaparoscopeView::LaparoscopeView(const SceneView& scene, const Look& look)
    : impl_(std::make_unique<Impl>(scene, look)) {
  Update();
}
LaparoscopeView::~LaparoscopeView() = default;

void LaparoscopeView::SetTissue(std::span<const float> xyz) { impl_->layers.SetTissue(xyz); }

bool LaparoscopeView::SetBreath(double simulated_time_s) {
  const Vec3f breath = BreathingOffset(impl_->scene.breathing, simulated_time_s);
  if (breath == impl_->breath) {
    return false;
  }
  impl_->breath = breath;
  impl_->surroundings.SetShift(breath);
  impl_->optics.SceneChanged();
  return true;
}

bool LaparoscopeView::SetTopology(const TopologyState& topology) {
  if (!impl_->layers.SetTopology(topology)) {
    return false;
  }
  impl_->atlas_texture.Update(impl_->atlas.PaintCuts(impl_->scene, topology));
  impl_->film_texture.Update(impl_->atlas.TakeFilmChange());
  return true;
}

bool LaparoscopeView::ApplyPatch(const TemperaturePatch& patch) {
  if (patch.header.surface == BurntSurface::kSolids) {
    if (!impl_->layers.Burn(patch)) return false;
  } else {
    const AtlasRect rect = impl_->atlas.Apply(patch);
    if (rect.empty()) return false;
    impl_->atlas_texture.Update(rect);
    impl_->film_texture.Update(impl_->atlas.TakeFilmChange());
  }
  impl_->optics.SceneChanged();
  return true;
}

void LaparoscopeView::SetTool(int tool, const ToolSample& sample) {
  impl_->instruments.SetPose(tool, sample);
  impl_->tools[static_cast<std::size_t>(tool)] = sample;
  impl_->tools_moved = true;
  impl_->optics.EdgesChanged();
}

void LaparoscopeView::SetJaw(int tool, float angle_rad) {
  impl_->instruments.SetJaw(tool, angle_rad);
  impl_->optics.EdgesChanged();
}

void LaparoscopeView::SetClips(std::span<const Clip> clips) {
  impl_->clips.Set(clips);
  impl_->FollowClips();
  impl_->bleeding.SetClips(clips);
  impl_->optics.EdgesChanged();
}

void LaparoscopeView::SetFlow(int tool, TubeFlow flow, double session_time_s) {
  TubeFlow& now = impl_->flows[static_cast<std::size_t>(tool)];
  if (now == flow) return;
  (void)UpdateEffects(session_time_s);  // With what the tubes have done so far.
  now = flow;
}

bool LaparoscopeView::TubesWork() const {
  return std::any_of(impl_->flows.begin(), impl_->flows.end(), [](TubeFlow flow) { return flow != TubeFlow::kNone; });
}

void LaparoscopeView::SetSize(int width, int height) {
  RenderParams& render = impl_->scene.render;
  render.width = static_cast<std::uint32_t>(width);
  render.height = static_cast<std::uint32_t>(height);
  impl_->PlaceEyes();
  impl_->optics.SetSize(impl_->eyes, width, height);
  impl_->overlay.SetSize(width, height);
}

void LaparoscopeView::SetCamera(const RenderParams& params) {
  RenderParams& render = impl_->scene.render;
  render.scope_tip_W = params.scope_tip_W;
  render.scope_target_W = params.scope_target_W;
  render.roll_deg = params.roll_deg;
  render.fov_deg = params.fov_deg;
  impl_->PlaceEyes();
  impl_->optics.SetEyes(impl_->eyes);
  impl_->ShineFrom(impl_->scope);
}

void LaparoscopeView::SetDetail(float factor) { impl_->layers.SetDetail(factor); }

void LaparoscopeView::SetSoil(float soil) { impl_->optics.SetSoil(soil); }

void LaparoscopeView::SetScale(float scale) {
  impl_->optics.SetScale(scale);
  impl_->layers.SetScale(scale);
}

void LaparoscopeView::SetMostScale(float most) { impl_->optics.SetMostScale(most); }

void LaparoscopeView::SetSmoothed(bool on) { impl_->optics.SetSmoothed(on); }

void LaparoscopeView::SetSmoothEdges(bool on) {
  if (on == impl_->smooths_edges) return;
  impl_->smooths_edges = on;
  if (!on) return impl_->optics.SetEdges({});
  impl_->optics.SetEdges([impl = impl_.get()](const Laparoscope& eye, const Vec2f& size, std::vector<EdgeLine>* lines) {
    impl->instruments.AppendEdges(eye, size, lines);
    impl->clips.AppendEdges(eye, size, lines);
  });
}

bool LaparoscopeView::Refine() { return impl_->optics.Refine(); }

bool LaparoscopeView::DrawsBackgroundAtRest() const { return impl_->optics.DrawsBackgroundAtRest(); }

void LaparoscopeView::Update() {
  impl_->ShowFat();
  impl_->FollowClips();
  if (impl_->layers.Update(impl_->atlas)) {
    impl_->optics.SceneChanged();
    impl_->tools_moved = true;
    if (!impl_->clips.empty()) impl_->optics.EdgesChanged();
  }
  if (impl_->tools_moved) {
    impl_->CastShadows();
  }
  impl_->optics.UpdateEdges();
}

void LaparoscopeView::SetTexts(std::span<const OverlayText> texts) { impl_->overlay.Set(texts); }

void LaparoscopeView::AddSmoke(const Vec2f& material, double session_time_s) {
  AddSmokeAt(OnMembrane(material), session_time_s);
}

void LaparoscopeView::AddSmokeAt(const Vec3f& p_W, double session_time_s) { impl_->smoke.Add(p_W, session_time_s); }

void LaparoscopeView::RehearseBurn(bool on) {
  impl_->layers.RehearseBurn(on);
  impl_->optics.SceneChanged();
}

void LaparoscopeView::OpenVessels(const Vec2f& material, double session_time_s) {
  impl_->bleeding.Cut(material, impl_->atlas, session_time_s);
}

std::vector<WorkingTube> LaparoscopeView::Impl::Tubes() const {
  std::vector<WorkingTube> working;
  for (std::size_t k = 0; k < flows.size(); ++k) {
    const ToolSample& tool = tools[k];
    if (flows[k] == TubeFlow::kNone || tool.kind != ToolKind::kSuction) continue;
    working.push_back({flows[k], tool.p_WT, tool.q_WT.normalized() * Vec3f::UnitZ(), scene.tools[k].tip_radius_m});
  }
  return working;
}

bool LaparoscopeView::UpdateEffects(double session_time_s) {
  const std::vector<WorkingTube> tubes = impl_->Tubes();
  std::vector<Vec3f> sinks;
  for (const WorkingTube& tube : tubes) {
    if (tube.flow == TubeFlow::kAspirates) sinks.push_back(tube.tip_W);
  }
  impl_->smoke.SetSinks(sinks, impl_->effects_s);
  impl_->effects_s = session_time_s;
  const bool smoking = impl_->smoke.Update(session_time_s);
  impl_->haze = impl_->smoke.HazeAt(session_time_s);
  impl_->optics.SetHaze(impl_->haze);
  const bool bled = impl_->bleeding.Update(session_time_s, impl_->layers.membrane(), tubes, &impl_->atlas);
  impl_->film_texture.Update(impl_->atlas.TakeFilmChange());
  const bool supplied = impl_->bleeding.FindCutOff(impl_->atlas, session_time_s);
  if (supplied) impl_->layers.Pale(impl_->atlas, impl_->bleeding.cut_off());
  if (smoking || bled || supplied) impl_->optics.SceneChanged();
  return smoking || bled || impl_->bleeding.moves();
}

double LaparoscopeView::shed_m3() const { return impl_->bleeding.shed_m3(); }

bool LaparoscopeView::HasFaded(double session_time_s) const {
  return impl_->smoke.HazeAt(session_time_s) != impl_->haze || impl_->bleeding.AgesAt(session_time_s);
}

const Atlas& LaparoscopeView::atlas() const { return impl_->atlas; }
const BurnAtlas& LaparoscopeView::burn_atlas() const { return impl_->layers.burn_atlas(); }
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
  return materials.empty() ? Vec3f::Zero() : impl_->layers.membrane().positions()[best];
}

}  // namespace fulcrum::render
