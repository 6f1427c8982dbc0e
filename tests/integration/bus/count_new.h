// How often this thread has called operator new. Always 0 where a sanitizer owns it.
#pragma once

namespace fulcrum::bus::test {

[[nodiscard]] long NewCalls();

}  // namespace fulcrum::bus::test
