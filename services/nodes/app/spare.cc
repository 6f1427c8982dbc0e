#include "services/nodes/app/spare.h"

#include <poll.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <string>

#include "services/base/runtime/realtime.h"

namespace fulcrum::app {
namespace {

constexpr int kLook_ms = 200;  // A stop signal just before poll() does not interrupt it, so poll() has this timeout.

void SetProcessName(const std::string& name) { ::prctl(PR_SET_NAME, name.c_str()); }

}  // namespace

void BecomeSpare(NodeId node) {
  std::string name = NodeName(node);
  SetProcessName(name.substr(0, name.find('_')) + "_spare");
}

bool WaitUntilNeeded(NodeId node) {
  pollfd input{STDIN_FILENO, POLLIN, 0};
  while (!runtime::ShouldStop()) {
    if (::poll(&input, 1, kLook_ms) <= 0) continue;
    char needed = 0;
    if (::read(STDIN_FILENO, &needed, 1) != 1) return false;
    SetProcessName(NodeName(node));
    return true;
  }
  return false;
}

}  // namespace fulcrum::app
