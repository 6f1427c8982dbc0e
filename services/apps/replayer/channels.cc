#include "services/apps/replayer/channels.h"

#include <cstdio>
#include <memory>
#include <utility>

#include "services/apps/replayer/png_file.h"
#include "services/base/core/error.h"

namespace fulcrum::replay {
namespace {

constexpr std::size_t kMostJobs = 24;  // Two pictures with all that belongs to them.

struct CloseFile {
  void operator()(std::FILE* file) const { (void)std::fclose(file); }
};

}  // namespace

Channel::Channel(int columns, int rows, int bits_of_each, int samples_of_each)
    : width(columns),
      height(rows),
      bits(bits_of_each),
      samples(samples_of_each),
      values(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows) *
             static_cast<std::size_t>(samples_of_each)) {}

Channel FromBitmap(const render::Bitmap& picture) {
  Channel channel(picture.width, picture.height, 8, 3);
  const auto row = 3 * static_cast<std::size_t>(picture.width);
  for (std::size_t y = 0; y < static_cast<std::size_t>(picture.height); ++y) {
    const std::size_t from = (static_cast<std::size_t>(picture.height) - 1 - y) * row;
    for (std::size_t i = 0; i < row; ++i) channel.values[y * row + i] = picture.rgb[from + i];
  }
  return channel;
}

void WriteChannel(const Channel& channel, const std::filesystem::path& file) {
  const std::vector<std::uint8_t> bytes = PngOf(channel);
  const std::unique_ptr<std::FILE, CloseFile> out(std::fopen(file.c_str(), "wbe"));
  const bool written =
      out && std::fwrite(bytes.data(), 1, bytes.size(), out.get()) == bytes.size() && std::fflush(out.get()) == 0;
  if (!written) throw InputError(file.string() + ": cannot be written; is the disk full?");
}

ChannelWriter::ChannelWriter(int threads) {
  for (int i = 0; i < threads; ++i) threads_.emplace_back([this] { Work(); });
}

ChannelWriter::~ChannelWriter() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake_.notify_all();
}

void ChannelWriter::Add(Channel channel, std::filesystem::path file) {
  {
    std::unique_lock lock(mutex_);
    done_.wait(lock, [this] { return jobs_.size() < kMostJobs || failure_; });
    ThrowFailure();
    jobs_.push_back({std::move(channel), std::move(file)});
  }
  wake_.notify_one();
}

void ChannelWriter::Finish() {
  std::unique_lock lock(mutex_);
  done_.wait(lock, [this] { return (jobs_.empty() && writing_ == 0) || failure_; });
  ThrowFailure();
}

void ChannelWriter::ThrowFailure() {
  if (failure_) std::rethrow_exception(failure_);
}

void ChannelWriter::Work() {
  std::unique_lock lock(mutex_);
  for (;;) {
    wake_.wait(lock, [this] { return stop_ || !jobs_.empty(); });
    if (jobs_.empty()) return;
    const Job job = std::move(jobs_.front());
    jobs_.pop_front();
    ++writing_;
    lock.unlock();
    std::exception_ptr failure;
    try {
      WriteChannel(job.channel, job.file);
    } catch (...) {
      failure = std::current_exception();
    }
    lock.lock();
    --writing_;
    if (failure && !failure_) failure_ = failure;
    done_.notify_all();
  }
}

}  // namespace fulcrum::replay
