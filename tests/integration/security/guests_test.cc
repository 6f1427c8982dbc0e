// A third-party tool on a secured bus: admitted while the session runs, limited to its rights, revoked. Real DDS, real
// keys, the command as a user types it. The test of a guest with a forged local state is among the other attempts
// (security_test.cc, tests/support/intruder.h).
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <memory>
#include <optional>

#include "services/base/core/error.h"
#include "services/transport/bus/dds/participant.h"
#include "services/transport/bus/dds/shared_memory.h"
#include "services/transport/bus/input_account.h"
#include "services/transport/keys/issuing.h"
#include "tests/support/cart.h"
#include "tests/support/program.h"

namespace fulcrum {
namespace {

namespace fs = std::filesystem;
using testing::Program;
using testing::WaitFor;

constexpr int kDomain = 76;
constexpr std::time_t kDay_s = 24 * 3600;
// A handshake takes 0.3 s on a busy machine; one that lost a message is retried after 1 s.
constexpr double kPatience_s = 20;

/// The keys of a session where `fulcrum up` stores them, and its supervisor, which publishes Health.
class RunningSession : public ::testing::Test {
 protected:
  RunningSession() {
    RemoveSession();
    bus::PrepareSharedMemory(memory_);
    const std::time_t now = std::time(nullptr);
    keys::MakeSessionKeys(folder_, {now, now + kDay_s});
    bus::AnnounceSession(memory_, {folder_, {}});
    fs::remove_all(out_);
    supervisor_ = Join("supervisor");
    healths_ = supervisor_->MakeOutput<Health>();
    tools_ = supervisor_->MakeInput<ToolState>();
  }
  ~RunningSession() override {
    tools_.reset();
    healths_.reset();
    supervisor_.reset();
    RemoveSession();
    std::error_code ignored;
    fs::remove_all(out_, ignored);
  }
  void RemoveSession() const {
    keys::RemoveSessionKeys(folder_);
    bus::RemoveSharedMemory(memory_);
  }

  [[nodiscard]] std::unique_ptr<bus::DdsParticipant> Join(const std::string& identity) const {
    return std::make_unique<bus::DdsParticipant>(
        bus::DdsSettings{.domain = kDomain, .node_name = identity, .security = {folder_, identity}});
  }
  /// A tool that joins under the name recorder with the keys of probe.
  [[nodiscard]] bus::DdsSettings Guest(std::uint64_t schema_hash = bus::SchemaHash()) const {
    return {.domain = kDomain, .node_name = "recorder", .schema_hash = schema_hash, .security = {out_, "probe"}};
  }
  /// `fulcrum keys` with these words, for the session in this domain.
  std::string Keys(std::vector<std::string> words, int wanted_code = 0) const {
    words.insert(words.begin(), "keys");
    words.insert(words.end(), {"--domain", std::to_string(kDomain)});
    Program run("fulcrum", words);
    std::optional<int> code;
    EXPECT_TRUE(WaitFor(kPatience_s, [&] { return (code = run.Poll()).has_value(); }));
    EXPECT_EQ(code, wanted_code) << run.Said();
    return run.Said();
  }
  void WriteHealth() {
    Health health;
    health.stamp = stamper_.Next(std::chrono::steady_clock::now().time_since_epoch().count());
    healths_->Write(health);
  }
  bool Receives(bus::Input<Health>* input, double limit_s = kPatience_s) {
    return WaitFor(limit_s, [&] {
      WriteHealth();
      Health health;
      return input->TakeNext(&health);
    });
  }
  static bool Tells(const bus::DdsParticipant& participant, const std::string& part) {
    return std::ranges::any_of(participant.refusals().texts,
                               [&](const std::string& text) { return text.find(part) != std::string::npos; });
  }

  const fs::path memory_ = bus::SharedMemoryDirectory(kDomain), folder_ = memory_ / "keys";
  const fs::path out_ = fs::temp_directory_path() / ("fulcrum-guest-" + std::to_string(::getpid()));
  std::unique_ptr<bus::DdsParticipant> supervisor_;
  std::unique_ptr<bus::Output<Health>> healths_;
  std::unique_ptr<bus::Input<ToolState>> tools_;
  bus::Stamper stamper_{std::chrono::steady_clock::now().time_since_epoch().count()};
};

/// Message of the InputError that `action` throws; empty: none.
template <class Action>
std::string Problem(const Action& action) {
  try {
    action();
  } catch (const InputError& problem) {
    return problem.what();
  }
  return {};
}

TEST_F(RunningSession, AdmitsAGuestAtOnceAndGivesItItsRightsOnly) {
  Keys({"issue", "probe", "--read", "Health", "--out", out_});
  bus::DdsParticipant guest(Guest());
  const auto healths = guest.MakeInput<Health>();
  EXPECT_TRUE(Receives(healths.get()));
  EXPECT_TRUE(supervisor_->HasParticipant("probe"));
  EXPECT_FALSE(supervisor_->HasParticipant("recorder")) << "a guest passes for a participant of the cart";
  for (const std::string& text : {Problem([&] { (void)guest.MakeOutput<ToolState>(); }),
                                  Problem([&] { (void)guest.MakeInput<TissueFrame>(); })}) {
    EXPECT_NE(text.find("access control refuses it to \"probe\""), std::string::npos) << text;
  }
  EXPECT_EQ(supervisor_->refusals().count(), 0u) << supervisor_->refusals().texts.front();
}

TEST_F(RunningSession, IsWrittenToByAGuestThatMay) {
  Keys({"issue", "probe", "--write", "ToolState", "--out", out_});
  bus::DdsParticipant guest(Guest());
  const auto tools = guest.MakeOutput<ToolState>();
  EXPECT_TRUE(WaitFor(kPatience_s, [&] { return tools_->stats().matched; }));
  EXPECT_EQ(supervisor_->refusals().count(), 0u);
}

TEST_F(RunningSession, IsNotEndedByAGuestOfAnotherSchema) {
  Keys({"issue", "probe", "--read", "Health", "--out", out_});
  bus::DdsParticipant guest(Guest(bus::SchemaHash() + 1));
  EXPECT_TRUE(WaitFor(kPatience_s, [&] { return Tells(*supervisor_, "the guest probe uses schema"); }));
  EXPECT_EQ(supervisor_->schema_mismatch(), "");
}

TEST_F(RunningSession, RefusesARevokedGuestFromTheNextParticipantOn) {
  Keys({"issue", "probe", "--read", "Health", "--out", out_});
  EXPECT_NE(Keys({"revoke", "probe"}).find("Participants that start from now on refuse it"), std::string::npos);
  bus::DdsParticipant guest(Guest());
  const auto healths = guest.MakeInput<Health>();
  EXPECT_TRUE(Receives(healths.get())) << "the library reads the list at the start only; if this fails, it reads it "
                                          "later, too, and help and DESIGN must say so";
  const auto restarted = Join("haptics_node");
  EXPECT_TRUE(WaitFor(kPatience_s, [&] { return Tells(*restarted, "certificate revoked"); }));
  EXPECT_TRUE(WaitFor(kPatience_s, [&] { return restarted->HasParticipant("supervisor"); }));
  EXPECT_FALSE(restarted->HasParticipant("probe"));
  // The state after the restart of every participant.
  tools_.reset();
  healths_.reset();
  supervisor_.reset();
  supervisor_ = Join("supervisor");
  healths_ = supervisor_->MakeOutput<Health>();
  EXPECT_TRUE(WaitFor(kPatience_s, [&] { return Tells(*supervisor_, "certificate revoked"); }));
  Health health;
  while (healths->TakeNext(&health)) {
  }
  EXPECT_FALSE(Receives(healths.get(), 2));
}

TEST(KeysCommand, NamesTheMissingSession) {
  bus::RemoveSharedMemory(bus::SharedMemoryDirectory(kDomain));
  Program run("fulcrum", {"keys", "issue", "probe", "--read", "Health", "--domain", std::to_string(kDomain)});
  EXPECT_EQ(run.End(0), 2);
  EXPECT_NE(run.Said().find("no session with keys runs in domain 76"), std::string::npos) << run.Said();
}

}  // namespace
}  // namespace fulcrum
