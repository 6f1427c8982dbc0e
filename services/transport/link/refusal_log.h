// What a link has refused: counted, and named once each for the operator.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>

#include "services/transport/bus/security.h"

namespace fulcrum::link {

class RefusalLog {
 public:
  explicit RefusalLog(std::string peer) : peer_(std::move(peer)) {}

  /// Counts a packet that needs no name: malformed, or of another link or session.
  void Count() { ++count_; }
  /// Counts and names what the other side sent although it may not.
  void Foreign(const std::string& what) {
    ++count_;
    if (Name("the other host " + peer_ + " sent " + what + ", which it may not")) ++named_.endpoints;
  }
  /// Adds the participants and addresses that a connection has refused.
  void Add(bus::Refusals refused) {
    for (std::string& text : refused.texts) {
      if (Name(std::move(text))) ++named_.participants;
    }
  }

  [[nodiscard]] std::uint64_t count() const { return count_; }
  [[nodiscard]] const bus::Refusals& named() const { return named_; }

 private:
  bool Name(std::string text) {
    if (named_.texts.size() >= bus::Refusals::kMostTexts ||
        std::ranges::find(named_.texts, text) != named_.texts.end()) {
      return false;
    }
    named_.texts.push_back(std::move(text));
    return true;
  }

  const std::string peer_;
  std::uint64_t count_ = 0;
  bus::Refusals named_;
};

}  // namespace fulcrum::link
