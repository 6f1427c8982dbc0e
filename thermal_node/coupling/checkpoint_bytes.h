// What checkpoints of the thermal solvers consist of: values as bytes, and the tiles of a field, each with only those
// arrays that differ from their defaults.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>

#include "thermal_node/damage/arrhenius.h"
#include "thermal_node/heat/heat_field.h"

namespace fulcrum::thermal {

class Writer {
 public:
  explicit Writer(std::span<std::byte> out) : out_(out) {}
  template <class T>
  void Put(std::span<const T> values) {
    static_assert(std::is_trivially_copyable_v<T>);
    const std::span<const std::byte> bytes = std::as_bytes(values);
    if (at_ + bytes.size() > out_.size()) full_ = true;
    if (full_) return;
    std::copy(bytes.begin(), bytes.end(), out_.begin() + static_cast<std::ptrdiff_t>(at_));
    at_ += bytes.size();
  }
  template <class T>
  void PutValue(const T& value) {
    Put(std::span<const T>(&value, 1));
  }
  [[nodiscard]] std::size_t used() const { return full_ ? 0 : at_; }

 private:
  std::span<std::byte> out_;
  std::size_t at_ = 0;
  bool full_ = false;
};

class Reader {
 public:
  explicit Reader(std::span<const std::byte> in) : in_(in) {}
  template <class T>
  bool Get(std::span<T> values) {
    const std::size_t bytes = values.size_bytes();
    if (at_ + bytes > in_.size()) return false;
    if (bytes > 0) std::memcpy(values.data(), in_.data() + at_, bytes);
    at_ += bytes;
    return true;
  }
  template <class T>
  bool GetValue(T* value) {
    return Get(std::span<T>(value, 1));
  }
  [[nodiscard]] bool at_end() const { return at_ == in_.size(); }

 private:
  std::span<const std::byte> in_;
  std::size_t at_ = 0;
};

inline auto FloatArrays(auto& s) {
  return std::array{&s.enthalpy, &s.water, &s.omega_cell, &s.omega_collagen, &s.charred};
}
/// Default of an array of FloatArrays; an array that holds nothing else is not stored.
[[nodiscard]] inline float DefaultOf(std::size_t array) { return array == 1 ? 1.0f : 0.0f; }

template <class Values>
[[nodiscard]] bool AllWithin(const Values& values, float low, float high) {
  return std::all_of(values.begin(), values.end(), [&](float v) { return v >= low && v <= high; });  // false for NaN
}

/// Number of tiles that PutTiles writes.
[[nodiscard]] std::uint32_t StoredTiles(const HeatField& field);
void PutTiles(const HeatField& field, Writer* writer);
/// Returns false, and clears the field, if no solver can have written these tiles.
[[nodiscard]] bool GetTiles(Reader* reader, std::uint32_t count, HeatField* field);

}  // namespace fulcrum::thermal
