// A participant that does not belong to the cart and speaks on its topics.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "services/base/core/messages.h"
#include "services/transport/bus/security.h"

namespace fulcrum::testing {

/// Joins a secured domain with a side of its own that is forged: what it takes for true about permissions is signed by
/// any of the authorities in `authorities` (PEM), and is read from the pipe `permissions` each time anew. Makes a
/// writer of ToolState and writes `bytes` again and again for so long. Throws
/// std::runtime_error when the library refuses it already.
void WriteForgedTools(int domain, const std::string& name, const bus::Security& security,
                      const std::string& authorities, const std::string& permissions, std::vector<std::uint8_t> bytes,
                      std::chrono::seconds time);

/// What a flood is to hold.
enum class Flood {
  kToolState,     ///< Tools that are nowhere: not finite, outside of the world, turned by no rotation.
  kContactModel,  ///< The same of models.
  kCommand,       ///< Verbs that nobody knows, to everybody.
};

class Rogue {
 public:
  explicit Rogue(int domain);
  ~Rogue();
  Rogue(const Rogue&) = delete;
  Rogue& operator=(const Rogue&) = delete;

  /// Its stamps carry this.
  [[nodiscard]] std::uint64_t epoch() const;
  /// Waits until the cart listens, then writes 20 messages each millisecond for so long; how many were sent.
  std::uint64_t Pour(Flood what, double seconds, std::uint32_t seed);
  /// On each topic, under the name of its type: bytes that are no message, some random, some cut short, some that
  /// promise more than follows. How many were sent.
  std::uint64_t PourBytes(int per_topic, std::uint32_t seed);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace fulcrum::testing
