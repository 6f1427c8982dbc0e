// Greedy colouring: constraints of one colour share no particle and can be solved in any order.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "services/base/core/scene_view.h"

namespace fulcrum::scene {

/// Colours `count` constraints over `particle_count` particles; `particles(i)` is a range of the particles of
/// constraint i. Returns the colour of each: the lowest one that is free at its particles, in the order given.
template <class Particles>
std::vector<Index> GreedyColours(std::size_t count, std::size_t particle_count, const Particles& particles) {
  std::vector<std::vector<bool>> taken(particle_count);
  std::vector<Index> colours(count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto own = particles(i);
    Index colour = 0;
    const auto is_taken = [&](Index c) {
      return std::any_of(own.begin(), own.end(), [&](Index p) { return c < taken[p].size() && taken[p][c]; });
    };
    while (is_taken(colour)) {
      ++colour;
    }
    for (const Index p : own) {
      if (taken[p].size() <= colour) {
        taken[p].resize(colour + 1, false);
      }
      taken[p][colour] = true;
    }
    colours[i] = colour;
  }
  return colours;
}

/// Sorts `constraints` by colour (keeping their order within a colour) and returns the offsets: colour k is [offset[k],
/// offset[k+1]). For an empty list the result is {0}.
template <class Constraint, class Particles>
std::vector<Index> SortByColour(std::vector<Constraint>* constraints, std::size_t particle_count,
                                const Particles& particles) {
  const std::vector<Index> colours =
      GreedyColours(constraints->size(), particle_count, [&](std::size_t i) { return particles((*constraints)[i]); });
  const Index colour_count = colours.empty() ? 0 : 1 + *std::max_element(colours.begin(), colours.end());
  std::vector<Index> offsets(colour_count + 1, 0);
  for (const Index colour : colours) {
    ++offsets[colour + 1];
  }
  for (Index k = 0; k < colour_count; ++k) {
    offsets[k + 1] += offsets[k];
  }
  std::vector<Index> next(offsets.begin(), offsets.end() - 1);
  std::vector<Constraint> sorted(constraints->size());
  for (std::size_t i = 0; i < constraints->size(); ++i) {
    sorted[next[colours[i]]++] = (*constraints)[i];
  }
  *constraints = std::move(sorted);
  return offsets;
}

inline std::array<Index, 2> ParticlesOf(const StretchConstraint& c) { return {c.a, c.b}; }
inline const Tetrahedron& ParticlesOf(const Tetrahedron& c) { return c; }
inline const std::array<Index, 4>& ParticlesOf(const BendingConstraint& c) { return c.v; }
inline std::array<Index, 4> ParticlesOf(const Binding& c) {
  return {c.membrane, c.surface[0], c.surface[1], c.surface[2]};
}

}  // namespace fulcrum::scene
