// fulcrum: the command with which an operator runs a cart.
#include <cstdio>
#include <exception>
#include <iostream>
#include <stdexcept>

#include "services/apps/fulcrum/commands.h"
#include "services/base/core/error.h"
#include "services/base/runtime/realtime.h"

int main(int argc, char** argv) {
  using fulcrum::ExitCode;
  fulcrum::runtime::SetLogName("fulcrum");
  fulcrum::runtime::InstallStopSignals();
  fulcrum::runtime::InstallLastWords();
  const auto fail = [](ExitCode code, const std::exception& error) {
    std::fprintf(stderr, "fulcrum: %s\n", error.what());
    return static_cast<int>(code);
  };
  try {
    const ExitCode code = fulcrum::supervisor::cli::Dispatch({argv + 1, argv + argc});
    std::cout.flush();
    // A reader that has seen enough, such as head, has closed its end; a full disk is a fault.
    if ((std::fflush(stdout) != 0 || std::ferror(stdout) != 0 || !std::cout) && code == ExitCode::kDone &&
        !fulcrum::supervisor::cli::ReaderIsGone()) {
      throw std::runtime_error("the output could not be written; is the disk full?");
    }
    return static_cast<int>(code);
  } catch (const fulcrum::InputError& error) {
    return fail(ExitCode::kBadUsage, error);
  } catch (const fulcrum::MismatchError& error) {
    return fail(ExitCode::kMismatch, error);
  } catch (const std::exception& error) {
    return fail(ExitCode::kFailure, error);
  }
}
