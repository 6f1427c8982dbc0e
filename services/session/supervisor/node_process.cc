#include "services/session/supervisor/node_process.h"

#include <signal.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <thread>
#include <utility>

#include "services/base/core/error.h"
#include "services/base/core/exit_code.h"
#include "services/base/core/tick.h"
#include "services/base/runtime/cyclic_thread.h"
#include "services/nodes/app/longest_end.h"

namespace fulcrum::supervisor {
namespace {

// From the time at which a node that hangs ends itself to its SIGKILL at the end of a session.
constexpr std::int64_t kBeyondLongestEnd = kSecond_ns;
// From the start of a node to the start of its spare: the spare must not compete with the node's own start.
constexpr std::int64_t kBeforeSpare = kSecond_ns;
// From a start for which the system had no descriptor, process or memory to the next try.
constexpr std::int64_t kAfterShortage = kSecond_ns;
constexpr auto kPollPeriod = std::chrono::milliseconds(5);

/// True when another start with the same arguments would end the same way.
bool IsFinal(const runtime::ProcessEnd& end) {
  const auto code = static_cast<ExitCode>(end.exit_code);
  return end.signal == 0 &&
         (code == ExitCode::kBadUsage || code == ExitCode::kMismatch || code == ExitCode::kDeviceLost);
}

}  // namespace

void NodeProcess::Start(std::int64_t now_ns) {
  process_ = spare_ && spare_->IsThere()
                 ? spare_->Take()
                 : runtime::ChildProcess::Start(command_.program, command_.arguments, command_.log);
  spare_.reset();
  started_ns_ = now_ns;
  pulse_.Start(now_ns);
  due_ns_ = 0;
  kill_ns_ = 0;
  lacks_ = false;
  complaint_ = nullptr;
}

void NodeProcess::WatchPulse(std::int64_t now_ns) {
  // A node that ends has its own time for it, and sends no Health at last.
  if (complaint_ == nullptr && kill_ns_ == 0) {
    complaint_ = pulse_.Complaint(command_.has_spare, now_ns);
    if (complaint_ != nullptr) process_.Signal(SIGKILL);
  }
  if (kill_ns_ != 0 && now_ns >= kill_ns_) {
    process_.Signal(SIGKILL);
  }
}

void NodeProcess::KeepSpare(std::int64_t now_ns) {
  if (!command_.has_spare || spare_ || kill_ns_ != 0 || !has_reported() || now_ns - started_ns_ < kBeforeSpare) return;
  try {
    spare_ = std::make_unique<SpareProcess>(command_);
  } catch (const InputError&) {
    command_.has_spare = false;  // A spare only shortens a restart.
  }
}

std::optional<SupervisedNode::Death> NodeProcess::Update(std::int64_t now_ns) {
  if (failed_) {
    return std::nullopt;
  }
  if (due_ns_ != 0) {
    if (now_ns >= due_ns_) {
      command_.arguments.insert(command_.arguments.end(), command_.again.begin(), command_.again.end());
      command_.again.clear();
      try {
        Start(now_ns);
      } catch (const runtime::ShortageError& error) {
        due_ns_ = now_ns + kAfterShortage;
        if (std::exchange(lacks_, true)) return std::nullopt;
        return Death{std::string("could not be started (") + error.what() + ")", false, {}, false, 0};
      } catch (const InputError& error) {
        if (before_) return GiveBack(error.what(), {}, now_ns);
        failed_ = true;
        return Death{error.what(), true, {}, false, 0};
      }
    }
    return std::nullopt;
  }
  const std::optional<runtime::ProcessEnd> end = process_.Poll();
  if (!end) {
    WatchPulse(now_ns);
    KeepSpare(now_ns);
    return std::nullopt;
  }
  Death death{complaint_ != nullptr ? complaint_ : end->Describe(), false, *end, false, 0};
  if (next_) {
    before_ = std::exchange(command_, std::move(*next_));
    next_.reset();
    death.cause = "was replaced by command";
    death.asked = true;
    due_ns_ = now_ns;
    return death;
  }
  if (before_ && !has_reported()) {
    return GiveBack("was replaced by " + command_.program.string() + ", which " + death.cause, *end, now_ns);
  }
  if (kill_ns_ != 0) {
    death.cause = "was restarted by command";
    death.asked = true;
    due_ns_ = now_ns;
    return death;
  }
  const std::optional<std::int64_t> delay = IsFinal(*end) ? std::nullopt : policy_.OnDeath(now_ns - started_ns_);
  death.for_good = failed_ = !delay.has_value();
  due_ns_ = now_ns + delay.value_or(0);
  return death;
}

SupervisedNode::Death NodeProcess::GiveBack(const std::string& why, const runtime::ProcessEnd& end,
                                            std::int64_t now_ns) {
  Death death{why + ": the previous program is started again", false, end, false, 0};
  command_ = std::move(*before_);
  before_.reset();
  due_ns_ = now_ns;
  return death;
}

bool NodeProcess::OnHealth(const Health& health, std::int64_t now_ns) {
  if (health.node != id() || (health.pid != pid() && !command_.foreign)) return false;
  pulse_.Add(health, now_ns);
  before_.reset();
  return true;
}

void NodeProcess::ResetTimeouts(std::int64_t now_ns) { pulse_.ResetTimeouts(now_ns); }

void NodeProcess::AskRestart(std::int64_t now_ns) {
  spare_.reset();  // The program may have been rebuilt since the spare was started.
  process_.Signal(SIGTERM);
  kill_ns_ = now_ns + app::LongestEnd_s(id()) * kSecond_ns;
}

void NodeProcess::Swap(NodeCommand command, std::int64_t now_ns) {
  next_ = std::move(command);
  AskRestart(now_ns);
}

void NodeProcess::Stop() {
  spare_.reset();
  process_.Signal(SIGTERM);
}

const char* NodeProcess::StopWaiting() {
  process_.Signal(SIGKILL);
  return "was killed";
}

bool NodeProcess::HasEnded() {
  (void)process_.Poll();
  return !process_.running();
}

void EndAll(const std::vector<SupervisedNode*>& nodes, const std::function<void(std::int64_t now_ns)>& turn,
            const std::function<void(const SupervisedNode& node, const char* done)>& given_up) {
  for (SupervisedNode* node : nodes) node->Stop();
  const std::int64_t begin = runtime::MonotonicNs();
  const auto is_gone = [](SupervisedNode* node) { return node->HasEnded(); };
  std::vector<SupervisedNode*> awaited = nodes;
  while (!std::all_of(nodes.begin(), nodes.end(), is_gone)) {
    const std::int64_t now = runtime::MonotonicNs();
    std::erase_if(awaited, [&](SupervisedNode* node) {
      if (now - begin <= app::LongestEnd_s(node->id()) * kSecond_ns + kBeyondLongestEnd) return false;
      if (!node->HasEnded()) given_up(*node, node->StopWaiting());
      return true;
    });
    turn(now);
    std::this_thread::sleep_for(kPollPeriod);
  }
}

std::string LastLine(const std::filesystem::path& log) {
  std::ifstream stream(log);
  std::string line, last;
  while (std::getline(stream, line)) {
    if (!line.empty()) {
      last = line;
    }
  }
  return last;
}

}  // namespace fulcrum::supervisor
