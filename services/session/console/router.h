// From a request to what is wanted: access, method, path and fields are checked here, in one table. Pure.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "services/session/console/access.h"
#include "services/session/console/form.h"
#include "services/session/console/http_message.h"

namespace fulcrum::console {

enum class Wanted {
  kPage,        ///< A file of the page: path.
  kReport,      ///< With a ticket of kTicket.
  kState,       ///< What the page shows now.
  kEvents,      ///< The same again and again.
  kChoices,     ///< Scenes and what can be set.
  kPicture,     ///< name
  kRecordings,  ///< What can be replayed.
  kSummary,     ///< Figures of the last session.
  kTicket,      ///< Opens the report of the last session once.
  kStart,       ///< scene; power, seconds, record, picture_rate
  kStop,
  kRestart,  ///< node
  kDump,
  kGenerator,  ///< cut, coag, blend
  kReplay,     ///< name
  kCalibrate,  ///< what, tool
  kEnter,      ///< To the guided task.
  kCancel,
  kClose,  ///< The task's result was read.
};

struct Routed {
  Wanted wanted = Wanted::kPage;
  std::string path;
  Form fields;  ///< Those of the route alone, each checked.
};

/// Either what is wanted, or the refusal.
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
