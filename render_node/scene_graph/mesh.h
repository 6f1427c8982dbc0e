// One indexed triangle mesh in vertex buffers, filled from arrays of core types.
#pragma once

#include <osg/Geometry>
#include <span>
#include <string_view>

#include "services/base/core/types.h"

namespace fulcrum::render {

class Mesh {
 public:
  /// @param name name for messages. @param dynamic positions change from picture to picture.
  Mesh(std::string_view name, bool dynamic);
  /// Other triangles of `mesh`: positions, normals and coordinates are those of `mesh`, which sets them.
  Mesh(std::string_view name, const Mesh& mesh);

  void SetPositions(std::span<const Vec3f> positions);
  void SetNormals(std::span<const Vec3f> normals);
  /// Four floats per vertex, defined by the shader.
  void SetCoordinates(std::span<const std::array<float, 4>> coordinates);
  void SetColours(std::span<const std::array<float, 4>> colours);
  void SetTriangles(std::span<const Triangle> triangles);

  [[nodiscard]] osg::Geometry* geometry() const { return geometry_; }
  [[nodiscard]] osg::StateSet* state() const { return geometry_->getOrCreateStateSet(); }

 private:
  osg::ref_ptr<osg::Geometry> geometry_;
  osg::ref_ptr<osg::Vec3Array> positions_;
  osg::ref_ptr<osg::Vec3Array> normals_;
  osg::ref_ptr<osg::Vec4Array> coordinates_;
  osg::ref_ptr<osg::Vec4Array> colours_;
  osg::ref_ptr<osg::DrawElementsUInt> triangles_;
};

}  // namespace fulcrum::render
