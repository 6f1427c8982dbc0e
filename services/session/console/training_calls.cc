#include "services/session/console/training_calls.h"

#include "services/base/core/error.h"
#include "services/base/runtime/cyclic_thread.h"
#include "services/session/console/library.h"

namespace fulcrum::console {
namespace {

namespace fs = std::filesystem;

const std::string& TextIn(const Form& fields, std::string_view name) { return fields.find(name)->second; }

}  // namespace

HttpResponse TrainingCalls::Answer(const Routed& routed, const fs::path& scenes) {
  const Form& fields = routed.fields;
  switch (routed.wanted) {
    case Wanted::kTraining:
      return {.body = desk_.OverviewJson(FindScenes(scenes))};
    case Wanted::kTrainingCsv:
      return {.type = "text/csv; charset=utf-8", .body = desk_.Csv()};
    case Wanted::kTrainingEnter:
      desk_.Enter(TextIn(fields, "name"), TextIn(fields, "pin"), runtime::MonotonicNs());
      return Done("entered");
    case Wanted::kTrainingNew:
      desk_.Create(TextIn(fields, "name"), TextIn(fields, "pin"),
                   fields.contains("instructor") && TextIn(fields, "instructor") == "on");
      return Done("the account is made");
    case Wanted::kTrainingLeave:
      desk_.Leave();
      return Done("left");
    case Wanted::kAttempt:
      return {.body = desk_.AttemptJson(TextIn(fields, "session"))};
    case Wanted::kAttemptEvents: {
      const fs::path folder = desk_.FolderOf(TextIn(fields, "session"));
      if (folder.empty()) throw InputError("no attempt \"" + TextIn(fields, "session") + "\" of yours");
      return {.body = events_.JsonOf(folder)};
    }
    default:
      return Refusal(404, "unknown call of the training");
  }
}

}  // namespace fulcrum::console
