#include "physics_node/node/contact_pace.h"

#include <algorithm>

namespace fulcrum::physics {
namespace {

/// Tissue slower than this counts as that slow.
constexpr double kLeastPace = 0.1;
/// A viscosity is not increased beyond this [N s/m]: the servo refuses contacts with twice as much.
constexpr float kMostViscous = 1000;

}  // namespace

void ToRealTime(double pace, DeviceContacts* device) {
  const auto slower = static_cast<float>(std::clamp(pace, kLeastPace, 1.0));
  device->p_ext_W *= slower;
  for (std::uint32_t i = 0; i < device->count; ++i) {
    Contact& contact = device->contacts[i];
    contact.v_s *= slower;
    contact.du_c *= slower;
    contact.b_body = std::min(contact.b_body / slower, std::max(contact.b_body, kMostViscous));
  }
}

}  // namespace fulcrum::physics
