// Which of several sources of OperatorInput operates. haptics_node and handle_bridge both hold one, and the same
// samples give the same choice.
#pragma once

#include <cstdint>

#include "services/base/core/messages.h"

namespace fulcrum {

/// After this time without a sample [ns] the operator counts as absent: tools are let go and pedals are up.
inline constexpr std::int64_t kOperatorSilence_ns = 250'000'000;

class OperatorChoice {
 public:
  /// Takes a received sample. True if it is of the present operator: the source with the newest claim. A source that
  /// releases the controls is followed by none until one claims them later than that source had: a source whose claim
  /// is older may still send what its operator wanted before.
  bool Add(const OperatorInput& input) {
    if (input.claim_ns == 0) {
      const bool same_writer = input.source == newest_.source && input.stamp.epoch == newest_.stamp.epoch;
      if (!same_writer || newest_.claim_ns == 0) return false;
      released_ns_ = newest_.claim_ns;
    } else if (input.claim_ns < newest_.claim_ns || input.claim_ns <= released_ns_) {
      return false;
    }
    newest_ = input;
    return true;
  }

  /// Newest sample of the present operator; null: there is none, or none for kOperatorSilence_ns.
  /// @param now_ns CLOCK_MONOTONIC [ns].
  [[nodiscard]] const OperatorInput* At(std::int64_t now_ns) const {
    const bool operates = newest_.claim_ns != 0 && now_ns - newest_.stamp.stamp_ns <= kOperatorSilence_ns;
    return operates ? &newest_ : nullptr;
  }

 private:
  OperatorInput newest_;
  std::int64_t released_ns_ = 0;  ///< Claim that was released last; 0: none.
};

}  // namespace fulcrum
