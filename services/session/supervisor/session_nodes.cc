#include "services/session/supervisor/session_nodes.h"

#include <algorithm>
#include <sstream>
#include <utility>

#include "services/base/core/error.h"
#include "services/session/supervisor/node_process.h"
#include "services/session/supervisor/watch_times.h"
#include "services/transport/bus/dds/shared_memory.h"

namespace fulcrum::supervisor {
namespace {

// From a restart by command until peers no longer report the node's absence (assumed) [ns].
constexpr std::int64_t kExcuse_ns = 3 * kSecond_ns;

}  // namespace

SupervisedNode* FindRunning(std::span<const std::unique_ptr<SupervisedNode>> nodes, std::string_view name) {
  SupervisedNode* found = nullptr;
  for (const auto& node : nodes) {
    if (name != NodeName(node->id()) || !node->running()) continue;
    if (found == nullptr || (node->steps() && !found->steps())) found = node.get();
  }
  return found;
}

SessionNodes::SessionNodes(const SessionSetup& setup, const AttachedNode::Order& order) : setup_(setup) {
  const UpSettings& up = setup.settings;
  for (const NodeId id : setup.node_ids) {
    if (!up.attach.empty()) {
      nodes_.push_back(
          std::make_unique<AttachedNode>(setup.starter.Usual(id), setup.folder.path / AttachedNode::kFolder, order));
    } else if (id == NodeId::kPhysics && up.standby) {
      nodes_.push_back(std::make_unique<NodeProcess>(setup.starter.InPair("a", false)));
      nodes_.push_back(std::make_unique<NodeProcess>(setup.starter.InPair("b", true)));
    } else {
      nodes_.push_back(std::make_unique<NodeProcess>(setup.starter.Usual(id)));
    }
  }
}

void SessionNodes::Start(std::int64_t now_ns) {
  last_watch_ns_ = now_ns;
  for (const auto& node : nodes_) node->Start(now_ns);
}

void SessionNodes::Watch(std::int64_t now_ns, const OnDeath& died) {
  if (now_ns - last_watch_ns_ > kHeldUp_ns) {
    for (const auto& node : nodes_) node->ResetTimeouts(TimeoutsFrom(now_ns, now_ns - last_watch_ns_));
  }
  last_watch_ns_ = now_ns;
  for (const auto& node : nodes_) {
    const std::optional<SupervisedNode::Death> death = node->Update(now_ns);
    if (!death) continue;
    sweep_ns_ = now_ns + kSweepAfter_ns;
    if (death->for_good) {
      const bool own_code = death->end.signal == 0 && death->end.exit_code >= 2 && death->end.exit_code <= 4;
      failure_ = {own_code ? static_cast<ExitCode>(death->end.exit_code) : ExitCode::kFailure,
                  std::string(NodeName(node->id())) + " " + death->cause + ", for good"};
    }
    died(*node, *death);
  }
  if (sweep_ns_ != 0 && now_ns >= sweep_ns_) {
    sweep_ns_ = 0;
    bus::SweepSharedMemory(setup_.memory);
  }
}

void SessionNodes::End(const std::function<void(std::int64_t now_ns)>& turn,
                       const std::function<void(const SupervisedNode& node, const char* done)>& given_up) {
  const auto recorder =
      std::find_if(nodes_.begin(), nodes_.end(), [](const auto& node) { return node->id() == NodeId::kRecorder; });
  for (const auto& some : {std::span(nodes_.begin(), recorder), std::span(recorder, nodes_.end())}) {
    std::vector<SupervisedNode*> these;
    for (const auto& node : some) these.push_back(node.get());
    EndAll(these, turn, given_up);
  }
}

std::optional<CommandAnswer> SessionNodes::Restart(const std::string& name, std::int64_t now_ns) {
  SupervisedNode* node = FindRunning(nodes_, name);
  if (node == nullptr) return std::nullopt;
  CommandAnswer answer{true, "restarting " + name + " (pid " + std::to_string(node->pid()) + ")"};
  node->AskRestart(now_ns);
  excused_ns_ = now_ns + kExcuse_ns;
  return answer;
}

CommandAnswer SessionNodes::Swap(const std::string& argument, std::int64_t now_ns) {
  std::vector<std::string> words;
  std::istringstream lines(argument);
  for (std::string word; std::getline(lines, word);) words.push_back(std::move(word));
  const std::string name = words.empty() ? std::string() : words.front();
  SupervisedNode* node = FindRunning(nodes_, name);
  if (node == nullptr) return NotRunning(name);
  try {
    words.erase(words.begin());
    NodeCommand command = setup_.starter.Replacement(node->command(), words);
    CommandAnswer answer{
        true, "replacing " + name + " (pid " + std::to_string(node->pid()) + ") by " + command.program.string()};
    node->Swap(std::move(command), now_ns);
    excused_ns_ = now_ns + kExcuse_ns;
    return answer;
  } catch (const InputError& error) {
    return {false, error.what()};
  }
}

CommandAnswer SessionNodes::NotRunning(const std::string& name) {
  return {false, "no running node \"" + name + "\" in this session"};
}

bool SessionNodes::AreReady() const {
  return std::all_of(nodes_.begin(), nodes_.end(),
                     [](const auto& node) { return node->has_reported() || node->failed(); });
}

std::size_t SessionNodes::running() const {
  return static_cast<std::size_t>(
      std::count_if(nodes_.begin(), nodes_.end(), [](const auto& node) { return node->running(); }));
}

}  // namespace fulcrum::supervisor
