#include "render_node/offscreen/jpeg.h"

#include <turbojpeg.h>

#include <stdexcept>
#include <string>

namespace fulcrum::render {
namespace {

/// Qualities in the order in which they are tried. The first shows no blocks in tissue at 960 x 540 and takes some 60
/// to 100 kB; the others are for pictures that exceed the limit.
constexpr int kQualities[] = {80, 60, 35};

}  // namespace

JpegEncoder::JpegEncoder() : handle_(tjInitCompress()) {
  if (handle_ == nullptr) throw std::runtime_error("cannot compress pictures: " + std::string(tjGetErrorStr2(nullptr)));
}
JpegEncoder::~JpegEncoder() { (void)tjDestroy(handle_); }

std::span<const std::uint8_t> JpegEncoder::Encode(const Bitmap& picture, std::size_t most) {
  // The library writes up to this size without a check.
  file_.resize(tjBufSize(picture.width, picture.height, TJSAMP_420));
  for (const int quality : kQualities) {
    unsigned char* to = file_.data();
    unsigned long size = file_.size();
    if (tjCompress2(handle_, picture.rgb.data(), picture.width, 0, picture.height, TJPF_RGB, &to, &size, TJSAMP_420,
                    quality, TJFLAG_NOREALLOC | TJFLAG_BOTTOMUP | TJFLAG_FASTDCT) != 0) {
      throw std::runtime_error("cannot compress a picture: " + std::string(tjGetErrorStr2(handle_)));
    }
    if (size <= most) return {file_.data(), size};
  }
  throw std::runtime_error("a picture of " + std::to_string(picture.width) + " x " + std::to_string(picture.height) +
                           " does not fit into " + std::to_string(most) + " bytes");
}

}  // namespace fulcrum::render
