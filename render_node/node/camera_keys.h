// Keys of the window that move the camera.
#pragma once

#include <map>
#include <optional>
#include <osgGA/GUIEventAdapter>

#include "render_node/geometry/camera_control.h"

namespace fulcrum::render {

/// @param key an X key symbol.
[[nodiscard]] inline std::optional<CameraKey> CameraKeyOf(int key) {
  static const std::map<int, CameraKey> kKeys{{osgGA::GUIEventAdapter::KEY_Left, CameraKey::kLeft},
                                              {osgGA::GUIEventAdapter::KEY_Right, CameraKey::kRight},
                                              {osgGA::GUIEventAdapter::KEY_Up, CameraKey::kUp},
                                              {osgGA::GUIEventAdapter::KEY_Down, CameraKey::kDown},
                                              {'+', CameraKey::kNearer},
                                              {'-', CameraKey::kFarther},
                                              {'r', CameraKey::kRollLeft},
                                              {'t', CameraKey::kRollRight},
                                              {'0', CameraKey::kReset}};
  const auto found = kKeys.find(key);
  return found == kKeys.end() ? std::nullopt : std::optional(found->second);
}

}  // namespace fulcrum::render
