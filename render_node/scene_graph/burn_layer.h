// The burns of the solids as a translucent mesh over their surfaces. Mesh and texture are made when the first burn
// shows: most sessions have none.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <osg/Geode>
#include <osg/Program>
#include <span>
#include <vector>

#include "render_node/geometry/field_of_view.h"
#include "render_node/geometry/solid_burn.h"
#include "render_node/scene_graph/atlas_texture.h"
#include "render_node/scene_graph/mesh.h"

namespace fulcrum::render {

class BurnLayer {
 public:
  /// Keeps a reference to the arrays of `scene`.
  explicit BurnLayer(const SceneView& scene) : burn_(scene) {}

  /// Applies a patch of the solids. The first burn adds the mesh to `parent`. Returns false if the patch is of another
  /// surface, lies outside or has the wrong size.
  bool Apply(const TemperaturePatch& patch, osg::Geode* parent);
  /// Adds a triangle of burnt tissue that is to be drawn once: the rasteriser compiles a shader at its first use, a
  /// quarter of a second, which must not happen during the session.
  void Rehearse(const std::array<Vec3f, 3>& corners, const Vec3f& normal, osg::Geode* parent);
  void EndRehearsal(osg::Geode* parent);
  /// Whether triangles have been added since the last Update().
  [[nodiscard]] bool grown() const { return burn_.additions() != shown_additions_; }
  /// Places the mesh on the solids. Positions, frame W [m], and normals by SceneView::surface_vertices.
  void Update(std::span<const Vec3f> positions, std::span<const Vec3f> normals, FieldOfView* field);
  [[nodiscard]] const BurnAtlas& atlas() const { return burn_.atlas(); }

 private:
  [[nodiscard]] std::unique_ptr<Mesh> MakeMesh(const AtlasTexture& texture, int width, int height);

  SolidBurn burn_;
  osg::ref_ptr<osg::Program> program_;
  std::unique_ptr<AtlasTexture> texture_, rehearsal_texture_;
  std::unique_ptr<Mesh> mesh_, rehearsal_;
  std::vector<std::uint8_t> rehearsal_texels_;
  std::vector<Vec3f> positions_, normals_;  // Of the corners.
  std::vector<Triangle> seen_;              // Passed to OpenGL.
  std::uint64_t shown_additions_ = 0;
};

}  // namespace fulcrum::render
