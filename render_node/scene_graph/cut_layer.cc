#include "render_node/scene_graph/cut_layer.h"

#include "render_node/scene_graph/order.h"
#include "render_node/scene_graph/program.h"

namespace fulcrum::render {

std::unique_ptr<Mesh> CutLayer::MakeMesh() {
  auto mesh = std::make_unique<Mesh>("cut", true);
  if (!program_) program_ = MakeProgram("surface.vert", "cut.frag");
  mesh->state()->setAttributeAndModes(program_);
  Blend(mesh->state());
  DrawIn(Order::kCut, mesh->state());
  return mesh;
}

void CutLayer::Rehearse(const std::array<Vec3f, 3>& corners, const Vec3f& normal, osg::Geode* parent) {
  rehearsal_ = MakeMesh();
  rehearsal_->SetPositions(corners);
  rehearsal_->SetNormals(std::array{normal, normal, normal});
  rehearsal_->SetCoordinates(std::array<std::array<float, 4>, 3>{{{0, 0, 0, 1}, {0, 0, 0, 1}, {0, 0, 0, 1}}});
  const std::array<Triangle, 1> triangle{{{0, 1, 2}}};
  rehearsal_->SetTriangles(triangle);
  parent->addDrawable(rehearsal_->geometry());
}

void CutLayer::EndRehearsal(osg::Geode* parent) {
  if (!rehearsal_) return;
  parent->removeDrawable(rehearsal_->geometry());
  rehearsal_.reset();
}

bool CutLayer::Update(const Atlas& atlas, const MembraneMesh& mesh, bool recut, bool moved, const Vec3f& eye_W,
                      float pixels_per_rad, FieldOfView* field, osg::Geode* parent) {
  if (atlas.removals() == 0) return false;
  bool changed = recut || moved || !mesh_;
  if (recut || !mesh_) places_.SetTopology(mesh);
  if (recut || atlas.removals() != removals_) {
    lip_.Find(atlas, mesh, places_);
    strands_.Find(atlas, mesh, places_);
    changed = true;
  } else if (atlas.patches() != patches_ && lip_.Curl(atlas)) {
    changed = true;
  }
  removals_ = atlas.removals();
  patches_ = atlas.patches();
  if (!changed) return false;
  if (!mesh_) {
    mesh_ = MakeMesh();
    parent->addDrawable(mesh_->geometry());
  }
  geometry_.Clear();
  lip_.Append(mesh, &geometry_);
  strands_.Append(mesh, eye_W, pixels_per_rad, &geometry_);
  mesh_->SetPositions(geometry_.positions);
  mesh_->SetNormals(geometry_.normals);
  mesh_->SetCoordinates(geometry_.coordinates);
  if (field->Find(geometry_.positions, geometry_.triangles, Sides::kBoth, &seen_)) mesh_->SetTriangles(seen_);
  return true;
}

}  // namespace fulcrum::render
