// All message types, for typed tests.
#pragma once

#include <gtest/gtest.h>

#include "services/base/core/messages.h"

namespace fulcrum::bus::test {

template <class None, class... T>
using TypesOf = ::testing::Types<T...>;

#define FULCRUM_NEXT(T) , T
using MessageTypes = TypesOf<void FULCRUM_MESSAGES(FULCRUM_NEXT)>;
#undef FULCRUM_NEXT

}  // namespace fulcrum::bus::test
