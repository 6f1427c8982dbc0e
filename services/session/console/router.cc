#include "services/session/console/router.h"

#include <algorithm>
#include <array>
#include <span>

#include "services/base/core/json_text.h"
#include "services/base/core/messages.h"

namespace fulcrum::console {
namespace {

using Check = bool (*)(std::string_view);

struct Field {
  std::string_view name;
  bool needed;
  Check check;
  std::string_view valid;
};

bool IsNode(std::string_view text) {
  for (int i = 0; i < kNodeCount; ++i) {
    const auto node = static_cast<NodeId>(i);
    if (node != NodeId::kSupervisor && text == NodeName(node)) return true;
  }
  return false;
}
bool IsOnOff(std::string_view text) { return text == "on" || text == "off"; }
bool IsTool(std::string_view text) { return text == "0" || text == "1"; }
bool IsCalibration(std::string_view text) { return text == "handle" || text == "trocar"; }
bool IsPower(std::string_view text) { return ParseNumber(text, 1, 300).has_value(); }
bool IsKnob(std::string_view text) { return ParseNumber(text, 0, static_cast<double>(kMaxSetPower_W)).has_value(); }
bool IsSeconds(std::string_view text) { return ParseNumber(text, 1, 7 * 24 * 3600.0).has_value(); }
bool IsPictureRate(std::string_view text) { return ParseNumber(text, 0.1, 30).has_value(); }
bool IsTrainee(std::string_view text) { return text == "me" || text == "expert"; }
/// What a name or PIN may be at most; the desk that reads them knows their rules.
bool IsShortText(std::string_view text) {
  const auto control = [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; };
  return !text.empty() && text.size() <= 63 && std::none_of(text.begin(), text.end(), control);
}
bool IsTicket(std::string_view text) { return text.size() == 64 && IsPlainName(text); }

constexpr std::array kPictureFields{Field{"name", true, IsPictureName, "frame_<digits>.png"}};
constexpr std::array kTicketFields{Field{"ticket", true, IsTicket, "the text that /api/ticket returned"}};
constexpr std::array kStartFields{
    Field{"scene", true, IsPlainName, "a name that /api/choices lists"},
    Field{"power", false, IsPower, "1 to 300 W"},
    Field{"seconds", false, IsSeconds, "1 to 604800 s"},
    Field{"record", false, IsOnOff, "on, off"},
    Field{"picture_rate", false, IsPictureRate, "0.1 to 30 per second"},
    Field{"hands", false, IsOnOff, "on, off"},
    Field{"trainee", false, IsTrainee, "me, expert"},
    Field{"person", false, IsShortText, "the name that /api/training returned"},
};
constexpr Field kNameField{"name", true, IsShortText, "1 to 63 bytes without control characters"};
constexpr Field kPinField{"pin", true, IsShortText, "4 to 12 digits"};
constexpr std::array kAccountFields{kNameField, kPinField};
constexpr std::array kNewAccountFields{kNameField, kPinField, Field{"instructor", false, IsOnOff, "on, off"}};
constexpr std::array kAttemptFields{Field{"session", true, IsPlainName, "a session that /api/training lists"}};
constexpr std::array kAnswersFields{
    Field{"session", true, IsPlainName, "the session that /api/questionnaire returned"},
    Field{"answers", true, IsShortText, "twelve numbers from 0 to 5 with commas between"}};
constexpr std::array kNodeFields{Field{"node", true, IsNode, "a node's name, for example physics_node"}};
constexpr std::array kGeneratorFields{Field{"cut", false, IsKnob, "0 to 300 W"},
                                      Field{"coag", false, IsKnob, "0 to 300 W"},
                                      Field{"blend", false, IsKnob, "0 to 300 W"}};
constexpr std::array kReplayFields{Field{"name", true, IsRecordingName, "a name that /api/recordings lists"}};
constexpr std::array kCalibrateFields{Field{"what", true, IsCalibration, "handle, trocar"},
                                      Field{"tool", true, IsTool, "0, 1"}};

struct Entry {
  std::string_view path;
  bool post;
  Wanted wanted;
  std::span<const Field> fields;
};

constexpr std::array kEntries{
    Entry{"/api/state", false, Wanted::kState, {}},
    Entry{"/api/events", false, Wanted::kEvents, {}},
    Entry{"/api/choices", false, Wanted::kChoices, {}},
    Entry{"/api/picture", false, Wanted::kPicture, kPictureFields},
    Entry{"/api/recordings", false, Wanted::kRecordings, {}},
    Entry{"/api/summary", false, Wanted::kSummary, {}},
    Entry{"/api/ticket", true, Wanted::kTicket, {}},
    Entry{"/api/training", false, Wanted::kTraining, {}},
    Entry{"/api/training.csv", false, Wanted::kTrainingCsv, {}},
    Entry{"/api/training/enter", true, Wanted::kTrainingEnter, kAccountFields},
    Entry{"/api/training/new", true, Wanted::kTrainingNew, kNewAccountFields},
    Entry{"/api/training/leave", true, Wanted::kTrainingLeave, {}},
    Entry{"/api/attempt", false, Wanted::kAttempt, kAttemptFields},
    Entry{"/api/attempt/events", false, Wanted::kAttemptEvents, kAttemptFields},
    Entry{"/api/questionnaire", false, Wanted::kQuestions, {}},
    Entry{"/api/questionnaire/answers", true, Wanted::kAnswers, kAnswersFields},
    Entry{"/api/start", true, Wanted::kStart, kStartFields},
    Entry{"/api/stop", true, Wanted::kStop, {}},
    Entry{"/api/restart", true, Wanted::kRestart, kNodeFields},
    Entry{"/api/dump", true, Wanted::kDump, {}},
    Entry{"/api/generator", true, Wanted::kGenerator, kGeneratorFields},
    Entry{"/api/replay", true, Wanted::kReplay, kReplayFields},
    Entry{"/api/calibrate", true, Wanted::kCalibrate, kCalibrateFields},
    Entry{"/api/task/enter", true, Wanted::kEnter, {}},
    Entry{"/api/task/cancel", true, Wanted::kCancel, {}},
    Entry{"/api/task/close", true, Wanted::kClose, {}},
};

HttpResponse Answer(int status, bool ok, std::string_view text) {
  HttpResponse response;
  response.status = status;
  response.body = std::string("{\"ok\":") + (ok ? "true" : "false") + ",\"text\":" + JsonString(text) + "}";
  return response;
}

/// First error in the fields; empty: they are valid.
std::string Wrong(const Form& form, std::span<const Field> fields) {
  for (const auto& [name, value] : form) {
    const auto known = [&name = name](const Field& field) { return field.name == name; };
    if (std::none_of(fields.begin(), fields.end(), known)) return "no field \"" + name + "\" here";
  }
  for (const Field& field : fields) {
    const auto found = form.find(field.name);
    if (found == form.end() ? field.needed : !field.check(found->second)) {
      return std::string(field.name) + ": valid: " + std::string(field.valid);
    }
  }
  return {};
}

}  // namespace

HttpResponse Refusal(int status, std::string_view text) { return Answer(status, false, text); }
HttpResponse Done(std::string_view text) { return Answer(200, true, text); }

RouteResult Route(const Access& access, const HttpRequest& request) {
  const auto refuse = [](int status, std::string_view text) { return RouteResult{{}, Refusal(status, text)}; };
  if (!access.IsOwnHost(request.host)) {
    return refuse(421, "unknown host name; use the numeric address, or start the console with --host-name NAME");
  }
  const bool post = request.method == "POST";
  if (!post && request.method != "GET") return refuse(405, "invalid method; valid: GET, POST");
  const std::optional<Target> target = ParseTarget(request.target);
  if (!target) return refuse(400, "malformed target");
  const bool api = target->path.starts_with("/api/");
  if (!api) {
    if (post) return refuse(405, "GET");
    // Browsers send no token with these.
    const bool live = target->path == "/live", film = target->path == "/film";
    if (!live && !film && target->path != "/report") return {Routed{Wanted::kPage, target->path, {}}, {}};
    if (const std::string wrong = Wrong(target->query, kTicketFields); !wrong.empty()) return refuse(400, wrong);
    if ((live || film) && !Access::IsOwnSite(request)) {
      return refuse(403, "a page of another site may not use this console");
    }
    const Wanted wanted = live ? Wanted::kLive : film ? Wanted::kFilm : Wanted::kReport;
    return {Routed{wanted, target->path, target->query}, {}};
  }
  if (!Access::IsOwnSite(request)) return refuse(403, "a page of another site may not use this console");
  if (!access.HasToken(request))
    return refuse(401, "the token is missing or wrong; open the address that `fulcrum console` printed");
  const auto entry =
      std::find_if(kEntries.begin(), kEntries.end(), [&](const Entry& e) { return e.path == target->path; });
  if (entry == kEntries.end()) return refuse(404, "unknown call");
  if (entry->post != post)
    return refuse(405, entry->post ? "invalid method; valid: POST" : "invalid method; valid: GET");
  if (post && !target->query.empty()) return refuse(400, "a POST has its fields in the body, not in the address");
  if (!post && !request.body.empty()) return refuse(400, "a GET must have no body");
  if (!request.body.empty() && !request.content_type.starts_with("application/x-www-form-urlencoded")) {
    return refuse(415, "application/x-www-form-urlencoded");
  }
  std::optional<Form> form = post ? ParseForm(request.body) : target->query;
  if (!form) return refuse(400, "malformed form");
  if (const std::string wrong = Wrong(*form, entry->fields); !wrong.empty()) return refuse(400, wrong);
  return {Routed{entry->wanted, target->path, *std::move(form)}, {}};
}

}  // namespace fulcrum::console
