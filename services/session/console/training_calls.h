// The calls of the view Training.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>

#include "services/session/console/attempt_events.h"
#include "services/session/console/http_message.h"
#include "services/session/console/router.h"
#include "services/session/console/training_desk.h"

namespace fulcrum::console {

class TrainingCalls {
 public:
  /// @param database, courses, out as of TrainingDesk.
  TrainingCalls(std::filesystem::path database, std::filesystem::path courses, std::filesystem::path out)
      : desk_(std::move(database), std::move(courses), std::move(out)) {}

  /// Name of the person at the cart; empty: none.
  [[nodiscard]] std::string person() const { return desk_.person(); }
  /// As of TrainingDesk.
  [[nodiscard]] std::uint64_t person_changes() const { return desk_.person_changes(); }
  void Expect(const std::string& shown) { desk_.Expect(shown); }

  /// As TrainingDesk::FolderOf.
  [[nodiscard]] std::filesystem::path FolderOf(const std::string& session) { return desk_.FolderOf(session); }

  /// @param scenes folder of the scenes on offer. Throws InputError.
  [[nodiscard]] HttpResponse Answer(const Routed& routed, const std::filesystem::path& scenes);

 private:
  TrainingDesk desk_;
  AttemptEvents events_;
};

}  // namespace fulcrum::console
