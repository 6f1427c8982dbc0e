#include "render_node/scene_graph/mesh.h"

#include <cstring>
#include <string>

namespace fulcrum::render {
namespace {

// The bounding box is not used (no culling, fixed near and far planes), so it is not computed in each frame.
class WholeScene : public osg::Drawable::ComputeBoundingBoxCallback {
 public:
  osg::BoundingBox computeBound(const osg::Drawable&) const override { return {-1, -1, -1, 1, 1, 1}; }
};

template <class Array, class T>
void Fill(std::span<const T> values, Array* array) {
  static_assert(sizeof(T) == sizeof((*array)[0]));
  array->resize(values.size());
  if (!values.empty()) {
    // As bytes: both are packed floats, but Eigen's vectors are not trivially copyable.
    const auto bytes = std::as_bytes(values);
    std::memcpy(&array->front(), bytes.data(), bytes.size());
  }
  array->dirty();
}

}  // namespace

Mesh::Mesh(std::string_view name, bool dynamic)
    : geometry_(new osg::Geometry),
      positions_(new osg::Vec3Array),
      normals_(new osg::Vec3Array),
      coordinates_(new osg::Vec4Array),
      colours_(new osg::Vec4Array),
      triangles_(new osg::DrawElementsUInt(osg::PrimitiveSet::TRIANGLES)) {
  geometry_->setName(std::string(name));
  geometry_->setUseDisplayList(false);
  geometry_->setUseVertexBufferObjects(true);
  geometry_->setDataVariance(dynamic ? osg::Object::DYNAMIC : osg::Object::STATIC);
  geometry_->setCullingActive(false);
  geometry_->setComputeBoundingBoxCallback(new WholeScene);
  geometry_->setVertexArray(positions_);
  geometry_->addPrimitiveSet(triangles_);
}

Mesh::Mesh(std::string_view name, const Mesh& mesh) : Mesh(name, true) {
  positions_ = mesh.positions_;
  normals_ = mesh.normals_;
  coordinates_ = mesh.coordinates_;
  geometry_->setVertexArray(positions_);
  geometry_->setNormalArray(normals_, osg::Array::BIND_PER_VERTEX);
  geometry_->setTexCoordArray(0, coordinates_, osg::Array::BIND_PER_VERTEX);
}

void Mesh::SetPositions(std::span<const Vec3f> positions) { Fill(positions, positions_.get()); }

void Mesh::SetNormals(std::span<const Vec3f> normals) {
  Fill(normals, normals_.get());
  geometry_->setNormalArray(normals_, osg::Array::BIND_PER_VERTEX);
}

void Mesh::SetCoordinates(std::span<const std::array<float, 4>> coordinates) {
  Fill(coordinates, coordinates_.get());
  geometry_->setTexCoordArray(0, coordinates_, osg::Array::BIND_PER_VERTEX);
}

void Mesh::SetColours(std::span<const std::array<float, 4>> colours) {
  Fill(colours, colours_.get());
  geometry_->setColorArray(colours_, osg::Array::BIND_PER_VERTEX);
}

void Mesh::SetTriangles(std::span<const Triangle> triangles) {
  triangles_->resize(3 * triangles.size());
  if (!triangles.empty()) {
    std::memcpy(&triangles_->front(), triangles.data(), triangles.size_bytes());
  }
  triangles_->dirty();
}

}  // namespace fulcrum::render
