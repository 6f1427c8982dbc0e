// A secured cart: real processes, real DDS, real keys.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <linux/if_ether.h>
#include <net/if.h>
#include <netpacket/packet.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <ctime>
#include <fstream>
#include <functional>
#include <optional>
#include <string_view>
#include <thread>

#include "services/base/core/error.h"
#include "services/transport/bus/access.h"
#include "services/transport/bus/dds/shared_memory.h"
#include "services/transport/bus/topics.h"
#include "services/transport/keys/key_folder.h"
#include "tests/support/cart.h"
#include "tests/support/intruder.h"
#include "tests/support/program.h"
#include "tests/support/working_scene.h"

namespace fulcrum {
namespace {

namespace fs = std::filesystem;
using testing::Cart;
using testing::Program;
using testing::ReadFile;
using testing::WaitFor;

constexpr int kAttemptsDomain = 71, kSessionDomain = 72, kEncryptedDomain = 73;
constexpr std::time_t kDay_s = 24 * 3600;
constexpr std::array kNodes = {"handle_bridge", "haptics_node", "physics_node",
                               "thermal_node",  "render_node",  "recorder"};

/// A folder that is removed with the test.
class Scratch {
 public:
  explicit Scratch(const std::string& name)
      : path_(fs::temp_directory_path() / ("fulcrum-security-" + std::to_string(::getpid()) + "-" + name)) {
    fs::remove_all(path_);
    fs::create_directories(path_);
  }
  ~Scratch() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  [[nodiscard]] const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

void Write(const fs::path& file, const std::string& text) { std::ofstream(file, std::ios::binary) << text; }

keys::Validity Today() {
  const std::time_t now = std::time(nullptr);
  return {now, now + kDay_s};
}

// ------------------------------------------------------------------------------------------------------- strangers

TEST(SecuredBus, EveryAttemptIsRefusedAndReported) {
  bus::RemoveSharedMemory(bus::SharedMemoryDirectory(kAttemptsDomain));
  const Scratch scratch("attempts");
  for (const testing::Attempt& attempt : testing::TryAllAttempts(kAttemptsDomain, scratch.path())) {
    SCOPED_TRACE(attempt.name + ": " + attempt.last_line);
    EXPECT_FALSE(attempt.came_through);
    EXPECT_EQ(attempt.exit_code, attempt.wanted_exit_code);
    EXPECT_TRUE(attempt.reported || attempt.wanted_of_cart.empty())
        << "the cart does not report " << attempt.wanted_of_cart;
    EXPECT_TRUE(attempt.wanted_exit_code == 0 || !attempt.last_line.empty());
    RecordProperty(attempt.name, attempt.last_line);
  }
  bus::RemoveSharedMemory(bus::SharedMemoryDirectory(kAttemptsDomain));
}

// -------------------------------------------------------------------------------------------------- whole sessions

/// All packets on the loopback interface; needs the right to capture them (root).
class Sniffer {
 public:
  Sniffer() : socket_(::socket(AF_PACKET, SOCK_DGRAM | SOCK_CLOEXEC, htons(ETH_P_IP))) {
    if (socket_ < 0) {
      problem_ = std::strerror(errno);
      return;
    }
    sockaddr_ll address{};
    address.sll_family = AF_PACKET;
    address.sll_protocol = htons(ETH_P_IP);
    address.sll_ifindex = static_cast<int>(::if_nametoindex("lo"));
    const int buffer = 64 << 20;
    ::setsockopt(socket_, SOL_SOCKET, SO_RCVBUFFORCE, &buffer, sizeof(buffer));
    const timeval patience{0, 100'000};
    ::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience));
    if (::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
      problem_ = std::strerror(errno);
      return;
    }
    thread_ = std::jthread([this](const std::stop_token& stop) {
      std::vector<char> packet(1 << 16);
      while (!stop.stop_requested()) {
        const ssize_t size = ::recv(socket_, packet.data(), packet.size(), 0);
        if (size > 0) Look({packet.data(), static_cast<std::size_t>(size)});
      }
    });
  }
  ~Sniffer() {
    thread_ = {};
    if (socket_ >= 0) ::close(socket_);
  }
  Sniffer(const Sniffer&) = delete;
  Sniffer& operator=(const Sniffer&) = delete;

  [[nodiscard]] const std::string& problem() const { return problem_; }
  /// Packets of this cart (they contain its schema hash) and those of them that contain the name of its scene.
  [[nodiscard]] int packets() const { return packets_; }
  [[nodiscard]] int overheard() const { return overheard_; }

 private:
  void Look(std::string_view packet) {
    packets_ += packet.find("RTPS") != std::string_view::npos ? 1 : 0;
    overheard_ += packet.find(kSceneName) != std::string_view::npos ? 1 : 0;
  }

  static constexpr std::string_view kSceneName = "overheard_scene";
  int socket_;
  std::string problem_;
  std::atomic<int> packets_{0}, overheard_{0};
  std::jthread thread_;
};

/// The small scene under a name that a sniffer can recognise: SceneManifest contains it. Tissue is pulled and cut all
/// the time, so that nodes that authenticate late also take part.
fs::path NamedScene(const fs::path& folder) {
  std::string text = testing::WorkingScene("small", 60);
  const std::string was = "name: small\n";
  text.replace(text.find(was), was.size(), "name: overheard_scene\n");
  Write(folder / "overheard_scene.yaml", text);
  return folder / "overheard_scene.yaml";
}

fs::path SecuredCart(const fs::path& folder, bool encrypt) {
  keys::MakeKeyFolder(folder / "keys", Today(), false);
  Write(folder / "cart.yaml", std::string("security: {keys: keys, encrypt: ") + (encrypt ? "true" : "false") + "}\n");
  return folder / "cart.yaml";
}

std::string Logs(const fs::path& session) {
  std::string text;
  for (const auto& entry : fs::directory_iterator(session / "logs")) text += ReadFile(entry.path());
  return text;
}

/// Output of a program that must end by itself.
std::string RunProgram(const std::string& program, const std::vector<std::string>& arguments, int wanted_code) {
  Program run(program, arguments);
  std::optional<int> code;
  EXPECT_TRUE(WaitFor(60, [&] { return (code = run.Poll()).has_value(); })) << program << " does not end";
  EXPECT_EQ(code, wanted_code) << run.Said();
  return run.Said();
}

TEST(SecuredSession, EndsWellWithAllNodesAndTellsWhoWasRefused) {
  const Scratch scratch("session");
  const fs::path cart_file = SecuredCart(scratch.path(), false);
  const std::string domain = std::to_string(kSessionDomain);
  const Sniffer sniffer;
  Cart cart(NamedScene(scratch.path()), kSessionDomain, {"--cart", cart_file, "--record"});
  // The nodes authenticate one after the other: some are received seconds before the last.
  std::string status;
  EXPECT_TRUE(WaitFor(60,
                      [&] {
                        Program run("fulcrum", {"status", "--domain", domain});
                        const bool runs = run.End(0) == 0;
                        status = run.Said();
                        return runs && std::ranges::all_of(kNodes, [&](const char* node) {
                                 return status.find(node) != std::string::npos;
                               });
                      }))
      << status << cart.Said();
  // A node that is only stopped for a while must stay matched: the library does not authenticate a participant again
  // after it has removed it.
  const auto nodes = cart.nodes();
  const auto handles = nodes.find("handle_bridge");
  ASSERT_NE(handles, nodes.end()) << cart.Said();
  const auto stopped = std::chrono::steady_clock::now();
  ::kill(handles->second, SIGSTOP);
  std::this_thread::sleep_for(std::chrono::milliseconds(800));  // A stop of a second would be a fault of the session.
  ::kill(handles->second, SIGCONT);
  const std::chrono::duration<double> stop = std::chrono::steady_clock::now() - stopped;
  // A killed node joins again with its keys; a node with keys of another cart does not.
  const auto thermal = nodes.find("thermal_node");
  ASSERT_NE(thermal, nodes.end()) << cart.Said();
  ::kill(thermal->second, SIGKILL);
  const Scratch elsewhere("elsewhere");
  const std::string stranger = RunProgram("handle_bridge",
                                          {"--scene", cart.session() / "scene.fulcrum", "--session", scratch.path(),
                                           "--domain", domain, "--cart", SecuredCart(elsewhere.path(), false)},
                                          3);
  EXPECT_NE(stranger.find("has keys of another authority"), std::string::npos) << stranger;

  // A node with foreign keys detects only after seconds that no leader with its keys is present; the session lasts
  // until then.
  cart.Signal(SIGINT);
  const std::string fault = cart.FaultAtEnd(90);
  // On a busy machine the stop may have lasted longer than this test asked for.
  const bool long_stop = stop.count() > 1 && fault.find("handle_bridge was silent") != std::string::npos;
  ASSERT_EQ(long_stop ? "" : fault, "");
  const std::string summary = ReadFile(cart.session() / "summary.json");
  EXPECT_NE(summary.find("\"thermal_node.restarts\": 1"), std::string::npos) << summary;
  EXPECT_NE(summary.find("\"handle_bridge.restarts\": 0"), std::string::npos) << summary;
  EXPECT_NE(summary.find("\"refused.participants\": 1"), std::string::npos) << summary << cart.Said();
  EXPECT_NE(summary.find("\"refused.endpoints\": 0"), std::string::npos) << summary;
  EXPECT_NE(ReadFile(cart.session() / "report.html").find("Refused on the bus"), std::string::npos);
  EXPECT_NE(cart.Said().find("has keys of another authority"), std::string::npos) << cart.Said();
  EXPECT_EQ(Logs(cart.session()).find("may not"), std::string::npos) << Logs(cart.session());
  if (sniffer.problem().empty()) {
    EXPECT_GT(sniffer.overheard(), 0)
        << "the name must be found here, or the test of the encrypted session checks nothing";
  }
}

TEST(SecuredSession, EncryptedCannotBeOverheard) {
  const Scratch scratch("encrypted");
  const fs::path cart_file = SecuredCart(scratch.path(), true);
  const Sniffer sniffer;
  Cart cart(NamedScene(scratch.path()), kEncryptedDomain, {"--cart", cart_file, "--seconds", "8"});
  ASSERT_EQ(cart.FaultAtEnd(90), "");
  EXPECT_NE(ReadFile(cart.session() / "summary.json").find("\"refused.participants\": 0"), std::string::npos);
  if (!sniffer.problem().empty()) {
    GTEST_SKIP() << "the session ended well, but its packets were not captured: no raw socket for this user ("
                 << sniffer.problem() << "); run as root";
  }
  EXPECT_GT(sniffer.packets(), 1000);
  EXPECT_EQ(sniffer.overheard(), 0);
}

// ------------------------------------------------------------------------------------------------- table and keys

TEST(AccessTable, GivesEachTopicOfOneOwnerToOneNodeOnly) {
  for (const bus::TopicRole& topic : bus::kTopicRoles) {
    const auto writers = std::ranges::count_if(bus::kAccessRoles, [&](const bus::AccessRole& role) {
      return !bus::StandsIn(role.identity) && bus::Contains(role.writes, topic.id);
    });
    EXPECT_TRUE(topic.one_owner() ? writers == 1 : writers > 0) << topic.name << " has " << writers;
  }
  for (int node = 0; node < kNodeCount; ++node) {
    EXPECT_NE(bus::AccessRoleOf(NodeName(static_cast<NodeId>(node))), nullptr) << node;
  }
}

/// Refusal of a folder in which `change` was applied to the keys of render_node.
std::string ProblemAfter(const std::function<void(const keys::KeyFiles& files)>& change, std::time_t later_s = 0) {
  const Scratch scratch("folder");
  const fs::path folder = scratch.path() / "keys";
  keys::MakeKeyFolder(folder, Today(), false);
  change(keys::KeyFilesOf(folder, "render_node", false));
  try {
    keys::CheckIdentity(folder, "render_node", false, std::time(nullptr) + later_s);
  } catch (const InputError& problem) {
    return problem.what();
  }
  return "";
}

void ExpectSaid(const std::string& text, const std::vector<std::string>& parts) {
  for (const std::string& part : parts) EXPECT_NE(text.find(part), std::string::npos) << text;
}

TEST(KeyFolder, SaysWhatIsWrongWithAKeyAndWhatToDo) {
  const auto nothing = [](const keys::KeyFiles&) {};
  EXPECT_EQ(ProblemAfter(nothing), "");
  ExpectSaid(ProblemAfter([](const auto& files) { fs::remove(files.key); }),
             {"render_node.key", "No such file", "fulcrum keys init"});
  ExpectSaid(ProblemAfter([](const auto& files) { Write(files.key, "no key"); }),
             {"render_node.key", "is no private key"});
  ExpectSaid(ProblemAfter([](const auto& files) {
               fs::copy_file(files.key.parent_path() / "recorder.key", files.key, fs::copy_options::overwrite_existing);
             }),
             {"render_node.key", "not the key of the certificate"});
  ExpectSaid(ProblemAfter([](const auto& files) { fs::permissions(files.key, fs::perms(0640)); }),
             {"render_node.key", "open to others", "0640", "chmod 0600"});
  ExpectSaid(ProblemAfter([](const auto& files) { fs::permissions(files.key.parent_path(), fs::perms(0755)); }),
             {"open to others", "0755", "chmod 0700"});
  ExpectSaid(ProblemAfter([](const auto& files) { Write(files.certificate, ""); }),
             {"render_node.pem", "is no certificate"});
  ExpectSaid(ProblemAfter([](const auto& files) {
               fs::copy_file(files.key.parent_path() / "recorder.pem", files.certificate,
                             fs::copy_options::overwrite_existing);
             }),
             {"render_node.pem", "issued to \"recorder\""});
  ExpectSaid(ProblemAfter([](const auto& files) {
               std::string text = ReadFile(files.permissions);
               text.replace(text.find("ThermalEvent"), 12, "ToolState");
               Write(files.permissions, text);
             }),
             {"render_node.p7s", "changed"});
  ExpectSaid(ProblemAfter([](const auto& files) { Write(files.governance, "<dds/>"); }),
             {"governance.p7s", "no signed document"});
  ExpectSaid(ProblemAfter(nothing, 2 * kDay_s), {"render_node.pem", "today is", "fulcrum keys init --force"});
  ExpectSaid(ProblemAfter(nothing, -kDay_s), {"render_node.pem", "set the clock right"});
  ExpectSaid(ProblemAfter([](const auto& files) {
               const fs::path other = files.key.parent_path().parent_path() / "other";
               keys::MakeKeyFolder(other, Today(), false);
               fs::copy_file(other / "authority.pem", files.authority, fs::copy_options::overwrite_existing);
             }),
             {"authority", "changed"});
}

TEST(KeysCommand, MakesShowsAndChecksAndOverwritesNothing) {
  const Scratch scratch("command");
  const std::string folder = scratch.path() / "keys";
  ExpectSaid(RunProgram("fulcrum", {"keys", "init", folder, "--days", "30"}, 0),
             {"security: {keys: " + folder, "until"});
  const std::string key = ReadFile(scratch.path() / "keys" / "physics_node.key");
  ExpectSaid(RunProgram("fulcrum", {"keys", "init", folder}, 2), {"has keys already", "--force"});
  EXPECT_EQ(ReadFile(scratch.path() / "keys" / "physics_node.key"), key);
  ExpectSaid(RunProgram("fulcrum", {"keys", "show", folder}, 0),
             {"physics_node", "30 days", "writes TissueFrame, ContactModel, CauteryContact", "reads  everything"});
  ExpectSaid(RunProgram("fulcrum", {"keys", "check", folder}, 0), {"✓ physics_node"});
  const std::string out = scratch.path() / "probe-keys";
  ExpectSaid(RunProgram("fulcrum", {"keys", "issue", "probe", "--read", "Health", "--out", out, "--keys", folder}, 0),
             {"write nothing", "read Health", out});
  ExpectSaid(RunProgram("fulcrum", {"keys", "show", folder}, 0), {"probe", "guest, key handed over"});
  ExpectSaid(RunProgram("fulcrum", {"keys", "issue", "x", "--read", "Pulse", "--keys", folder}, 2),
             {"--read", "\"Pulse\"", "ToolState", "Health"});
  RunProgram("fulcrum", {"keys", "revoke", "probe", "--keys", folder}, 0);
  ExpectSaid(RunProgram("fulcrum", {"keys", "show", folder}, 0), {"guest, key handed over, revoked"});
  ExpectSaid(RunProgram("fulcrum", {"keys", "check", folder}, 0), {"– probe: revoked", "✓ physics_node"});
  fs::permissions(fs::path(folder) / "physics_node.key", fs::perms(0644));
  ExpectSaid(RunProgram("fulcrum", {"keys", "check", folder}, 2), {"✗ physics_node", "open to others"});
  RunProgram("fulcrum", {"keys", "init", folder, "--force"}, 0);
  EXPECT_NE(ReadFile(scratch.path() / "keys" / "physics_node.key"), key);
  Write(fs::path(folder) / "notes.txt", "mine");
  ExpectSaid(RunProgram("fulcrum", {"keys", "init", folder, "--force"}, 2), {"notes.txt", "is no key"});
  ExpectSaid(RunProgram("fulcrum", {"keys", "init", folder, "--days", "0"}, 2), {"1 to 3650"});
  ExpectSaid(RunProgram("fulcrum", {"keys", "made"}, 2), {"init, show, check"});
}

}  // namespace
}  // namespace fulcrum
