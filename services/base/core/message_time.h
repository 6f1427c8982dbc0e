// The times in a message, for its conversion to another clock.
#pragma once

#include <cstdint>
#include <string_view>
#include <type_traits>
#include <vector>

#include "services/base/core/message_fields.h"

namespace fulcrum {

/// Calls visit(name, value) for each number in `message`, at any depth, that is a time of CLOCK_MONOTONIC by its name:
/// "epoch" and names that end in "_ns". Values of 0, which mean none, are skipped.
template <class T, class Visit>
void ForEachTime(T* message, const Visit& visit) {
  if constexpr (HasFields<T>) {
    ForEachField<T>([&](const char* field, auto member) {
      const std::string_view name = field;
      auto& part = message->*member;
      if constexpr (std::is_integral_v<std::remove_reference_t<decltype(part)>>) {
        if (part != 0 && (name == "epoch" || name.ends_with("_ns"))) visit(name, part);
      } else if constexpr (std::is_same_v<std::remove_reference_t<decltype(part)>, std::vector<std::int64_t>>) {
        for (std::int64_t& time : part) {
          if (time != 0) visit(name, time);
        }
      } else {
        ForEachTime(&part, visit);
      }
    });
  } else if constexpr (requires { requires HasFields<typename T::value_type>; }) {
    for (auto& part : *message) ForEachTime(&part, visit);
  }
}

}  // namespace fulcrum
