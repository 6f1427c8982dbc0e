// A participant that does not belong to the cart and speaks on its topics.
#pragma once

#include <cstdint>
#include <memory>

#include "services/core/messages.h"

namespace fulcrum::testing {

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
