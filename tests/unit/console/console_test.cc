// The console's parts: access, the meaning of requests, the display of terminals, advice to the operator.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>

#include "services/base/core/error.h"
#include "services/base/core/tick.h"
#include "services/session/console/access.h"
#include "services/session/console/advice.h"
#include "services/session/console/form.h"
#include "services/session/console/library.h"
#include "services/session/console/live_state.h"
#include "services/session/console/opinion.h"
#include "services/session/console/page.h"
#include "services/session/console/router.h"
#include "services/session/console/screen_text.h"
#include "services/session/console/session_run.h"
#include "services/session/console/training_group.h"

namespace fulcrum::console {
namespace {

namespace fs = std::filesystem;

const std::string kToken(64, 'a');

Access TestAccess() { return {kToken, {"cart-3"}}; }
HttpRequest Get(const std::string& target) {
  HttpRequest request;
  request.method = "GET";
  request.target = target;
  request.host = "127.0.0.1:8480";
  request.authorization = "Bearer " + kToken;
  return request;
}
HttpRequest Post(const std::string& target, const std::string& body = "") {
  HttpRequest request = Get(target);
  request.method = "POST";
  request.origin = "http://127.0.0.1:8480";
  request.content_type = "application/x-www-form-urlencoded;charset=UTF-8";
  request.body = body;
  return request;
}
int StatusOf(const HttpRequest& request) {
  const RouteResult result = Route(TestAccess(), request);
  return result.routed ? 200 : result.refusal.status;
}

TEST(Form, DecodesWhatABrowserSends) {
  const auto form = ParseForm("scene=built-in&power=35.5&text=a+b%2Fc%C3%A9");
  ASSERT_TRUE(form);
  EXPECT_EQ(form->at("scene"), "built-in");
  EXPECT_EQ(form->at("text"), "a b/c\xc3\xa9");
  EXPECT_TRUE(ParseForm("")->empty());
}

TEST(Form, RefusesWhatIsNotPlainlyRight) {
  for (const char* bad :
       {"a", "=b", "a=%", "a=%4", "a=%zz", "a=%00", "a=%0a", "a=1&a=2", "A=1", "a=1&&b=2", "a%20=1"}) {
    EXPECT_FALSE(ParseForm(bad)) << bad;
  }
  EXPECT_FALSE(ParseForm("a=" + std::string(5000, 'x')));
}

TEST(Form, TargetsAreNamesAndNothingElse) {
  EXPECT_EQ(ParseTarget("/api/picture?name=frame_1.png")->path, "/api/picture");
  for (const char* bad :
       {"", "x", "/..", "/a/../b", "//", "/a//b", "/.git", "/%2e%2e/", "/a\\b", "http://x/", "/a?b", "/a b"}) {
    EXPECT_FALSE(ParseTarget(bad)) << bad;
  }
}

TEST(Form, NamesOfFilesCannotLeaveTheirFolder) {
  EXPECT_TRUE(IsPictureName("frame_000123.png"));
  for (const char* bad :
       {"frame_.png", "frame_1.png/", "../frame_1.png", "frame_1.PNG", "frame_1a.png", "frame_1.png\n"}) {
    EXPECT_FALSE(IsPictureName(bad)) << bad;
  }
  EXPECT_TRUE(IsRecordingName("20260101-120000-small/recording-2.mcap"));
  for (const char* bad :
       {"recording.mcap", "../a.mcap", "a/../b.mcap", "a/.mcap", "a/b/c.mcap", "/a.mcap", "a/b.png"}) {
    EXPECT_FALSE(IsRecordingName(bad)) << bad;
  }
}

TEST(Access, OnlyTheWholeTokenOpens) {
  EXPECT_TRUE(SameSecret(kToken, kToken));
  EXPECT_FALSE(SameSecret("", kToken));
  EXPECT_FALSE(SameSecret(kToken.substr(1), kToken));
  EXPECT_FALSE(SameSecret(kToken + "a", kToken));
  EXPECT_FALSE(SameSecret(kToken.substr(1) + "b", kToken));
  EXPECT_NE(MakeToken(), MakeToken());
  EXPECT_EQ(MakeToken().size(), 64u);
}

TEST(Access, HostsOfOthersAreRefused) {
  const Access access = TestAccess();
  for (const char* good :
       {"127.0.0.1", "127.0.0.1:8480", "localhost:1", "LocalHost", "[::1]:8480", "192.168.0.7:80", "cart-3"}) {
    EXPECT_TRUE(access.IsOwnHost(good)) << good;
  }
  for (const char* bad : {"", ":80", "evil.example", "evil.example:8480", "127.0.0.1.evil.example", "localhost:",
                          "localhost:x", "[::1", "localhost.evil", "cart-3.evil", "127.0.0.1:8480:1", "127.0.0.1 "}) {
    EXPECT_FALSE(access.IsOwnHost(bad)) << bad;
  }
  using std::string_literals::operator""s;
  EXPECT_FALSE(access.IsOwnHost("127.0.0.1\0.evil.example"s)) << "an address up to the NUL";
}

class TokenFile : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "fulcrum_token_XXXXXX").string();
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path folder_;
};

TEST_F(TokenFile, IsItsOwnersAlone) {
  const fs::path file = folder_ / "deep" / "token";
  WriteToken(file, kToken);
  struct stat status {};
  ASSERT_EQ(::stat(file.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777u, 0600u);
  EXPECT_EQ(ReadToken(file), kToken);
  ::chmod(file.c_str(), 0640);
  EXPECT_THROW((void)ReadToken(file), InputError);
}

TEST_F(TokenFile, ThatHoldsNoTokenIsRefused) {
  for (const char* bad :
       {"", "short\n", "sixteen letters and spaces\n", "aaaaaaaaaaaaaaaaaaaa\nbbbbbbbbbbbbbbbbbbbbb\n"}) {
    const fs::path file = folder_ / "token";
    std::ofstream(file) << bad;
    ::chmod(file.c_str(), 0600);
    EXPECT_THROW((void)ReadToken(file), InputError) << bad;
  }
  fs::create_symlink("token", folder_ / "link");
  EXPECT_THROW((void)ReadToken(folder_ / "link"), InputError);
}

TEST(Router, EveryCallNeedsTheToken) {
  for (const char* call : {"/api/state", "/api/events", "/api/choices", "/api/recordings", "/api/nothing",
                           "/api/picture?name=frame_1.png"}) {
    HttpRequest request = Get(call);
    request.authorization = "";
    EXPECT_EQ(StatusOf(request), 401) << call;
    request.authorization = "Bearer " + std::string(64, 'b');
    EXPECT_EQ(StatusOf(request), 401) << call;
    request.authorization = kToken;
    EXPECT_EQ(StatusOf(request), 401) << call;
  }
  HttpRequest page = Get("/");
  page.authorization = "";
  EXPECT_EQ(StatusOf(page), 200);
}

TEST(Router, PagesOfOthersAreRefused) {
  HttpRequest request = Post("/api/stop");
  EXPECT_EQ(StatusOf(request), 200);
  request.host = "evil.example";
  EXPECT_EQ(StatusOf(request), 421);
  request = Post("/api/stop");
  for (const char* origin : {"http://evil.example", "null", "https://127.0.0.1:8480", "http://127.0.0.1:81"}) {
    request.origin = origin;
    EXPECT_EQ(StatusOf(request), 403) << origin;
  }
  request = Post("/api/stop");
  request.fetch_site = "cross-site";
  EXPECT_EQ(StatusOf(request), 403);
}

TEST(Router, FieldsAreCheckedByTheTable) {
  EXPECT_EQ(StatusOf(Post("/api/start", "scene=small&power=40&seconds=20&record=off&picture_rate=5")), 200);
  for (const char* bad : {"", "scene=", "scene=..%2Fx", "scene=a&power=0", "scene=a&power=1e2", "scene=a&power=nan",
                          "scene=a&seconds=-1", "scene=a&record=yes", "scene=a&more=1", "scene=a&picture_rate=1000"}) {
    EXPECT_EQ(StatusOf(Post("/api/start", bad)), 400) << bad;
  }
  EXPECT_EQ(StatusOf(Post("/api/questionnaire/answers", "session=a&answers=0,1,2,3,4,5,0,1,2,3,4,5")), 200);
  EXPECT_EQ(StatusOf(Post("/api/questionnaire/answers", "session=../a&answers=0,1,2,3,4,5,0,1,2,3,4,5")), 400);
  EXPECT_EQ(StatusOf(Post("/api/questionnaire/answers", "answers=0,1,2,3,4,5,0,1,2,3,4,5")), 400) << "of which session";
  EXPECT_EQ(StatusOf(Post("/api/questionnaire/answers")), 400);
  EXPECT_EQ(StatusOf(Post("/api/restart", "node=physics_node")), 200);
  EXPECT_EQ(StatusOf(Post("/api/restart", "node=supervisor")), 400);
  EXPECT_EQ(StatusOf(Post("/api/calibrate", "what=handle&tool=2")), 400);
  EXPECT_EQ(StatusOf(Get("/api/picture?name=..%2F..%2Fetc%2Fpasswd")), 400);
  EXPECT_EQ(StatusOf(Get("/report?ticket=1")), 400);
  EXPECT_EQ(StatusOf(Post("/api/start", "scene=small&hands=on")), 200);
  EXPECT_EQ(StatusOf(Post("/api/start", "scene=small&hands=mouse")), 400);
}

TEST(Router, AStartNamesThePersonThatThePageShows) {
  EXPECT_EQ(StatusOf(Post("/api/start", "scene=line&trainee=me&person=Ann%20M%C3%BCller")), 200);
  EXPECT_EQ(StatusOf(Post("/api/start", "scene=line&trainee=me&person=")), 400);
}

TEST(Router, AWebSocketNeedsATicketAndThisPage) {
  for (const std::string path : {"/live", "/film"}) {
    SCOPED_TRACE(path);
    EXPECT_EQ(StatusOf(Get(path)), 400);
    EXPECT_EQ(StatusOf(Get(path + "?ticket=1")), 400);
    HttpRequest request = Get(path + "?ticket=" + std::string(64, 'a'));
    request.authorization.clear();  // A browser sends none with a WebSocket.
    EXPECT_EQ(StatusOf(request), 200);
    request.origin = "http://evil.example";
    EXPECT_EQ(StatusOf(request), 403);
    request.origin.clear();
    request.fetch_site = "cross-site";
    EXPECT_EQ(StatusOf(request), 403);
  }
}

TEST(Tickets, AreValidOnceAndForAMinute) {
  Tickets tickets;
  const std::string first = tickets.Issue(0), second = tickets.Issue(kSecond_ns);
  EXPECT_FALSE(tickets.Use("", 0));
  EXPECT_FALSE(tickets.Use(std::string(64, 'a'), 0));
  EXPECT_TRUE(tickets.Use(second, 2 * kSecond_ns));
  EXPECT_FALSE(tickets.Use(second, 2 * kSecond_ns)) << "once";
  EXPECT_FALSE(tickets.Use(first, 60 * kSecond_ns)) << "a minute";
  const std::string old = tickets.Issue(0);
  for (std::size_t i = 0; i < Tickets::kMost; ++i) EXPECT_NE(tickets.Issue(0), old);
  EXPECT_FALSE(tickets.Use(old, 1)) << "the oldest of too many";
}

TEST(Router, MethodsAndBodies) {
  EXPECT_EQ(StatusOf(Get("/api/start")), 405);
  EXPECT_EQ(StatusOf(Post("/api/state")), 405);
  EXPECT_EQ(StatusOf(Post("/")), 405);
  HttpRequest request = Get("/");
  request.method = "TRACE";
  EXPECT_EQ(StatusOf(request), 405);
  request = Post("/api/start", "{\"scene\":\"small\"}");
  request.content_type = "application/json";
  EXPECT_EQ(StatusOf(request), 415);
  EXPECT_EQ(StatusOf(Post("/api/stop?x=1")), 400);
}

TEST(Page, HoldsItsFilesAndNothingOfOthers) {
  ASSERT_NE(FindPageFile("/"), nullptr);
  EXPECT_EQ(FindPageFile("/")->path, "/index.html");
  EXPECT_NE(FindPageFile("/")->text.find("<html lang=\"en\">"), std::string_view::npos);
  EXPECT_EQ(FindPageFile("/console.js")->type, "text/javascript; charset=utf-8");
  EXPECT_EQ(FindPageFile("/nothing"), nullptr);
  for (const PageFile& file : PageFiles()) {
    EXPECT_EQ(file.text.find("://"),
              file.path == "/icon.svg" ? file.text.find("://www.w3.org/2000/svg") : std::string_view::npos)
        << file.path;
    EXPECT_EQ(file.text.find("style=\""), std::string_view::npos) << file.path << ": the policy refuses it";
    EXPECT_EQ(file.text.find("onclick="), std::string_view::npos) << file.path;
  }
}

TEST(ScreenText, ShowsWhatATerminalWould) {
  ScreenText screen;
  screen.Add("one\r\ntwo 10 %\rtwo 20 %\r\033[Kthree\n\033[1mfour\033[0m");
  EXPECT_EQ(screen.Text(), "one\nthree\nfour");
  screen.Add("\a\b\x7f\xff!");
  EXPECT_EQ(screen.last(), "four\xff!");
  EXPECT_EQ(screen.Text(), "one\nthree\nfour?!");
}

TEST(ScreenText, IsBounded) {
  ScreenText screen;
  for (int i = 0; i < 1000; ++i) screen.Add(std::string(1000, 'x') + "\n");
  EXPECT_LE(screen.Text().size(), ScreenText::kMostLines * (ScreenText::kLongestLine + 1));
}

TEST(ScreenText, ValidUtf8KeepsWhatIsValid) {
  EXPECT_EQ(ValidUtf8("a\xc3\xa9\xe2\x82\xac\xf0\x9f\x98\x80"), "a\xc3\xa9\xe2\x82\xac\xf0\x9f\x98\x80");
  EXPECT_EQ(ValidUtf8("\xc0\x80"), "??");
  EXPECT_EQ(ValidUtf8("\xed\xa0\x80"), "???");
  EXPECT_EQ(ValidUtf8("\xe2\x82"), "??");
}

// ------------------------------------------------------------------------------------------------ advice

constexpr std::int64_t kNow = 100'000'000'000;

Health Healthy(NodeId node) {
  Health health;
  health.node = node;
  health.pid = 7;
  health.state = HealthState::kRunning;
  health.stamp.stamp_ns = kNow - 50'000'000;
  health.rate_asked_Hz = 100;
  health.rate_achieved_Hz = 99.8f;
  return health;
}

TEST(Advice, ConditionsAreColourAndWord) {
  Health health = Healthy(NodeId::kPhysics);
  const auto word = [&] { return std::string(ConditionOf({NodeId::kPhysics, &health}, kNow).word); };
  const auto level = [&] { return std::string(ConditionOf({NodeId::kPhysics, &health}, kNow).level); };
  EXPECT_EQ(word(), "Healthy");
  EXPECT_EQ(level(), "good");
  health.rate_achieved_Hz = 70;
  EXPECT_EQ(word(), "Slow");
  health.state = HealthState::kDegraded;
  EXPECT_EQ(word(), "Impaired");
  EXPECT_EQ(level(), "busy");
  health.stamp.stamp_ns = kNow - 2'000'000'000;
  EXPECT_EQ(word(), "Silent");
  EXPECT_EQ(level(), "bad");
  health.pid = 0;
  EXPECT_EQ(word(), "Starting");
}

TEST(Advice, SaysNothingWhenAllIsWell) {
  const Health physics = Healthy(NodeId::kPhysics), thermal = Healthy(NodeId::kThermal);
  SituationReport situation;
  situation.now_ns = kNow;
  situation.begun = true;
  situation.nodes = {{NodeId::kPhysics, &physics}, {NodeId::kThermal, &thermal}};
  EXPECT_TRUE(WarningsOf(situation).empty());
}

TEST(Advice, ThePatientComesFirstAndEachHasSomethingToDo) {
  Health physics = Healthy(NodeId::kPhysics);
  physics.stamp.stamp_ns = kNow - 3'000'000'000;
  const Health thermal = Healthy(NodeId::kThermal);
  SituationReport situation;
  situation.now_ns = kNow;
  situation.begun = true;
  situation.nodes = {{NodeId::kPhysics, &physics}, {NodeId::kThermal, &thermal, 1, kNow - 1'000'000'000}};
  situation.events_ns[static_cast<std::size_t>(ThermalEventKind::kUreterWarning)] = kNow - 1'000'000'000;
  const std::vector<Warning> warnings = WarningsOf(situation);
  ASSERT_EQ(warnings.size(), 3u);
  EXPECT_STREQ(warnings[0].level, "danger");
  EXPECT_NE(warnings[0].text.find("ureter"), std::string::npos);
  EXPECT_NE(warnings[1].text.find("silent for 3 s"), std::string::npos);
  EXPECT_NE(warnings[2].text.find("restarted"), std::string::npos);
  for (const Warning& warning : warnings) EXPECT_FALSE(warning.todo.empty()) << warning.text;
  // A warning of heat ends without further events; an injury stays.
  situation.now_ns += 60'000'000'000;
  EXPECT_STRNE(WarningsOf(situation)[0].level, "danger");
  situation.events_ns[static_cast<std::size_t>(ThermalEventKind::kSolidBurn)] = situation.now_ns;
  EXPECT_NE(WarningsOf(situation)[0].text.find("burns the surface of an organ"), std::string::npos);
  situation.events_ns[static_cast<std::size_t>(ThermalEventKind::kNerveInjury)] = kNow;
  EXPECT_NE(WarningsOf(situation)[0].text.find("nerve is injured"), std::string::npos);
}

// ------------------------------------------------------------------------------------------------ library, orders

TEST(Library, ListsTheShippedScenesWithTheirPower) {
  const auto scenes = FindScenes(FULCRUM_SOURCE_DIR "/deploy/scenes");
  const auto small = std::find_if(scenes.begin(), scenes.end(), [](const SceneChoice& s) { return s.name == "small"; });
  ASSERT_NE(small, scenes.end());
  EXPECT_EQ(small->power_W, 35);
  EXPECT_EQ(small->duration_s, 6);
  EXPECT_EQ(small->picture_rate_Hz, 2);
  // An exercise has the script of the scene that it is based on.
  const auto exercise =
      std::find_if(scenes.begin(), scenes.end(), [](const SceneChoice& s) { return s.name == "dissection"; });
  ASSERT_NE(exercise, scenes.end());
  EXPECT_EQ(exercise->power_W, 35);
  EXPECT_EQ(exercise->duration_s, 20);
  EXPECT_EQ(exercise->description.find("Exercise: "), 0u);
  EXPECT_TRUE(FindScenes("/nonexistent").empty());
}

TEST(SessionRun, WordsOfAnOrder) {
  SessionRunSettings settings;
  settings.out = "/o";
  settings.cart = "/c.yaml";
  SessionOrder order;
  order.scene = "/s.yaml";
  order.power_W = 40;
  order.record = false;
  const std::vector<std::string> wanted{"up", "/s.yaml", "--out",   "/o",    "--domain",           "7", "--keep-last",
                                        "30", "--cart",  "/c.yaml", "--set", "script.power_W=40.0"};
  EXPECT_EQ(UpWords(settings, order), wanted);
  settings.database = "/d.sqlite";
  order.trainee = "Ann";
  const std::vector<std::string> words = UpWords(settings, order);
  const std::vector<std::string> scored{"--trainee", "Ann", "--database", "/d.sqlite"};
  EXPECT_TRUE(std::equal(scored.begin(), scored.end(), words.end() - 4));
}

TEST(SessionRun, TraineesOperateWithTheTouchOfTheCartAndDemonstrationsAreTheScripts) {
  SessionRunSettings settings;
  const auto hands = [&](const std::string& trainee, bool on) {
    SessionOrder order{.scene = "/s.yaml", .power_W = {}, .seconds = {}, .picture_rate_Hz = {}, .trainee = trainee};
    order.hands = on;
    const std::vector<std::string> words = UpWords(settings, order);
    const auto option = std::ranges::find(words, "--hands");
    return option == words.end() ? std::string() : *(option + 1);
  };
  EXPECT_EQ(hands("Ann", true), "browser");
  EXPECT_EQ(hands(kExpert, false), "script");
  EXPECT_EQ(hands("", false), "");
  settings.touch = true;
  EXPECT_EQ(hands("Ann", true), "");
  EXPECT_EQ(hands(kExpert, false), "script");
  EXPECT_EQ(hands("", true), "browser") << "a session that is to be operated on the page";
}

TEST(SessionRun, ItsEndIsNotThatOfASessionStartedElsewhere) {
  const fs::path folder = fs::temp_directory_path() / ("console_end_test." + std::to_string(::getpid()));
  SessionRunSettings settings;
  settings.out = folder;
  settings.program = "/bin/false";
  SessionRun run(settings);
  const SessionOrder order{.scene = "small", .power_W = {}, .seconds = {}, .picture_rate_Hz = {}, .trainee = {}};
  run.Start(order);
  run.NoteBegun(5);
  while (run.running()) run.Poll();
  ASSERT_TRUE(run.end());
  EXPECT_FALSE(run.end()->well);
  run.NoteBegun(5);
  EXPECT_TRUE(run.end()) << "its own session is still on the bus";
  run.NoteBegun(6);
  EXPECT_FALSE(run.end());
  // One that did not begin.
  run.Start(order);
  while (run.running()) run.Poll();
  EXPECT_TRUE(run.end());
  run.NoteBegun(5);
  EXPECT_FALSE(run.end());
  fs::remove_all(folder);
}

TEST(Opinion, AnswersGoToTheSessionThatTheyAreFor) {
  const fs::path out = fs::temp_directory_path() / ("console_opinion_test." + std::to_string(::getpid()));
  for (const char* session : {"1-ann", "2-bob"}) fs::create_directories(out / session);
  fs::create_directory_symlink("2-bob", out / "latest");
  const std::string answers = "0,1,2,3,4,5,0,1,2,3,4,5";
  EXPECT_NE(QuestionsJson(out, "1-ann").find(R"("session":"1-ann")"), std::string::npos);
  // The dialog was opened after the first session; the second has ended meanwhile.
  StoreAnswers(out, "1-ann", "", answers);
  EXPECT_TRUE(fs::exists(out / "1-ann/questionnaire.json"));
  EXPECT_THROW(StoreAnswers(out, "2-bob", "2-bob", answers), InputError) << "it runs";
  for (const char* wrong : {"", ".", "..", "latest", "3-cy", "1-ann/frames"}) {
    EXPECT_THROW(StoreAnswers(out, wrong, "", answers), InputError) << wrong;
  }
  EXPECT_FALSE(fs::exists(out / "2-bob/questionnaire.json"));
  fs::remove_all(out);
}

TEST(LiveState, ASessionThatWritesItsReportIsNotStarting) {
  const fs::path folder = fs::temp_directory_path() / ("console_run_test." + std::to_string(::getpid()));
  fs::create_directories(folder);
  std::ofstream(folder / "fulcrum") << "#!/bin/sh\nread -r line < " << (folder / "report").string() << "\n";
  fs::permissions(folder / "fulcrum", fs::perms::owner_all);
  ASSERT_EQ(::mkfifo((folder / "report").c_str(), 0600), 0);
  constexpr int kQuietDomain = 99;
  SessionRun run({.program = folder / "fulcrum",
                  .out = folder / "out",
                  .cart = {},
                  .data = {},
                  .database = {},
                  .domain = kQuietDomain});
  const SessionWatch watch(kQuietDomain);
  const auto phase = [&] {
    LiveState state;
    state.watch = &watch;
    state.run = &run;
    std::uint64_t cursor = 0;
    const std::string json = LiveJson(state, &cursor);
    return json.substr(0, json.find(','));
  };
  EXPECT_EQ(phase(), R"({"phase":"idle")");
  run.Start({.scene = "small", .power_W = {}, .seconds = {}, .picture_rate_Hz = {}, .trainee = {}});
  EXPECT_EQ(phase(), R"({"phase":"starting")");
  run.NoteBegun(5);
  EXPECT_EQ(phase(), R"({"phase":"stopping")") << "it is on the bus no more";
  std::ofstream(folder / "report") << "written\n";
  while (run.running()) run.Poll();
  EXPECT_EQ(phase(), R"({"phase":"idle")");
  fs::remove_all(folder);
}

}  // namespace
}  // namespace fulcrum::console
