#include "services/apps/replayer/channels.h"

#include <png.h>

#include <csetjmp>
#include <cstdio>
#include <memory>
#include <utility>

#include "services/base/core/error.h"

namespace fulcrum::replay {
namespace {

constexpr std::size_t kMostJobs = 24;  // Two pictures with all that belongs to them.

struct CloseFile {
  void operator()(std::FILE* file) const { (void)std::fclose(file); }
};

/// libpng reports failures by longjmp: no object with a destructor may be made between.
bool Encode(std::FILE* file, const Channel& channel, const std::uint8_t* rows, std::size_t row_bytes) {
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png != nullptr ? png_create_info_struct(png) : nullptr;
  if (info == nullptr || setjmp(png_jmpbuf(png)) != 0) {
    png_destroy_write_struct(&png, &info);
    return false;
  }
  png_init_io(png, file);
  // A quarter of the default level's time for a tenth more bytes.
  png_set_compression_level(png, 1);
  png_set_filter(png, 0, PNG_FILTER_SUB);
  png_set_IHDR(png, info, static_cast<png_uint_32>(channel.width), static_cast<png_uint_32>(channel.height),
               channel.bits, channel.samples == 1 ? PNG_COLOR_TYPE_GRAY : PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_write_info(png, info);
  for (int y = 0; y < channel.height; ++y) png_write_row(png, rows + static_cast<std::size_t>(y) * row_bytes);
  png_write_end(png, info);
  png_destroy_write_struct(&png, &info);
  return true;
}

/// Values as the file has them: the high byte first.
std::vector<std::uint8_t> Bytes(const Channel& channel) {
  std::vector<std::uint8_t> bytes;
  bytes.reserve(channel.values.size() * static_cast<std::size_t>(channel.bits) / 8);
  for (const std::uint16_t value : channel.values) {
    if (channel.bits == 16) bytes.push_back(static_cast<std::uint8_t>(value >> 8));
    bytes.push_back(static_cast<std::uint8_t>(value));
  }
  return bytes;
}

}  // namespace

Channel::Channel(int columns, int rows, int bits_of_each, int samples_of_each)
    : width(columns),
      height(rows),
      bits(bits_of_each),
      samples(samples_of_each),
      values(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows) *
             static_cast<std::size_t>(samples_of_each)) {}

std::uint16_t& Channel::At(int x, int y, int sample) {
  const auto pixel = static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
  return values[pixel * static_cast<std::size_t>(samples) + static_cast<std::size_t>(sample)];
}

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
  const std::vector<std::uint8_t> bytes = Bytes(channel);
  const std::unique_ptr<std::FILE, CloseFile> out(std::fopen(file.c_str(), "wbe"));
  const bool written =
      out && Encode(out.get(), channel, bytes.data(), bytes.size() / static_cast<std::size_t>(channel.height)) &&
      std::fflush(out.get()) == 0;
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
