#include "render_node/scene_graph/tissue_layers.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <osg/CullFace>
#include <osg/Depth>

#include "render_node/geometry/sheet_detail.h"
#include "render_node/geometry/surface.h"
#include "render_node/scene_graph/atlas_texture.h"
#include "render_node/scene_graph/program.h"
#include "render_node/scene_graph/surroundings.h"
#include "services/base/core/solid_charts.h"

namespace fulcrum::render {
namespace {

using Float4 = std::array<float, 4>;

constexpr std::uint32_t kFatStride = 2;
// Layers of tissue in contact overlap by up to a millimetre in the simulation; in the depth test the inner one counts
// as this much farther away.
constexpr float kFatBehind = 0.0015f;        // [m]
constexpr float kRectumBehind = 0.0025f;     // [m] kBurnBehind of burn_layer.cc is a little less.
constexpr std::size_t kMostLinePoints = 64;  // As in membrane.frag.
// [m] Margin of the box around a planned line outside which the shader skips the line.
constexpr float kInkReach = 0.001f;
// [m] From a clip within which tissue is drawn together, as kGather of membrane.frag.
constexpr float kGather_m = 0.009f;
constexpr float kFasciaDepth = 0.0006f;  // [m] Below the peritoneum: the least depth of the fat.

/// The place in the middle of the eyes.
Vec3f MiddleOf(std::span<const Laparoscope> eyes) { return 0.5f * (EyeOf(eyes.front()) + EyeOf(eyes.back())); }

float PixelsPerRad(const Laparoscope& scope) { return scope.projection(1, 1) * scope.picture_centre.y(); }

/// Linear colours between which the pattern of a solid varies, colour and share of the small vessels on it, patterns
/// per metre, wetness. By SolidLook; chosen by eye.
constexpr std::array<std::array<float, 12>, kSolidLooks> kLooks{{
    {0.52f, 0.070f, 0.060f, 0.72f, 0.20f, 0.15f, 0.26f, 0.008f, 0.014f, 0.5f, 20.0f, 0.8f},    // bowel
    {0.58f, 0.26f, 0.20f, 0.74f, 0.42f, 0.33f, 0.34f, 0.03f, 0.03f, 0.6f, 14.0f, 0.8f},        // bladder
    {0.15f, 0.022f, 0.014f, 0.23f, 0.045f, 0.026f, 0.11f, 0.012f, 0.01f, 0.15f, 26.0f, 0.9f},  // liver
    {0.16f, 0.23f, 0.13f, 0.34f, 0.38f, 0.20f, 0.24f, 0.05f, 0.03f, 0.5f, 16.0f, 0.9f},        // gallbladder
    {0.66f, 0.40f, 0.10f, 0.84f, 0.60f, 0.22f, 0.45f, 0.06f, 0.03f, 0.3f, 40.0f, 0.8f},        // fat
    {0.40f, 0.060f, 0.050f, 0.56f, 0.12f, 0.09f, 0.26f, 0.01f, 0.01f, 0.2f, 30.0f, 0.6f},      // muscle
    {0.55f, 0.10f, 0.08f, 0.70f, 0.24f, 0.18f, 0.40f, 0.02f, 0.02f, 0.3f, 30.0f, 0.8f},        // artery
    {0.22f, 0.08f, 0.14f, 0.34f, 0.14f, 0.20f, 0.16f, 0.03f, 0.08f, 0.3f, 30.0f, 0.8f},        // vein
    {0.66f, 0.46f, 0.34f, 0.80f, 0.62f, 0.48f, 0.46f, 0.06f, 0.05f, 0.4f, 30.0f, 0.8f},        // ureter
    {0.72f, 0.64f, 0.46f, 0.82f, 0.76f, 0.60f, 0.5f, 0.2f, 0.14f, 0.1f, 30.0f, 0.6f},          // nerve
}};

void SetLook(SolidLook look, osg::StateSet* state) {
  const auto& v = kLooks[static_cast<std::size_t>(look)];
  const auto colour = [&](std::size_t k) { return osg::Vec3(v[k], v[k + 1], v[k + 2]); };
  state->addUniform(new osg::Uniform("dark", colour(0)));
  state->addUniform(new osg::Uniform("light", colour(3)));
  state->addUniform(new osg::Uniform("vessel_colour", colour(6)));
  state->addUniform(new osg::Uniform("vessel_share", v[9]));
  state->addUniform(new osg::Uniform("pattern_scale", v[10]));
  state->addUniform(new osg::Uniform("wetness", v[11]));
}

}  // namespace

TissueLayers::TissueLayers(const SceneView& scene, std::span<const Laparoscope> eyes)
    : scene_(scene),
      field_(eyes),
      eye_W_(MiddleOf(eyes)),
      pixels_per_rad_(PixelsPerRad(eyes.front())),
      membrane_(scene),
      detail_(scene.membrane),
      fat_(scene, kFatStride),
      rim_(SheetRim(scene)),
      burn_(scene),
      cut_(scene) {
  xyz_.resize(3 * scene.rest_position.size());
  for (std::size_t i = 0; i < scene.rest_position.size(); ++i) {
    Eigen::Map<Vec3f>(xyz_.data() + 3 * i) = scene.rest_position[i];
  }
  AddSolids();
  AddSheets();
}

void TissueLayers::Add(Layer* layer, const char* name, Order order, osg::Program* program) {
  layer->mesh = std::make_unique<Mesh>(name, true);
  layer->mesh->state()->setAttributeAndModes(program);
  DrawIn(order, layer->mesh->state());
  geode_->addDrawable(layer->mesh->geometry());
}

void TissueLayers::AddSolids() {
  solid_positions_.resize(scene_.surface_vertices.size());
  solid_normals_.resize(scene_.surface_vertices.size());
  UpdateSolids();
  solid_program_ = MakeProgram("surface.vert", "rectum.frag");
  if (!scene_.solids.empty()) {
    for (const fulcrum::Solid& solid : scene_.solids) AddSolid(solid);
    return;
  }
  fulcrum::Solid whole{};
  whole.surface_vertex_count = static_cast<Index>(scene_.surface_vertices.size());
  whole.surface_triangle_count = static_cast<Index>(scene_.surface_triangles.size());
  AddSolid(whole);
}

void TissueLayers::AddSolid(const fulcrum::Solid& solid) {
  const std::span<const Vec3f> positions =
      std::span(solid_positions_).subspan(solid.first_surface_vertex, solid.surface_vertex_count);
  const std::span<const Vec3f> normals =
      std::span(solid_normals_).subspan(solid.first_surface_vertex, solid.surface_vertex_count);
  // The pattern is fixed to the tissue: its coordinates are those at rest along the solid's three principal directions.
  Vec3f mean = Vec3f::Zero();
  for (const Vec3f& p : positions) {
    mean += p / static_cast<float>(positions.size());
  }
  Mat3f spread = Mat3f::Zero();
  for (const Vec3f& p : positions) {
    spread += (p - mean) * (p - mean).transpose();
  }
  const Mat3f axes = Eigen::SelfAdjointEigenSolver<Mat3f>(spread).eigenvectors();  // Ascending: the long axis is last.
  std::vector<Float4> coordinates(positions.size());
  for (std::size_t k = 0; k < positions.size(); ++k) {
    const Vec3f place = axes.transpose() * (positions[k] - mean);
    const Vec3f facing = axes.transpose() * normals[k];
    const float front = facing[0] * facing[0], side = facing[1] * facing[1];
    coordinates[k] = {place[2], place[1], place[0], front + side > 0 ? front / (front + side) : 0.5f};
  }
  SolidLayer& added = solids_.emplace_back();
  added.first_vertex = solid.first_surface_vertex;
  added.vertex_count = solid.surface_vertex_count;
  for (const Triangle& t :
       scene_.surface_triangles.subspan(solid.first_surface_triangle, solid.surface_triangle_count)) {
    added.triangles.push_back({t[0] - added.first_vertex, t[1] - added.first_vertex, t[2] - added.first_vertex});
  }
  Add(&added.layer, solid.look == SolidLook::kBowel ? "rectum" : "organ", Order::kRectum, solid_program_);
  osg::StateSet* state = added.layer.mesh->state();
  state->setAttributeAndModes(new osg::CullFace(osg::CullFace::BACK));
  state->addUniform(new osg::Uniform("behind", kRectumBehind));
  SetLook(solid.look, state);
  added.layer.mesh->SetCoordinates(coordinates);
}

void TissueLayers::AddSheets() {
  Add(&beneath_layer_, "fat beneath", Order::kFat, MakeProgram("surface.vert", "fat.frag", "BENEATH"));
  Add(&fat_layer_, "fat", Order::kFat, MakeProgram("surface.vert", "fat.frag"));
  for (const Layer* layer : {&beneath_layer_, &fat_layer_}) {
    Blend(layer->mesh->state());
    layer->mesh->state()->addUniform(new osg::Uniform("behind", kFatBehind));
  }
  touched_state_ = new osg::StateSet;
  // Runs are drawn in their order, whatever their shaders.
  touched_state_->setRenderBinDetails(static_cast<int>(Order::kMembrane), "TraversalOrderBin");
  Blend(touched_state_);
  touched_state_->addUniform(new osg::Uniform("fascia_depth", kFasciaDepth));
  const auto around = SurroundingColour(SurfaceRole::kRetroperitoneum);
  touched_state_->addUniform(new osg::Uniform("around", osg::Vec4(around[0], around[1], around[2], around[3])));
  untouched_state_ = new osg::StateSet(*touched_state_);
  untouched_state_->setAttributeAndModes(MakeProgram("surface.vert", "membrane.frag", "UNTOUCHED"));
  const bool clipped = FindTool(scene_.tools, ToolKind::kClipApplier).has_value();
  touched_state_->setAttributeAndModes(MakeProgram("surface.vert", "membrane.frag",
                                                   !DrawsCuts(scene_) ? "AS_PRINTED"
                                                   : clipped          ? "CLIPS"
                                                                      : ""));
  Gather({});
  touched_state_->addUniform(new osg::Uniform("cut_off", static_cast<int>(kCutOffUnit)));
  touched_state_->setTextureAttribute(kCutOffUnit, MakeTexture(1, 1, 1, {0}, false));
  AddPlannedLine();
  sheet_.push_back(std::make_unique<Mesh>("membrane", true));
  sheet_.front()->geometry()->setStateSet(untouched_state_);
  geode_->addDrawable(sheet_.front()->geometry());
}

void TissueLayers::AddPlannedLine() {
  const std::size_t all = scene_.planned_line.size();
  const std::size_t count = std::min(all, kMostLinePoints);
  osg::StateSet* state = touched_state_;
  state->addUniform(new osg::Uniform("planned_points", static_cast<int>(count)));
  if (count < 2) {
    return;
  }
  osg::ref_ptr<osg::Uniform> line =
      new osg::Uniform(osg::Uniform::FLOAT_VEC2, "planned_line", static_cast<int>(kMostLinePoints));
  Vec2f low = scene_.planned_line[0], high = low;
  for (std::size_t i = 0; i < count; ++i) {
    const Vec2f& p = scene_.planned_line[i * (all - 1) / (count - 1)];
    line->setElement(static_cast<unsigned>(i), osg::Vec2(p.x(), p.y()));
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  state->addUniform(line);
  state->addUniform(new osg::Uniform(
      "planned_box", osg::Vec4(low.x() - kInkReach, low.y() - kInkReach, high.x() + kInkReach, high.y() + kInkReach)));
}

void TissueLayers::Gather(std::span<const ClipFootprint> clips) {
  const std::span<const ClipFootprint> drawn = clips.first(std::min(clips.size(), std::size_t{kMaxClips}));
  gathered_.assign(drawn.begin(), drawn.end());
  regathered_ = true;
  if (gathered_.empty()) {
    touched_state_->getOrCreateUniform("clip_count", osg::Uniform::INT)->set(0);
    return;
  }
  osg::Uniform* lines = touched_state_->getOrCreateUniform("clip_lines", osg::Uniform::FLOAT_VEC4, kMaxClips);
  for (std::size_t k = 0; k < gathered_.size(); ++k) {
    const auto& [from, to] = gathered_[k];
    lines->setElement(static_cast<unsigned>(k), osg::Vec4(from.x(), from.y(), to.x(), to.y()));
  }
  touched_state_->getOrCreateUniform("clip_count", osg::Uniform::INT)->set(static_cast<int>(gathered_.size()));
}

void TissueLayers::Pale(const Atlas& atlas, std::span<const std::uint8_t> cut_off) {
  touched_state_->setTextureAttribute(
      kCutOffUnit, MakeTexture(atlas.film_width(), atlas.film_height(), 1, {cut_off.begin(), cut_off.end()}, false));
  const auto width = static_cast<std::size_t>(atlas.film_width());
  pale_.setEmpty();
  for (std::size_t k = 0; k < cut_off.size(); ++k) {
    if (cut_off[k] == 0) continue;
    pale_.extend(2 * atlas.texel_m() * Vec2f(static_cast<float>(k % width), static_cast<float>(k / width)));
  }
  regathered_ = true;
}

void TissueLayers::SetTissue(std::span<const float> xyz) {
  std::copy(xyz.begin(), xyz.end(), xyz_.begin());
  tissue_changed_ = seen_ = true;
}

bool TissueLayers::SetTopology(const TopologyState& topology) {
  if (!membrane_.SetTopology(topology)) {
    return false;
  }
  topology_changed_ = recut_ = true;
  return true;
}

void TissueLayers::SetEyes(std::span<const Laparoscope> eyes) {
  field_ = FieldOfView(eyes);
  eye_W_ = MiddleOf(eyes);
  pixels_per_rad_ = PixelsPerRad(eyes.front());
  scope_changed_ = true;
}

void TissueLayers::SetScale(float scale) {
  if (scale == scale_) return;
  scale_ = scale;
  scope_changed_ = true;
}

void TissueLayers::SetDetail(float factor) {
  detail_factor_ = factor;
  scope_changed_ = true;
}

void TissueLayers::ShowFat(const std::function<bool(const Vec2f& material, float thickness)>& visible,
                           const std::function<bool(const Vec2f& material)>& opened) {
  fat_visible_.resize(fat_.materials().size());
  fat_opened_.resize(fat_visible_.size());
  for (std::size_t k = 0; k < fat_visible_.size(); ++k) {
    fat_opened_[k] = opened(fat_.materials()[k]) ? 1 : 0;
    fat_visible_[k] = visible(fat_.materials()[k], fat_.thickness()[k]) ? 1 : 0;
  }
  fat_chosen_ = false;
  topology_changed_ = true;
}

void TissueLayers::RehearseBurn(bool on) {
  rehearsing_ = on;
  fat_chosen_ = false;
  UpdateFat();
  // Each other block of the membrane as touched: both its shaders are drawn.
  const std::vector<std::uint8_t> untouched = untouched_;
  for (std::size_t block = 1; on && block < untouched_.size(); block += 2) untouched_[block] = 0;
  ShowMembrane();
  untouched_ = untouched;
  if (!on) {
    burn_.EndRehearsal(geode_);
    cut_.EndRehearsal(geode_);
    return;
  }
  // A piece of a centimetre, twice as near as what the scope looks at.
  constexpr float kHalf_m = 0.005f;
  const Vec3f middle = 0.5f * (eye_W_ + scene_.render.scope_target_W);
  const Vec3f normal = (eye_W_ - middle).normalized();
  const Vec3f u = kHalf_m * normal.unitOrthogonal(), v = normal.cross(u);
  const std::array<Vec3f, 3> corners{middle - u - v, middle + u - v, middle + v};
  if (DrawsCuts(scene_)) cut_.Rehearse(corners, normal, geode_);
  if (SolidsBurn(scene_)) burn_.Rehearse(corners, normal, geode_);
}

bool TissueLayers::Update(const Atlas& atlas) {
  const bool moved = tissue_changed_ || topology_changed_ || scope_changed_ || burn_.grown();
  const bool marked = FindUntouched(atlas);
  if (moved) UpdateMembrane();
  if (moved || marked) ShowMembrane();
  // A patch alone changes lips at most.
  const bool cut_changed = DrawsCuts(scene_) && cut_.Update(atlas, membrane_, recut_, moved, eye_W_,
                                                            std::min(scale_, 1.0f) * pixels_per_rad_, &field_, geode_);
  recut_ = false;
  if (!moved) return cut_changed || marked;
  UpdateFat();
  if (tissue_changed_ || scope_changed_) {
    if (tissue_changed_) UpdateSolids();
    for (SolidLayer& solid : solids_) {
      const auto own = [&](const std::vector<Vec3f>& all) {
        return std::span(all).subspan(solid.first_vertex, solid.vertex_count);
      };
      if (tissue_changed_) solid.layer.mesh->SetPositions(own(solid_positions_));
      if (tissue_changed_) solid.layer.mesh->SetNormals(own(solid_normals_));
      Show(&solid.layer, own(solid_positions_), solid.triangles, Sides::kFront);
    }
  }
  burn_.Update(solid_positions_, solid_normals_, &field_);
  tissue_changed_ = topology_changed_ = scope_changed_ = false;
  return true;
}

void TissueLayers::UpdateSolids() {
  MapEmbedded(scene_.tets, scene_.surface_vertices, xyz_, solid_positions_);
  ComputeNormals(solid_positions_, scene_.surface_triangles, solid_normals_);
}

bool TissueLayers::FindUntouched(const Atlas& atlas) {
  if (marks_ == atlas.marks() && !regathered_) return false;
  marks_ = atlas.marks();
  regathered_ = false;
  const std::uint32_t rows = membrane_.block_rows(), cols = membrane_.block_cols();
  untouched_.assign(std::size_t{rows} * cols, 0);
  // The paper's colours are functions of the present temperature: nothing is left out.
  if (scene_.thermal.model == ThermalModel::kPaper) return true;
  Eigen::AlignedBox2f planned;
  for (const Vec2f& p : scene_.planned_line) planned.extend(p);
  for (std::size_t block = 0; block < untouched_.size(); ++block) {
    Eigen::AlignedBox2f box;
    detail_.ForEachNode(block, [&](Index node) { box.extend(scene_.membrane_material[node]); });
    const bool inked = !planned.isEmpty() && planned.exteriorDistance(box) <= kInkReach;
    const bool gathered = std::ranges::any_of(gathered_, [&](const ClipFootprint& clip) {
      const Eigen::AlignedBox2f around(clip.from.cwiseMin(clip.to), clip.from.cwiseMax(clip.to));
      return around.exteriorDistance(box) <= kGather_m;
    });
    const bool pale = !pale_.isEmpty() && pale_.exteriorDistance(box) <= Atlas::kReach_m;
    untouched_[block] = !inked && !gathered && !pale && atlas.Untouched(box.min(), box.max()) ? 1 : 0;
  }
  return true;
}

void TissueLayers::UpdateMembrane() {
  const bool moved = tissue_changed_ || topology_changed_;
  if (moved) membrane_.Update(xyz_);
  const std::span<const Vec3f> positions = membrane_.positions();
  if (moved) sheet_.front()->SetPositions(positions);
  if (moved) sheet_.front()->SetNormals(membrane_.normals());
  if (topology_changed_) {
    std::vector<Float4> coordinates(positions.size());
    for (std::size_t k = 0; k < coordinates.size(); ++k) {
      const Vec2f& m = membrane_.materials()[k];
      coordinates[k] = {m.x(), m.y(), membrane_.sides()[k], rim_[membrane_.NodeOf(static_cast<Index>(k))]};
    }
    sheet_.front()->SetCoordinates(coordinates);
  }
}

void TissueLayers::ShowMembrane() {
  detail_.Choose(membrane_, eye_W_, detail_factor_ * pixels_per_rad_, untouched_, &chosen_);
  std::vector<std::size_t>& ends = chosen_.ends;
  const bool changed = field_.Find(membrane_.positions(), chosen_.triangles, Sides::kBoth, &shown_.triangles, ends);
  if (!changed && ends == shown_.ends) return;
  shown_.ends = ends;
  while (sheet_.size() < ends.size()) {
    const bool untouched = sheet_.size() % 2 == 0;
    sheet_.push_back(std::make_unique<Mesh>("membrane", *sheet_.front()));
    sheet_.back()->geometry()->setStateSet(untouched ? untouched_state_ : touched_state_);
    geode_->addDrawable(sheet_.back()->geometry());
  }
  for (std::size_t k = 0; k < sheet_.size(); ++k) {
    const std::size_t first = k == 0 ? 0 : k < ends.size() ? ends[k - 1] : 0, end = k < ends.size() ? ends[k] : first;
    sheet_[k]->SetTriangles(std::span(shown_.triangles).subspan(first, end - first));
  }
}

void TissueLayers::UpdateFat() {
  if (topology_changed_) fat_.FindCuts(membrane_);
  fat_.Update(xyz_, membrane_, eye_W_);
  for (const Layer* layer : {&beneath_layer_, &fat_layer_}) {
    layer->mesh->SetPositions(fat_.positions());
    layer->mesh->SetNormals(fat_.normals());
  }
  if (!fat_chosen_ || !std::ranges::equal(fat_.bared(), fat_bared_)) ChooseFat();
  Show(&beneath_layer_, fat_.positions(), fat_beneath_, Sides::kBoth);
  Show(&fat_layer_, fat_.positions(), fat_shown_, Sides::kBoth);
}

void TissueLayers::ChooseFat() {
  const std::span<const float> bared = fat_.bared();
  fat_coordinates_.resize(bared.size());
  for (std::size_t k = 0; k < bared.size(); ++k) {
    const Vec2f& m = fat_.materials()[k];
    fat_coordinates_[k] = {m.x(), m.y(), fat_.thickness()[k], bared[k]};
  }
  beneath_layer_.mesh->SetCoordinates(fat_coordinates_);
  fat_layer_.mesh->SetCoordinates(fat_coordinates_);
  const auto open = [&](Index k) { return rehearsing_ || bared[k] > 0 || fat_opened_[k] != 0; };
  fat_shown_.clear();
  fat_beneath_.clear();
  for (const Triangle& t : fat_.triangles()) {
    const bool opened = open(t[0]) || open(t[1]) || open(t[2]);
    const bool visible = fat_visible_[t[0]] != 0 || fat_visible_[t[1]] != 0 || fat_visible_[t[2]] != 0;
    if (opened) fat_shown_.push_back(t);
    // A rehearsal compiles both shaders.
    if (rehearsing_ || (visible && !opened)) fat_beneath_.push_back(t);
  }
  fat_chosen_ = true;
  fat_bared_.assign(bared.begin(), bared.end());
}

void TissueLayers::Show(Layer* layer, std::span<const Vec3f> positions, std::span<const Triangle> triangles,
                        Sides sides) {
  if (field_.Find(positions, triangles, sides, &layer->seen)) {
    layer->mesh->SetTriangles(layer->seen);
  }
}

}  // namespace fulcrum::render
