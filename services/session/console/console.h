// The operator's console: a page for the cart's touch screen, and what it asks for. Outlives the sessions it starts.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace fulcrum::console {

struct ConsoleSettings {
  std::string bind = "127.0.0.1";
  int port = 8480;                      ///< 0: any that is free.
  std::vector<std::string> host_names;  ///< Under which the page may be asked for, beside localhost and addresses.
  /// Holds the token: what is in it already, or a new one. Empty: a new one in a file of the user's own.
  std::filesystem::path token_file;
  std::filesystem::path cart;      ///< Empty: everything simulated.
  std::filesystem::path data;      ///< Meshes that scenes import; empty: the scenes' own.
  std::filesystem::path out;       ///< Session folders.
  std::filesystem::path scenes;    ///< Descriptions to choose from.
  std::filesystem::path programs;  ///< fulcrum, replayer and the nodes.
  int domain = 7;
};

class Console {
 public:
  /// Listens. Throws InputError.
  explicit Console(const ConsoleSettings& settings);
  ~Console();
  Console(const Console&) = delete;
  Console& operator=(const Console&) = delete;

  /// Address of the page, with the token.
  [[nodiscard]] std::string Address() const;
  [[nodiscard]] const std::filesystem::path& token_file() const;

  /// Serves until a stop signal. Call from the main thread: what it starts may die with the thread.
  void Run();
  /// A session that was started here runs still.
  [[nodiscard]] bool session_runs() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace fulcrum::console
