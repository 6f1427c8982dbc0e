#include "render_node/node/picture_outlet.h"

namespace fulcrum::render {

PictureOutlet::PictureOutlet(const std::filesystem::path& folder, std::uint64_t keep_free_B,
                             bus::LoanOutput<Picture>* pictures)
    : writer_(folder, keep_free_B),
      stream_(pictures != nullptr ? std::make_unique<PictureStream>(pictures) : nullptr) {}

void PictureOutlet::Give(const Bitmap& picture, const Use& use) {
  if (use.live) stream_->Add(picture, use.header);
  if (use.file && !writer_.Add(picture, use.session_time_s)) files_dropped_.fetch_add(1, std::memory_order_relaxed);
}

void PictureOutlet::Lose() {
  lost_.fetch_add(1, std::memory_order_relaxed);
  if (expected_->file) files_dropped_.fetch_add(1, std::memory_order_relaxed);
  expected_.reset();
}

void PictureOutlet::Expect(const Use& use) {
  if (expected_) Lose();
  expected_ = use;
}

void PictureOutlet::Collect(bool wait, Display* display) {
  if (!expected_) return;
  const ReadResult result = display->TakeRead(wait, &read_);
  if (result == ReadResult::kPending) return;
  if (result != ReadResult::kDone) return Lose();
  Give(read_, *expected_);
  expected_.reset();
}

std::string PictureOutlet::FillHealth(Health* health) const {
  health->metrics.push_back({"png_written", static_cast<double>(writer_.written())});
  health->metrics.push_back({"png_failed", static_cast<double>(writer_.failed())});
  health->metrics.push_back({"png_dropped", static_cast<double>(files_dropped_.load(std::memory_order_relaxed))});
  std::string error = writer_.last_error();
  if (error.empty() && lost() > 0) error = std::to_string(lost()) + " pictures could not be read from the GPU";
  if (!stream_) return error;
  health->metrics.push_back({"pictures_sent", static_cast<double>(stream_->sent())});
  health->metrics.push_back({"pictures_late", static_cast<double>(stream_->dropped())});
  health->metrics.push_back({"jpeg_ms", stream_->encode_ms()});
  return error.empty() ? stream_->last_error() : error;
}

}  // namespace fulcrum::render
