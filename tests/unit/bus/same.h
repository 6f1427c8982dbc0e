// Equality of messages in every field. Beside the messages, so that argument lookup finds it.
#pragma once

#include "services/base/core/message_difference.h"

namespace fulcrum {

template <HasFields T>
bool Same(const T& a, const T& b) {
  return !FirstDifference(a, b);
}

}  // namespace fulcrum
