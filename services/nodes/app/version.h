#pragma once

namespace fulcrum::app {

inline constexpr const char* kVersion = FULCRUM_VERSION;

}  // namespace fulcrum::app
