#include "services/session/supervisor/spare_process.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "services/base/core/error.h"

namespace fulcrum::supervisor {

SpareProcess::SpareProcess(const NodeCommand& command) {
  std::vector<std::string> arguments = command.arguments;
  arguments.emplace_back("--spare");
  int pipe[2];
  if (::pipe2(pipe, O_CLOEXEC) != 0) {
    throw InputError("no pipe for a spare " + command.program.string() + ": " + ::strerror(errno));
  }
  try {
    process_ =
        runtime::ChildProcess::Start(command.program, arguments, command.log, runtime::WithParent::kDies, pipe[0]);
  } catch (...) {
    ::close(pipe[0]);
    ::close(pipe[1]);
    throw;
  }
  ::close(pipe[0]);
  call_ = pipe[1];
}

SpareProcess::~SpareProcess() { ::close(call_); }

bool SpareProcess::IsThere() {
  (void)process_.Poll();
  return process_.running();
}

runtime::ChildProcess SpareProcess::Take() {
  const char needed = 1;
  [[maybe_unused]] const ssize_t written = ::write(call_, &needed, 1);
  return std::move(process_);
}

}  // namespace fulcrum::supervisor
