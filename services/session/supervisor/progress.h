// Progress of a session on standard output: one live line on a terminal, a line every few seconds elsewhere.
#pragma once

#include <cstdint>
#include <string>

namespace fulcrum::supervisor {

class Progress {
 public:
  /// @param quiet shows no progress; for a service, whose status has the same content.
  explicit Progress(bool quiet);
  /// True when a new line is due; check it before building a line.
  [[nodiscard]] bool IsDue(std::int64_t now_ns) const;
  void Show(std::int64_t now_ns, const std::string& line);
  /// Prints a permanent line, for example about a restart.
  void Say(const std::string& line);

 private:
  void ClearLive();
  bool quiet_;
  bool live_;          ///< Standard output is a terminal.
  bool open_ = false;  ///< The terminal shows a live line.
  std::int64_t last_ns_ = 0;
};

/// UTF-8 `text` cut to `columns` display columns.
[[nodiscard]] std::string CutToColumns(const std::string& text, std::size_t columns);

}  // namespace fulcrum::supervisor
