// Routing of requests: one table lists the calls, and access, method, path and fields are checked here. Pure functions.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "services/session/console/access.h"
#include "services/session/console/form.h"
#include "services/session/console/http_message.h"

namespace fulcrum::console {

enum class Wanted {
  kPage,        ///< A file of the page; `path` is its path.
  kReport,      ///< The report; needs a ticket of kTicket.
  kLive,        ///< The live picture and the controls, as a WebSocket; needs a ticket of kTicket.
  kFilm,        ///< The pictures of an attempt, as a WebSocket; needs a ticket of kTicket.
  kState,       ///< The present state of the page.
  kEvents,      ///< The state as a stream, repeatedly.
  kChoices,     ///< The scenes and their settings.
  kPicture,     ///< A picture. Field: name.
  kRecordings,  ///< The recordings that can be replayed.
  kSummary,     ///< Figures of the last session.
  kTicket,      ///< A ticket that opens the report of the last session, the live picture or an attempt's, once.
  kStart,       ///< Starts a session. Fields: scene; optional power, seconds, record, picture_rate, hands,
                ///< trainee (me, expert), person.
  kStop,
  kRestart,  ///< Restarts a node. Field: node.
  kDump,
  kGenerator,  ///< Sets knobs. Optional fields: cut, coag, blend.
  kReplay,     ///< Starts a replay. Field: name.
  kCalibrate,  ///< Starts a calibration. Fields: what, tool.
  kEnter,      ///< Sends Enter to the guided task.
  kCancel,
  kTraining,       ///< Courses, person and attempts.
  kTrainingCsv,    ///< The attempts with all measures.
  kTrainingEnter,  ///< Fields: name, pin.
  kTrainingNew,    ///< Makes an account. Fields: name, pin; optional instructor.
  kTrainingLeave,
  kAttempt,        ///< Sheet of an attempt. Field: session.
  kAttemptEvents,  ///< What happened when. Field: session.
  kQuestions,      ///< The questionnaire, the session that it is for, and the answers of all sessions.
  kAnswers,        ///< Stores the answers for an ended session. Fields: session, answers.
  kClose,          ///< Removes the ended task from the page.
};

struct Routed {
  Wanted wanted = Wanted::kPage;
  std::string path;
  Form fields;  ///< Fields of the route only, each checked.
};

/// Either a valid request, or the refusal.
struct RouteResult {
  std::optional<Routed> routed;
  HttpResponse refusal;
};

[[nodiscard]] RouteResult Route(const Access& access, const HttpRequest& request);

/// {"ok":false,"text":...}
[[nodiscard]] HttpResponse Refusal(int status, std::string_view text);
/// {"ok":true,"text":...}
[[nodiscard]] HttpResponse Done(std::string_view text);

}  // namespace fulcrum::console
