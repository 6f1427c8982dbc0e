// A session that this console starts: `fulcrum up` as a child that goes on when the console ends.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "services/base/config/cart.h"
#include "services/base/runtime/child_process.h"

namespace fulcrum::console {

struct SessionOrder {
  std::string scene;
  std::optional<double> power_W, seconds, picture_rate_Hz;
  bool record = true;
  bool hands = false;   ///< The tools follow the operator on the page, or a trainee's Touch devices; no script.
  std::string trainee;  ///< The score is stored under this name; empty: not stored.
};

struct SessionRunSettings {
  std::filesystem::path program;  ///< Path of the program fulcrum.
  std::filesystem::path out;
  std::filesystem::path cart;      ///< Cart file; empty: all hardware is simulated.
  std::filesystem::path data;      ///< Folder of meshes; empty: the folder of the scene.
  std::filesystem::path database;  ///< Of the trainees.
  int domain = config::DefaultDomain();
  bool touch = false;  ///< The cart has a Touch: trainees operate with it, not on the page.
};

/// How a session ended.
struct SessionEnd {
  bool well = false;
  std::string text;  ///< One line for the operator.
};

/// Arguments of `fulcrum up` for an order.
[[nodiscard]] std::vector<std::string> UpWords(const SessionRunSettings& settings, const SessionOrder& order);

class SessionRun {
 public:
  explicit SessionRun(SessionRunSettings settings);

  /// Starts a session. Throws InputError. Call from the main thread.
  void Start(const SessionOrder& order);
  /// Requests the end of a session that was started here; the session writes its report before it ends.
  void Stop();
  /// Detects the end of the session.
  void Poll();
  /// A session is seen on the bus: its nodes are ready. One that was started elsewhere has an end of its own, which
  /// is not known here. @param session its number, not 0.
  void NoteBegun(std::uint64_t session);

  [[nodiscard]] bool running() const { return up_.running(); }
  [[nodiscard]] bool stopping() const { return stopping_; }
  /// True from the beginning of the session until `fulcrum up` has ended: it still writes its report after the session.
  [[nodiscard]] bool begun() const { return begun_; }
  [[nodiscard]] bool recording() const { return running() && recording_; }
  [[nodiscard]] const SessionRunSettings& settings() const { return settings_; }
  /// Newest line of the output of `fulcrum up`.
  [[nodiscard]] std::string LastWord() const;
  /// End of the last session; nullopt before the first one, while one runs, and after one that was started elsewhere.
  [[nodiscard]] const std::optional<SessionEnd>& end() const { return end_; }
  /// Time that a dump covers [s].
  static constexpr int kKeep_s = 30;

 private:
  SessionRunSettings settings_;
  std::filesystem::path log_;
  runtime::ChildProcess up_;
  bool stopping_ = false, begun_ = false, recording_ = false;
  std::uint64_t own_ = 0;  ///< Number of the last session that was started here; 0: it has not begun.
  std::optional<SessionEnd> end_;
};

}  // namespace fulcrum::console
