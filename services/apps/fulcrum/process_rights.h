// What the kernel says about the rights of the processes of a cart, for `fulcrum doctor --security`.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <string>
#include <vector>

namespace fulcrum::supervisor::cli {

struct ProcessRights {
  pid_t pid = 0;
  std::string name;
  std::vector<std::string> words;  ///< Its command line.
  bool filtered = false;           ///< A seccomp filter is in force.
  bool no_new_privileges = false;
  std::uint64_t capabilities = 0;  ///< In force.

  [[nodiscard]] bool Has(const std::string& word) const;
  /// The word after `option`, or what follows "option="; empty: not there.
  [[nodiscard]] std::string ValueOf(const std::string& option) const;
};

/// Processes of this user that run a program of the same folder as this one, or of an installation.
[[nodiscard]] std::vector<ProcessRights> FulcrumProcesses();

}  // namespace fulcrum::supervisor::cli
