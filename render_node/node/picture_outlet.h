// Where drawn pictures go: PNG files and the topic Picture. It also keeps what belongs to a picture that is still being
// read back from a GPU.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "render_node/node/picture_stream.h"
#include "render_node/offscreen/png_writer.h"
#include "render_node/scene_graph/display.h"

namespace fulcrum::render {

class PictureOutlet {
 public:
  /// What belongs to a picture.
  struct Use {
    bool file = false, live = false;
    double session_time_s = 0;  ///< Of the file.
    PictureHeader header;       ///< Of the live picture.
  };

  /// @param folder of the files; empty: none. @param keep_free_B as for FrameWriter. @param pictures null: no live
  /// pictures; must outlive the outlet.
  PictureOutlet(const std::filesystem::path& folder, std::uint64_t keep_free_B, bus::LoanOutput<Picture>* pictures);

  [[nodiscard]] bool has_folder() const { return writer_.has_folder(); }
  [[nodiscard]] bool has_readers() const { return stream_ && stream_->has_readers(); }

  void Give(const Bitmap& picture, const Use& use);
  /// The use of the picture whose reading a display has started; Collect gives it. A former one that has not come is
  /// lost.
  void Expect(const Use& use);
  /// Gives the expected picture, if it has been read; with `wait` it waits for that. One that cannot be read is lost.
  void Collect(bool wait, Display* display);

  /// Waits until the files of the pictures given so far are written.
  void WaitForFiles() { writer_.Wait(); }

  // From any thread.
  [[nodiscard]] std::uint64_t files_written() const { return writer_.written(); }
  /// Pictures that were drawn to be read and could not be.
  [[nodiscard]] std::uint64_t lost() const { return lost_.load(std::memory_order_relaxed); }
  /// Adds the metrics, and returns the last error or an empty text.
  [[nodiscard]] std::string FillHealth(Health* health) const;

 private:
  void Lose();

  FrameWriter writer_;
  std::unique_ptr<PictureStream> stream_;
  std::optional<Use> expected_;
  Bitmap read_;
  std::atomic<std::uint64_t> files_dropped_{0}, lost_{0};
};

}  // namespace fulcrum::render
