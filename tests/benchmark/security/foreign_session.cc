#include "tests/benchmark/security/foreign_session.h"

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "services/transport/bus/dds/participant.h"
#include "services/transport/bus/input_account.h"
#include "services/transport/bus/topics.h"
#include "tests/support/cart.h"
#include "tests/support/replay_run.h"
#include "tests/support/session_bus.h"
#include "tests/unit/bus/samples.h"

namespace fulcrum {
namespace {

constexpr int kForeignDomain = 77;
constexpr double kForeignPatience_s = 120;

/// Publishes valid samples of a topic as another session would, newer than those of the session.
template <class T>
class Stranger {
 public:
  explicit Stranger(bus::DdsParticipant* participant) : output_(participant->MakeOutput<T>()) {}
  void Write() {
    const std::int64_t now_ns = std::chrono::steady_clock::now().time_since_epoch().count();
    T message = bus::test::Sample<T>();
    bus::MutableStampOf(&message) = stamper_.Next(now_ns);
    written_ += output_->Write(message) ? 1 : 0;
  }
  [[nodiscard]] std::uint64_t written() const { return written_; }

 private:
  bus::Stamper stamper_{std::chrono::steady_clock::now().time_since_epoch().count()};
  std::unique_ptr<typename bus::OutputOf<T>::type> output_;
  std::uint64_t written_ = 0;
};

}  // namespace

std::string MeasureForeignSession(benchmark::Report* report) {
  // Without keys: only the number of the session distinguishes the two.
  testing::Cart cart("small", kForeignDomain, {"--open-bus", "--record", "--seconds", report->quick() ? "4" : "8"});
  bus::DdsSettings settings = testing::ReaderOf(kForeignDomain, "supervisor");
  const std::uint64_t session = bus::AnnouncedSession(settings.shared_memory);
  settings.session = session + 1;
  bus::DdsParticipant participant(settings);
  Stranger<ToolState> tools(&participant);
  Stranger<HandleState> handles(&participant);
  Stranger<ContactModel> models(&participant);
  Stranger<CauteryContact> contacts(&participant);
  Stranger<TopologyState> topology(&participant);
  Stranger<GeneratorSetting> generator(&participant);
  Stranger<SceneManifest> manifests(&participant);
  Stranger<TickManifest> ticks(&participant);
  Stranger<Health> healths(&participant);
  std::optional<int> code;
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; !(code = cart.WaitForEnd(0)); ++i) {
    if (std::chrono::steady_clock::now() - begin > std::chrono::duration<double>(kForeignPatience_s)) return "no end";
    tools.Write();
    if (i % 5 == 0) {
      handles.Write();
      models.Write();
      contacts.Write();
      ticks.Write();
    }
    if (i % 50 == 0) {
      topology.Write();
      generator.Write();
      manifests.Write();
      healths.Write();
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  const testing::ReplayRun replay = testing::Replay(cart.session() / "recording.mcap",
                                                    {"--into", "haptics", "physics", "thermal"}, kForeignPatience_s);
  std::fprintf(stderr, "session: exit code %d, %s\n", *code, cart.Said().substr(cart.Said().rfind("s of \"")).c_str());
  // Every state of every node follows from what the session itself has published: with nothing mixed in, a replay of
  // the recorded inputs reaches the same hashes.
  double mismatches = 0, compared = 0;
  for (const char* node : {"haptics_node", "physics_node", "thermal_node"}) {
    const auto figure = [&](const char* name) {
      const auto found = replay.figures.find(std::string(node) + name);
      return found == replay.figures.end() ? std::nan("") : found->second;
    };
    mismatches += figure(".mismatches");
    compared += figure(".compared");
  }
  report->Add("security.foreign_session_effect", mismatches, "");
  report->Add("security.foreign_session.ticks_compared", compared, "");
  report->Add("security.foreign_session.sent",
              static_cast<double>(tools.written() + handles.written() + topology.written() + generator.written()), "");
  // If no sample was dropped, no foreign sample reached a node.
  const std::string said = cart.Said(), before = "nodes dropped ";
  const std::size_t at = said.rfind(before);
  if (at == std::string::npos) return "no sample of the stranger arrived";
  report->Add("security.foreign_session.dropped_when_named", std::atof(said.c_str() + at + before.size()), "");
  return {};
}

}  // namespace fulcrum
