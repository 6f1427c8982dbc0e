#include "render_node/scene_graph/burn_layer.h"

#include <array>
#include <cstddef>
#include <osg/CullFace>
#include <osg/Depth>

#include "render_node/scene_graph/order.h"
#include "render_node/scene_graph/program.h"

namespace fulcrum::render {
namespace {

// [m] Less than kRectumBehind of tissue_layers.cc: with the same triangles the depth test would depend on rounding.
constexpr float kBurnBehind = 0.0023f;

}  // namespace

bool BurnLayer::Apply(const TemperaturePatch& patch, osg::Geode* parent) {
  const AtlasRect rect = burn_.Apply(patch);
  if (rect.empty()) return false;
  if (texture_) {
    texture_->Update(rect);
  } else if (grown()) {
    texture_ = std::make_unique<AtlasTexture>(atlas().width(), atlas().height(), atlas().texels());
    mesh_ = MakeMesh(*texture_, atlas().width(), atlas().height());
    parent->addDrawable(mesh_->geometry());
  }
  return true;
}

void BurnLayer::Rehearse(const std::array<Vec3f, 3>& corners, const Vec3f& normal, osg::Geode* parent) {
  // Damaged and half dry: nothing of the shader is skipped.
  rehearsal_texels_ = {120, 200, 90, 255};
  rehearsal_texture_ = std::make_unique<AtlasTexture>(1, 1, rehearsal_texels_);
  rehearsal_ = MakeMesh(*rehearsal_texture_, 1, 1);
  const std::array<Vec3f, 3> normals{normal, normal, normal};
  const std::array<float, 4> middle{0.5f * kSolidCell_m, 0.5f * kSolidCell_m, 0, 0};
  const std::array<float, 4> box{0, 0, kSolidCell_m, kSolidCell_m};
  rehearsal_->SetPositions(corners);
  rehearsal_->SetNormals(normals);
  rehearsal_->SetCoordinates(std::array{middle, middle, middle});
  rehearsal_->SetColours(std::array{box, box, box});
  const std::array<Triangle, 1> triangle{{{0, 1, 2}}};
  rehearsal_->SetTriangles(triangle);
  parent->addDrawable(rehearsal_->geometry());
}

void BurnLayer::EndRehearsal(osg::Geode* parent) {
  if (!rehearsal_) return;
  parent->removeDrawable(rehearsal_->geometry());
  rehearsal_.reset();
  rehearsal_texture_.reset();
}

std::unique_ptr<Mesh> BurnLayer::MakeMesh(const AtlasTexture& texture, int width, int height) {
  auto mesh = std::make_unique<Mesh>("burn", true);
  osg::StateSet* state = mesh->state();
  if (!program_) program_ = MakeProgram("surface.vert", "burn.frag");
  state->setAttributeAndModes(program_);
  state->setAttributeAndModes(new osg::CullFace(osg::CullFace::BACK));
  state->setAttributeAndModes(new osg::Depth(osg::Depth::LEQUAL, 0, 1, false));
  Blend(state);
  DrawIn(Order::kBurn, state);
  state->setTextureAttribute(static_cast<unsigned>(kBurnUnit), texture.texture());
  state->addUniform(new osg::Uniform("burn_atlas", static_cast<int>(kBurnUnit)));
  state->addUniform(new osg::Uniform("burn_per_metre", osg::Vec2(1 / (kSolidCell_m * static_cast<float>(width)),
                                                                 1 / (kSolidCell_m * static_cast<float>(height)))));
  state->addUniform(new osg::Uniform("behind", kBurnBehind));
  return mesh;
}

void BurnLayer::Update(std::span<const Vec3f> positions, std::span<const Vec3f> normals, FieldOfView* field) {
  if (!mesh_) return;
  const std::span<const Index> vertices = burn_.vertices();
  positions_.resize(vertices.size());
  normals_.resize(vertices.size());
  for (std::size_t k = 0; k < vertices.size(); ++k) {
    positions_[k] = positions[vertices[k]];
    normals_[k] = normals[vertices[k]];
  }
  mesh_->SetPositions(positions_);
  mesh_->SetNormals(normals_);
  if (grown()) {
    shown_additions_ = burn_.additions();
    std::vector<std::array<float, 4>> coordinates;
    coordinates.reserve(vertices.size());
    for (std::size_t k = 0; k < vertices.size(); ++k) {
      const Vec2f& m = burn_.materials()[k];
      coordinates.push_back({m.x(), m.y(), static_cast<float>(burn_.charts()[k]), 0});
    }
    mesh_->SetCoordinates(coordinates);
    mesh_->SetColours(burn_.boxes());
  }
  if (field->Find(positions_, burn_.triangles(), Sides::kFront, &seen_)) mesh_->SetTriangles(seen_);
}

}  // namespace fulcrum::render
