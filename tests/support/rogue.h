// A participant that does not belong to the cart and writes to its topics.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "services/base/core/messages.h"
#include "services/transport/bus/dds/participant.h"
#include "services/transport/bus/security.h"

namespace fulcrum::testing {

/// Joins a secured domain with forged local state: it accepts permissions signed by any of the authorities in
/// `authorities` (PEM), and reads them from the pipe `permissions` at each use. Makes a writer of ToolState and writes
/// `bytes` repeatedly for the given time. Throws std::runtime_error if the library refuses it.
void WriteForgedTools(int domain, const std::string& name, const bus::Security& security,
                      const std::string& authorities, const std::string& permissions, std::vector<std::uint8_t> bytes,
                      std::chrono::seconds time);

/// Content of a flood.
enum class Flood {
  kToolState,     ///< Invalid tools: not finite, outside of the world, not a rotation.
  kContactModel,  ///< Invalid contact models.
};

class Rogue {
 public:
  /// Waits for the session of a cart in that domain (WriterOf).
  explicit Rogue(int domain);
  /// A bus without a cart.
  explicit Rogue(const bus::DdsSettings& settings);
  ~Rogue();
  Rogue(const Rogue&) = delete;
  Rogue& operator=(const Rogue&) = delete;

  /// Epoch of its stamps.
  [[nodiscard]] std::uint64_t epoch() const;
  /// Waits for readers of the cart, then writes 20 messages each millisecond for `seconds`. Returns the number of
  /// messages.
  std::uint64_t Pour(Flood what, double seconds, std::uint32_t seed);
  /// Writes invalid bytes to each topic under the name of its type: random, truncated, or with lengths beyond their
  /// end. Returns the number of messages.
  std::uint64_t PourBytes(int per_topic, std::uint32_t seed);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace fulcrum::testing
