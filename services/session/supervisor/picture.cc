#include "services/session/supervisor/picture.h"

#include <png.h>

#include <algorithm>
#include <charconv>
#include <cmath>

namespace fulcrum::supervisor {

std::vector<Frame> FindFrames(const std::filesystem::path& folder) {
  constexpr std::string_view kPrefix = "frame_";
  std::vector<Frame> frames;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    const std::string stem = entry.path().stem();
    std::uint64_t ms = 0;
    if (entry.path().extension() != ".png" || stem.size() <= kPrefix.size() || !stem.starts_with(kPrefix) ||
        std::from_chars(stem.data() + kPrefix.size(), stem.data() + stem.size(), ms).ptr != stem.data() + stem.size()) {
      continue;
    }
    frames.push_back({entry.path(), 1e-3 * static_cast<double>(ms)});
  }
  std::sort(frames.begin(), frames.end(), [](const Frame& a, const Frame& b) { return a.time_s < b.time_s; });
  return frames;
}

std::vector<Frame> Spread(const std::vector<Frame>& frames, std::size_t count) {
  if (frames.size() <= count || count < 2) {
    return frames;
  }
  std::vector<Frame> chosen;
  std::size_t next = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double u = static_cast<double>(i) / static_cast<double>(count - 1);
    const double wanted = frames.front().time_s + u * (frames.back().time_s - frames.front().time_s);
    // Frames may be missing during a restart, so frames are chosen by time, not by number, and each at most once.
    const std::size_t last = frames.size() - (count - i);
    while (next < last && std::abs(frames[next + 1].time_s - wanted) <= std::abs(frames[next].time_s - wanted)) {
      ++next;
    }
    chosen.push_back(frames[next++]);
  }
  return chosen;
}

std::string EmbedPng(const std::filesystem::path& file, unsigned shrink) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_file(&image, file.c_str()) == 0) {
    return {};
  }
  image.format = PNG_FORMAT_RGB;
  std::vector<std::uint8_t> pixels(PNG_IMAGE_SIZE(image));
  if (png_image_finish_read(&image, nullptr, pixels.data(), 0, nullptr) == 0) {
    return {};
  }
  const std::size_t width = image.width / shrink, height = image.height / shrink;
  if (width == 0 || height == 0) {
    return {};
  }
  std::vector<std::uint8_t> small(width * height * 3);
  for (std::size_t y = 0; y < height; ++y) {
    for (std::size_t x = 0; x < width; ++x) {
      for (std::size_t channel = 0; channel < 3; ++channel) {
        unsigned sum = 0;
        for (std::size_t j = 0; j < shrink; ++j) {
          for (std::size_t i = 0; i < shrink; ++i) {
            sum += pixels[((y * shrink + j) * image.width + x * shrink + i) * 3 + channel];
          }
        }
        small[(y * width + x) * 3 + channel] =
            static_cast<std::uint8_t>((sum + shrink * shrink / 2) / (shrink * shrink));
      }
    }
  }
  png_image out{};
  out.version = PNG_IMAGE_VERSION;
  out.width = static_cast<png_uint_32>(width);
  out.height = static_cast<png_uint_32>(height);
  out.format = PNG_FORMAT_RGB;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(out);
  std::vector<std::uint8_t> encoded(size);
  if (png_image_write_to_memory(&out, encoded.data(), &size, 0, small.data(), 0, nullptr) == 0) {
    return {};
  }
  return "data:image/png;base64," + Base64(std::span(encoded.data(), size));
}

std::string Base64(std::span<const std::uint8_t> bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t left = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t group = 0;
    for (std::size_t j = 0; j < 3; ++j) {
      group = group << 8 | (j < left ? bytes[i + j] : 0u);
    }
    for (std::size_t j = 0; j < 4; ++j) {
      text += j <= left ? kDigits[group >> (18 - 6 * j) & 63u] : '=';
    }
  }
  return text;
}

}  // namespace fulcrum::supervisor
