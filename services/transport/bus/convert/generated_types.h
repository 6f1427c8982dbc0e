// The generated type of each message. Included by services/transport/bus/convert and services/transport/bus/dds only.
#pragma once

#include "all_topics.h"  // Made by idl/CMakeLists.txt.
#include "services/base/core/messages.h"

namespace fulcrum::bus {

template <class T>
struct TypeSupportOf;
#define FULCRUM_TYPE_SUPPORT(T)      \
  template <>                        \
  struct TypeSupportOf<T> {          \
    using type = idl::T##PubSubType; \
  };
FULCRUM_MESSAGES(FULCRUM_TYPE_SUPPORT)
#undef FULCRUM_TYPE_SUPPORT

template <class T>
using WireOf = typename TypeSupportOf<T>::type::type;

/// Whether T is sent as a loan, as its memory, which is its CDR, too.
template <class T>
concept Loanable = requires {
  typename T::View;
};

}  // namespace fulcrum::bus
