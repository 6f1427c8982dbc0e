// `fulcrum console` as used by a stranger, by its page and by an operator: a real server, real sessions, a raw client.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>

#include "services/session/console/session_run.h"
#include "tests/support/cart.h"
#include "tests/support/http_client.h"

namespace fulcrum::console {
namespace {

namespace fs = std::filesystem;
using fulcrum::testing::ConsoleProgram;
using fulcrum::testing::HttpConnection;
using fulcrum::testing::HttpReply;
using fulcrum::testing::ReadFile;
using fulcrum::testing::WaitFor;

constexpr int kDomain = 64;

class ConsoleTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "fulcrum_console_XXXXXX").string();
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  void TearDown() override { fs::remove_all(folder_); }

  [[nodiscard]] std::string out() const { return folder_ / "out"; }
  [[nodiscard]] std::vector<std::string> Token() const { return {"--token-file", (folder_ / "token").string()}; }
  /// True if the state for the page contains all of these.
  static bool Says(const ConsoleProgram& console, std::initializer_list<const char*> texts) {
    const std::string state = console.Get("/api/state").body;
    return std::all_of(texts.begin(), texts.end(),
                       [&](const char* text) { return state.find(text) != std::string::npos; });
  }
  /// True if the supervisor executes the request. Its answer may be late on a busy machine; the request is then
  /// repeated.
  static bool Obeys(const ConsoleProgram& console, const std::string& call, const std::string& body) {
    const auto number = [&] { return Between(console.Get("/api/state").body, "\"notice\":{\"number\":", ","); };
    for (int attempt = 0; attempt < 3; ++attempt) {
      const std::string before = number();
      if (console.Post(call, body).status != 200 || !WaitFor(20, [&] { return number() != before; })) return false;
      if (Between(console.Get("/api/state").body, "\"notice\":{", "}").find("\"ok\":true") != std::string::npos)
        return true;
    }
    return false;
  }
  static std::string Between(const std::string& text, const std::string& begin, const std::string& end) {
    const std::size_t from = text.find(begin);
    return from == std::string::npos
               ? ""
               : text.substr(from + begin.size(), text.find(end, from + begin.size()) - from - begin.size());
  }

  fs::path folder_;
};

TEST_F(ConsoleTest, StrangersGetThePageAndNothingElse) {
  ConsoleProgram console(kDomain, out(), Token());
  const std::string host = "Host: 127.0.0.1:" + std::to_string(console.port()) + "\r\n";
  const std::string token = "Authorization: Bearer " + console.token() + "\r\n";
  const HttpReply page = console.Ask("GET", "/", host);
  EXPECT_EQ(page.status, 200);
  EXPECT_NE(page.body.find("Fulcrum"), std::string::npos);
  EXPECT_TRUE(page.head.at("content-security-policy").starts_with("default-src 'self';"));
  EXPECT_EQ(page.head.at("x-content-type-options"), "nosniff");

  EXPECT_EQ(console.Get("/api/state").status, 200);
  EXPECT_EQ(console.Ask("GET", "/api/state", host).status, 401);
  EXPECT_EQ(console.Ask("GET", "/api/state", host + "Authorization: Bearer " + std::string(64, '0') + "\r\n").status,
            401);
  EXPECT_EQ(console.Ask("GET", "/api/state", "Host: evil.example\r\n" + token).status, 421);
  EXPECT_EQ(console.Ask("GET", "/api/state", host + host + token).status, 421);
  EXPECT_EQ(console.Ask("GET", "/api/state", token).status, 421);
  EXPECT_EQ(
      console.Ask("POST", "/api/stop", host + token + "Origin: http://evil.example\r\nContent-Length: 0\r\n").status,
      403);
  EXPECT_EQ(
      console.Ask("POST", "/api/stop", host + token + "Sec-Fetch-Site: cross-site\r\nContent-Length: 0\r\n").status,
      403);

  for (const char* target :
       {"/../../etc/passwd", "/%2e%2e/etc/passwd", "/api/picture?name=../../../etc/passwd", "//etc/passwd"}) {
    EXPECT_EQ(console.Ask("GET", target, host + token).status, 400) << target;
  }
  EXPECT_EQ(console.Ask("GET", "/index.htm", host).status, 404);
  EXPECT_EQ(console.Ask("GET", "/api/picture?name=frame_1.png", host + token).status, 404);
  EXPECT_EQ(console.Ask("DELETE", "/", host).status, 405);
  EXPECT_EQ(console.Ask("GET", "/", host + "X: " + std::string(20'000, 'x') + "\r\n").status, 431);
  EXPECT_EQ(console.Ask("POST", "/api/stop", host + token + "Content-Length: 100000\r\n").status, 413);
  EXPECT_EQ(console.Ask("GET ", "/", host).status, 400);
  HttpConnection garbage(console.port());
  garbage.Send(std::string("\0\xff\x16\x03\x01 nothing that is HTTP\r\n\r\n", 31));
  EXPECT_EQ(garbage.Reply().status, 400);

  EXPECT_EQ(console.Post("/api/restart", "node=physics_node").status, 409);
  EXPECT_EQ(console.Post("/api/start", "scene=nothing").status, 404);
  EXPECT_EQ(console.program().End(SIGTERM), 0);
}

TEST_F(ConsoleTest, ASessionFromStartToReport) {
  ConsoleProgram console(kDomain, out(), Token());
  HttpConnection events(console.port());
  events.Send("GET /api/events HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(console.port()) +
              "\r\nAuthorization: Bearer " + console.token() + "\r\n\r\n");
  EXPECT_EQ(events.Reply().head.at("content-type"), "text/event-stream");

  EXPECT_EQ(console.Post("/api/start", "scene=small&power=30&picture_rate=5&seconds=60&record=on").status, 200);
  EXPECT_EQ(console.Post("/api/start", "scene=small").status, 409);
  ASSERT_TRUE(WaitFor(60, [&] { return Says(console, {"\"phase\":\"running\""}); }))
      << ReadFile(out() + "/console.log");
  // All processes run: five of the scene, and the recorder for dumps. Slowness is not a failure in this test.
  EXPECT_TRUE(WaitFor(20, [&] {
    const std::string state = console.Get("/api/state").body;
    std::size_t running = 0;
    for (const char* level : {"\"level\":\"good\",\"word\"", "\"level\":\"busy\",\"word\""}) {
      for (std::size_t at = 0; (at = state.find(level, at)) != std::string::npos; ++at) ++running;
    }
    return running == 6;
  })) << console.Get("/api/state").body;

  std::string name;
  EXPECT_TRUE(
      WaitFor(120, [&] { return !(name = Between(console.Get("/api/state").body, "\"picture\":\"", "\"")).empty(); }));
  const HttpReply picture = console.Get("/api/picture?name=" + name);
  EXPECT_EQ(picture.head.at("content-type"), "image/png");
  EXPECT_TRUE(picture.body.starts_with("\x89PNG\r\n"));
  EXPECT_GT(picture.body.size(), 1000u);
  EXPECT_NE(events.Receive(20, "\"points\":[[").find("data: {"), std::string::npos);

  EXPECT_TRUE(Obeys(console, "/api/restart", "node=thermal_node")) << console.Get("/api/state").body;
  EXPECT_TRUE(WaitFor(120, [&] { return Says(console, {"\"restarts\":1"}); })) << console.Get("/api/state").body;
  EXPECT_TRUE(Obeys(console, "/api/dump", "")) << console.Get("/api/state").body;
  EXPECT_EQ(console.Post("/api/calibrate", "what=handle&tool=0").status, 409);

  EXPECT_EQ(console.Post("/api/stop").status, 200);
  ASSERT_TRUE(WaitFor(60, [&] { return Says(console, {"\"phase\":\"idle\"", "\"has_report\":true"}); }));
  const bool well = Says(console, {"\"ended\":{\"well\":true"});
  EXPECT_EQ(fulcrum::testing::FaultBesidePace(well ? 0 : 1, ReadFile(out() + "/console.log")), "");
  EXPECT_NE(console.Get("/api/summary").body.find("\"scene\": \"small\""), std::string::npos);
  // The session ran with the settings chosen on the page.
  const std::string configuration = ReadFile(fs::path(out()) / "latest" / "configuration.yaml");
  EXPECT_NE(configuration.find("power_W: 30"), std::string::npos);
  EXPECT_EQ(configuration.find("power_W: 35"), std::string::npos);
  EXPECT_NE(configuration.find("png_rate_Hz: 5"), std::string::npos);

  // Other users cannot read the session.
  const fs::path session_folder = fs::canonical(fs::path(out()) / "latest");
  EXPECT_EQ(fs::status(session_folder).permissions(), fs::perms::owner_all);
  for (const fs::path& file : {session_folder / "report.html", fs::path(out()) / "console.log"}) {
    EXPECT_EQ(fs::status(file).permissions(), fs::perms::owner_read | fs::perms::owner_write) << file;
  }

  const std::string report = "/report?ticket=" + Between(console.Post("/api/ticket").body, "\"text\":\"", "\"");
  const std::string host = "Host: 127.0.0.1:" + std::to_string(console.port()) + "\r\n";
  const HttpReply first = console.Ask("GET", report, host);
  EXPECT_EQ(first.status, 200);
  EXPECT_NE(first.head.at("content-security-policy").find("sandbox"), std::string::npos);
  EXPECT_EQ(console.Ask("GET", report, host).status, 401) << "a ticket is valid once";

  const std::string recordings = console.Get("/api/recordings").body;
  EXPECT_NE(recordings.find("/dump.mcap"), std::string::npos) << recordings;
  const std::string session = Between(recordings, "\"name\":\"", "/");
  EXPECT_EQ(console.Post("/api/replay", "name=" + session + "%2Fnothing.mcap").status, 404);
  EXPECT_EQ(console.Post("/api/replay", "name=" + session + "%2Frecording.mcap").status, 200);
  EXPECT_TRUE(WaitFor(60, [&] {
    return Says(console, {"all the same", "\"running\":false", "\"ok\":true"});
  })) << console.Get("/api/state").body;
}

TEST_F(ConsoleTest, ASessionOutlivesItsConsoleAndIsFoundAgain) {
  {
    ConsoleProgram console(kDomain, out(), Token());
    EXPECT_EQ(console.Post("/api/start", "scene=small&seconds=60&record=off").status, 200);
    ASSERT_TRUE(WaitFor(60, [&] { return Says(console, {"\"phase\":\"running\"", "\"own\":true"}); }));
    console.program().End(SIGKILL);
  }
  ConsoleProgram again(kDomain, out(), Token());
  EXPECT_TRUE(WaitFor(120, [&] { return Says(again, {"\"phase\":\"running\"", "\"own\":false"}); }));
  EXPECT_TRUE(WaitFor(120, [&] { return Says(again, {"\"picture\":\"frame_"}); }));
  EXPECT_EQ(again.Post("/api/stop").status, 200);
  EXPECT_TRUE(WaitFor(60, [&] { return Says(again, {"\"phase\":\"idle\"", "\"has_report\":true"}); }));
}

TEST_F(ConsoleTest, TheLivePictureReturnsAfterTheConsoleHadNoDescriptorsForAWhile) {
  ConsoleProgram console(kDomain, out(), Token());
  EXPECT_EQ(console.Post("/api/start", "scene=small&seconds=60&record=off").status, 200);
  ASSERT_TRUE(WaitFor(60, [&] {
    return Says(console, {"\"phase\":\"running\"", "\"picture\":\"frame_"});
  })) << ReadFile(out() + "/console.log");
  const std::string ticket = Between(console.Post("/api/ticket").body, "\"text\":\"", "\"");
  const std::string host = "127.0.0.1:" + std::to_string(console.port());
  HttpConnection page(console.port());
  page.Send("GET /live?ticket=" + ticket + " HTTP/1.1\r\nHost: " + host + "\r\nOrigin: http://" + host +
            "\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n" +
            "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n");
  const std::string there = "\"ready\":true", gone = "\"ready\":false";
  // The console closes a WebSocket whose client is silent for 10 s.
  const auto says = [&](const std::string& what) {
    std::string said;
    return WaitFor(60, [&] {
      page.Send(std::string("\x8a\x80\0\0\0\0", 6));  // A pong without content (RFC 6455, 5.5.3).
      said += page.Receive(1, what);
      return said.find(what) != std::string::npos;
    });
  };
  ASSERT_TRUE(says(there));
  // Without a descriptor it cannot ask for the supervisor, and leaves the session.
  rlimit before{};
  ASSERT_EQ(::prlimit(console.program().pid(), RLIMIT_NOFILE, nullptr, &before), 0);
  const rlimit none{.rlim_cur = 3, .rlim_max = before.rlim_max};
  ASSERT_EQ(::prlimit(console.program().pid(), RLIMIT_NOFILE, &none, nullptr), 0);
  EXPECT_TRUE(says(gone));
  ASSERT_EQ(::prlimit(console.program().pid(), RLIMIT_NOFILE, &before, nullptr), 0);
  EXPECT_TRUE(says(there)) << console.Get("/api/state").body;
  EXPECT_EQ(console.Post("/api/stop").status, 200);
  EXPECT_TRUE(WaitFor(60, [&] { return Says(console, {"\"phase\":\"idle\""}); }));
}

TEST_F(ConsoleTest, ACalibrationIsLedStepByStep) {
  ConsoleProgram console(kDomain, out(), Token());
  EXPECT_EQ(console.Post("/api/calibrate", "what=trocar&tool=0").status, 409)
      << "nothing to measure on a simulated cart";
  EXPECT_EQ(console.Post("/api/calibrate", "what=handle&tool=0").status, 200);
  EXPECT_TRUE(WaitFor(120, [&] { return Says(console, {"Set the jaw to 0 deg", "\"wants_enter\":true"}); }));
  EXPECT_EQ(console.Post("/api/start", "scene=small").status, 409);
  EXPECT_EQ(console.Post("/api/task/enter").status, 200);
  EXPECT_TRUE(WaitFor(120, [&] {
    return Says(console, {"taken from", "Set the jaw to 15 deg", "\"wants_enter\":true"});
  })) << console.Get("/api/state").body;
  EXPECT_EQ(console.Post("/api/task/cancel").status, 200);
  EXPECT_TRUE(WaitFor(120, [&] { return Says(console, {"\"running\":false", "\"cancelled\":true"}); }));
  EXPECT_EQ(console.Post("/api/task/close").status, 200);
  EXPECT_EQ(console.Get("/api/state").body.find("\"task\""), std::string::npos);
}

}  // namespace
}  // namespace fulcrum::console
