// `fulcrum console` under attack: silent connections, floods of headers, garbage for TLS, and its output about the
// token.
#include "tests/support/siege.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "tests/support/cart.h"
#include "tests/support/http_client.h"

namespace fulcrum::console {
namespace {

namespace fs = std::filesystem;
using fulcrum::testing::ConsoleProgram;
using fulcrum::testing::HttpConnection;
using fulcrum::testing::OpenDescriptors;
using fulcrum::testing::Program;
using fulcrum::testing::ReadFile;
using fulcrum::testing::Siege;
using fulcrum::testing::WaitFor;

constexpr int kDomain = 66;
// Slots of guests and of clients with the token, and a few sockets that may be open for a moment.
constexpr std::size_t kMostSockets = 256 + 32 + 8;

class SiegeTest : public ::testing::Test {
 protected:
  void SetUp() override {
    ::signal(SIGPIPE, SIG_IGN);
    std::string name = (fs::temp_directory_path() / "fulcrum_siege_XXXXXX").string();
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    folder_ = name;
    ::setenv("XDG_STATE_HOME", (folder_ / "state").c_str(), 1);
  }
  void TearDown() override {
    ::unsetenv("XDG_STATE_HOME");
    fs::remove_all(folder_);
  }
  [[nodiscard]] std::vector<std::string> Words(std::vector<std::string> more = {}) const {
    more.insert(more.end(), {"--token-file", (folder_ / "token").string()});
    return more;
  }
  [[nodiscard]] std::string out() const { return folder_ / "out"; }

  fs::path folder_;
};

std::vector<std::string> ManyAddresses() {
  std::vector<std::string> addresses;
  for (int i = 2; i < 102; ++i) addresses.push_back("127.0.0." + std::to_string(i));
  return addresses;
}

TEST_F(SiegeTest, TheOperatorIsAnsweredBesideAThousandSilentConnections) {
  ConsoleProgram console(kDomain, out(), Words());
  const std::size_t before = OpenDescriptors(console.program().pid());
  HttpConnection held(console.port());
  const std::string ask =
      "GET /api/state HTTP/1.1\r\nHost: 127.0.0.1\r\nAuthorization: Bearer " + console.token() + "\r\n\r\n";
  held.Send(ask);
  ASSERT_EQ(held.Reply().status, 200);
  for (const auto& from : {std::vector<std::string>{"127.0.0.1"}, ManyAddresses()}) {
    Siege siege(console.port(), {.connections = 1000, .from = from, .said = from.size() > 1 ? "GET / HT" : ""});
    ASSERT_TRUE(WaitFor(20, [&] { return siege.made() > 1000; }));
    for (int i = 0; i < 20; ++i) {
      EXPECT_EQ(console.Post("/api/stop").status, 409) << "no session runs";
      held.Send(ask);
      EXPECT_EQ(held.Reply().status, 200) << "a connection that has presented the token stays";
      EXPECT_LE(OpenDescriptors(console.program().pid()), before + kMostSockets);
    }
  }
  EXPECT_EQ(console.program().End(SIGTERM), 0);
}

TEST_F(SiegeTest, HeadersThatDoNotEndAreCutOff) {
  ConsoleProgram console(kDomain, out(), Words());
  Siege siege(console.port(), {.connections = 200, .said = "GET / HTTP/1.1\r\n" + std::string(60'000, 'a')});
  ASSERT_TRUE(WaitFor(20, [&] { return siege.made() > 400; }));
  EXPECT_EQ(console.Get("/api/state").status, 200);
  HttpConnection many(console.port());
  std::string lines = "GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n";
  for (int i = 0; i < 3000; ++i) lines += "X" + std::to_string(i) + ": 1\r\n";
  many.Send(lines + "\r\n");
  const int status = many.Reply().status;
  EXPECT_TRUE(status == 431 || status == 0) << status;
  EXPECT_EQ(console.program().End(SIGTERM), 0);
}

TEST_F(SiegeTest, BeyondThisMachineEverythingIsOverTls) {
  ConsoleProgram console(kDomain, out(), Words({"--bind", "0.0.0.0", "--host-name", "cart-3"}));
  ASSERT_TRUE(console.tls());
  const std::string said = console.program().Said();
  EXPECT_NE(said.find("open https://cart-3:"), std::string::npos) << said;
  HttpConnection client(console.port(), {.tls = true});
  EXPECT_NE(said.find("SHA-256 " + client.fingerprint()), std::string::npos) << said;
  EXPECT_EQ(console.Get("/api/state").status, 200);
  const std::string head =
      "Host: cart-3:" + std::to_string(console.port()) + "\r\nAuthorization: Bearer " + console.token() + "\r\n";
  EXPECT_EQ(console
                .Ask("POST", "/api/stop",
                     head + "Content-Length: 0\r\nOrigin: http://cart-3:" + std::to_string(console.port()) + "\r\n")
                .status,
            403)
      << "without TLS it is another origin";
  EXPECT_EQ(console
                .Ask("POST", "/api/stop",
                     head + "Content-Length: 0\r\nOrigin: https://cart-3:" + std::to_string(console.port()) + "\r\n")
                .status,
            409);
  for (const char* name : {"console.key", "console.pem"}) {
    struct stat status {};
    ASSERT_EQ(::stat((folder_ / "state" / "fulcrum" / name).c_str(), &status), 0) << name;
    EXPECT_EQ(status.st_mode & 0777u, 0600u) << name;
  }
  EXPECT_EQ(console.program().End(SIGTERM), 0);
  // The next start has the same certificate.
  ConsoleProgram again(kDomain, out(), Words({"--bind", "0.0.0.0"}));
  EXPECT_NE(again.program().Said().find(client.fingerprint()), std::string::npos);
  EXPECT_EQ(again.program().Said().find(", new;"), std::string::npos);
}

TEST_F(SiegeTest, HandshakesThatDoNotEndAndGarbageHoldNobodyUp) {
  ConsoleProgram console(kDomain, out(), Words({"--bind", "0.0.0.0"}));
  const std::size_t before = OpenDescriptors(console.program().pid());
  std::mt19937 random(7);
  std::string noise(3000, '\0');
  for (char& c : noise) c = static_cast<char>(random());
  const std::string begun("\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03", 11);
  for (const std::string& said : {begun, noise, begun + noise}) {
    Siege siege(console.port(), {.connections = 300, .from = ManyAddresses(), .said = said});
    ASSERT_TRUE(WaitFor(20, [&] { return siege.made() > 600; }));
    for (int i = 0; i < 5; ++i) {
      EXPECT_EQ(console.Get("/api/state").status, 200);
      EXPECT_LE(OpenDescriptors(console.program().pid()), before + kMostSockets);
    }
  }
  // All opened sockets are closed again.
  EXPECT_TRUE(WaitFor(10, [&] { return OpenDescriptors(console.program().pid()) <= before + 1; }))
      << OpenDescriptors(console.program().pid()) << " descriptors, " << before << " before";
  EXPECT_EQ(console.program().End(SIGTERM), 0);
}

TEST_F(SiegeTest, FewDescriptorsAreEnough) {
  // The console must neither spin nor stop answering when the system has no descriptor for one more connection.
  Program console("/bin/sh",
                  {"-c", "ulimit -n 64; exec \"$@\"", "sh", FULCRUM_BIN_DIR "/fulcrum", "console", "--port", "0",
                   "--domain", std::to_string(kDomain), "--out", out(), "--token-file", (folder_ / "token").string()});
  ASSERT_TRUE(WaitFor(20, [&] { return console.Said().find("Ctrl-C ends") != std::string::npos; })) << console.Said();
  const std::string said = console.Said();
  const std::size_t at = said.find("127.0.0.1:");
  const int port = std::stoi(said.substr(at + 10));
  std::string token = ReadFile(folder_ / "token");
  token.pop_back();
  Siege siege(port, {.connections = 300, .from = ManyAddresses()});
  ASSERT_TRUE(WaitFor(20, [&] { return siege.made() > 350; }));
  EXPECT_TRUE(WaitFor(10, [&] {
    HttpConnection client(port);
    client.Send("GET /api/state HTTP/1.1\r\nHost: 127.0.0.1\r\nAuthorization: Bearer " + token + "\r\n\r\n");
    return client.Reply(1).status == 200;
  }));
  EXPECT_EQ(console.End(SIGTERM), 0);
}

TEST_F(SiegeTest, TheTokenIsInItsFileOnly) {
  ConsoleProgram console(kDomain, out(), Words());
  ASSERT_GE(console.token().size(), 16u);
  EXPECT_EQ(console.Get("/api/state").status, 200);
  EXPECT_EQ(console.Get("/" + console.token()).status, 404);
  EXPECT_EQ(console.Post("/api/start", "scene=nothing").status, 404);
  EXPECT_EQ(console.program().End(SIGTERM), 0);
  EXPECT_EQ(console.program().Said().find(console.token()), std::string::npos);
  EXPECT_NE(console.program().Said().find((folder_ / "token").string()), std::string::npos);
}

}  // namespace
}  // namespace fulcrum::console
