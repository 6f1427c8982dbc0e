#include "render_node/geometry/tissue_pattern.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "render_node/geometry/texel.h"

namespace fulcrum::render {
namespace {

constexpr std::uint32_t kSeedStep = 101;  // More than the seeds of one set of patterns differ by.

// The standard fixes the sequence of std::mt19937 but not those of its distributions.
class Uniform {
 public:
  explicit Uniform(std::uint32_t seed) : engine_(seed) {}
  float operator()() { return static_cast<float>(engine_() >> 8) * 0x1p-24f; }

 private:
  std::mt19937 engine_;
};

float SmoothStep(float t) { return t * t * (3 - 2 * t); }

/// Adds value noise with `cells` cells a side to a square field.
void AddValueNoise(int size, int cells, float amplitude, Uniform* uniform, std::vector<float>* field) {
  std::vector<float> lattice(static_cast<std::size_t>(cells) * cells);
  for (float& value : lattice) {
    value = (*uniform)() - 0.5f;
  }
  // Lattice columns and weights of each x; the same for all rows.
  struct Column {
    std::size_t left, right;
    float share;
  };
  const auto place = [&](int texel) {
    const float f = static_cast<float>(texel) * cells / size;
    const int cell = static_cast<int>(f);
    return Column{static_cast<std::size_t>(cell % cells), static_cast<std::size_t>((cell + 1) % cells),
                  SmoothStep(f - cell)};
  };
  std::vector<Column> columns;
  columns.reserve(static_cast<std::size_t>(size));
  for (int x = 0; x < size; ++x) columns.push_back(place(x));
  std::vector<float> row(static_cast<std::size_t>(cells));
  for (int y = 0; y < size; ++y) {
    const Column& between = columns[static_cast<std::size_t>(y)];
    const float* low = lattice.data() + between.left * static_cast<std::size_t>(cells);
    const float* high = lattice.data() + between.right * static_cast<std::size_t>(cells);
    for (std::size_t k = 0; k < row.size(); ++k) row[k] = amplitude * (low[k] + between.share * (high[k] - low[k]));
    float* out = field->data() + TexelIndex(0, y, size);
    for (const Column& x : columns) *out++ += row[x.left] + x.share * (row[x.right] - row[x.left]);
  }
}

/// Rounds to nearest, halves up; std::lround would be a function call per texel.
std::uint8_t ToByte(float value) {
  return static_cast<std::uint8_t>(static_cast<int>(2 * std::clamp(value, 0.0f, 255.0f) + 1) / 2);
}

/// Square RGBA8 image with the three noises, alpha 0.
std::vector<std::uint8_t> MakeNoises(int size, std::uint32_t seed) {
  std::vector<std::uint8_t> image(4u * static_cast<std::size_t>(size) * size);
  for (std::size_t channel = 0; channel < 3; ++channel) {
    Uniform uniform(static_cast<std::uint32_t>(17 + channel) + kSeedStep * seed);
    std::vector<float> field(static_cast<std::size_t>(size) * size, 0.0f);
    for (const int cells : {5, 11, 23, 47}) {
      AddValueNoise(size, cells, std::pow(5.0f / static_cast<float>(cells), 0.75f), &uniform, &field);
    }
    for (std::size_t i = 0; i < field.size(); ++i) {
      image[4 * i + channel] = ToByte(128 + 115 * field[i]);
    }
  }
  return image;
}

/// Adds rounded cells, about `cells` a side, that rise by `amplitude` from the clefts between them to a square field.
/// `tone`: a value 0 … 1 of the nearest cell, mixed in the clefts.
void AddCells(int size, int cells, float amplitude, Uniform* uniform, std::vector<float>* field,
              std::vector<float>* tone) {
  struct Centre {
    float u, v, tone;
  };
  const auto count = static_cast<std::size_t>(cells);
  std::vector<Centre> centres;
  for (std::size_t k = 0; k < count * count; ++k) {
    const std::size_t column = k % count, row = k / count;
    const float u = static_cast<float>(column) + 0.1f + 0.8f * (*uniform)();
    const float v = static_cast<float>(row) + 0.1f + 0.8f * (*uniform)();
    centres.push_back({u, v, (*uniform)()});
  }
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      // In units of a cell.
      const float u = (static_cast<float>(x) + 0.5f) * static_cast<float>(cells) / static_cast<float>(size);
      const float v = (static_cast<float>(y) + 0.5f) * static_cast<float>(cells) / static_cast<float>(size);
      float nearest = 99, second = 99;  // Squared.
      float own = 0, other = 0;
      for (int dy = -2; dy <= 2; ++dy) {
        for (int dx = -2; dx <= 2; ++dx) {
          const int column = static_cast<int>(u) + dx, row = static_cast<int>(v) + dy;
          const int wrapped_x = (column + cells) % cells, wrapped_y = (row + cells) % cells;
          const Centre& centre = centres[TexelIndex(wrapped_x, wrapped_y, cells)];
          const float du = u - (centre.u + static_cast<float>(column - wrapped_x));
          const float dv = v - (centre.v + static_cast<float>(row - wrapped_y));
          const float d = du * du + dv * dv;
          if (d < nearest) {
            second = nearest;
            other = own;
            nearest = d;
            own = centre.tone;
          } else if (d < second) {
            second = d;
            other = centre.tone;
          }
        }
      }
      // Round, steepest at the cleft.
      const float inside = std::min(1.0f, 1.1f * (std::sqrt(second) - std::sqrt(nearest)));
      const float rise = 1 - (1 - inside) * (1 - inside);
      const std::size_t texel = TexelIndex(x, y, size);
      (*field)[texel] += amplitude * rise;
      if (tone != nullptr) (*tone)[texel] = own + (other - own) * 0.5f * (1 - SmoothStep(std::min(1.0f, 4 * inside)));
    }
  }
}

/// Mean over squares of 2 * reach + 1 texels, twice: the clefts become round as well.
void Blur(int size, int reach, std::vector<float>* field) {
  std::vector<float> line(static_cast<std::size_t>(size));
  for (int pass = 0; pass < 4; ++pass) {
    for (int k = 0; k < size; ++k) {
      const auto at = [&](int i) -> float& {
        const int wrapped = (i + size) % size;
        return (*field)[pass % 2 == 0 ? TexelIndex(wrapped, k, size) : TexelIndex(k, wrapped, size)];
      };
      for (int i = 0; i < size; ++i) {
        float sum = 0;
        for (int j = i - reach; j <= i + reach; ++j) sum += at(j);
        line[static_cast<std::size_t>(i)] = sum / static_cast<float>(2 * reach + 1);
      }
      for (int i = 0; i < size; ++i) at(i) = line[static_cast<std::size_t>(i)];
    }
  }
}

}  // namespace

std::vector<std::uint8_t> MakeNoisePattern(int size, std::uint32_t seed) {
  std::vector<std::uint8_t> image = MakeNoises(size, seed);
  for (std::size_t i = 3; i < image.size(); i += 4) image[i] = 255;
  return image;
}

std::vector<std::uint8_t> MakeFatPattern(int size, std::uint32_t seed) {
  constexpr float kLarge_m = 8e-4f,
                  kSmall_m = 2.5e-4f;  // Heights of lobules and of the small ones that they consist of.
  const std::size_t texels = static_cast<std::size_t>(size) * static_cast<std::size_t>(size);
  std::vector<float> height(texels, 0.0f), tone(texels);
  Uniform uniform(5 + kSeedStep * seed);
  AddCells(size, kFatLobules, kLarge_m, &uniform, &height, &tone);
  AddCells(size, 5 * kFatLobules / 2, kSmall_m, &uniform, &height, nullptr);
  Blur(size, size / 100, &height);
  const std::vector<std::uint8_t> vessels = MakeVesselPattern(size, seed + 53);
  std::vector<std::uint8_t> image(4 * texels);
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const auto at = [&](int dx, int dy) {
        return height[TexelIndex((x + dx + size) % size, (y + dy + size) % size, size)];
      };
      const std::size_t i = TexelIndex(x, y, size);
      const float two_texels_m = 2 * kFatPeriod_m / static_cast<float>(size);
      image[4 * i] = ToByte(128 + 64 * (at(1, 0) - at(-1, 0)) / two_texels_m);
      image[4 * i + 1] = ToByte(128 + 64 * (at(0, 1) - at(0, -1)) / two_texels_m);
      image[4 * i + 2] = ToByte(255 * at(0, 0) / (kLarge_m + kSmall_m));
      // Vessels lie in the clefts and fade on the lobules.
      const float vessel = static_cast<float>(vessels[i]) / 255 * (1.5f - 0.8f * at(0, 0) / kLarge_m);
      image[4 * i + 3] = ToByte((1 - std::clamp(vessel, 0.0f, 1.0f)) * (128 + 127 * tone[i]));
    }
  }
  return image;
}

std::vector<std::uint8_t> MakeVesselPattern(int size, std::uint32_t seed) {
  std::vector<float> image(static_cast<std::size_t>(size) * size, 0.0f);
  struct Walker {
    float x, y, angle, radius, left;
  };
  constexpr std::size_t kMostWalkers = 400;
  Uniform uniform(29 + kSeedStep * seed);
  std::vector<Walker> walkers;
  walkers.reserve(kMostWalkers);
  for (int k = 0; k < 7; ++k) {
    walkers.push_back(
        {uniform() * size, uniform() * size, 2 * std::numbers::pi_v<float> * uniform(), 0.0042f * size, 0.9f * size});
  }
  for (std::size_t w = 0; w < walkers.size(); ++w) {
    Walker walker = walkers[w];
    while (walker.left > 0 && walker.radius > 0.35f) {
      const int reach = static_cast<int>(walker.radius) + 2;
      for (int dy = -reach; dy <= reach; ++dy) {
        for (int dx = -reach; dx <= reach; ++dx) {
          const int x = static_cast<int>(std::floor(walker.x)) + dx, y = static_cast<int>(std::floor(walker.y)) + dy;
          const float ex = static_cast<float>(x) + 0.5f - walker.x, ey = static_cast<float>(y) + 0.5f - walker.y;
          const float d = std::sqrt(ex * ex + ey * ey);
          const float strength = std::min(1.0f, 0.35f + walker.radius / (0.004f * size)) *
                                 SmoothStep(std::clamp(walker.radius + 1 - d, 0.0f, 1.0f));
          float& texel = image[TexelIndex((x % size + size) % size, (y % size + size) % size, size)];
          texel = std::max(texel, strength);
        }
      }
      walker.angle += 0.35f * (uniform() - 0.5f);
      walker.x += std::cos(walker.angle);
      walker.y += std::sin(walker.angle);
      walker.left -= 1;
      walker.radius *= 0.9985f;
      // A thinner branch starts about every thirtieth of the image (Murray's law: r0^3 = r1^3 + r2^3).
      if (uniform() < 30.0f / static_cast<float>(size) && walkers.size() < kMostWalkers) {
        const float turn = (uniform() < 0.5f ? -1.0f : 1.0f) * (0.5f + 0.6f * uniform());
        walkers.push_back({walker.x, walker.y, walker.angle + turn, 0.68f * walker.radius, 0.5f * walker.left});
        walker.radius *= 0.88f;
      }
    }
  }
  std::vector<std::uint8_t> bytes(image.size());
  std::transform(image.begin(), image.end(), bytes.begin(), [](float v) { return ToByte(255 * v); });
  return bytes;
}

std::vector<std::uint8_t> MakeSerosaPattern(int size, std::uint32_t seed) {
  std::vector<std::uint8_t> image = MakeNoises(size, seed);
  const std::vector<std::uint8_t> vessels = MakeVesselPattern(size, seed);
  for (std::size_t i = 0; i < vessels.size(); ++i) {
    image[4 * i + 3] = vessels[i];
  }
  return image;
}

StructureMap MakeStructureMap(const SceneView& scene, float width_m, float height_m) {
  constexpr float kTexel = 4.0e-4f;  // [m]: a fifth of a ureter.
  StructureMap map;
  if (scene.protected_structures.empty()) {
    map.texels.assign(2, 0);
    return map;
  }
  map.width = std::max(1, static_cast<int>(std::ceil(width_m / kTexel)));
  map.height = std::max(1, static_cast<int>(std::ceil(height_m / kTexel)));
  map.texels.assign(2u * static_cast<std::size_t>(map.width) * map.height, 0);
  for (const ProtectedStructure& structure : scene.protected_structures) {
    const std::size_t channel = structure.kind == ProtectedKind::kUreter ? 0 : 1;
    const float reach = 2 * structure.radius_m;
    for (Index k = 0; k + 1 < structure.point_count; ++k) {
      const Vec2f a = scene.protected_points[structure.first_point + k].material;
      const Vec2f ab = scene.protected_points[structure.first_point + k + 1].material - a;
      const Vec2f low = a.cwiseMin(a + ab).array() - reach, high = a.cwiseMax(a + ab).array() + reach;
      for (int y = std::max(0, static_cast<int>(low.y() / kTexel));
           y <= std::min(map.height - 1, static_cast<int>(high.y() / kTexel)); ++y) {
        for (int x = std::max(0, static_cast<int>(low.x() / kTexel));
             x <= std::min(map.width - 1, static_cast<int>(high.x() / kTexel)); ++x) {
          const Vec2f p((static_cast<float>(x) + 0.5f) * kTexel, (static_cast<float>(y) + 0.5f) * kTexel);
          const float length2 = std::max(ab.squaredNorm(), std::numeric_limits<float>::min());
          const float t = std::clamp((p - a).dot(ab) / length2, 0.0f, 1.0f);
          const float shade = std::clamp(1 - (p - a - t * ab).norm() / reach, 0.0f, 1.0f);
          std::uint8_t& texel = map.texels[2 * TexelIndex(x, y, map.width) + channel];
          texel = std::max(texel, ToByte(255 * shade));
        }
      }
    }
  }
  return map;
}

}  // namespace fulcrum::render
