#include "render_node/scene_graph/display.h"

#include <osg/GLExtensions>
#include <osgGA/GUIEventHandler>
#include <osgViewer/Viewer>
#include <utility>

#include "render_node/offscreen/egl_context.h"
#include "render_node/scene_graph/x11_window.h"
#include "services/base/core/error.h"

namespace fulcrum::render {
namespace {

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

class OffscreenDisplay : public Display {
 public:
  OffscreenDisplay(const LaparoscopeView& view, const RenderParams& params) {
    context_.MakeCurrent();
    viewer_ = new osgViewer::Viewer;
    const int width = static_cast<int>(params.width), height = static_cast<int>(params.height);
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

  [[nodiscard]] std::vector<int> TakeKeys() override { return {}; }
  [[nodiscard]] bool closed() const override { return false; }
  [[nodiscard]] std::string description() const override { return context_.description(); }

 private:
  EglContext context_;
  std::unique_ptr<Framebuffer> framebuffer_;
  osg::ref_ptr<osgViewer::Viewer> viewer_;
  osg::ref_ptr<osgViewer::GraphicsWindowEmbedded> window_;
};

class ReadAfterDraw : public osg::Camera::DrawCallback {
 public:
  ReadAfterDraw(int width, int height) : width_(width), height_(height) {}
  void operator()(osg::RenderInfo&) const override {
    if (picture != nullptr) {
      ReadBoundFramebuffer(width_, height_, picture);
    }
  }
  Bitmap* picture = nullptr;

 private:
  int width_;
  int height_;
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
  WindowDisplay(const LaparoscopeView& view, const RenderParams& params)
      : read_(new ReadAfterDraw(static_cast<int>(params.width), static_cast<int>(params.height))) {
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
    traits->supportsResize = false;
    traits->windowName = "Fulcrum";
    context_ = osg::GraphicsContext::createGraphicsContext(traits);
    if (!context_) {
      throw InputError("--window: the display refuses an OpenGL window of this size");
    }
    SetUpState(context_->getState());
    viewer_.getCamera()->setGraphicsContext(context_);
    viewer_.getCamera()->setViewport(0, 0, traits->width, traits->height);
    viewer_.getCamera()->setFinalDrawCallback(read_);
    SetUpViewer(view, &viewer_);
    viewer_.addEventHandler(keys_);
    viewer_.realize();
    if (!viewer_.isRealized()) {
      throw InputError("--window: the display refuses an OpenGL window");
    }
    // The context is passed from the thread that opens the window to the thread that draws.
    viewer_.setReleaseContextAtEndOfFrameHint(true);
  }

  void Draw() override { viewer_.frame(); }

  void DrawAndRead(Bitmap* picture) override {
    read_->picture = picture;
    viewer_.frame();
    read_->picture = nullptr;
  }

  [[nodiscard]] std::vector<int> TakeKeys() override {
    keys_->clicked = false;
    viewer_.advance();
    viewer_.eventTraversal();
    return std::exchange(keys_->pressed, {});
  }

  [[nodiscard]] bool clicked() const override { return keys_->clicked; }
  [[nodiscard]] unsigned long window() const override { return X11WindowOf(context_.get()); }
  [[nodiscard]] bool closed() const override { return viewer_.done(); }
  [[nodiscard]] std::string description() const override { return "window"; }

 private:
  osg::ref_ptr<ReadAfterDraw> read_;
  osg::ref_ptr<Keyboard> keys_ = new Keyboard;
  osg::ref_ptr<osg::GraphicsContext> context_;
  osgViewer::Viewer viewer_;
};

}  // namespace

std::unique_ptr<Display> MakeOffscreenDisplay(const LaparoscopeView& view, const RenderParams& params) {
  return std::make_unique<OffscreenDisplay>(view, params);
}

std::unique_ptr<Display> MakeWindowDisplay(const LaparoscopeView& view, const RenderParams& params) {
  return std::make_unique<WindowDisplay>(view, params);
}

}  // namespace fulcrum::render
