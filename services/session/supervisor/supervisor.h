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
  std::filesystem::path out;       ///< Folder in which the session folder is made.
  std::filesystem::path programs;  ///< Folder of the node programs.
  config::CartConfig cart;         ///< The session runs in its domain.
  double seconds = -1;  ///< Session time [s]; negative: the script's duration; without a script until stopped.
  bool window = false;
  std::string quality = "auto";  ///< Quality of the picture: auto, low, high.
  /// File of the recording of all topics. A folder: <session>.mcap in it. Empty: recording.mcap in the session folder.
  std::optional<std::filesystem::path> record;
  bool video = true;  ///< A recorded session is drawn as a video at its end.
  /// Time [s] that a dump covers: the recorder keeps the newest samples in memory and writes them into a separate file
  /// when a node dies or a dump is requested. 0: no dumps.
  double keep_s = 0;
  bool standby = false;  ///< A second physics_node follows the first and takes over when the first is silent.
  /// Nodes that run on another host, one bit per NodeId; 0: all run here.
  std::uint32_t remote = 0;
  std::string peer, address;
  std::filesystem::path link_keys;          ///< Folder of the link's keys; empty: an insecure link.
  int link_domain = 0;                      ///< Domain of the link, 101 to 200.
  std::string trainee;                      ///< Name under which the score is stored; empty: it is not stored.
  std::filesystem::path training_database;  ///< File of the scores; services/session/supervisor/training_log.h.
  bool open_bus = false;                    ///< No keys: every process of this machine can join the bus.
  bool allow_swap_command = false;          ///< `fulcrum swap --with` may name any command.
  bool keep_going = false;                  ///< A node that failed for good does not end the session.
  /// Not empty: systemd starts the nodes and reads their arguments below "session" in this folder.
  std::filesystem::path attach;
};

class Supervisor {
 public:
  /// Makes the session folder with the effective configuration and joins the bus. Throws InputError or MismatchError.
  explicit Supervisor(const UpSettings& settings);
  ~Supervisor();
  Supervisor(const Supervisor&) = delete;
  Supervisor& operator=(const Supervisor&) = delete;

  /// Returns when the session has ended and its report is written. Call from the main thread: the children are killed
  /// when the calling thread ends.
  ExitCode Run();

  [[nodiscard]] const std::filesystem::path& session_folder() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace fulcrum::supervisor
