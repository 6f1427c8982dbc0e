#include "render_node/scene_graph/drawn_surfaces.h"

#include <algorithm>
#include <cstring>
#include <map>
#include <osg/Camera>
#include <osg/CullFace>
#include <osg/Geode>
#include <osg/Geometry>
#include <osg/MatrixTransform>
#include <osg/NodeVisitor>
#include <set>
#include <span>
#include <string_view>
#include <utility>

#include "render_node/scene_graph/instruments.h"

namespace fulcrum::render {
namespace {

/// Of tissue and surroundings. All that is named below a tool is a part of it.
constexpr std::array<std::string_view, 8> kSurfaces{"rectum", "organ", "fat",          "membrane",
                                                    "cut",    "clip",  "surroundings", "breathing"};
constexpr std::array<std::string_view, 1> kBurns{"burn"};

class Collector final : public osg::NodeVisitor {
 public:
  /// @param names of the surfaces of no tool that are collected; they must outlive it.
  /// @param tools whether those of tools are collected.
  Collector(std::span<const std::string_view> names, bool tools)
      : osg::NodeVisitor(TRAVERSE_ALL_CHILDREN), names_(names), tools_(tools) {
    setNodeMaskOverride(~0u);  // Cameras rest when they have drawn.
  }

  void apply(osg::Camera& camera) override { traverse(camera); }  // Its matrix is no place of its content.
  void apply(osg::MatrixTransform& transform) override {
    if (transform.getNodeMask() == 0) return;  // An instrument that is not there.
    const osg::Matrix before = place_;
    const int tool = tool_;
    place_ = transform.getMatrix() * place_;
    if (const int named = ToolNamed(transform.getName()); named >= 0) tool_ = named;
    traverse(transform);
    place_ = before;
    tool_ = tool;
  }
  void apply(osg::Geometry& geometry) override {
    const bool wanted = tool_ >= 0 ? tools_ && !geometry.getName().empty()
                                   : std::find(names_.begin(), names_.end(), geometry.getName()) != names_.end();
    if (!wanted) return;
    // The fixed surroundings are there for two backgrounds; the jaws of an instrument share a mesh.
    if (tool_ < 0 && !seen_.insert(&geometry).second) return;
    // The sheet is one surface in several runs of triangles.
    if (tool_ < 0 && !surfaces.empty() && geometry.getVertexArray() == last_) {
      AppendTriangles(geometry, &surfaces.back());
      return;
    }
    last_ = geometry.getVertexArray();
    DrawnSurface surface;
    surface.name = geometry.getName();
    surface.tool = tool_;
    surface.part = parts_[{surface.name, tool_}]++;
    Read(geometry, &surface);
    surfaces.push_back(std::move(surface));
  }

  std::vector<DrawnSurface> surfaces;

 private:
  static void AppendTriangles(const osg::Geometry& geometry, DrawnSurface* surface) {
    const auto& corners = dynamic_cast<const osg::DrawElementsUInt&>(*geometry.getPrimitiveSet(0));
    for (std::size_t k = 0; k + 2 < corners.size(); k += 3) {
      surface->triangles.push_back({corners[k], corners[k + 1], corners[k + 2]});
    }
  }
  void Read(const osg::Geometry& geometry, DrawnSurface* surface) const {
    const osg::StateSet* state = geometry.getStateSet();
    osg::Vec3 shift;
    float behind = 0;
    if (state != nullptr) {
      if (const osg::Uniform* uniform = state->getUniform("behind")) uniform->get(behind);
      if (const osg::Uniform* uniform = state->getUniform("shift")) uniform->get(shift);
      surface->cull_back = state->getAttribute(osg::StateAttribute::CULLFACE) != nullptr;
    }
    surface->behind_m = static_cast<double>(behind);
    const auto& positions = dynamic_cast<const osg::Vec3Array&>(*geometry.getVertexArray());
    surface->positions_W.reserve(positions.size());
    for (const osg::Vec3& p : positions) {
      const osg::Vec3d p_W = osg::Vec3d(p + shift) * place_;
      surface->positions_W.emplace_back(p_W.x(), p_W.y(), p_W.z());
    }
    AppendTriangles(geometry, surface);
    if (const auto* coordinates = dynamic_cast<const osg::Vec4Array*>(geometry.getTexCoordArray(0))) {
      for (const osg::Vec4& c : *coordinates) surface->coordinates.push_back({c[0], c[1], c[2], c[3]});
    }
  }

  std::span<const std::string_view> names_;
  const bool tools_;
  std::set<const osg::Geometry*> seen_;
  const osg::Array* last_ = nullptr;  // Positions of the last surface.
  osg::Matrix place_;
  int tool_ = -1;
  std::map<std::pair<std::string, int>, int> parts_;
};

}  // namespace

std::vector<DrawnSurface> DrawnSurfaces(osg::Node* root) {
  Collector collector(kSurfaces, true);
  root->accept(collector);
  return std::move(collector.surfaces);
}

std::optional<DrawnSurface> DrawnBurn(osg::Node* root) {
  Collector collector(kBurns, false);
  root->accept(collector);
  if (collector.surfaces.empty() || collector.surfaces.front().triangles.empty()) return std::nullopt;
  return std::move(collector.surfaces.front());
}

}  // namespace fulcrum::render
