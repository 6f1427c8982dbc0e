// How the levels above the particles follow cuts, contacts and sleep.
#include <algorithm>

#include "physics_node/implicit/coarse_space.h"

namespace fulcrum::physics::implicit {

/// Middle functions that a node of the sheet takes part in, by place in a row of them: its own, and the one after.
std::array<std::uint32_t, 2> CoarseSpace::FunctionsOf(std::uint32_t col) const {
  const std::uint32_t place = layout_.Offset(0, col), group = place / kLanes / 4, lane = place % kLanes;
  const std::uint32_t own = kLanes * group + lane;
  return {own, group + 1 < static_cast<std::uint32_t>(middle_slots_) ? own + kLanes : (lane + 1) % kLanes};
}

/// Value of a middle function at a node; 0 outside the sheet.
float CoarseSpace::Hat(std::uint32_t function, int row, int col) const {
  if (row < 0 || row >= rows_ || col < 0 || col >= static_cast<int>(cols_)) {
    return 0.0f;
  }
  const auto r = static_cast<std::size_t>(row);
  const int above = static_cast<int>(function / width_) - cell_[r];
  const std::uint32_t place = layout_.Offset(0, static_cast<std::uint32_t>(col)),
                      in_row = function % static_cast<std::uint32_t>(width_);
  const auto [own, next] = FunctionsOf(static_cast<std::uint32_t>(col));
  const float along = above == 0 ? 1.0f - fraction_[r] : above == 1 ? fraction_[r] : 0.0f;
  return along * ((in_row == own ? own_[place] : 0.0f) + (in_row == next ? next_[place] : 0.0f));
}

void CoarseSpace::MarkEdit(std::uint32_t row, std::uint32_t col, std::size_t d) {
  const auto mark = [&](std::uint32_t r, std::uint32_t c) {
    for (std::uint32_t i = 0; i < (fraction_[r] > 0.0f ? 2u : 1u); ++i) {
      for (const std::uint32_t in_row : FunctionsOf(c)) {
        edited_.push_back((static_cast<std::uint32_t>(cell_[r]) + i) * static_cast<std::uint32_t>(width_) + in_row);
      }
    }
  };
  mark(row, col);
  mark(std::min(row + (d != 0 ? 1 : 0), static_cast<std::uint32_t>(rows_) - 1),
       std::min(col + (d != 1 ? 1 : 0), cols_ - 1));
}

void CoarseSpace::ScaleBlocks(const Sheet& sheet) {
  std::sort(edited_.begin(), edited_.end());
  edited_.erase(std::unique(edited_.begin(), edited_.end()), edited_.end());
  const auto whole = [&](int row, int col, std::size_t d) {
    const bool inside = row >= 0 && row < rows_ && col >= 0 && col < static_cast<int>(cols_);
    return inside &&
           sheet.axial[d][layout_.Offset(static_cast<std::uint32_t>(row), static_cast<std::uint32_t>(col))] > 0;
  };
  for (const std::uint32_t function : edited_) {
    const auto r = static_cast<std::size_t>(function / width_);
    const int centre_row = centre_[r], in_row = static_cast<int>(function % width_);
    const int slot = 4 * (in_row / kLanes), first_col = in_row % kLanes * static_cast<int>(layout_.slots);
    float exact = 0, sampled = 0;
    for (int row = centre_row - 4; row < centre_row + 4; ++row) {
      for (int col = first_col + slot - 4; col < first_col + slot + 4; ++col) {
        for (std::size_t d = 0; d < 3; ++d) {
          if (whole(row, col, d)) {
            const float step = Hat(function, row + (d != 0 ? 1 : 0), col + (d != 1 ? 1 : 0)) - Hat(function, row, col);
            exact += step * step;
          }
        }
      }
    }
    for (int sample = 0; sample < 4; ++sample) {
      const int row = std::clamp(centre_row + (sample < 2 ? -1 : 1), 0, rows_ - 1);
      const int at = std::min(slot + (sample & 1), static_cast<int>(layout_.slots) - 1);
      for (std::size_t d = 0; d < 3; ++d) {
        sampled += whole(row, first_col + at, d) ? (d == 2 ? 2.75f : 1.375f) / 4.0f : 0.0f;
      }
    }
    // Of 5.5. Where much is cut, what is left may hold in other directions than the samples do: no hat there.
    scale_[function] = exact > 3.8f && sampled > 3.3f ? std::max(exact / sampled, 1.0f) : 0.0f;
  }
  edited_.clear();
}

void CoarseSpace::FollowRegions(const Regions& regions) {
  coarse_rests_ = !regions.everything();
  middle_rests_.assign(static_cast<std::size_t>(middle_rows_), 0);
  for (int r = 0; r < middle_rows_; ++r) {
    const auto i = static_cast<std::size_t>(r);
    const int first = r > 0 ? centre_[i - 1] + 1 : 0, end = r + 1 < middle_rows_ ? centre_[i + 1] : rows_;
    for (int row = first; row < end; ++row) {
      middle_rests_[i] |= regions.computed(regions.At(true, row)) ? 0 : 1;
    }
  }
  std::fill_n(nodes4_.data(), nodes4_.size(), 0.0f);
  std::fill_n(value_.data(), value_.size(), 0.0f);
}

void CoarseSpace::ForgetContacts() {
  if (!held_.empty()) {
    std::fill(yields_.begin(), yields_.end(), 1.0f);
  }
  held_.clear();
}

void CoarseSpace::Stiffen(const Element& contact) {
  struct Share {
    std::size_t function;
    float weight;
  };
  std::array<Share, 16> shares;
  std::size_t count = 0;
  const auto add = [&](std::size_t function, float weight) {
    if (!(weight != 0.0f)) {
      return;
    }
    for (std::size_t i = 0; i < count; ++i) {
      if (shares[i].function == function) {
        shares[i].weight += weight;
        return;
      }
    }
    shares[count++] = {function, weight};
  };
  for (std::size_t k = 0; k < static_cast<std::size_t>(contact.count); ++k) {
    if (contact.at[k].base < tube_floats_) {
      continue;
    }
    const std::size_t at = contact.at[k].base - tube_floats_, row = at / static_cast<std::size_t>(stride_),
                      place = at % static_cast<std::size_t>(stride_), slot = place / kLanes, lane = place % kLanes;
    const std::size_t group = slot / 4, own = kLanes * group + lane;
    const std::size_t next = group + 1 < static_cast<std::size_t>(middle_slots_) ? own + kLanes : (lane + 1) % kLanes;
    for (std::size_t i = 0; i < 2; ++i) {
      const float along = contact.weight[k] * (i == 0 ? 1 - fraction_[row] : fraction_[row]);
      const std::size_t first = (static_cast<std::size_t>(cell_[row]) + i) * width_;
      add(first + own, along * own_[place]);
      add(first + next, along * next_[place]);
    }
  }
  // (B + v v^T)^-1 by Sherman and Morrison.
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t at = shares[i].function;
    const Vec3f v = shares[i].weight * contact.m;
    Eigen::Matrix3f inverse;
    inverse << block_[0][at], block_[3][at], block_[4][at], block_[3][at], block_[1][at], block_[5][at], block_[4][at],
        block_[5][at], block_[2][at];
    const Vec3f bv = inverse * v;
    held_.push_back({at, 0.0f});
    yields_[at] /= 1.0f + v.dot(bv);
    inverse -= bv * bv.transpose() / (1.0f + v.dot(bv));
    block_[0][at] = inverse(0, 0);
    block_[1][at] = inverse(1, 1);
    block_[2][at] = inverse(2, 2);
    block_[3][at] = inverse(0, 1);
    block_[4][at] = inverse(0, 2);
    block_[5][at] = inverse(1, 2);
  }
}

/// The coarse nodes' part fades out towards what contacts hold, over kFade functions: cut off sharply it would cost
/// more energy than the coarse matrix says, and what it overestimates grows.
void CoarseSpace::FadeAtContacts() {
  constexpr int kFade = 4;
  const int columns = middle_slots_ * kLanes;
  for (auto& [function, part] : held_) {
    part = 1.0f - yields_[function];
  }
  for (const auto& [function, part] : held_) {
    const int row = static_cast<int>(function / width_), place = static_cast<int>(function % width_);
    const int column = place % kLanes * middle_slots_ + place / kLanes;
    for (int r = std::max(row - kFade + 1, 0); r < std::min(row + kFade, middle_rows_); ++r) {
      for (int c = std::max(column - kFade + 1, 0); c < std::min(column + kFade, columns); ++c) {
        const int away = std::max(std::abs(r - row), std::abs(c - column));
        float& yields = yields_[static_cast<std::size_t>(r) * width_ +
                                static_cast<std::size_t>(c % middle_slots_ * kLanes + c / middle_slots_)];
        yields = std::min(yields, 1.0f - part * (1.0f - static_cast<float>(away) / kFade));
      }
    }
  }
}

}  // namespace fulcrum::physics::implicit
