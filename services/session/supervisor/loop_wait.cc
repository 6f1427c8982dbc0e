#include "services/session/supervisor/loop_wait.h"

#include "services/transport/control/control_socket.h"

namespace fulcrum::supervisor {

LoopWait::LoopWait() {
  struct sigaction action {};
  action.sa_handler = [](int) {};  // A signal with a handler interrupts poll(2).
  action.sa_flags = SA_RESTART | SA_NOCLDSTOP;
  sigemptyset(&action.sa_mask);
  ::sigaction(SIGCHLD, &action, &before_);
}

LoopWait::~LoopWait() { ::sigaction(SIGCHLD, &before_, nullptr); }

void LoopWait::Wait(const std::vector<int>& descriptors, std::chrono::milliseconds longest) const {
  control::AwaitInput(descriptors, longest);
}

}  // namespace fulcrum::supervisor
