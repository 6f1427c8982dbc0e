// The operator's console: serves a page for the cart's touch screen and executes its requests. Sessions that it starts
// go on when it ends.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "services/base/config/cart.h"
#include "services/session/console/greeting.h"

namespace fulcrum::console {

struct ConsoleSettings {
  std::string bind = "127.0.0.1";
  int port = 8480;                      ///< 0: any free port.
  std::vector<std::string> host_names;  ///< Valid host names of the page, besides localhost and numeric addresses.
  /// File of the token: an existing token is used, else a new one is written. Empty: a new token in a private file of
  /// the user.
  std::filesystem::path token_file;
  std::filesystem::path cart;      ///< Cart file; empty: all hardware is simulated.
  std::filesystem::path data;      ///< Folder of meshes that scenes import; empty: the folder of each scene.
  std::filesystem::path out;       ///< Folder of the session folders.
  std::filesystem::path scenes;    ///< Folder of the scene descriptions on offer.
  std::filesystem::path courses;   ///< Folder of the courses.
  std::filesystem::path database;  ///< Of the trainees; it may be missing.
  std::filesystem::path programs;  ///< Folder of fulcrum, replayer and the nodes.
  std::filesystem::path state;     ///< Folder of what lasts: the certificate of a console that others can reach.
  int domain = config::DefaultDomain();
};

class Console {
 public:
  /// Binds the port and listens, over TLS unless only this machine can reach the address. Throws InputError.
  explicit Console(const ConsoleSettings& settings);
  ~Console();
  Console(const Console&) = delete;
  Console& operator=(const Console&) = delete;

  /// Address, token and fingerprint, for the operator.
  [[nodiscard]] GreetingFacts Facts() const;

  /// Serves until a stop signal. Call from the main thread: tasks are killed when the calling thread ends.
  void Run();
  /// True when a session that was started here still runs.
  [[nodiscard]] bool session_runs() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace fulcrum::console
