// Datagrams that a process without keys forges under the GUID of a writer of a keyed session: real sockets, real DDS.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "services/transport/bus/convert/cdr.h"
#include "services/transport/bus/dds/participant.h"
#include "services/transport/bus/dds/shared_memory.h"
#include "services/transport/keys/key_folder.h"
#include "tests/support/cart.h"
#include "tests/unit/bus/samples.h"

namespace fulcrum {
namespace {

namespace fs = std::filesystem;

constexpr int kDomain = 70;
constexpr std::uint64_t kSession = 0x1122334455667788, kEarlierSession = 0x8877665544332211;
constexpr float kForged_m = 0.123f;  // Position that only forged tools have.
constexpr double kPatience_s = 20;
constexpr int kSome = 200, kMany = 10'000;  // Forged datagrams, one every 2 ms or later.

/// An RTPS message with one DATA submessage from `writer` to all its readers (RTPS 2.3, 8.3.7.2, 9.4.5.3).
std::vector<std::uint8_t> DataMessage(const bus::WriterGuid& writer, std::uint64_t number,
                                      const std::vector<std::uint8_t>& payload) {
  std::vector<std::uint8_t> message{'R', 'T', 'P', 'S', 2, 3, 1, 15};
  message.insert(message.end(), writer.begin(), writer.begin() + 12);
  const auto size = static_cast<std::uint16_t>(20 + payload.size());
  const auto put16 = [&](std::uint16_t v) {
    message.push_back(static_cast<std::uint8_t>(v & 0xff));
    message.push_back(static_cast<std::uint8_t>(v >> 8));
  };
  message.push_back(0x15);  // DATA
  message.push_back(0x05);  // little endian, with payload
  put16(size);
  put16(0);
  put16(16);                                    // from here to the payload
  message.insert(message.end(), {0, 0, 0, 0});  // ENTITYID_UNKNOWN: every matched reader
  message.insert(message.end(), writer.begin() + 12, writer.end());
  for (const auto half : {static_cast<std::uint32_t>(number >> 32), static_cast<std::uint32_t>(number)}) {
    put16(static_cast<std::uint16_t>(half & 0xffff));
    put16(static_cast<std::uint16_t>(half >> 16));
  }
  message.insert(message.end(), payload.begin(), payload.end());
  return message;
}

/// Sends to the user ports of all participants that a domain can have here (RTPS 2.3, 9.6.1.1).
void SendToAll(const std::vector<std::uint8_t>& message) {
  const int udp = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  for (int participant = 0; participant < 8; ++participant) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_addr.s_addr = ::inet_addr("127.0.0.1");
    to.sin_port = htons(static_cast<std::uint16_t>(7400 + 250 * kDomain + 11 + 2 * participant));
    (void)::sendto(udp, message.data(), message.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
  }
  ::close(udp);
}

class Forgery : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("forgery_test." + std::to_string(::getpid()));
    const std::time_t now = std::time(nullptr);
    keys::MakeKeyFolder(folder_, {now, now + 24 * 3600}, false);
    bus::RemoveSharedMemory(bus::SharedMemoryDirectory(kDomain));
    servo_ = Join("haptics_node");
    physics_ = Join("physics_node");
    recorder_ = Join("recorder");
    tools_ = servo_->MakeOutput<ToolState>();
    heard_ = physics_->MakeInput<ToolState>();
    raw_ = recorder_->MakeRawInput(TopicId::kToolState, [this](const bus::RawSample& sample) {
      std::vector<std::uint8_t> bytes;
      for (const auto& part : {sample.head, sample.body}) {
        for (const std::byte byte : part) bytes.push_back(std::to_integer<std::uint8_t>(byte));
      }
      ToolState tool;
      const std::lock_guard lock(mutex_);
      writer_ = sample.writer;
      ++recorded_;
      forged_recorded_ += !bus::DecodeCdr(bytes, &tool) || IsForged(tool) ? 1 : 0;
    });
    // Both readers have matched the true writer.
    ASSERT_TRUE(testing::WaitFor(kPatience_s, [this] {
      Write();
      const std::lock_guard lock(mutex_);
      return recorded_ > 0 && heard_->TakeLatest(&tool_);
    }));
  }
  void TearDown() override {
    raw_.reset();
    heard_.reset();
    tools_.reset();
    recorder_.reset();
    physics_.reset();
    servo_.reset();
    bus::RemoveSharedMemory(bus::SharedMemoryDirectory(kDomain));
    fs::remove_all(folder_);
  }

  std::unique_ptr<bus::DdsParticipant> Join(const char* identity) const {
    return std::make_unique<bus::DdsParticipant>(bus::DdsSettings{
        .domain = kDomain, .node_name = identity, .security = {folder_, identity}, .session = kSession});
  }
  void Write() { tools_->Write(bus::test::Sample<ToolState>(++number_)); }

  static bool IsForged(const ToolState& tool) { return tool.tools[0].p_WT.x() == kForged_m; }

  /// Forges at most `most` tools with this session in their stamps. @return whether a node received one.
  bool ForgedAreHeard(std::uint64_t session, int most) {
    ToolState forged = bus::test::Sample<ToolState>(number_ + 1000);
    forged.stamp.epoch = static_cast<std::uint64_t>(std::chrono::steady_clock::now().time_since_epoch().count());
    forged.tools[0].p_WT.x() = kForged_m;
    std::vector<std::uint8_t> bytes;
    EXPECT_TRUE(bus::EncodeCdr(forged, &bytes));
    constexpr std::size_t kSessionAt = 4 + 24;  // Encapsulation, then number, epoch and time of the stamp.
    std::memcpy(bytes.data() + kSessionAt, &session, sizeof session);
    bool heard = false;
    for (int i = 0; i < most && !heard; ++i) {
      forged_number_ += 1;
      SendToAll(DataMessage(writer_, 1'000'000 + forged_number_, bytes));
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
      while (heard_->TakeNext(&tool_)) heard |= IsForged(tool_);
    }
    return heard;
  }
  std::uint64_t ForgedRecorded() {
    const std::lock_guard lock(mutex_);
    return forged_recorded_;
  }
  /// Most datagrams of a test were dropped for their session.
  static bool Drops(const bus::DdsParticipant& participant) {
    return testing::WaitFor(kPatience_s, [&] { return participant.foreign_samples() > 100; });
  }

  fs::path folder_;
  std::unique_ptr<bus::DdsParticipant> servo_, physics_, recorder_;
  std::unique_ptr<bus::Output<ToolState>> tools_;
  std::unique_ptr<bus::Input<ToolState>> heard_;
  std::unique_ptr<bus::RawInput> raw_;
  std::mutex mutex_;  ///< Guards writer_, recorded_ and forged_recorded_.
  bus::WriterGuid writer_{};
  std::uint64_t recorded_ = 0, forged_recorded_ = 0, number_ = 0, forged_number_ = 0;
  ToolState tool_;
};

TEST_F(Forgery, ASampleWithoutTheSessionsNumberIsDroppedAndCounted) {
  EXPECT_FALSE(ForgedAreHeard(0, kSome));
  EXPECT_FALSE(ForgedAreHeard(kSession + 1, kSome));
  EXPECT_TRUE(Drops(*physics_)) << "the datagrams did not arrive: the test checks nothing";
  EXPECT_TRUE(Drops(*recorder_));
  EXPECT_EQ(ForgedRecorded(), 0u) << "a forged sample was recorded";
  EXPECT_EQ(heard_->stats().rejected, 0u);
}

TEST_F(Forgery, PacketsOfAnEarlierSessionAreDroppedAndCounted) {
  EXPECT_FALSE(ForgedAreHeard(kEarlierSession, kSome));
  EXPECT_TRUE(Drops(*physics_)) << "the datagrams did not arrive: the test checks nothing";
}

// Effect of the number: with it the same datagram is a valid sample, which only encryption prevents.
TEST_F(Forgery, WithTheNumberTheSameDatagramWouldBeHeard) { EXPECT_TRUE(ForgedAreHeard(kSession, kMany)); }

}  // namespace
}  // namespace fulcrum
