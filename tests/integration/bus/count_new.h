// Number of calls of operator new on this thread. Always 0 if a sanitizer replaces operator new.
#pragma once

namespace fulcrum::bus::test {

[[nodiscard]] long NewCalls();

}  // namespace fulcrum::bus::test
