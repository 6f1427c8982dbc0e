// In-process backend of the ports, for tests and for programs that contain several nodes. It behaves as the bus does:
// same gate, same counters, same history for late joiners; a sample is copied, never shared.
//
//   bus::InProcessTopic<ToolState> topic;
//   auto out = topic.MakeOutput();
//   auto in = topic.MakeInput();
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "services/base/core/tissue_blocks.h"
#include "services/transport/bus/gate.h"
#include "services/transport/bus/input_account.h"
#include "services/transport/bus/port.h"
#include "services/transport/bus/topics.h"

namespace fulcrum::bus {
namespace in_process {

/// Fixed ring whose slots keep their buffers, so that a steady stream does not allocate.
template <class T>
class Ring {
 public:
  explicit Ring(std::size_t depth) : slots_(std::max<std::size_t>(depth, 1)) {}
  [[nodiscard]] bool empty() const { return size_ == 0; }
  [[nodiscard]] bool full() const { return size_ == slots_.size(); }
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] T& At(std::size_t i) { return slots_[(first_ + i) % slots_.size()]; }
  /// Copies the sample in; a full ring drops its oldest sample.
  void Push(const T& sample) {
    if (full()) Pop();
    At(size_) = sample;
    ++size_;
  }
  void Pop() {
    first_ = (first_ + 1) % slots_.size();
    --size_;
  }

 private:
  std::vector<T> slots_;
  std::size_t first_ = 0, size_ = 0;
};

/// State shared by the ports of one topic; exists until the last of them is destroyed.
template <class T>
struct Hub {
  std::mutex mutex;
  std::vector<Ring<T>*> inputs;   ///< Unread samples of each live input.
  std::vector<Ring<T>*> history;  ///< Newest samples of each live output, for late joiners.
};

template <class T>
class HubInput final : public Input<T> {
 public:
  HubInput(std::shared_ptr<Hub<T>> hub, std::size_t depth)
      : hub_(std::move(hub)), unread_(depth), account_(kQualityOf<T>.gap_is_loss, RoleOf<T>().one_owner()) {
    const std::lock_guard lock(hub_->mutex);
    for (Ring<T>* history : hub_->history) {
      for (std::size_t i = 0; i < history->size(); ++i) unread_.Push(history->At(i));
    }
    hub_->inputs.push_back(&unread_);
  }
  ~HubInput() override {
    const std::lock_guard lock(hub_->mutex);
    std::erase(hub_->inputs, &unread_);
  }

  bool TakeLatest(T* sample) override {
    bool found = false;
    while (TakeNext(sample)) found = true;
    return found;
  }

  bool TakeNext(T* sample) override {
    const std::lock_guard lock(hub_->mutex);
    while (!unread_.empty()) {
      T& oldest = unread_.At(0);
      const bool good = PassesGate(oldest) && account_.IsOfOwner(StampOf(oldest));
      if (good) {
        account_.Accept(StampOf(oldest));
        std::swap(*sample, oldest);
      } else {
        account_.Reject(StampOf(oldest));
      }
      unread_.Pop();
      if (good) return true;
    }
    return false;
  }

  InputStats stats() const override {
    const std::lock_guard lock(hub_->mutex);
    return account_.stats(!hub_->history.empty());
  }

 private:
  std::shared_ptr<Hub<T>> hub_;
  Ring<T> unread_;
  InputAccount account_;
};

template <class T>
class HubOutput : public OutputOf<T>::type {
 public:
  explicit HubOutput(std::shared_ptr<Hub<T>> hub)
      : hub_(std::move(hub)), history_(static_cast<std::size_t>(kQualityOf<T>.writer_depth)) {
    const std::lock_guard lock(hub_->mutex);
    hub_->history.push_back(&history_);
  }
  ~HubOutput() override {
    const std::lock_guard lock(hub_->mutex);
    std::erase(hub_->history, &history_);
  }

  bool Write(const T& sample) noexcept override {
    try {
      const std::lock_guard lock(hub_->mutex);
      for (Ring<T>* input : hub_->inputs) input->Push(sample);
      if (kQualityOf<T>.late_joiners_served) history_.Push(sample);
      ++stats_.written;
      return true;
    } catch (...) {
      return Fail();
    }
  }

  bool has_readers() const noexcept override {
    const std::lock_guard lock(hub_->mutex);
    return !hub_->inputs.empty();
  }

  OutputStats stats() const override {
    const std::lock_guard lock(hub_->mutex);
    return stats_;
  }

 protected:
  bool Fail() noexcept {
    const std::lock_guard lock(hub_->mutex);
    ++stats_.failed;
    return false;
  }

 private:
  std::shared_ptr<Hub<T>> hub_;
  Ring<T> history_;
  OutputStats stats_;
};

inline TissueFrame::View MakeView(TissueFrame* frame) {
  frame->header = {};
  frame->xyz.clear();
  return {frame->header, frame->xyz};
}
/// Makes the payload what a reader on the bus would get. False if it is not as the header counts it.
inline bool Close(TissueFrame* frame) {
  const std::size_t count = frame->header.vertex_count;
  return count <= kMaxTissueVertices && frame->xyz.size() == 3 * count && RoundPositions(frame->xyz);
}
inline TemperaturePatch::View MakeView(TemperaturePatch* patch) {
  patch->header = {};
  patch->texels.resize(std::size_t{4} * kPatchTexels * kPatchTexels);
  return {patch->header, patch->texels};
}
inline bool Close(TemperaturePatch*) { return true; }
inline Picture::View MakeView(Picture* picture) {
  picture->header = {};
  picture->jpeg.resize(kMaxPictureBytes);
  return {picture->header, picture->jpeg};
}
inline bool Close(Picture* picture) {
  if (picture->header.size > kMaxPictureBytes) return false;
  picture->jpeg.resize(picture->header.size);
  return true;
}

/// Output of the large topics; T must have a View.
template <class T>
class HubLoanOutput final : public HubOutput<T> {
 public:
  using HubOutput<T>::HubOutput;
  bool WriteInPlace(const typename LoanOutput<T>::Fill& fill) noexcept override {
    try {
      fill(MakeView(&loan_));
      return Close(&loan_) ? this->Write(loan_) : this->Fail();
    } catch (...) {
      return this->Fail();
    }
  }

 private:
  T loan_;
};

}  // namespace in_process

/// One topic within this process. Ports may outlive it.
template <class T>
class InProcessTopic {
 public:
  /// @param depth unread samples kept; 0: the reader depth of the topic's role.
  [[nodiscard]] std::unique_ptr<Input<T>> MakeInput(std::size_t depth = 0) {
    return std::make_unique<in_process::HubInput<T>>(
        hub_, depth != 0 ? depth : static_cast<std::size_t>(kQualityOf<T>.reader_depth));
  }
  [[nodiscard]] std::unique_ptr<typename OutputOf<T>::type> MakeOutput() {
    if constexpr (requires { typename T::View; }) {
      return std::make_unique<in_process::HubLoanOutput<T>>(hub_);
    } else {
      return std::make_unique<in_process::HubOutput<T>>(hub_);
    }
  }

 private:
  std::shared_ptr<in_process::Hub<T>> hub_ = std::make_shared<in_process::Hub<T>>();
};

}  // namespace fulcrum::bus
