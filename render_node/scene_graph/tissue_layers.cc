#include "render_node/scene_graph/tissue_layers.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <osg/CullFace>
#include <osg/Depth>

#include "render_node/geometry/sheet_detail.h"
#include "render_node/geometry/surface.h"
#include "render_node/scene_graph/program.h"
#include "render_node/scene_graph/surroundings.h"

namespace fulcrum::render {
namespace {

using Float4 = std::array<float, 4>;

constexpr std::uint32_t kFatStride = 2;
// Layers of tissue in contact overlap by up to a millimetre in the simulation; in the depth test the inner one counts
// as this much farther away.
constexpr float kFatBehind = 0.0015f;        // [m]
constexpr float kRectumBehind = 0.0025f;     // [m]
constexpr std::size_t kMostLinePoints = 64;  // As in membrane.frag.
// [m] Margin of the box around a planned line outside which the shader skips the line.
constexpr float kInkReach = 0.001f;
constexpr float kFasciaDepth = 0.0006f;  // [m] Below the peritoneum: the least depth of the fat.

Vec3f EyeOf(const Laparoscope& scope) {
  return -scope.view.block<3, 3>(0, 0).transpose() * scope.view.block<3, 1>(0, 3);
}

float PixelsPerRad(const Laparoscope& scope) { return scope.projection(1, 1) * scope.picture_centre.y(); }

}  // namespace

TissueLayers::TissueLayers(const SceneView& scene, const Laparoscope& scope)
    : scene_(scene),
      field_(scope),
      eye_W_(EyeOf(scope)),
      pixels_per_rad_(PixelsPerRad(scope)),
      membrane_(scene),
      detail_(scene.membrane),
      fat_(scene, kFatStride),
      rim_(SheetRim(scene)) {
  xyz_.resize(3 * scene.rest_position.size());
  for (std::size_t i = 0; i < scene.rest_position.size(); ++i) {
    Eigen::Map<Vec3f>(xyz_.data() + 3 * i) = scene.rest_position[i];
  }
  AddRectum();
  AddSheets();
}

void TissueLayers::Add(Layer* layer, const char* name, Order order, const char* fragment, const char* defined) {
  layer->mesh = std::make_unique<Mesh>(name, true);
  layer->mesh->state()->setAttributeAndModes(MakeProgram("surface.vert", fragment, defined));
  DrawIn(order, layer->mesh->state());
  geode_->addDrawable(layer->mesh->geometry());
}

void TissueLayers::AddRectum() {
  const std::size_t count = scene_.surface_vertices.size();
  rectum_positions_.resize(count);
  rectum_normals_.resize(count);
  UpdateRectum();
  // The pattern is fixed to the tissue: its coordinates are those at rest along the organ's three principal directions.
  Vec3f mean = Vec3f::Zero();
  for (const Vec3f& p : rectum_positions_) {
    mean += p / static_cast<float>(count);
  }
  Mat3f spread = Mat3f::Zero();
  for (const Vec3f& p : rectum_positions_) {
    spread += (p - mean) * (p - mean).transpose();
  }
  const Mat3f axes = Eigen::SelfAdjointEigenSolver<Mat3f>(spread).eigenvectors();  // Ascending: the long axis is last.
  std::vector<Float4> coordinates(count);
  for (std::size_t k = 0; k < count; ++k) {
    const Vec3f place = axes.transpose() * (rectum_positions_[k] - mean);
    const Vec3f facing = axes.transpose() * rectum_normals_[k];
    const float front = facing[0] * facing[0], side = facing[1] * facing[1];
    coordinates[k] = {place[2], place[1], place[0], front + side > 0 ? front / (front + side) : 0.5f};
  }
  Add(&rectum_, "rectum", Order::kRectum, "rectum.frag");
  rectum_.mesh->state()->setAttributeAndModes(new osg::CullFace(osg::CullFace::BACK));
  rectum_.mesh->state()->addUniform(new osg::Uniform("behind", kRectumBehind));
  rectum_.mesh->SetCoordinates(coordinates);
}

void TissueLayers::AddSheets() {
  Add(&fat_layer_, "fat", Order::kFat, "fat.frag");
  Blend(fat_layer_.mesh->state());
  fat_layer_.mesh->state()->addUniform(new osg::Uniform("behind", kFatBehind));
  const bool printed = scene_.thermal.model == ThermalModel::kPaper && scene_.thermal.as == PaperForm::kPrinted;
  Add(&sheet_, "membrane", Order::kMembrane, "membrane.frag", printed ? "AS_PRINTED" : "");
  Blend(sheet_.mesh->state());
  sheet_.mesh->state()->addUniform(new osg::Uniform("fascia_depth", kFasciaDepth));
  const auto around = SurroundingColour(SurfaceRole::kRetroperitoneum);
  sheet_.mesh->state()->addUniform(new osg::Uniform("around", osg::Vec4(around[0], around[1], around[2], around[3])));
  AddPlannedLine();
}

void TissueLayers::AddPlannedLine() {
  const std::size_t all = scene_.planned_line.size();
  const std::size_t count = std::min(all, kMostLinePoints);
  osg::StateSet* state = sheet_.mesh->state();
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

void TissueLayers::SetTissue(std::span<const float> xyz) {
  std::copy(xyz.begin(), xyz.end(), xyz_.begin());
  tissue_changed_ = true;
}

bool TissueLayers::SetTopology(const TopologyState& topology) {
  if (!membrane_.SetTopology(topology)) {
    return false;
  }
  topology_changed_ = true;
  return true;
}

void TissueLayers::SetScope(const Laparoscope& scope) {
  field_ = FieldOfView(scope);
  eye_W_ = EyeOf(scope);
  pixels_per_rad_ = PixelsPerRad(scope);
  scope_changed_ = true;
}

void TissueLayers::SetDetail(float factor) {
  detail_factor_ = factor;
  scope_changed_ = true;
}

void TissueLayers::ShowFat(const std::function<bool(const Vec2f& material, float thickness)>& visible,
                           const std::function<bool(const Vec2f& material)>& opened) {
  fat_.FindBared(opened, membrane_, &fat_bared_);
  std::vector<std::uint8_t> seen(fat_.materials().size());
  std::vector<Float4> coordinates(seen.size());
  for (std::size_t k = 0; k < seen.size(); ++k) {
    const Vec2f& m = fat_.materials()[k];
    seen[k] = fat_bared_[k] > 0 || visible(m, fat_.thickness()[k]) ? 1 : 0;
    coordinates[k] = {m.x(), m.y(), fat_.thickness()[k], fat_bared_[k]};
  }
  fat_layer_.mesh->SetCoordinates(coordinates);
  fat_shown_.clear();
  for (const Triangle& t : fat_.triangles()) {
    if (seen[t[0]] || seen[t[1]] || seen[t[2]]) {
      fat_shown_.push_back(t);
    }
  }
  topology_changed_ = true;
}

bool TissueLayers::Update() {
  if (!tissue_changed_ && !topology_changed_ && !scope_changed_) {
    return false;
  }
  UpdateMembrane();
  UpdateFat();
  if (tissue_changed_ || scope_changed_) {
    UpdateRectum();
    rectum_.mesh->SetPositions(rectum_positions_);
    rectum_.mesh->SetNormals(rectum_normals_);
    Show(&rectum_, rectum_positions_, scene_.surface_triangles, Sides::kFront);
  }
  tissue_changed_ = topology_changed_ = scope_changed_ = false;
  return true;
}

void TissueLayers::UpdateRectum() {
  MapEmbedded(scene_.tets, scene_.surface_vertices, xyz_, rectum_positions_);
  ComputeNormals(rectum_positions_, scene_.surface_triangles, rectum_normals_);
}

void TissueLayers::UpdateMembrane() {
  membrane_.Update(xyz_);
  const std::span<const Vec3f> positions = membrane_.positions();
  sheet_.mesh->SetPositions(positions);
  sheet_.mesh->SetNormals(membrane_.normals());
  if (topology_changed_) {
    std::vector<Float4> coordinates(positions.size());
    for (std::size_t k = 0; k < coordinates.size(); ++k) {
      const Vec2f& m = membrane_.materials()[k];
      coordinates[k] = {m.x(), m.y(), membrane_.sides()[k], rim_[membrane_.NodeOf(static_cast<Index>(k))]};
    }
    sheet_.mesh->SetCoordinates(coordinates);
  }
  detail_.Choose(membrane_, eye_W_, detail_factor_ * pixels_per_rad_, &chosen_);
  Show(&sheet_, positions, chosen_, Sides::kBoth);
}

void TissueLayers::UpdateFat() {
  fat_.Update(xyz_, membrane_);
  fat_layer_.mesh->SetPositions(fat_.positions());
  fat_layer_.mesh->SetNormals(fat_.normals());
  Show(&fat_layer_, fat_.positions(), fat_shown_, Sides::kBoth);
}

void TissueLayers::Show(Layer* layer, std::span<const Vec3f> positions, std::span<const Triangle> triangles,
                        Sides sides) {
  if (field_.Find(positions, triangles, sides, &layer->seen)) {
    layer->mesh->SetTriangles(layer->seen);
  }
}

}  // namespace fulcrum::render
