// Any bytes as a request to the console's routes, one field of it a line (route_check.h).
#include "tests/fuzz/console/route_check.h"
#include "tests/fuzz/target.h"

namespace fulcrum::fuzz {
namespace {

class ConsoleRoute final : public Target {
 public:
  Outcome Offer(Input input) override {
    const console::HttpRequest request = console::testing::RequestFrom(TextOf(input));
    const std::string broken = console::testing::Broken(request);
    Promise(broken.empty(), broken);
    return Route(access_, request).routed ? Outcome::kAccepted : Outcome::kRefused;
  }

 private:
  const console::Access access_{console::testing::kToken, {"cart"}};
};

}  // namespace

std::unique_ptr<Target> MakeConsoleRoute() { return std::make_unique<ConsoleRoute>(); }

}  // namespace fulcrum::fuzz
