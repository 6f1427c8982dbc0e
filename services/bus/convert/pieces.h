// Pieces that several messages share. Internal to services/bus/convert.
#pragma once

#include <array>
#include <cstdint>

#include "common.h"
#include "services/core/messages.h"

namespace fulcrum::bus::convert {

inline idl::Stamp ToWire(const Stamp& from) {
  idl::Stamp to;
  to.number(from.sequence);
  to.epoch(from.epoch);
  to.stamp_ns(from.stamp_ns);
  return to;
}
inline Stamp FromWire(const idl::Stamp& from) { return {from.number(), from.epoch(), from.stamp_ns()}; }

inline std::array<float, 2> ToWire(const Vec2f& v) { return {v.x(), v.y()}; }
inline std::array<float, 3> ToWire(const Vec3f& v) { return {v.x(), v.y(), v.z()}; }
inline std::array<float, 4> ToWire(const Quatf& q) { return {q.w(), q.x(), q.y(), q.z()}; }
inline Vec2f FromWire(const std::array<float, 2>& v) { return {v[0], v[1]}; }
inline Vec3f FromWire(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }
inline Quatf FromWire(const std::array<float, 4>& q) { return {q[0], q[1], q[2], q[3]}; }

template <class Enum>
std::uint8_t Octet(Enum value) {
  return static_cast<std::uint8_t>(value);
}

}  // namespace fulcrum::bus::convert
