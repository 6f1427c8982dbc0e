#include "render_node/scene_graph/display.h"

#include <osg/GLExtensions>
#include <osgGA/GUIEventHandler>
#include <osgViewer/Viewer>
#include <string_view>
#include <utility>

#include "render_node/offscreen/egl_context.h"
#include "render_node/offscreen/pixel_reader.h"
#include "render_node/scene_graph/x11_window.h"
#include "services/base/core/error.h"

namespace fulcrum::render {
namespace {

constexpr int kSmoothsFrom = 45;  // OpenGL 4.5: ReadTexture and WriteTexture.

void SetUpViewer(const LaparoscopeView& view, osgViewer::Viewer* viewer) {
  viewer->setThreadingModel(osgViewer::ViewerBase::SingleThreaded);
  viewer->setSceneData(view.root());
  viewer->setLightingMode(osg::View::NO_LIGHT);
  viewer->setKeyEventSetsDone(0);
  osg::Camera* camera = viewer->getCamera();
  camera->setComputeNearFarMode(osg::Camera::DO_NOT_COMPUTE_NEAR_FAR);
  camera->setCullingMode(osg::CullSettings::NO_CULLING);
  camera->setClearColor(osg::Vec4(0, 0, 0, 1));
  camera->setProjectionResizePolicy(osg::Camera::FIXED);
}

void SetUpState(osg::State* state) {
  state->setUseModelViewAndProjectionUniforms(true);
  state->setUseVertexAttributeAliasing(true);
}

/// Mesa's software rasterisers by their names in GL_RENDERER.
bool IsGpu(std::string_view renderer) {
  return renderer.find("llvmpipe") == std::string_view::npos && renderer.find("softpipe") == std::string_view::npos;
}

class OffscreenDisplay : public Display {
 public:
  OffscreenDisplay(const LaparoscopeView& view, const RenderParams& params) {
    context_.MakeCurrent();
    viewer_ = new osgViewer::Viewer;
    const int width = static_cast<int>(params.width), height = static_cast<int>(params.height);
    picture_ = {0, 0, width, height};
    framebuffer_ = std::make_unique<Framebuffer>(width, height);
    window_ = viewer_->setUpViewerAsEmbeddedInWindow(0, 0, width, height);
    window_->setDefaultFboId(framebuffer_->id());
    SetUpState(window_->getState());
    SetUpViewer(view, viewer_.get());
    viewer_->realize();
    context_.Release();
  }

  ~OffscreenDisplay() override {
    // OSG deletes its OpenGL objects in the destructor, which requires the context to be current.
    context_.MakeCurrent();
    viewer_ = nullptr;
    window_ = nullptr;
    framebuffer_.reset();
    reader_.reset();
    context_.Release();
  }

  void Draw() override {
    context_.MakeCurrent();
    viewer_->frame();
    glFinish();
    context_.Release();
  }

  void DrawAndRead(Bitmap* picture) override {
    context_.MakeCurrent();
    viewer_->frame();
    framebuffer_->Read(picture);
    context_.Release();
  }

  void DrawAndStartRead() override {
    context_.MakeCurrent();
    viewer_->frame();
    framebuffer_->Bind();
    reader_->Start(0, 0, picture_.width, picture_.height);
    context_.Release();
  }

  [[nodiscard]] ReadResult TakeRead(bool wait, Bitmap* picture) override {
    if (!reader_->pending()) return ReadResult::kNone;
    context_.MakeCurrent();
    const ReadResult result = reader_->Take(wait, picture);
    context_.Release();
    return result;
  }

  [[nodiscard]] std::vector<int> TakeKeys() override { return {}; }
  [[nodiscard]] PixelBox picture() const override { return picture_; }
  [[nodiscard]] bool closed() const override { return false; }
  [[nodiscard]] bool is_gpu() const override { return IsGpu(context_.description()); }
  [[nodiscard]] bool can_smooth() const override { return !is_gpu() && context_.version() >= kSmoothsFrom; }
  [[nodiscard]] std::string description() const override { return context_.description(); }

 private:
  EglContext context_;
  PixelBox picture_{};
  std::unique_ptr<Framebuffer> framebuffer_;
  std::unique_ptr<PixelReader> reader_ = std::make_unique<PixelReader>();
  osg::ref_ptr<osgViewer::Viewer> viewer_;
  osg::ref_ptr<osgViewer::GraphicsWindowEmbedded> window_;
};

class ReadAfterDraw : public osg::Camera::DrawCallback {
 public:
  void operator()(osg::RenderInfo& info) const override {
    const osg::Viewport& box = *info.getCurrentCamera()->getViewport();
    const int x = static_cast<int>(box.x()), y = static_cast<int>(box.y());
    const int width = static_cast<int>(box.width()), height = static_cast<int>(box.height());
    if (picture != nullptr) ReadBoundFramebuffer(x, y, width, height, picture);
    if (reader != nullptr) reader->Start(x, y, width, height);
  }
  Bitmap* picture = nullptr;
  PixelReader* reader = nullptr;
};

/// Blackens the whole window, because OpenSceneGraph clears the camera's viewport only.
class ClearBars : public osg::Camera::DrawCallback {
 public:
  void operator()(osg::RenderInfo& info) const override {
    info.getState()->applyMode(GL_SCISSOR_TEST, false);
    glClearColor(0, 0, 0, 1);
    glClear(GL_COLOR_BUFFER_BIT);
  }
};

/// Instead of OpenSceneGraph's way, which stretches the viewport with the window.
class KeepShape : public osg::GraphicsContext::ResizedCallback {
 public:
  KeepShape(osg::Camera* camera, const RenderParams& params) : camera_(camera), params_(params) {}
  void resizedImplementation(osg::GraphicsContext* context, int x, int y, int width, int height) override {
    context->resizedImplementation(x, y, width, height);
    Fit(width, height);
  }
  void Fit(int width, int height) {
    const PixelBox box = FitPicture(params_, width, height);
    camera_->setViewport(box.x, box.y, box.width, box.height);
  }

 private:
  osg::Camera* camera_;  // Outlives the window.
  RenderParams params_;
};

class Keyboard : public osgGA::GUIEventHandler {
 public:
  bool handle(const osgGA::GUIEventAdapter& event, osgGA::GUIActionAdapter&) override {
    if (event.getEventType() == osgGA::GUIEventAdapter::KEYDOWN) {
      pressed.push_back(event.getKey());
    }
    clicked = clicked || event.getEventType() == osgGA::GUIEventAdapter::PUSH;
    return false;
  }
  std::vector<int> pressed;
  bool clicked = false;
};

class WindowDisplay : public Display {
 public:
  WindowDisplay(const LaparoscopeView& view, const RenderParams& params) {
    osg::GraphicsContext::WindowingSystemInterface* system = osg::GraphicsContext::getWindowingSystemInterface();
    osg::GraphicsContext::ScreenIdentifier screen;
    screen.readDISPLAY();
    if (system == nullptr || system->getNumScreens(screen) == 0) {
      throw InputError("--window: no display can be opened (DISPLAY); start an X server or leave --window out");
    }
    osg::ref_ptr<osg::GraphicsContext::Traits> traits = new osg::GraphicsContext::Traits;
    traits->readDISPLAY();
    traits->setUndefinedScreenDetailsToDefaultScreen();
    traits->x = 40;
    traits->y = 40;
    traits->width = static_cast<int>(params.width);
    traits->height = static_cast<int>(params.height);
    traits->doubleBuffer = true;
    traits->windowDecoration = true;
    traits->supportsResize = true;
    traits->windowName = "Fulcrum";
    context_ = osg::GraphicsContext::createGraphicsContext(traits);
    if (!context_) {
      throw InputError("--window: the display refuses an OpenGL window of this size");
    }
    SetUpState(context_->getState());
    viewer_.getCamera()->setGraphicsContext(context_);
    const osg::ref_ptr<KeepShape> shape = new KeepShape(viewer_.getCamera(), params);
    shape->Fit(traits->width, traits->height);
    context_->setResizedCallback(shape);
    viewer_.getCamera()->setInitialDrawCallback(new ClearBars);
    viewer_.getCamera()->setFinalDrawCallback(read_);
    SetUpViewer(view, &viewer_);
    viewer_.addEventHandler(keys_);
    viewer_.realize();
    if (!viewer_.isRealized()) {
      throw InputError("--window: the display refuses an OpenGL window");
    }
    context_->makeCurrent();
    if (const auto* renderer = glGetString(GL_RENDERER)) is_gpu_ = IsGpu(reinterpret_cast<const char*>(renderer));
    can_smooth_ = !is_gpu_ && GlVersion() >= kSmoothsFrom;
    context_->releaseContext();
    // The context is passed from the thread that opens the window to the thread that draws.
    viewer_.setReleaseContextAtEndOfFrameHint(true);
    window_ = std::make_unique<X11Window>(context_.get());
  }

  ~WindowDisplay() override {
    const bool current = context_->makeCurrent();
    if (!current) reader_->Abandon();
    reader_.reset();
    if (current) context_->releaseContext();
  }

  void Draw() override { viewer_.frame(); }

  void DrawAndRead(Bitmap* picture) override {
    read_->picture = picture;
    viewer_.frame();
    read_->picture = nullptr;
  }

  void DrawAndStartRead() override {
    read_->reader = reader_.get();
    viewer_.frame();
    read_->reader = nullptr;
  }

  [[nodiscard]] ReadResult TakeRead(bool wait, Bitmap* picture) override {
    if (!reader_->pending()) return ReadResult::kNone;
    if (!context_->makeCurrent()) {  // The window was closed.
      reader_->Abandon();
      return ReadResult::kFailed;
    }
    const ReadResult result = reader_->Take(wait, picture);
    context_->releaseContext();
    return result;
  }

  [[nodiscard]] std::vector<int> TakeKeys() override {
    keys_->clicked = false;
    viewer_.advance();
    viewer_.eventTraversal();
    return std::exchange(keys_->pressed, {});
  }

  [[nodiscard]] bool clicked() const override { return keys_->clicked; }
  [[nodiscard]] unsigned long window() const override { return window_->id(); }
  [[nodiscard]] PixelBox picture() const override {
    const osg::Viewport& box = *viewer_.getCamera()->getViewport();
    return {static_cast<int>(box.x()), static_cast<int>(box.y()), static_cast<int>(box.width()),
            static_cast<int>(box.height())};
  }
  void ToggleFullScreen() override { window_->ToggleFullScreen(); }
  [[nodiscard]] bool closed() const override { return viewer_.done(); }
  [[nodiscard]] bool is_gpu() const override { return is_gpu_; }
  [[nodiscard]] bool can_smooth() const override { return can_smooth_; }
  [[nodiscard]] std::string description() const override { return "window"; }

 private:
  bool is_gpu_ = false, can_smooth_ = false;
  std::unique_ptr<PixelReader> reader_ = std::make_unique<PixelReader>();
  osg::ref_ptr<ReadAfterDraw> read_ = new ReadAfterDraw;
  osg::ref_ptr<Keyboard> keys_ = new Keyboard;
  osg::ref_ptr<osg::GraphicsContext> context_;
  osgViewer::Viewer viewer_;
  std::unique_ptr<X11Window> window_;
};

}  // namespace

std::unique_ptr<Display> MakeOffscreenDisplay(const LaparoscopeView& view, const RenderParams& params) {
  return std::make_unique<OffscreenDisplay>(view, params);
}

std::unique_ptr<Display> MakeWindowDisplay(const LaparoscopeView& view, const RenderParams& params) {
  return std::make_unique<WindowDisplay>(view, params);
}

}  // namespace fulcrum::render
