// Runs one session: starts the nodes of a scene, watches and restarts them, records what they report, ends them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "services/base/config/cart.h"
#include "services/base/core/exit_code.h"

namespace fulcrum::supervisor {

struct UpSettings {
  std::filesystem::path scene;     ///< Compiled scene file.
  std::filesystem::path out;       ///< The session folder is made in here.
  std::filesystem::path programs;  ///< Folder of the node programs.
  config::CartConfig cart;         ///< Its domain is the session's.
  double seconds = -1;             ///< Session time; negative: the script's duration, or until stopped without one.
  bool window = false;
  std::string quality = "auto";  ///< Of the picture: auto, low, high.
  /// Recording of all topics; a folder: <session>.mcap in it; empty: recording.mcap in the session folder.
  std::optional<std::filesystem::path> record;
  /// The recorder keeps so much of the newest past in memory [s] and writes it into a file of its own when a node dies
  /// or a dump is asked for. 0: it does not.
  double keep_s = 0;
  bool standby = false;  ///< A second physics_node follows the first and takes over when that falls silent.
  /// Nodes that run on another host, bit per NodeId, and how to reach it; 0: all run here.
  std::uint32_t remote = 0;
  std::string peer, address;
  int link_domain = 0;                      ///< 0: the usual one of the cart's domain.
  std::string trainee;                      ///< The session's score is remembered under this name; empty: it is not.
  std::filesystem::path training_database;  ///< Where; services/session/supervisor/training_log.h.
  bool keep_going = false;                  ///< A node that failed for good does not end the session.
  /// Not empty: nodes are started by somebody else, systemd, who finds what they need below this folder's "session".
  std::filesystem::path attach;
};

class Supervisor {
 public:
  /// Makes the session folder with the effective configuration and joins the bus. Throws InputError or MismatchError.
  explicit Supervisor(const UpSettings& settings);
  ~Supervisor();
  Supervisor(const Supervisor&) = delete;
  Supervisor& operator=(const Supervisor&) = delete;

  /// Returns when the session has ended and its report is written. Call from the main thread: children die with it.
  ExitCode Run();

  [[nodiscard]] const std::filesystem::path& session_folder() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace fulcrum::supervisor
