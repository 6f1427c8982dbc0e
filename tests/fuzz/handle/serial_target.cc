// Any bytes from a serial line, through framer, gates, channels and estimator.
#include "tests/fuzz/handle/protocol_check.h"
#include "tests/fuzz/target.h"

namespace fulcrum::fuzz {
namespace {

class HandleSerial final : public Target {
 public:
  Outcome Offer(Input input) override {
    const auto* bytes = reinterpret_cast<const char*>(input.data());
    const handle_bridge::ProtocolVerdict verdict = handle_bridge::CheckProtocol({bytes, input.size()});
    Promise(verdict.broken.empty(), verdict.broken);
    const int good = verdict.good_lines + verdict.good_frames + verdict.good_pedals;
    return good > 0 ? Outcome::kAccepted : Outcome::kRefused;
  }
};

}  // namespace

std::unique_ptr<Target> MakeHandleSerial() { return std::make_unique<HandleSerial>(); }

}  // namespace fulcrum::fuzz
