// How hats and coarse nodes follow cuts, sleep and contacts.
#include <algorithm>

#include "physics_node/implicit/coarse_space.h"

namespace fulcrum::physics::implicit {
namespace {

/// Least sums of (difference of a hat)^2 over the edges that a cut leaves, exactly (of 5.375 for a whole hat) and by
/// the samples (of 5.5). With less the edges that are left may hold in other directions than the samples do, and the
/// hat is switched off. Assumed.
constexpr float kLeastEdgesLeft = 3.8f, kLeastSampledEdges = 3.3f;
/// Hats from a contact to where the coarse nodes' part is whole again. Cut off sharply it would cost more energy than
/// the coarse matrix contains, and corrections that overshoot grow. Assumed.
constexpr int kFadeHats = 4;
/// Hats that overlap at a particle. A clip couples all of its hats, which their blocks leave out: with its stiffness
/// taken once the layers in a clip tremble (deploy/docs/measurements/physics, Clips).
constexpr float kHatsAtParticle = 4;

}  // namespace

/// Hats that a node of the sheet belongs to, by place in a row of them: its own, and the one after.
std::array<std::uint32_t, 2> CoarseSpace::HatsOf(std::uint32_t col) const {
  const std::uint32_t place = layout_.Offset(0, col), group = place / kLanes / kHatSpacing, lane = place % kLanes;
  const std::uint32_t own = kLanes * group + lane;
  return {own, group + 1 < static_cast<std::uint32_t>(hats_.slots) ? own + kLanes : (lane + 1) % kLanes};
}

/// Value of a hat at a node; 0 outside the sheet.
float CoarseSpace::HatAt(std::uint32_t hat, int row, int col) const {
  if (row < 0 || row >= sheet_rows_ || col < 0 || col >= static_cast<int>(layout_.cols)) {
    return 0.0f;
  }
  const auto r = static_cast<std::size_t>(row);
  const int above = static_cast<int>(hat / hats_.width) - hats_.cell[r];
  const std::uint32_t place = layout_.Offset(0, static_cast<std::uint32_t>(col)),
                      in_row = hat % static_cast<std::uint32_t>(hats_.width);
  const auto [own, next] = HatsOf(static_cast<std::uint32_t>(col));
  const float along = above == 0 ? 1.0f - hats_.fraction[r] : above == 1 ? hats_.fraction[r] : 0.0f;
  return along * ((in_row == own ? hats_.own[place] : 0.0f) + (in_row == next ? hats_.next[place] : 0.0f));
}

void CoarseSpace::MarkEdit(std::uint32_t row, std::uint32_t col, std::size_t d) {
  const auto width = static_cast<std::uint32_t>(hats_.width);
  const auto mark = [&](std::uint32_t r, std::uint32_t c) {
    for (std::uint32_t i = 0; i < (hats_.fraction[r] > 0.0f ? 2u : 1u); ++i) {
      for (const std::uint32_t in_row : HatsOf(c)) {
        blocks_.edited.push_back((static_cast<std::uint32_t>(hats_.cell[r]) + i) * width + in_row);
      }
    }
  };
  mark(row, col);
  mark(std::min(row + (d != 0 ? 1 : 0), layout_.rows - 1), std::min(col + (d != 1 ? 1 : 0), layout_.cols - 1));
}

/// Where the next hat is near, a hat is so steep that the samples, made for a distance of four, are far too soft:
/// by 2.5 times beside a group of one column. With three columns they are within a fifth, which the blocks have room
/// for. And beside the last column half of the samples have no edge to the right. Not with several sheets, whose rims
/// lie anywhere between the hats: a loose band that falls would come to rest 0.1 mm too high.
void CoarseSpace::MarkSteepHats() {
  if (hats_.rows == 0 || grid_.sheets.size() != 1) return;
  const auto is_short = [](int distance) { return distance > 0 && distance <= kHatSpacing / 2; };
  // The last group of a lane is the shorter one: its hat, and the first of the next lane.
  const bool columns = is_short(static_cast<int>(layout_.slots) % kHatSpacing);
  const bool last_rows = is_short((sheet_rows_ - 1) % kHatSpacing);
  const std::uint32_t before_last = std::max(layout_.cols, 2u) - 2;
  const bool has_middle = layout_.Offset(0, before_last) / kLanes % kHatSpacing == 0;
  for (int r = 0; r < hats_.rows; ++r) {
    for (std::uint32_t i = 0; i < hats_.width; ++i) {
      const bool beside = columns && i > 0 && (i < kLanes || i + kLanes >= hats_.width);
      if (beside || (last_rows && r + 2 == hats_.rows) || (has_middle && i == HatsOf(before_last)[0])) {
        blocks_.edited.push_back(static_cast<std::uint32_t>(r) * static_cast<std::uint32_t>(hats_.width) + i);
      }
    }
  }
}

void CoarseSpace::ScaleHats(const Sheet& sheet) {
  std::vector<std::uint32_t>& edited = blocks_.edited;
  std::sort(edited.begin(), edited.end());
  edited.erase(std::unique(edited.begin(), edited.end()), edited.end());
  const auto whole = [&](int row, int col, std::size_t d) {
    const bool inside = row >= 0 && row < sheet_rows_ && col >= 0 && col < static_cast<int>(layout_.cols);
    return inside &&
           sheet.whole[d][layout_.Offset(static_cast<std::uint32_t>(row), static_cast<std::uint32_t>(col))] > 0;
  };
  for (const std::uint32_t hat : edited) {
    const auto r = static_cast<std::size_t>(hat / hats_.width);
    const int centre_row = hats_.centre[r], in_row = static_cast<int>(hat % hats_.width);
    const int slot = kHatSpacing * (in_row / kLanes), first_col = in_row % kLanes * static_cast<int>(layout_.slots);
    float exact = 0, sampled = 0, steep = 1;
    std::array<float, 3> of_kind{};
    for (int row = centre_row - kHatSpacing; row < centre_row + kHatSpacing; ++row) {
      for (int col = first_col + slot - kHatSpacing; col < first_col + slot + kHatSpacing; ++col) {
        for (std::size_t d = 0; d < 3; ++d) {
          if (whole(row, col, d)) {
            const float step = HatAt(hat, row + (d != 0 ? 1 : 0), col + (d != 1 ? 1 : 0)) - HatAt(hat, row, col);
            exact += step * step;
            of_kind[d] += step * step;
          }
        }
      }
    }
    for (int sample = 0; sample < kHatSamples; ++sample) {
      const int row = std::clamp(centre_row + (sample < 2 ? -1 : 1), 0, sheet_rows_ - 1);
      const int at = std::min(slot + (sample & 1), static_cast<int>(layout_.slots) - 1);
      for (std::size_t d = 0; d < 3; ++d) {
        const float edges = (d == 2 ? kHatDiagonalEdges : kHatStraightEdges) / float{kHatSamples};
        sampled += whole(row, first_col + at, d) ? edges : 0.0f;
      }
    }
    // Towards a hat that is near, the edges of one kind count for more than on the mean.
    for (std::size_t d = 0; d < 3; ++d) {
      steep = std::max(steep, of_kind[d] / (d == 2 ? kHatDiagonalEdges : kHatStraightEdges));
    }
    const bool measurable = exact > kLeastEdgesLeft && sampled > kLeastSampledEdges;
    blocks_.scale[hat] = measurable ? std::max(exact / sampled, steep) : 0.0f;
  }
  edited.clear();
}

bool CoarseSpace::FollowsComputed(const Regions& regions, const Slides& slides) const {
  for (int row = 0; row < grid_.rows; ++row) {
    if (regions.whole(grid_.body[static_cast<std::size_t>(row * grid_.columns)])) return true;
  }
  const Partition& partition = regions.partition();
  return (grid_.rows == 0 && regions.whole(0)) || std::ranges::any_of(slides.elements(), [&](const Element& slide) {
           return std::ranges::any_of(
               slide.at, [&](ParticleRef at) { return regions.whole(partition.BodyOf(partition.Of(at))); });
         });
}

void CoarseSpace::UpdateRegions(const Regions& regions) {
  coarse_off_ = true;
  for (int body = 0; body < regions.partition().body_count(); ++body) {
    const bool whole = regions.whole(body);
    coarse_off_ &= !whole;
    matrix_.left_out[GroupOf(body, matrix_.left_out.size())] = whole ? 0 : 1;
  }
  grid_.off.clear();
  for (std::size_t node = 0; node < grid_.body.size(); ++node) {
    if (!regions.whole(grid_.body[node])) grid_.off.push_back(static_cast<int>(node));
  }
  blocks_.off.assign(static_cast<std::size_t>(hats_.rows), 0);
  for (int r = 0; r < hats_.rows; ++r) {
    const auto i = static_cast<std::size_t>(r);
    const int first = r > 0 ? hats_.centre[i - 1] + 1 : 0, end = r + 1 < hats_.rows ? hats_.centre[i + 1] : sheet_rows_;
    // Rows of another sheet, and the empty ones before this, do not count: without the hats at its rim, which also
    // carry the coarse nodes' part, corrections overshoot.
    const std::size_t sheet = grid_.sheet_of[static_cast<std::size_t>(hats_.centre[i])];
    for (int row = first; row < end; ++row) {
      if (grid_.sheet_of[static_cast<std::size_t>(row)] != sheet) continue;
      blocks_.off[i] |= regions.computed(regions.partition().At(true, row)) ? 0 : 1;
    }
  }
  std::fill_n(scratch_.nodes4.data(), scratch_.nodes4.size(), 0.0f);
  std::fill_n(scratch_.value.data(), scratch_.value.size(), 0.0f);
}

void CoarseSpace::ExcludeSolids(std::span<const Index> folded) {
  grid_.folded.clear();
  for (const Index solid : folded) {
    grid_.folded.insert(grid_.folded.end(), grid_.lattice[solid].begin(), grid_.lattice[solid].end());
  }
}

void CoarseSpace::ClearContacts() {
  if (!contacts_.stiff.empty()) {
    std::fill(contacts_.coarse_weight.begin(), contacts_.coarse_weight.end(), 1.0f);
  }
  contacts_.stiff.clear();
}

template <class Body>
void CoarseSpace::ForHatsAt(ParticleRef particle, float scale, const Body& body) const {
  if (particle.base < tube_floats_) return;
  const std::size_t at = particle.base - tube_floats_, row = at / layout_.stride, place = at % layout_.stride,
                    slot = place / kLanes, lane = place % kLanes;
  const std::size_t group = slot / kHatSpacing, own = kLanes * group + lane;
  const std::size_t next = group + 1 < static_cast<std::size_t>(hats_.slots) ? own + kLanes : (lane + 1) % kLanes;
  for (std::size_t i = 0; i < 2; ++i) {
    const float along = scale * (i == 0 ? 1 - hats_.fraction[row] : hats_.fraction[row]);
    const std::size_t first = (static_cast<std::size_t>(hats_.cell[row]) + i) * hats_.width;
    body(first + own, along * hats_.own[place]);
    body(first + next, along * hats_.next[place]);
  }
}

void CoarseSpace::AddContact(const Element& contact) {
  struct Share {
    std::size_t hat;
    float weight;
  };
  std::array<Share, kHatsPerContact> shares;
  std::size_t count = 0;
  const auto add = [&](std::size_t hat, float weight) {
    if (!(weight != 0.0f)) {
      return;
    }
    for (std::size_t i = 0; i < count; ++i) {
      if (shares[i].hat == hat) {
        shares[i].weight += weight;
        return;
      }
    }
    shares[count++] = {hat, weight};
  };
  for (std::size_t k = 0; k < static_cast<std::size_t>(contact.count); ++k) {
    ForHatsAt(contact.at[k], contact.weight[k], add);
  }
  // (B + v v^T)^-1 = B^-1 - (B^-1 v) (B^-1 v)^T / (1 + v . B^-1 v), by Sherman and Morrison (1950).
  std::array<FloatArray, 6>& block = blocks_.inverse;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t at = shares[i].hat;
    const Vec3f v = shares[i].weight * contact.m;
    Eigen::Matrix3f inverse;
    inverse << block[0][at], block[3][at], block[4][at], block[3][at], block[1][at], block[5][at], block[4][at],
        block[5][at], block[2][at];
    const Vec3f bv = inverse * v;
    contacts_.stiff.push_back({at, 0.0f});
    contacts_.coarse_weight[at] /= 1.0f + v.dot(bv);
    inverse -= bv * bv.transpose() / (1.0f + v.dot(bv));
    block[0][at] = inverse(0, 0);
    block[1][at] = inverse(1, 1);
    block[2][at] = inverse(2, 2);
    block[3][at] = inverse(0, 1);
    block[4][at] = inverse(0, 2);
    block[5][at] = inverse(1, 2);
  }
}

void CoarseSpace::AddClip(std::span<const ParticleRef> clipped, float stiffness) {
  // By hat: sum of its weights at the particles, and of their squares.
  struct Share {
    std::size_t hat;
    float sum, squares;
  };
  std::array<Share, kHatsPerClip> shares;
  std::size_t count = 0;
  for (const ParticleRef particle : clipped) {
    ForHatsAt(particle, 1.0f, [&](std::size_t hat, float weight) {
      if (!(weight > 0.0f)) return;
      std::size_t i = 0;
      while (i < count && shares[i].hat != hat) ++i;
      if (i == kHatsPerClip) return;
      if (i == count) shares[count++] = {hat, 0.0f, 0.0f};
      shares[i].sum += weight;
      shares[i].squares += weight * weight;
    });
  }
  std::array<FloatArray, 6>& block = blocks_.inverse;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t at = shares[i].hat;
    const float added = kHatsAtParticle * stiffness *
                        (shares[i].squares - shares[i].sum * shares[i].sum / static_cast<float>(clipped.size()));
    Eigen::Matrix3f inverse;
    inverse << block[0][at], block[3][at], block[4][at], block[3][at], block[1][at], block[5][at], block[4][at],
        block[5][at], block[2][at];
    if (!(inverse.trace() > 0.0f) || !(added > 0.0f)) continue;
    // (B + s I)^-1 = (I + s B^-1)^-1 B^-1. The rotation, which the clip also leaves free, is not taken off s.
    const Eigen::Matrix3f softened = (Eigen::Matrix3f::Identity() + added * inverse).inverse() * inverse;
    contacts_.stiff.push_back({at, 0.0f});
    contacts_.coarse_weight[at] *= softened.trace() / inverse.trace();
    block[0][at] = softened(0, 0);
    block[1][at] = softened(1, 1);
    block[2][at] = softened(2, 2);
    block[3][at] = 0.5f * (softened(0, 1) + softened(1, 0));
    block[4][at] = 0.5f * (softened(0, 2) + softened(2, 0));
    block[5][at] = 0.5f * (softened(1, 2) + softened(2, 1));
  }
}

void CoarseSpace::FadeAtContacts() {
  const int columns = hats_.slots * kLanes;
  for (auto& [hat, taken] : contacts_.stiff) {
    taken = 1.0f - contacts_.coarse_weight[hat];
  }
  for (const auto& [hat, taken] : contacts_.stiff) {
    const int row = static_cast<int>(hat / hats_.width), place = static_cast<int>(hat % hats_.width);
    const int column = place % kLanes * hats_.slots + place / kLanes;
    for (int r = std::max(row - kFadeHats + 1, 0); r < std::min(row + kFadeHats, hats_.rows); ++r) {
      for (int c = std::max(column - kFadeHats + 1, 0); c < std::min(column + kFadeHats, columns); ++c) {
        const int distance = std::max(std::abs(r - row), std::abs(c - column));
        float& weight = contacts_.coarse_weight[static_cast<std::size_t>(r) * hats_.width +
                                                static_cast<std::size_t>(c % hats_.slots * kLanes + c / hats_.slots)];
        weight = std::min(weight, 1.0f - taken * (1.0f - static_cast<float>(distance) / kFadeHats));
      }
    }
  }
}

}  // namespace fulcrum::physics::implicit
