// Images of data sets as libpng reads them.
#include "services/apps/replayer/png_file.h"

#include <gtest/gtest.h>
#include <png.h>

#include <algorithm>
#include <csetjmp>
#include <cstdio>
#include <memory>

namespace fulcrum::replay {
namespace {

/// Decodes with libpng, which checks all checksums; without width or height it could not.
Channel Decoded(const std::vector<std::uint8_t>& bytes) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(
      ::fmemopen(const_cast<std::uint8_t*>(bytes.data()), bytes.size(), "rb"), &std::fclose);
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  std::vector<std::uint8_t> row;
  Channel channel(0, 0, 8, 1);
  if (setjmp(png_jmpbuf(png)) != 0) {
    png_destroy_read_struct(&png, &info, nullptr);
    ADD_FAILURE() << "libpng refuses it";
    return channel;
  }
  png_init_io(png, file.get());
  png_read_info(png, info);
  channel = Channel(static_cast<int>(png_get_image_width(png, info)), static_cast<int>(png_get_image_height(png, info)),
                    png_get_bit_depth(png, info), png_get_channels(png, info));
  row.resize(png_get_rowbytes(png, info));
  std::uint16_t* to = channel.values.data();
  for (int y = 0; y < channel.height; ++y) {
    png_read_row(png, row.data(), nullptr);
    for (std::size_t i = 0; i < row.size(); i += static_cast<std::size_t>(channel.bits) / 8) {
      *to++ = channel.bits == 8 ? row[i] : static_cast<std::uint16_t>(row[i] << 8 | row[i + 1]);
    }
  }
  png_read_end(png, nullptr);
  png_destroy_read_struct(&png, &info, nullptr);
  return channel;
}

TEST(PngFile, KeepsEachValue) {
  for (const int bits : {8, 16}) {
    for (const int samples : {1, 3}) {
      Channel channel(37, 23, bits, samples);
      std::uint32_t state = 1;
      for (std::uint16_t& value : channel.values) {
        state = 1664525 * state + 1013904223;
        value = static_cast<std::uint16_t>((state >> 16) & ((1u << bits) - 1));
      }
      const Channel decoded = Decoded(PngOf(channel));
      EXPECT_EQ(decoded.width, 37);
      EXPECT_EQ(decoded.height, 23);
      EXPECT_EQ(decoded.bits, bits);
      EXPECT_EQ(decoded.samples, samples);
      EXPECT_EQ(decoded.values, channel.values) << bits << " bits, " << samples << " samples";
    }
  }
}

TEST(PngFile, IsSmallWhereNothingChanges) {
  Channel channel(960, 540, 16, 3);
  std::fill(channel.values.begin(), channel.values.end(), std::uint16_t{32768});
  EXPECT_LT(PngOf(channel).size(), channel.values.size() / 200);
}

}  // namespace
}  // namespace fulcrum::replay
