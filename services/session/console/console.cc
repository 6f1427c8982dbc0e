#include "services/session/console/console.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <chrono>
#include <cstdlib>
#include <ctime>
#include <future>
#include <optional>
#include <utility>

#include "services/base/config/operation.h"
#include "services/base/core/tick.h"
#include "services/base/runtime/cyclic_thread.h"
#include "services/base/runtime/realtime.h"
#include "services/session/console/access.h"
#include "services/session/console/attempt_films.h"
#include "services/session/console/file_response.h"
#include "services/session/console/guided_task.h"
#include "services/session/console/http_server.h"
#include "services/session/console/json.h"
#include "services/session/console/library.h"
#include "services/session/console/live_state.h"
#include "services/session/console/live_view.h"
#include "services/session/console/opinion.h"
#include "services/session/console/page.h"
#include "services/session/console/picture_watch.h"
#include "services/session/console/router.h"
#include "services/session/console/session_run.h"
#include "services/session/console/session_watch.h"
#include "services/session/console/training_calls.h"
#include "services/session/supervisor/ask.h"

namespace fulcrum::console {
namespace {

namespace fs = std::filesystem;
using runtime::MonotonicNs;

constexpr auto kTurn = std::chrono::milliseconds(200);
constexpr std::int64_t kFeedPeriod = kSecond_ns / 5;
constexpr std::size_t kMostRecordings = 50;
constexpr const char* kTicketIsOld = "this address is valid once and for one minute; open it from the page";
// A report contains its own style and pictures, and no scripts.
constexpr const char* kReportPolicy =
    "default-src 'none'; style-src 'unsafe-inline'; img-src data:; media-src data:; frame-ancestors 'self'; sandbox";

/// The names in lower case, and at the end that of this machine.
std::vector<std::string> OwnNames(std::vector<std::string> names) {
  std::array<char, 256> own{};
  if (::gethostname(own.data(), own.size() - 1) == 0) names.emplace_back(own.data());
  for (std::string& name : names) {
    std::transform(name.begin(), name.end(), name.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  }
  return names;
}

fs::path DefaultTokenFile(int port) {
  const std::string name = "console-" + std::to_string(port) + ".token";
  if (const char* run = std::getenv("XDG_RUNTIME_DIR"); run != nullptr && *run != '\0') {
    return fs::path(run) / "fulcrum" / name;
  }
  const char* home = std::getenv("HOME");
  return (home != nullptr ? fs::path(home) / ".cache" : fs::path("/tmp") / std::to_string(::geteuid())) / "fulcrum" /
         name;
}

double NumberIn(const Form& fields, std::string_view name) {
  const auto found = fields.find(name);
  return found == fields.end() ? 0 : ParseNumber(found->second, 0, 1e9).value_or(0);
}
std::optional<double> MaybeNumberIn(const Form& fields, std::string_view name) {
  return fields.contains(name) ? std::optional(NumberIn(fields, name)) : std::nullopt;
}
const std::string& TextIn(const Form& fields, std::string_view name) { return fields.find(name)->second; }

}  // namespace

struct Console::Impl {
  explicit Impl(const ConsoleSettings& given)
      : settings(given),
        run({.program = given.programs / "fulcrum",
             .out = given.out,
             .cart = given.cart,
             .data = given.data,
             .database = given.database,
             .domain = given.domain,
             .touch = !given.cart.empty() && config::HasTouch(config::LoadCart(given.cart))}),
        watch(given.domain),
        training(given.database, given.courses, given.out),
        films(
            given.programs / "replayer", [this](const std::string& attempt) { return training.FolderOf(attempt); },
            [this](std::function<void()> work) { server.Post(std::move(work)); }),
        server({.address = given.bind, .port = given.port, .tls = Identity()},
               {.handle = [this](const HttpRequest& request) { return Handle(request); },
                .knows = [this](const HttpRequest& request) { return access->HasToken(request); }}) {
    watch.OnLeave([this] {
      live.SetSession({}, 0);
      live_session = 0;  // A session whose supervisor was silent for a while is joined again.
    });
    token_file = settings.token_file.empty() ? DefaultTokenFile(server.port()) : settings.token_file;
    std::error_code error;
    if (!settings.token_file.empty() && fs::exists(token_file, error)) {
      token = ReadToken(token_file);
    } else {
      token = MakeToken();
      WriteToken(token_file, token);
    }
    access.emplace(token, OwnNames(settings.host_names));
    // The last session before this console was started, so that its report can be opened.
    ShowSession(fs::read_symlink(settings.out / "latest", error).filename());
  }

  // The bus and the films call the server for each picture: they end first.
  ~Impl() {
    live.SetSession({}, 0);
    films.End();
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  /// Certificate and key, unless only this machine can reach the page.
  std::optional<TlsIdentity> Identity() {
    if (IsLoopback(settings.bind)) return {};
    std::vector<std::string> names = OwnNames(settings.host_names);
    names.insert(names.end(), {"localhost", "127.0.0.1", "::1"});
    if (!BindsAny()) names.push_back(settings.bind);
    std::optional<TlsIdentity> identity = LoadTlsIdentity(settings.state, names, std::time(nullptr), &new_identity);
    fingerprint = identity->fingerprint;
    return identity;
  }

  [[nodiscard]] bool BindsAny() const { return settings.bind == "0.0.0.0" || settings.bind == "::"; }

  [[nodiscard]] std::string Address() const {
    const bool secure = !fingerprint.empty();
    std::string host = settings.bind.find(':') != std::string::npos ? "[" + settings.bind + "]" : settings.bind;
    if (BindsAny()) host = OwnNames({"localhost"}).back();
    if (secure && !settings.host_names.empty()) host = settings.host_names.front();
    return (secure ? "https://" : "http://") + host + ":" + std::to_string(server.port()) + "/";
  }

  // --------------------------------------------------------------------------------------------- requests

  HttpResponse Handle(const HttpRequest& request) {
    RouteResult result = Route(*access, request);
    if (!result.routed) return std::move(result.refusal);
    try {
      return Answer(*result.routed);
    } catch (const std::exception& error) {
      return Refusal(409, error.what());
    }
  }

  HttpResponse Answer(const Routed& routed) {
    switch (routed.wanted) {
      case Wanted::kPage:
        return Page(routed.path);
      case Wanted::kReport:
        return Report(TextIn(routed.fields, "ticket"));
      case Wanted::kLive:
      case Wanted::kFilm:
        if (!tickets.Use(TextIn(routed.fields, "ticket"), MonotonicNs())) return Refusal(401, kTicketIsOld);
        return {.socket = routed.wanted == Wanted::kLive ? &live_sockets : &film_sockets};
      case Wanted::kState:
        return {.body = StateJson(0)};
      case Wanted::kEvents:
        return {.type = "text/event-stream", .stream = true};
      case Wanted::kChoices:
        return {.body = ChoicesJson()};
      case Wanted::kPicture:
        return FileResponse(pictures.FileOf(TextIn(routed.fields, "name")), "image/png");
      case Wanted::kRecordings:
        return {.body = RecordingsJson()};
      case Wanted::kSummary:
        return FileResponse(SessionFile("summary.json"), "application/json");
      case Wanted::kTicket:
        return Done(tickets.Issue(MonotonicNs()));
      case Wanted::kStart:
        return Start(routed.fields);
      case Wanted::kStop:
        return Stop();
      case Wanted::kRestart:
        return Ask("restart", TextIn(routed.fields, "node"));
      case Wanted::kDump:
        return Ask("dump", "requested on the console");
      case Wanted::kGenerator:
        return TurnGenerator(routed.fields);
      case Wanted::kReplay:
        return Replay(TextIn(routed.fields, "name"));
      case Wanted::kCalibrate:
        return Calibrate(TextIn(routed.fields, "what"), TextIn(routed.fields, "tool"));
      case Wanted::kTraining:
      case Wanted::kTrainingCsv:
      case Wanted::kTrainingEnter:
      case Wanted::kTrainingNew:
      case Wanted::kTrainingLeave:
      case Wanted::kAttempt:
      case Wanted::kAttemptEvents: {
        const std::string person = training.person();
        HttpResponse response = training.Answer(routed, settings.scenes);
        if (training.person() != person) films.Stop("Another person is at the cart now.");
        return response;
      }
      case Wanted::kEnter:
      case Wanted::kCancel:
        return LeadTask(routed.wanted);
      case Wanted::kQuestions:
        return {.body = QuestionsJson(settings.out, watch.alive() ? std::string() : session)};
      case Wanted::kAnswers:
        StoreAnswers(settings.out, TextIn(routed.fields, "session"), watch.alive() ? session : std::string(),
                     TextIn(routed.fields, "answers"));
        return Done("Stored. Thank you.");
      case Wanted::kClose:
        if (task && task->running()) return Refusal(409, "the task still runs; wait for its end or cancel it");
        task.reset();
        return Done("closed");
    }
    return Refusal(404, "unknown call; valid calls: services/session/console/DESIGN.md");
  }

  static HttpResponse Page(const std::string& path) {
    const PageFile* file = FindPageFile(path);
    if (file == nullptr) return Refusal(404, "no such page");
    return {.type = std::string(file->type), .body = std::string(file->text)};
  }

  HttpResponse Report(const std::string& given) {
    if (!tickets.Use(given, MonotonicNs())) return Refusal(401, kTicketIsOld);
    HttpResponse response = FileResponse(SessionFile("report.html"), "text/html; charset=utf-8");
    response.policy = kReportPolicy;
    return response;
  }

  HttpResponse Start(const Form& fields) {
    if (watch.alive() || run.running()) return Refusal(409, "a session is running; stop it first");
    if (task && task->running())
      return Refusal(409, "\"" + task->title() + "\" still runs; wait for its end or cancel it");
    const std::string& scene = TextIn(fields, "scene");
    const std::vector<SceneChoice> scenes = FindScenes(settings.scenes);
    const auto known = [&](const SceneChoice& choice) { return choice.name == scene; };
    if (std::none_of(scenes.begin(), scenes.end(), known))
      return Refusal(404, "no scene \"" + scene + "\"; valid: those that /api/choices lists");
    SessionOrder order;
    order.scene = settings.scenes / (scene + ".yaml");
    order.power_W = MaybeNumberIn(fields, "power");
    order.seconds = MaybeNumberIn(fields, "seconds");
    order.picture_rate_Hz = MaybeNumberIn(fields, "picture_rate");
    order.hands = fields.contains("hands") && TextIn(fields, "hands") == "on";
    if (fields.contains("trainee")) {
      const bool expert = TextIn(fields, "trainee") == "expert";
      if (!expert) training.Expect(fields.contains("person") ? TextIn(fields, "person") : std::string());
      order.trainee = expert ? kExpert : training.person();
    }
    order.record = !fields.contains("record") || TextIn(fields, "record") == "on";
    run.Start(order);
    ShowSession({});
    return Done("starting");
  }

  HttpResponse Stop() {
    if (run.running()) {
      run.Stop();
      return Done("ending the session; its report is written");
    }
    return Ask("down", "");
  }

  /// Sends a command to the supervisor in another thread, because it may take seconds; the reply becomes a notice.
  HttpResponse Ask(const std::string& verb, const std::string& argument) {
    if (!watch.alive()) return Refusal(409, "no session runs");
    if (asking.valid()) return Refusal(409, "the supervisor has not replied to the last request yet; try again");
    asking = std::async(std::launch::async, supervisor::AskSupervisor, settings.domain, verb, argument);
    return Done("sent");
  }

  HttpResponse TurnGenerator(const Form& fields) {
    std::string words;
    for (const auto& [knob, power] : fields) {
      words.append(words.empty() ? "" : " ").append(knob).append("=").append(power);
    }
    if (words.empty()) return Refusal(400, "no knob is named; give cut, coag or blend with 0 to 300 W");
    return Ask("generator", words);
  }

  void StartTask(std::string title, const char* program, const std::vector<std::string>& arguments) {
    task.reset();
    task = std::make_unique<GuidedTask>(std::move(title), settings.programs / program, arguments);
  }

  /// Reason why no task can begin; empty: one can.
  [[nodiscard]] std::string TaskObstacle(const char* why_no_session) const {
    if (watch.alive() || run.running()) return std::string("stop the session first: ") + why_no_session;
    if (task && task->running()) return "\"" + task->title() + "\" still runs; wait for its end or cancel it";
    return {};
  }

  HttpResponse Replay(const std::string& name) {
    if (const std::string why = TaskObstacle("a replay would slow it down"); !why.empty()) return Refusal(409, why);
    const fs::path file = settings.out / name;
    std::error_code error;
    if (!fs::is_regular_file(file, error)) return Refusal(404, "no recording " + name);
    StartTask("Replay of " + name, "replayer", {file.string(), "--into", "physics", "thermal", "haptics"});
    return Done("replaying");
  }

  HttpResponse Calibrate(const std::string& what, const std::string& tool) {
    if (const std::string why = TaskObstacle("it uses the port or device"); !why.empty()) return Refusal(409, why);
    const bool handle = what == "handle";
    if (!handle && settings.cart.empty()) {
      return Refusal(409,
                     "a simulated device has no trocar to measure; start the console with --cart FILE of a cart with "
                     "Touch devices");
    }
    const std::string side = tool == "0" ? " of the first tool" : " of the second tool";
    std::vector<std::string> arguments{handle ? "calibrate" : "calibrate-trocar", "--tool", tool};
    if (!settings.cart.empty()) arguments.insert(arguments.end(), {"--cart", settings.cart.string()});
    StartTask((handle ? "Calibrate the handle" : "Measure the trocar") + side,
              handle ? "handle_bridge" : "haptics_node", arguments);
    return Done("started");
  }

  HttpResponse LeadTask(Wanted wanted) {
    if (!task || !task->running()) return Refusal(409, "no calibration or replay is running");
    if (wanted == Wanted::kEnter) {
      task->Enter();
    } else {
      task->Cancel(MonotonicNs());
    }
    return Done("sent to the task");
  }

  // ------------------------------------------------------------------------------------------------- what is shown

  [[nodiscard]] std::string StateJson(std::uint64_t cursor) { return LiveJson(Live(), &cursor); }

  [[nodiscard]] LiveState Live() {
    LiveState state;
    state.now_ns = MonotonicNs();
    state.watch = &watch;
    state.run = &run;
    state.task = task.get();
    state.session = session;
    state.person_changes = training.person_changes();
    state.picture = pictures.Newest();
    std::error_code error;
    state.has_report = !watch.alive() && !session.empty() && fs::is_regular_file(SessionFile("report.html"), error);
    state.notice = notice;
    return state;
  }

  [[nodiscard]] std::string ChoicesJson() const {
    Json scenes('[');
    for (const SceneChoice& scene : FindScenes(settings.scenes)) {
      Json one('{');
      one.Text("name", scene.name).Text("description", scene.description).Number("duration", scene.duration_s, 0.1);
      scenes.Item(one.Number("power", scene.power_W, 0.1).Number("picture_rate", scene.picture_rate_Hz, 0.1).Done());
    }
    Json json('{');
    json.Raw("scenes", scenes.Done()).Flag("simulated", settings.cart.empty());
    return json.Text("cart", settings.cart.empty() ? "simulated" : settings.cart.stem().string()).Done();
  }

  [[nodiscard]] std::string RecordingsJson() const {
    Json recordings('[');
    for (const RecordingChoice& one : FindRecordings(settings.out, kMostRecordings)) {
      recordings.Item(Json('{').Text("name", one.name).Raw("bytes", std::to_string(one.bytes)).Done());
    }
    return Json('{').Raw("recordings", recordings.Done()).Done();
  }

  [[nodiscard]] fs::path SessionFile(const char* name) const {
    return session.empty() ? fs::path() : settings.out / session / name;
  }

  /// Selects the session whose picture and report are shown; an invalid name selects none.
  void ShowSession(const std::string& id) {
    session = IsPlainName(id) ? id : std::string();
    pictures = PictureWatch(session.empty() ? fs::path() : settings.out / session / "frames");
  }

  void Turn() {
    const std::int64_t now = MonotonicNs();
    watch.Turn(now);
    run.Poll();
    if (watch.begun()) run.NoteBegun(watch.session());
    ShowLive(now);
    if (task) task->Poll(now);
    if (watch.begun() && watch.manifest().session_id != session) ShowSession(watch.manifest().session_id);
    if (asking.valid() && asking.wait_for(std::chrono::seconds(0)) == std::future_status::ready) TakeAnswer();
    if (now < next_feed_ns || server.stream_count() == 0) return;
    next_feed_ns = now + kFeedPeriod;
    const LiveState state = Live();
    server.Feed([&](std::uint64_t* cursor) { return "data: " + LiveJson(state, cursor) + "\n\n"; });
  }

  /// Live pictures and hands of the running session.
  void ShowLive(std::int64_t now) {
    if (watch.begun() && live_session != watch.session()) {
      live_session = watch.session();
      const auto make = [this] {
        bus::DdsParticipant& bus = watch.participant();
        // The server's thread waits for clients: a picture wakes it.
        return LiveView::Ports{bus.MakeInput<Picture>([this] { server.Post([this] { live.Turn(MonotonicNs()); }); }),
                               bus.MakeInput<OperatorInput>(), bus.MakeOutput<OperatorInput>()};
      };
      live.SetSession(make, live_session);
    }
    live.Turn(now);
  }

  void TakeAnswer() {
    ++notice.number;
    try {
      const control::Reply reply = asking.get();
      notice.ok = reply.ok;
      notice.text = reply.text;
    } catch (const std::exception& error) {
      notice.ok = false;
      notice.text = error.what();
    }
  }

  const SocketService live_sockets{
      .opened = [this](Socket* socket) { live.Open(socket); },
      .received = [this](Socket* socket, std::string_view text) { live.Receive(socket, text, MonotonicNs()); },
      .closed = [this](Socket* socket) { live.Close(socket, MonotonicNs()); }};
  const SocketService film_sockets{
      .opened = [this](Socket* socket) { films.Open(socket); },
      .received = [this](Socket* socket, std::string_view text) { films.Receive(socket, text); },
      .closed = [this](Socket* socket) { films.Close(socket); }};
  const ConsoleSettings settings;
  std::string token;
  fs::path token_file;
  std::optional<Access> access;
  SessionRun run;
  SessionWatch watch;
  TrainingCalls training;
  AttemptFilms films;
  LiveView live;  ///< Its ports are those of `watch`.
  std::uint64_t live_session = 0;
  std::unique_ptr<GuidedTask> task;
  std::string session;  ///< Name of the shown session's folder in `out`; empty: none.
  PictureWatch pictures;
  std::future<control::Reply> asking;
  Notice notice;
  Tickets tickets;
  std::int64_t next_feed_ns = 0;
  std::string fingerprint;  ///< Empty: no TLS.
  bool new_identity = false;
  // Declared last, because its handlers and Identity() use the other members.
  HttpServer server;
};

Console::Console(const ConsoleSettings& settings) : impl_(std::make_unique<Impl>(settings)) {}
Console::~Console() = default;

GreetingFacts Console::Facts() const {
  return {impl_->Address(), impl_->token, impl_->token_file, impl_->fingerprint, impl_->new_identity};
}

void Console::Run() {
  while (!runtime::ShouldStop()) {
    impl_->server.Turn(kTurn);
    impl_->Turn();
  }
}

bool Console::session_runs() const { return impl_->run.running(); }

}  // namespace fulcrum::console
