// Source of a link's bytes: a serial port, a pseudo-terminal, or memory in a test.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string_view>

namespace fulcrum::handle_bridge {

struct ReadResult {
  std::size_t bytes = 0;
  bool hung_up = false;  ///< The other end has closed and all bytes are read; the source must be reopened.
};

/// An open connection.
class ByteSource {
 public:
  virtual ~ByteSource() = default;
  /// Reads the bytes that have arrived, without waiting.
  virtual ReadResult Read(std::span<char> buffer) noexcept = 0;
  /// Serial number of the unit at the other end, or the port's name without one; constant while open.
  [[nodiscard]] virtual std::string_view unit() const noexcept = 0;
};

/// Finds and opens a source; used again after each hang-up.
class ByteSourceOpener {
 public:
  virtual ~ByteSourceOpener() = default;
  /// Opens the source; null if it does not exist (yet). May take milliseconds, so not for a cyclic thread. Bytes
  /// received before are discarded.
  virtual std::unique_ptr<ByteSource> Open(int baud) = 0;
};

}  // namespace fulcrum::handle_bridge
