// Bad geometry with the place where it is, so that a picture can show it.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "services/base/core/error.h"
#include "services/scene/readers/mesh_io.h"

namespace fulcrum::scene {

/// Where an import failed: the meshes at that stage and the place [m], all in one frame.
struct Spot {
  std::vector<TriangleMesh> meshes;  ///< The organ; if there are two, the membrane.
  Vec3d place = Vec3d::Zero();
};

/// Bad input with a place that can be shown.
class SpotError : public InputError {
 public:
  SpotError(const std::string& what, Spot spot) : InputError(what), spot_(std::make_shared<Spot>(std::move(spot))) {}
  [[nodiscard]] const Spot& spot() const { return *spot_; }

 private:
  std::shared_ptr<const Spot> spot_;  ///< Shared: exceptions are copied.
};

}  // namespace fulcrum::scene
