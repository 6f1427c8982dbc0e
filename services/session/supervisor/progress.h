// Progress of a session on standard output: one live line on a terminal, a line every few seconds elsewhere.
#pragma once

#include <cstdint>
#include <string>

namespace fulcrum::supervisor {

class Progress {
 public:
  /// `quiet`: shows nothing, for a service whose status says the same.
  explicit Progress(bool quiet);
  /// True when it is time to show a new line; ask before building one.
  [[nodiscard]] bool IsDue(std::int64_t now_ns) const;
  void Show(std::int64_t now_ns, const std::string& line);
  /// A line that stays, for example a restart.
  void Say(const std::string& line);

 private:
  void ClearLive();
  bool quiet_;
  bool live_;          ///< Standard output is a terminal.
  bool open_ = false;  ///< A live line stands on the terminal.
  std::int64_t last_ns_ = 0;
};

/// `text` cut to `columns` display columns. UTF-8.
[[nodiscard]] std::string CutToColumns(const std::string& text, std::size_t columns);

}  // namespace fulcrum::supervisor
