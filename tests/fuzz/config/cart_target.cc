// A cart's description: refused with the file's name, or read to a cart that is written and read again unchanged.
#include "services/base/config/cart.h"
#include "services/base/core/error.h"
#include "tests/fuzz/config/keys_of.h"
#include "tests/fuzz/line_mutator.h"
#include "tests/fuzz/target.h"

namespace fulcrum::fuzz {
namespace {

const std::filesystem::path kShipped = FULCRUM_SOURCE_DIR "/deploy/carts";

class Cart final : public Target {
 public:
  Outcome Offer(Input input) override {
    std::string yaml;
    try {
      yaml = config::CartToYaml(config::LoadCartText(std::string(TextOf(input)), "cart.yaml"));
    } catch (const InputError& refusal) {
      Promise(std::string_view(refusal.what()).starts_with("cart.yaml"), "a refusal that names no file");
      return Outcome::kRefused;
    }
    try {
      Promise(config::CartToYaml(config::LoadCartText(yaml, "again.yaml")) == yaml, "it is not read as it is written");
    } catch (const InputError& refusal) {
      throw BrokenPromise(std::string("what was written is refused: ") + refusal.what());
    }
    return Outcome::kAccepted;
  }
  Bytes Mutate(Input input, unsigned seed) override { return BytesOf(MutateLines(TextOf(input), seed)); }
  std::vector<std::string> Words() override { return KeysOf(config::CartRules(kShipped / "simulated.yaml")); }
  std::vector<Seed> Seeds() override { return FilesOf("deploy/carts", ".yaml"); }
};

}  // namespace

std::unique_ptr<Target> MakeCart() { return std::make_unique<Cart>(); }

}  // namespace fulcrum::fuzz
