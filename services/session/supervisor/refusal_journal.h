// Refusals on the bus and on the link, in the order in which the supervisor detected them.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <string>

#include "services/transport/bus/security.h"

namespace fulcrum::supervisor {

class RefusalJournal {
 public:
  static constexpr std::size_t kSources = 2;
  /// @param sources all refusals since the start, of each source.
  /// @param on_new called with the text of each refusal that is new.
  void Take(const std::array<bus::Refusals, kSources>& sources, const std::function<void(const std::string&)>& on_new);

  /// The refusals of all sources.
  [[nodiscard]] const bus::Refusals& all() const { return all_; }

 private:
  bus::Refusals all_;
  std::array<std::size_t, kSources> taken_{};  ///< Number of texts of each source that are in `all_`.
};

}  // namespace fulcrum::supervisor
