#include "render_node/node/picture_stream.h"

#include <pthread.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <span>
#include <utility>

namespace fulcrum::render {

PictureStream::PictureStream(bus::LoanOutput<Picture>* output) : output_(output) {
  thread_ = std::thread([this] { Work(); });
  (void)::pthread_setname_np(thread_.native_handle(), "picture stream");
}

PictureStream::~PictureStream() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

void PictureStream::Add(const Bitmap& picture, const PictureHeader& header) {
  {
    const std::lock_guard lock(mutex_);
    if (full_) dropped_.fetch_add(1, std::memory_order_relaxed);
    next_ = picture;  // Keeps its buffer.
    next_header_ = header;
    full_ = true;
  }
  wake_.notify_one();
}

std::string PictureStream::last_error() const {
  const std::lock_guard lock(mutex_);
  return last_error_;
}

void PictureStream::Work() {
  Bitmap picture;
  std::unique_lock lock(mutex_);
  for (;;) {
    wake_.wait(lock, [this] { return stop_ || full_; });
    if (stop_) return;
    std::swap(picture, next_);
    const PictureHeader header = next_header_;
    full_ = false;
    lock.unlock();
    const auto start = std::chrono::steady_clock::now();
    std::string error = Send(picture, header);
    const std::chrono::duration<double, std::milli> spent = std::chrono::steady_clock::now() - start;
    encode_ms_.store(spent.count(), std::memory_order_relaxed);
    lock.lock();
    last_error_ = std::move(error);
  }
}

std::string PictureStream::Send(const Bitmap& picture, const PictureHeader& header) {
  try {
    const std::span<const std::uint8_t> jpeg = encoder_.Encode(picture, kMaxPictureBytes);
    const bool sent = output_->WriteInPlace([&](Picture::View view) {
      view.header = header;
      view.header.width = static_cast<std::uint32_t>(picture.width);
      view.header.height = static_cast<std::uint32_t>(picture.height);
      view.header.size = static_cast<std::uint32_t>(jpeg.size());
      std::copy(jpeg.begin(), jpeg.end(), view.jpeg.begin());
    });
    if (!sent) return "a picture could not be published";
    sent_.fetch_add(1, std::memory_order_relaxed);
    return {};
  } catch (const std::exception& failure) {
    return failure.what();
  }
}

}  // namespace fulcrum::render
