// The force of the tissue on a tool, as every node shows and scores it (idl/README.md, Forces). Pure.
#pragma once

#include <algorithm>

#include "services/base/core/messages.h"

namespace fulcrum {

/// Force of the tissue on a tool at the time of the model, frame W [N]: the sum of its contacts that touch.
[[nodiscard]] inline Vec3d TissueForce(const DeviceContacts& contacts) {
  Vec3d force = Vec3d::Zero();
  for (std::uint32_t i = 0; i < std::min<std::uint32_t>(contacts.count, kMaxContacts); ++i) {
    const Contact& contact = contacts.contacts[i];
    const bool touches =
        contact.kind == ContactKind::kGrasp || (contact.kind == ContactKind::kSurface && contact.gap <= 0);
    if (touches) force += contact.f_ref.cast<double>();
  }
  return force;
}

}  // namespace fulcrum
