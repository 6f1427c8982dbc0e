// Where a link's bytes come from: a serial port, a pseudo-terminal, or memory in a test.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string_view>

namespace fulcrum::handle_bridge {

struct ReadResult {
  std::size_t bytes = 0;
  bool hung_up = false;  ///< The other end is gone and nothing is left to read: close and open anew.
};

/// An open connection.
class ByteSource {
 public:
  virtual ~ByteSource() = default;
  /// Takes what has arrived, without waiting.
  virtual ReadResult Read(std::span<char> buffer) noexcept = 0;
  /// Serial number of the unit at the other end, or what comes closest; the same as long as it is open.
  [[nodiscard]] virtual std::string_view unit() const noexcept = 0;
};

/// Finds and opens it, again after each hang-up.
class ByteSourceOpener {
 public:
  virtual ~ByteSourceOpener() = default;
  /// Null when it is not there (yet); may take milliseconds, so not for a cyclic thread. Bytes from before are dropped.
  virtual std::unique_ptr<ByteSource> Open(int baud) = 0;
};

}  // namespace fulcrum::handle_bridge
