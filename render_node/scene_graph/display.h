// Target of the view: memory (EGL, no display needed) or a window.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "render_node/offscreen/pixel_reader.h"
#include "render_node/scene_graph/laparoscope_view.h"

namespace fulcrum::render {

class Display {
 public:
  virtual ~Display() = default;
  /// Draws the present view and waits for completion. May be called from any thread, one at a time.
  virtual void Draw() = 0;
  /// Draws and reads the picture back.
  virtual void DrawAndRead(Bitmap* picture) = 0;
  /// Draws and starts to read the picture back; on a GPU it waits for neither. A former picture that was not taken is
  /// lost.
  virtual void DrawAndStartRead() = 0;
  /// Gives the picture of the last DrawAndStartRead if it has been read completely; with `wait` it waits for that.
  [[nodiscard]] virtual ReadResult TakeRead(bool wait, Bitmap* picture) = 0;
  /// Keys pressed since the last call, as X key symbols. Also processes the window's events, so it must be called even
  /// if nothing is drawn.
  [[nodiscard]] virtual std::vector<int> TakeKeys() = 0;
  /// True if the window was clicked since the last call of TakeKeys().
  [[nodiscard]] virtual bool clicked() const { return false; }
  /// Size of the picture [pixels]. Of a window it is the largest box with the scene's aspect; the rest is black.
  [[nodiscard]] virtual PixelBox picture() const = 0;
  /// Makes the window as large as the screen, or again as it was before. Off screen: no effect.
  virtual void ToggleFullScreen() {}
  /// Number of the X11 window; 0: none.
  [[nodiscard]] virtual unsigned long window() const { return 0; }
  /// True after the user has closed the window.
  [[nodiscard]] virtual bool closed() const = 0;
  /// A GPU draws, which has time to smooth edges.
  [[nodiscard]] virtual bool is_gpu() const = 0;
  /// Software draws, with the functions that LaparoscopeView::SetSmoothed needs (OpenGL 4.5).
  [[nodiscard]] virtual bool can_smooth() const { return false; }
  /// Renderer and version, for the log.
  [[nodiscard]] virtual std::string description() const = 0;
};

/// Throws std::runtime_error with a one-line message if OpenGL is missing. Keeps a reference to `view`.
[[nodiscard]] std::unique_ptr<Display> MakeOffscreenDisplay(const LaparoscopeView& view, const RenderParams& params);

/// Throws InputError if no display can be opened.
[[nodiscard]] std::unique_ptr<Display> MakeWindowDisplay(const LaparoscopeView& view, const RenderParams& params);

}  // namespace fulcrum::render
