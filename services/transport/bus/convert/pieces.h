// Conversion of a value to its wire type and back, selected by its type; of a struct field by field. Internal to
// services/transport/bus/convert.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <type_traits>
#include <vector>

#include "services/base/core/message_fields.h"
#include "services/transport/bus/convert/generated_types.h"
#include "services/transport/bus/gate.h"

namespace fulcrum::bus::convert {

/// Longest length of a list, by member: the wire types do not provide it. A list without a length does not compile.
template <auto member>
inline constexpr std::size_t kMost = 0;
template <>
inline constexpr std::size_t kMost<&Footprint::gap> = idl::MAX_FOOTPRINT;
template <>
inline constexpr std::size_t kMost<&TopologyState::dead_nodes> = idl::MAX_NODE_BYTES;
template <>
inline constexpr std::size_t kMost<&TopologyState::dead_edges> = idl::MAX_EDGE_BYTES;
template <>
inline constexpr std::size_t kMost<&TopologyState::shrink> = idl::MAX_EDGES;
template <>
inline constexpr std::size_t kMost<&TearState::torn_edges> = idl::MAX_EDGE_BYTES;
template <>
inline constexpr std::size_t kMost<&TickManifest::consumed> = kMaxConsumedInputs;
template <>
inline constexpr std::size_t kMost<&TickManifest::tick_times_ns> = kMaxTickTimes;
template <>
inline constexpr std::size_t kMost<&Health::inputs> = kMaxInputHealths;
template <>
inline constexpr std::size_t kMost<&Health::metrics> = kMaxMetrics;

template <class T>
inline constexpr bool kIsList = false;
template <class T>
inline constexpr bool kIsList<std::vector<T>> = true;

/// False if a list or a name does not fit.
#define FULCRUM_DECLARE(T)                           \
  [[nodiscard]] bool Put(const T& from, idl::T* to); \
  void Get(const idl::T& from, T* to);
FULCRUM_STRUCTS_ALIKE_IN_IDL(FULCRUM_DECLARE)
FULCRUM_DECLARE(Stamp)
FULCRUM_DECLARE(ConsumedInput)
#undef FULCRUM_DECLARE

template <class T>
requires std::is_arithmetic_v<T>
bool Put(T from, T* to) {
  *to = from;
  return true;
}
template <class T>
requires std::is_arithmetic_v<T>
void Get(T from, T* to) { *to = from; }

/// An octet, or an unsigned short.
template <class Enum>
requires std::is_enum_v<Enum>
bool Put(Enum from, std::underlying_type_t<Enum>* to) {
  *to = static_cast<std::underlying_type_t<Enum>>(from);
  return true;
}
template <class Enum>
requires std::is_enum_v<Enum>
void Get(std::underlying_type_t<Enum> from, Enum* to) { *to = static_cast<Enum>(from); }

inline bool Put(const Vec2f& v, std::array<float, 2>* to) {
  *to = {v.x(), v.y()};
  return true;
}
inline bool Put(const Vec3f& v, std::array<float, 3>* to) {
  *to = {v.x(), v.y(), v.z()};
  return true;
}
inline bool Put(const Quatf& q, std::array<float, 4>* to) {
  *to = {q.w(), q.x(), q.y(), q.z()};
  return true;
}
inline void Get(const std::array<float, 2>& from, Vec2f* to) { *to = {from[0], from[1]}; }
inline void Get(const std::array<float, 3>& from, Vec3f* to) { *to = {from[0], from[1], from[2]}; }
inline void Get(const std::array<float, 4>& from, Quatf* to) { *to = {from[0], from[1], from[2], from[3]}; }

template <std::size_t size>
bool Put(const std::string& from, eprosima::fastrtps::fixed_string<size>* to) {
  if (from.size() > size) return false;
  *to = from;  // assign() would keep the end of a longer previous text.
  return true;
}
template <std::size_t size>
void Get(const eprosima::fastrtps::fixed_string<size>& from, std::string* to) {
  to->assign(from.c_str(), from.size());
}

/// Converts the elements of an array or a list of equal length.
template <class From, class To>
bool PutEach(const From& from, To* to) {
  return std::equal(from.begin(), from.end(), to->begin(), [](const auto& a, auto& b) { return Put(a, &b); });
}
template <class From, class To>
void GetEach(const From& from, To* to) {
  auto at = to->begin();
  for (const auto& value : from) Get(value, &*at++);
}

template <class T, class Wire, std::size_t size>
bool Put(const std::array<T, size>& from, std::array<Wire, size>* to) {
  return PutEach(from, to);
}
template <class T, class Wire, std::size_t size>
void Get(const std::array<Wire, size>& from, std::array<T, size>* to) {
  GetEach(from, to);
}

template <class T, class Wire>
bool Put(const std::vector<T>& from, std::vector<Wire>* to) {
  if constexpr (std::is_same_v<T, Wire>) {
    *to = from;
    return true;
  } else {
    to->resize(from.size());
    return PutEach(from, to);
  }
}
template <class T, class Wire>
void Get(const std::vector<Wire>& from, std::vector<T>* to) {
  if constexpr (std::is_same_v<T, Wire>) {
    *to = from;
  } else {
    to->resize(from.size());
    GetEach(from, to);
  }
}

template <auto member, class T, class Wire>
bool PutField(const T& from, Wire* to) {
  if constexpr (kIsList<T>) {
    static_assert(kMost<member> > 0, "a list without a maximum length");
    if (from.size() > kMost<member>) return false;
  }
  return Put(from, to);
}

#define FULCRUM_PUT(name) &&PutField<&Struct::name>(from.name, &to->name())
#define FULCRUM_GET(name) Get(from.name(), &to->name);
#define FULCRUM_CONVERT(T)                          \
  inline bool Put(const T& from, idl::T* to) {      \
    using Struct = T;                               \
    return true FULCRUM_FIELDS_OF_##T(FULCRUM_PUT); \
  }                                                 \
  inline void Get(const idl::T& from, T* to) { FULCRUM_FIELDS_OF_##T(FULCRUM_GET) }
FULCRUM_STRUCTS_ALIKE_IN_IDL(FULCRUM_CONVERT)
#undef FULCRUM_CONVERT
#undef FULCRUM_GET
#undef FULCRUM_PUT

inline bool Put(const Stamp& from, idl::Stamp* to) {
  to->number(from.sequence);
  to->epoch(from.epoch);
  to->stamp_ns(from.stamp_ns);
  to->session(0);  // Set by the port that writes.
  return true;
}
inline void Get(const idl::Stamp& from, Stamp* to) { *to = {from.number(), from.epoch(), from.stamp_ns()}; }

inline bool Put(const ConsumedInput& from, idl::ConsumedInput* to) {
  to->topic(static_cast<std::uint8_t>(from.topic));
  to->epoch(from.epoch);
  to->number(from.sequence);
  return true;
}
inline void Get(const idl::ConsumedInput& from, ConsumedInput* to) {
  *to = {static_cast<TopicId>(from.topic()), from.epoch(), from.number()};
}

}  // namespace fulcrum::bus::convert
