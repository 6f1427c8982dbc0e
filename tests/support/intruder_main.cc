// The other process of an attempt (tests/support/intruder.h):
//   security_intruder DOMAIN NAME KEYS IDENTITY           our own program with these keys; KEYS "-": without any
//   security_intruder DOMAIN NAME KEYS IDENTITY CA FIFO   one with a forged local state: it accepts the authorities in
//                                                         CA, and reads its permissions from FIFO at each use
// Writes ToolState and reads SceneManifest. Exit codes as in exit_code.h; 5: a sample of the cart arrived.
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <thread>

#include "services/base/core/error.h"
#include "services/base/core/exit_code.h"
#include "services/transport/bus/convert/cdr.h"
#include "services/transport/bus/dds/participant.h"
#include "tests/support/rogue.h"
#include "tests/unit/bus/samples.h"

namespace fulcrum {
namespace {

constexpr int kHeard = 5;
constexpr auto kLongest = std::chrono::seconds(12);
// Or until the cart has reported it: SIGTERM ends it well.
constexpr auto kForgedFor = std::chrono::seconds(15);
// Participants that a forger makes, one after the other: once in some fifteen runs on a busy machine the cart has not
// met one within 25 s.
constexpr int kForgers = 3;

ToolState Forged() {
  ToolState state = bus::test::Sample<ToolState>();
  const std::int64_t now = std::chrono::steady_clock::now().time_since_epoch().count();
  state.stamp = {1, static_cast<std::uint64_t>(now), now};
  return state;
}

int Knock(const bus::DdsSettings& settings) {
  bus::DdsParticipant participant(settings);
  const auto tools = participant.MakeOutput<ToolState>();
  const auto scenes = participant.MakeInput<SceneManifest>();
  ToolState state = Forged();
  const auto begin = std::chrono::steady_clock::now();
  while (std::chrono::steady_clock::now() - begin < kLongest) {
    tools->Write(state);
    ++state.stamp.sequence;
    SceneManifest scene;
    if (scenes->TakeNext(&scene)) return kHeard;
    if (const std::string mismatch = participant.schema_mismatch(); !mismatch.empty()) throw MismatchError(mismatch);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return 0;
}

int Run(int argc, char** argv) {
  const int domain = std::stoi(argv[1]);
  bus::DdsSettings settings{.domain = domain, .node_name = argv[2]};
  if (std::string(argv[3]) != "-") {
    std::string identity = argv[4];
    const bool encrypt = identity.ends_with("/encrypt");
    settings.security = {argv[3], identity.substr(0, identity.find('/')), encrypt};
  }
  if (argc < 7) return Knock(settings);
  std::signal(SIGTERM, [](int) { ::_exit(0); });
  std::vector<std::uint8_t> bytes;
  if (!bus::EncodeCdr(Forged(), &bytes)) return 1;
  for (int i = 0; i < kForgers; ++i) {
    testing::WriteForgedTools(domain, argv[2], settings.security, argv[5], argv[6], bytes, kForgedFor);
  }
  return 0;
}

}  // namespace
}  // namespace fulcrum

int main(int argc, char** argv) {
  using fulcrum::ExitCode;
  const auto fail = [](ExitCode code, const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return static_cast<int>(code);
  };
  try {
    return argc < 5 ? 2 : fulcrum::Run(argc, argv);
  } catch (const fulcrum::InputError& error) {
    return fail(ExitCode::kBadUsage, error);
  } catch (const fulcrum::MismatchError& error) {
    return fail(ExitCode::kMismatch, error);
  } catch (const std::exception& error) {
    return fail(ExitCode::kFailure, error);
  }
}
