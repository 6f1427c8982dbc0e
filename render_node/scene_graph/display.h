// Where the view is drawn: into memory (EGL, no display needed) or into a window.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "render_node/offscreen/framebuffer.h"
#include "render_node/scene_graph/laparoscope_view.h"

namespace fulcrum::render {

class Display {
 public:
  virtual ~Display() = default;
  /// Draws the view as it is now and waits until it is done. Any thread, one at a time.
  virtual void Draw() = 0;
  /// Draws, and reads the picture back.
  virtual void DrawAndRead(Picture* picture) = 0;
  /// Keys pressed since the last call, as X key symbols; looks after the window also when nothing is drawn.
  [[nodiscard]] virtual std::vector<int> TakeKeys() = 0;
  /// The user closed the window.
  [[nodiscard]] virtual bool closed() const = 0;
  /// Renderer and version, for the log.
  [[nodiscard]] virtual std::string description() const = 0;
};

/// Throws std::runtime_error with one clear line when OpenGL is missing. Keeps a reference to `view`.
[[nodiscard]] std::unique_ptr<Display> MakeOffscreenDisplay(const LaparoscopeView& view, const RenderParams& params);

/// Throws InputError when no display can be opened.
[[nodiscard]] std::unique_ptr<Display> MakeWindowDisplay(const LaparoscopeView& view, const RenderParams& params);

}  // namespace fulcrum::render
