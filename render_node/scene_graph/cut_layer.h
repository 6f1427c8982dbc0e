// Lips and strands of the cuts (geometry/cut_lip.h, cut_strands.h) as a mesh over the sheet. It is made at the first
// cut: a session without one pays nothing.
#pragma once

#include <memory>
#include <osg/Geode>
#include <osg/Program>
#include <vector>

#include "render_node/geometry/cut_lip.h"
#include "render_node/geometry/cut_strands.h"
#include "render_node/geometry/field_of_view.h"
#include "render_node/scene_graph/mesh.h"

namespace fulcrum::render {

class CutLayer {
 public:
  /// Keeps a reference to the arrays of `scene`.
  explicit CutLayer(const SceneView& scene) : places_(scene), lip_(scene), strands_(scene) {}

  /// Makes the shader part of the next picture though nothing is cut: a triangle before everything.
  void Rehearse(const std::array<Vec3f, 3>& corners, const Vec3f& normal, osg::Geode* parent);
  void EndRehearsal(osg::Geode* parent);

  /// Follows `mesh` and `atlas`. The first cut adds the drawing to `parent`. Returns false, and does nothing, if what
  /// is drawn is the same.
  /// @param recut    the topology of `mesh` has changed since the last call.
  /// @param moved    `mesh`, `eye_W` or `pixels_per_rad` has changed.
  bool Update(const Atlas& atlas, const MembraneMesh& mesh, bool recut, bool moved, const Vec3f& eye_W,
              float pixels_per_rad, FieldOfView* field, osg::Geode* parent);

 private:
  [[nodiscard]] std::unique_ptr<Mesh> MakeMesh();

  SheetPlaces places_;
  CutLip lip_;
  CutStrands strands_;
  CutGeometry geometry_;
  std::uint64_t removals_ = 0, patches_ = 0;  // Of the atlas at the last Update().
  osg::ref_ptr<osg::Program> program_;
  std::unique_ptr<Mesh> mesh_, rehearsal_;
  std::vector<Triangle> seen_;  // Passed to OpenGL.
};

}  // namespace fulcrum::render
