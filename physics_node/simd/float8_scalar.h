// Eight floats one after the other, in plain C++: the reference with which tests compare the vector kernels bit by bit.
#pragma once

#include <cstddef>
#include <cstdint>

namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE {

struct F8 {
  static constexpr int kBatches = 1;
  float lane[8];
  static F8 Load(const float* p) {
    F8 r;
    for (int i = 0; i < 8; ++i) {
      r.lane[i] = p[i];
    }
    return r;
  }
  static F8 LoadAny(const float* p) { return Load(p); }
  static F8 All(float s) { return {{s, s, s, s, s, s, s, s}}; }
  void StoreAny(float* p) const { Store(p); }
  void Store(float* p) const {
    for (int i = 0; i < 8; ++i) {
      p[i] = lane[i];
    }
  }
};

template <class Operation>
inline F8 Each(const F8& a, const F8& b, const Operation& operation) {
  F8 r;
  for (int i = 0; i < 8; ++i) {
    r.lane[i] = operation(a.lane[i], b.lane[i]);
  }
  return r;
}
inline std::uint32_t BitsOf(float v) { return __builtin_bit_cast(std::uint32_t, v); }
inline float FloatOf(std::uint32_t v) { return __builtin_bit_cast(float, v); }

inline F8 operator+(F8 a, F8 b) {
  return Each(a, b, [](float x, float y) { return x + y; });
}
inline F8 operator-(F8 a, F8 b) {
  return Each(a, b, [](float x, float y) { return x - y; });
}
inline F8 operator*(F8 a, F8 b) {
  return Each(a, b, [](float x, float y) { return x * y; });
}
inline F8 operator/(F8 a, F8 b) {
  return Each(a, b, [](float x, float y) { return x / y; });
}
inline F8 operator&(F8 a, F8 b) {
  return Each(a, b, [](float x, float y) { return FloatOf(BitsOf(x) & BitsOf(y)); });
}
inline F8 operator^(F8 a, F8 b) {
  return Each(a, b, [](float x, float y) { return FloatOf(BitsOf(x) ^ BitsOf(y)); });
}
inline F8 operator>(F8 a, F8 b) {
  return Each(a, b, [](float x, float y) { return FloatOf(x > y ? 0xffffffffu : 0u); });
}
inline F8 operator<(F8 a, F8 b) {
  return Each(a, b, [](float x, float y) { return FloatOf(x < y ? 0xffffffffu : 0u); });
}
inline F8 Sqrt(F8 a) {
  return Each(a, a, [](float x, float) { return __builtin_sqrtf(x); });
}
/// As the vector instructions: the second operand where one is not a number.
inline F8 Max(F8 a, F8 b) {
  return Each(a, b, [](float x, float y) { return x > y ? x : y; });
}
inline F8 Min(F8 a, F8 b) {
  return Each(a, b, [](float x, float y) { return x < y ? x : y; });
}
inline std::uint32_t Bits(F8 mask) {
  std::uint32_t bits = 0;
  for (int i = 0; i < 8; ++i) {
    bits |= (BitsOf(mask.lane[i]) >> 31) << i;
  }
  return bits;
}
inline F8 Select(F8 mask, F8 yes, F8 no) {
  F8 r;
  for (int i = 0; i < 8; ++i) {
    r.lane[i] = BitsOf(mask.lane[i]) >> 31 != 0 ? yes.lane[i] : no.lane[i];
  }
  return r;
}
inline F8 Abs(F8 a) { return a & F8::All(FloatOf(0x7fffffffu)); }
inline F8 SignOf(F8 a) { return a & F8::All(-0.0f); }

/// Lane `lane` of each half in all lanes of that half.
template <int lane>
inline F8 Spread(F8 a) {
  F8 r;
  for (int i = 0; i < 8; ++i) {
    r.lane[i] = a.lane[i / 4 * 4 + lane];
  }
  return r;
}
/// Lane i of the result is lane i + 1; the last lane is lane 0.
inline F8 RotateDown(F8 a) {
  F8 r;
  for (int i = 0; i < 8; ++i) {
    r.lane[i] = a.lane[(i + 1) % 8];
  }
  return r;
}
/// The inverse of RotateDown.
inline F8 RotateUp(F8 a) {
  F8 r;
  for (int i = 0; i < 8; ++i) {
    r.lane[i] = a.lane[(i + 7) % 8];
  }
  return r;
}

inline void Transpose(F8* r0, F8* r1, F8* r2, F8* r3) {
  F8* rows[4] = {r0, r1, r2, r3};
  for (int half = 0; half < 8; half += 4) {
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < i; ++j) {
        const float kept = rows[i]->lane[half + j];
        rows[i]->lane[half + j] = rows[j]->lane[half + i];
        rows[j]->lane[half + i] = kept;
      }
    }
  }
}

inline F8 Gather(const float* pool, const std::uint32_t* index, const std::uint32_t* step, std::uint32_t plane) {
  F8 r;
  for (int i = 0; i < 8; ++i) {
    r.lane[i] = pool[index[i] + plane * step[i]];
  }
  return r;
}
inline F8 LoadRow(const float* rows, const std::uint32_t* index, int i) {
  F8 r;
  for (int j = 0; j < 4; ++j) {
    r.lane[j] = rows[index[i] + static_cast<std::size_t>(j)];
    r.lane[4 + j] = rows[index[i + 4] + static_cast<std::size_t>(j)];
  }
  return r;
}
inline void StoreRow(F8 row, float* rows, const std::uint32_t* index, int i) {
  for (int j = 0; j < 4; ++j) {
    rows[index[i] + static_cast<std::size_t>(j)] = row.lane[j];
    rows[index[i + 4] + static_cast<std::size_t>(j)] = row.lane[4 + j];
  }
}

}  // namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE
