#include "services/session/console/session_run.h"

#include <signal.h>

#include <cstdio>
#include <fstream>
#include <iterator>

#include "services/base/core/error.h"
#include "services/base/runtime/private_file.h"
#include "services/session/console/screen_text.h"
#include "services/session/console/training_group.h"
#include "services/session/supervisor/node_process.h"
#include "services/session/supervisor/outcome.h"

namespace fulcrum::console {
namespace {

constexpr std::size_t kLongestReason = 1000;

/// Reason of a failure from the output of `fulcrum up`: the line below its table, or "fulcrum: reason" with all lines
/// after it.
std::string Reason(const std::filesystem::path& log) {
  std::ifstream stream(log);
  std::string line, reason;
  for (bool to_the_end = false; std::getline(stream, line);) {
    if (to_the_end && !line.empty()) reason += "\n" + line;
    for (const std::string_view begin : {"fulcrum: ", "! ", "NOT WELL: "}) {
      if (to_the_end || !line.starts_with(begin)) continue;
      reason = line.substr(begin.size());
      to_the_end = begin == "fulcrum: ";
    }
  }
  return ValidUtf8(reason.substr(0, kLongestReason));
}

}  // namespace

std::vector<std::string> UpWords(const SessionRunSettings& settings, const SessionOrder& order) {
  std::vector<std::string> words{"up",          order.scene,
                                 "--out",       settings.out.string(),
                                 "--domain",    std::to_string(settings.domain),
                                 "--keep-last", std::to_string(SessionRun::kKeep_s)};
  const auto add = [&](const std::string& option, const std::string& value) {
    words.insert(words.end(), {option, value});
  };
  if (!settings.cart.empty()) add("--cart", settings.cart.string());
  if (!settings.data.empty()) add("--data", settings.data.string());
  if (order.seconds) add("--seconds", supervisor::Fixed(*order.seconds, 1));
  if (order.power_W) add("--set", "script.power_W=" + supervisor::Fixed(*order.power_W, 1));
  if (order.picture_rate_Hz) add("--set", "render.png_rate_Hz=" + supervisor::Fixed(*order.picture_rate_Hz, 1));
  // The page shows the recording itself, and a trainee waits for the score.
  if (order.record) words.insert(words.end(), {"--record", "--no-video"});
  if (order.trainee == kExpert) {
    add("--hands", "script");
  } else if (order.hands && (order.trainee.empty() || !settings.touch)) {
    add("--hands", "browser");
  }
  if (!order.trainee.empty()) {
    add("--trainee", order.trainee);
    add("--database", settings.database.string());
  }
  return words;
}

SessionRun::SessionRun(SessionRunSettings settings)
    : settings_(std::move(settings)), log_(settings_.out / "console.log") {
  std::error_code error;
  std::filesystem::create_directories(settings_.out, error);
  if (error) throw InputError("--out " + settings_.out.string() + ": " + error.message());
}

void SessionRun::Start(const SessionOrder& order) {
  runtime::WritePrivateFile(log_, "", "log");
  up_ = runtime::ChildProcess::Start(settings_.program, UpWords(settings_, order), log_, runtime::WithParent::kStays);
  stopping_ = begun_ = false;
  recording_ = order.record;
  own_ = 0;
  end_.reset();
}

void SessionRun::NoteBegun(std::uint64_t session) {
  begun_ = up_.running();
  if (begun_) {
    own_ = session;
  } else if (session != own_) {
    // The own session may still be on the bus when its process has ended.
    end_.reset();
  }
}

void SessionRun::Stop() {
  stopping_ = up_.running();
  up_.Signal(SIGTERM);
}

void SessionRun::Poll() {
  const auto end = up_.Poll();
  if (!end) return;
  stopping_ = begun_ = false;
  const bool well = end->signal == 0 && end->exit_code == 0;
  const std::string reason = well ? "" : Reason(log_);
  end_ = SessionEnd{well, well ? "All went well." : reason.empty() ? "fulcrum up " + end->Describe() : reason};
}

std::string SessionRun::LastWord() const { return ValidUtf8(supervisor::LastLine(log_)); }

}  // namespace fulcrum::console
