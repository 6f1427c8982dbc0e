#include "render_node/node/drawing_threads.h"

#include <sys/resource.h>

#include <cstdlib>
#include <filesystem>

#include "services/base/runtime/realtime.h"

namespace fulcrum::render {
namespace {

// A software rasteriser uses all cores, so it runs below servo and solvers where they share cores.
constexpr int kNice = 5;

}  // namespace

std::vector<int> ThreadsOfProcess() {
  std::vector<int> threads;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/task")) {
    threads.push_back(std::atoi(entry.path().filename().c_str()));
  }
  return threads;
}

void LowerPriority(std::span<const int> threads) {
  for (const int thread : threads) {
    if (setpriority(PRIO_PROCESS, static_cast<id_t>(thread), kNice) != 0) {
      runtime::Log(runtime::LogLevel::kWarning, "cannot lower the priority of drawing");
      return;
    }
  }
}

}  // namespace fulcrum::render
