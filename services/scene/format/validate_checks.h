// The single checks used in validate.cc and validate_parameters.cc: each throws Fault where it fails.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <sstream>
#include <vector>

#include "services/scene/format/colouring.h"
#include "services/scene/format/validate.h"

namespace fulcrum::scene {

inline constexpr float kFarthest_m = 10.0f;            ///< Largest distance of anything in a scene from the origin.
inline constexpr float kWeightSumTolerance = 1.0e-4f;  ///< Float rounding of weights of magnitude up to kLargestWeight.
inline constexpr float kLargestWeight = 20.0f;         ///< Larger weights are extrapolation far outside a tetrahedron.

/// Thrown by the checks only, caught by FindFault: leaves the nested loops at the first fault.
struct Fault {
  SceneFault what;
};

template <class... Parts>
[[noreturn]] void Fail(const char* section, const Parts&... parts) {
  std::ostringstream text;
  (text << ... << parts);
  throw Fault{{section, text.str()}};
}

inline void CheckRange(const char* section, const char* what, std::size_t element, double value, double low,
                       double high) {
  if (!(value >= low && value <= high)) {
    Fail(section, "element ", element, ": ", what, " = ", value, "; valid: ", low, " to ", high);
  }
}

inline void CheckIndex(const char* section, std::size_t element, std::uint64_t index, std::uint64_t first,
                       std::uint64_t end) {
  if (index < first || index >= end) {
    Fail(section, "element ", element, ": index ", index, "; valid: ", first, " to below ", end);
  }
}

template <class Indices>
void CheckDistinct(const char* section, std::size_t element, const Indices& indices) {
  for (std::size_t i = 0; i < indices.size(); ++i) {
    for (std::size_t j = i + 1; j < indices.size(); ++j) {
      if (indices[i] == indices[j]) {
        Fail(section, "element ", element, ": index ", indices[i], " twice");
      }
    }
  }
}

inline void CheckSize(const char* section, std::size_t size, std::size_t wanted) {
  if (size != wanted) {
    Fail(section, size, " elements; valid: ", wanted);
  }
}

template <std::size_t N>
void CheckWeights(const char* section, std::size_t element, const std::array<float, N>& weights) {
  float sum = 0;
  for (const float w : weights) {
    CheckRange(section, "weight", element, w, -kLargestWeight, kLargestWeight);
    sum += w;
  }
  if (std::abs(sum - 1) > kWeightSumTolerance) {
    Fail(section, "element ", element, ": weights sum to ", sum, "; valid: 1");
  }
}

inline void CheckPoint(const char* section, std::size_t element, const Vec3f& p) {
  for (int k = 0; k < 3; ++k) {
    CheckRange(section, "coordinate", element, p[k], -kFarthest_m, kFarthest_m);
  }
}

template <class Constraint>
void CheckColours(const char* section, std::span<const Index> offsets, std::span<const Constraint> constraints,
                  std::size_t particle_count) {
  if (offsets.empty() || offsets.front() != 0 || offsets.back() != constraints.size()) {
    Fail(section, "the offsets must begin with 0 and end with ", constraints.size());
  }
  std::vector<std::size_t> last_colour(particle_count, 0);
  for (std::size_t k = 0; k + 1 < offsets.size(); ++k) {
    if (offsets[k] > offsets[k + 1] || offsets[k + 1] > constraints.size()) {
      Fail(section, "element ", k + 1, ": offsets must grow and stay below ", constraints.size());
    }
    for (Index i = offsets[k]; i < offsets[k + 1]; ++i) {
      for (const Index p : ParticlesOf(constraints[i])) {
        if (last_colour[p] == k + 1) {
          Fail(section, "colour ", k, ": two constraints share particle ", p);
        }
        last_colour[p] = k + 1;
      }
    }
  }
}

/// Checks name, parameters and tools: everything that is no array.
void CheckParameters(const SceneView& scene);

}  // namespace fulcrum::scene
