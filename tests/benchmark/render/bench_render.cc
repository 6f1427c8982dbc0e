// Cost of a picture, drawn in full and when nothing changes, and the error of its edges: the built-in scene in the
// middle of its cut, off screen.
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <osg/GraphicsContext>
#include <osg/State>
#include <thread>

#include "render_node/geometry/atlas.h"
#include "render_node/geometry/quality.h"
#include "render_node/geometry/surface.h"
#include "render_node/geometry/texel.h"
#include "render_node/node/render_node.h"
#include "render_node/offscreen/egl_context.h"
#include "render_node/scene_graph/atlas_texture.h"
#include "render_node/scene_graph/display.h"
#include "services/scene/builder/build.h"
#include "tests/benchmark/render/parts.h"
#include "tests/benchmark/report.h"
#include "tests/integration/render/node_bus.h"
#include "tests/integration/render/synthetic_scene.h"

namespace fulcrum::render {

void Show(const SyntheticMoment& moment, LaparoscopeView* view) {
  view->SetTissue(moment.tissue.xyz);
  view->SetTopology(moment.topology);
  for (const TemperaturePatch& patch : moment.patches) {
    view->ApplyPatch(patch);
  }
  for (int tool = 0; tool < kMaxTools; ++tool) {
    view->SetTool(tool, moment.tools.tools[static_cast<std::size_t>(tool)]);
  }
}

namespace {

SceneView Enlarged(SceneView view, int size) {
  view.render.width *= static_cast<std::uint32_t>(size);
  view.render.height *= static_cast<std::uint32_t>(size);
  return view;
}

}  // namespace

Bitmap Mean(const Bitmap& fine, int n) {
  Bitmap mean{fine.width / n, fine.height / n, {}};
  for (int y = 0; y < mean.height; ++y) {
    for (int x = 0; x < mean.width; ++x) {
      for (int channel = 0; channel < 3; ++channel) {
        int sum = 0;
        for (int k = 0; k < n * n; ++k)
          sum += fine.rgb[3 * TexelIndex(n * x + k % n, n * y + k / n, fine.width) + channel];
        mean.rgb.push_back(static_cast<std::uint8_t>((sum + n * n / 2) / (n * n)));
      }
    }
  }
  return mean;
}

double MeanDifference(const Bitmap& a, const Bitmap& b, const std::vector<std::size_t>& pixels) {
  double sum = 0;
  for (const std::size_t pixel : pixels) {
    for (std::size_t k = 3 * pixel; k < 3 * pixel + 3; ++k) sum += std::abs(int{a.rgb[k]} - int{b.rgb[k]});
  }
  return sum / (3.0 * static_cast<double>(pixels.size()));
}

SampledView::SampledView(const SceneView& scene, const SyntheticMoment& moment, int size, float scale)
    : view(Enlarged(scene, size)), laparoscope(view) {
  laparoscope.SetMostScale(std::max(1.0f, scale));
  laparoscope.SetScale(scale);
  display = MakeOffscreenDisplay(laparoscope, view.render);
  Show(moment, &laparoscope);
}

double CpuMs(clockid_t clock) {
  timespec now;
  clock_gettime(clock, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

namespace {

std::int64_t MonotonicNs() {
  timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return std::int64_t{1'000'000'000} * now.tv_sec + now.tv_nsec;
}

}  // namespace

void Sway(const std::vector<float>& rest, int step, std::vector<float>* xyz) {
  const float lift = 0.001f * std::sin(0.4f * static_cast<float>(step));
  *xyz = rest;
  for (std::size_t k = 2; k < xyz->size(); k += 3) {
    (*xyz)[k] += lift * std::sin(60 * (*xyz)[k - 1]);
  }
}

namespace {

void FullScene(const SceneView& scene, StereoLayout layout, std::uint32_t width, std::uint32_t height,
               benchmark::Report* report) {
  const std::string what = layout == StereoLayout::kNone ? "full_scene_" : "stereo_";
  const std::string prefix = "render." + what + std::to_string(height) + "p.";
  if (!report->Wants(prefix)) {
    return;
  }
  SceneView view = scene;
  view.render.width = width;
  view.render.height = height;
  view.stereo.layout = layout;
  LaparoscopeView laparoscope(view);
  const auto display = MakeOffscreenDisplay(laparoscope, view.render);
  std::printf("# %s\n", display->description().c_str());
  const SyntheticMoment moment = MakeSyntheticMoment(view, 12.0);
  Show(moment, &laparoscope);
  QualityControl quality(Quality::kAuto, static_cast<int>(view.render.height), display->is_gpu());
  laparoscope.SetMostScale(quality.most());
  // As the node does for a window and live pictures.
  laparoscope.SetSmoothEdges(true);
  std::vector<float> xyz;
  std::vector<double> frame_ms, cpu_side_ms;
  const int repeats = report->quick() ? 20 : 100, settling = 200;
  for (int k = 0; k < settling + repeats; ++k) {
    Sway(moment.tissue.xyz, k, &xyz);
    const double start = CpuMs(CLOCK_MONOTONIC);
    laparoscope.SetTissue(xyz);
    laparoscope.SetScale(quality.scale());
    laparoscope.Update();
    const double updated = CpuMs(CLOCK_MONOTONIC);
    display->Draw();
    const double drawn = CpuMs(CLOCK_MONOTONIC);
    quality.Add(drawn - start);
    if (k >= settling) {
      frame_ms.push_back(drawn - start);
      cpu_side_ms.push_back(updated - start);
    }
  }
  report->Add(prefix + "frame_ms_p50", benchmark::Quantile(frame_ms, 0.5), "ms");
  report->Add(prefix + "frame_ms_p95", benchmark::Quantile(frame_ms, 0.95), "ms");
  report->Add(prefix + "cpu_side_ms_p50", benchmark::Quantile(cpu_side_ms, 0.5), "ms");
  report->Add(prefix + "scale", quality.scale(), "1");
  for (const auto& [name, scale] : {std::pair{"smooth4", 4.0f}, {"smooth2", 2.0f}, {"high", 1.0f}, {"low", 0.52f}}) {
    if (scale > quality.most()) continue;
    laparoscope.SetScale(scale);
    int step = 0;
    const double cpu_ms = CpuMs(CLOCK_PROCESS_CPUTIME_ID);
    const auto times = benchmark::TimeMs(3, repeats / 2, [&] {
      Sway(moment.tissue.xyz, ++step, &xyz);
      laparoscope.SetTissue(xyz);
      laparoscope.Update();
      display->Draw();
    });
    report->Add(prefix + name + "_frame_ms_p50", benchmark::Quantile(times, 0.5), "ms");
    // Of all threads, also while other programs take the cores.
    report->Add(prefix + name + "_cpu_ms", (CpuMs(CLOCK_PROCESS_CPUTIME_ID) - cpu_ms) / step, "ms");
  }
  // A held scope: each picture draws the fixed surroundings again.
  laparoscope.SetScale(1);
  RenderParams camera = view.render;
  const auto moved = benchmark::TimeMs(3, repeats / 2, [&] {
    camera.scope_tip_W.x() += 1e-4f;
    laparoscope.SetCamera(camera);
    laparoscope.Update();
    display->Draw();
  });
  report->Add(prefix + "high_moved_scope_frame_ms_p50", benchmark::Quantile(moved, 0.5), "ms");
}

/// A picture of 1080 lines as `auto` smooths it: not read back; read while the caller waits; read while it draws the
/// next one.
void ReadBack(const SceneView& scene, benchmark::Report* report) {
  const std::string prefix = "render.read_back_1080p.";
  if (!report->Wants(prefix)) return;
  SceneView view = scene;
  view.render.width = 1920;
  view.render.height = 1080;
  LaparoscopeView laparoscope(view);
  const auto display = MakeOffscreenDisplay(laparoscope, view.render);
  const float scale = display->is_gpu() ? 2.0f : 0.52f;
  laparoscope.SetMostScale(std::max(1.0f, scale));
  laparoscope.SetScale(scale);
  const SyntheticMoment moment = MakeSyntheticMoment(view, 12.0);
  Show(moment, &laparoscope);
  std::vector<float> xyz;
  Bitmap picture;
  int step = 0;
  const auto time = [&](const char* name, const auto& draw) {
    const auto times = benchmark::TimeMs(5, report->quick() ? 20 : 60, [&] {
      Sway(moment.tissue.xyz, ++step, &xyz);
      laparoscope.SetTissue(xyz);
      laparoscope.Update();
      draw();
    });
    report->Add(prefix + name + "_frame_ms_p50", benchmark::Quantile(times, 0.5), "ms");
    report->Add(prefix + name + "_frame_ms_p95", benchmark::Quantile(times, 0.95), "ms");
  };
  time("none", [&] { display->Draw(); });
  time("waiting", [&] { display->DrawAndRead(&picture); });
  time("deferred", [&] {
    (void)display->TakeRead(true, &picture);
    display->DrawAndStartRead();
  });
}

void Uploads(const SceneView& view, benchmark::Report* report) {
  if (!report->Wants("render.subtexture_update_ms") && !report->Wants("render.full_atlas_ms")) {
    return;
  }
  const SyntheticMoment moment = MakeSyntheticMoment(view, 12.0);
  EglContext context;
  context.MakeCurrent();
  Atlas atlas(view);
  AtlasTexture texture(atlas);
  const osg::ref_ptr<osg::State> state = new osg::State;
  state->setContextID(osg::GraphicsContext::createNewContextID());
  state->initializeExtensionProcs();
  texture.texture()->apply(*state);
  glFinish();
  const int repeats = report->quick() ? 15 : 60;
  const auto upload = [&](const AtlasRect& rect) {
    texture.Update(rect);
    texture.texture()->apply(*state);
    glFinish();
  };
  const auto patch = benchmark::TimeMs(3, repeats, [&] { upload(atlas.Apply(moment.patches.front())); });
  const auto all = benchmark::TimeMs(3, repeats, [&] { upload({0, 0, atlas.width(), atlas.height()}); });
  report->Add("render.subtexture_update_ms_p50", benchmark::Quantile(patch, 0.5), "ms");
  report->Add("render.full_atlas_ms", benchmark::Quantile(all, 0.5), "ms");
}

/// The surface in single precision against its definition in double, after a bend, a twist and a stretch by a half.
void Embedding(const SceneView& view, benchmark::Report* report) {
  if (!report->Wants("render.embedding_error_um_max")) {
    return;
  }
  std::vector<float> xyz;
  for (const Vec3f& p : view.rest_position) {
    const float turn = 8 * p.y(), lift = 0.05f * std::sin(25 * p.y());
    xyz.insert(xyz.end(), {std::cos(turn) * p.x() - std::sin(turn) * p.z(), 1.5f * p.y(),
                           std::sin(turn) * p.x() + std::cos(turn) * p.z() + lift});
  }
  std::vector<Vec3f> surface(view.surface_vertices.size());
  MapEmbedded(view.tets, view.surface_vertices, xyz, surface);
  double worst_m = 0;
  for (std::size_t k = 0; k < surface.size(); ++k) {
    const EmbeddedVertex& vertex = view.surface_vertices[k];
    Eigen::Vector3d exact = Eigen::Vector3d::Zero();
    for (std::size_t j = 0; j < 4; ++j) {
      exact +=
          static_cast<double>(vertex.barycentric[j]) * PositionOf(xyz, view.tets[vertex.tetrahedron][j]).cast<double>();
    }
    worst_m = std::max(worst_m, (surface[k].cast<double>() - exact).norm());
  }
  report->Add("render.embedding_error_um_max", 1e6 * worst_m, "um");
}

/// A node on ports of its own, as in a session.
class NodeRun {
 public:
  explicit NodeRun(const SceneView& view)
      : folder_(std::filesystem::temp_directory_path() / ("fulcrum_bench_render_" + std::to_string(getpid()))),
        node_(std::make_unique<RenderNode>(view, RenderSettings{.frames = folder_}, bus_.ports())) {}
  ~NodeRun() {
    node_.reset();  // The node writes until it is destroyed.
    std::filesystem::remove_all(folder_);
  }
  NodeRun(const NodeRun&) = delete;
  NodeRun& operator=(const NodeRun&) = delete;

  void Publish(SyntheticMoment* moment) {
    ++sequence_;
    const Stamp stamp{sequence_, 1, MonotonicNs()};
    moment->tissue.header.stamp = moment->tools.stamp = moment->topology.stamp = stamp;
    bus_.tissue_out->Write(moment->tissue);
    bus_.tools_out->Write(moment->tools);
    bus_.topology_out->Write(moment->topology);
  }
  void Step(double time_s) { node_->Step({static_cast<std::uint64_t>(1e3 * time_s), time_s, 1.0 / 30, 0}); }

 private:
  std::filesystem::path folder_;
  NodeBus bus_;
  std::uint64_t sequence_ = 0;
  std::unique_ptr<RenderNode> node_;
};

/// Frames arrive with unchanged content: 30 steps a second, tissue at 100 Hz.
void StaticScene(const SceneView& view, benchmark::Report* report) {
  if (!report->Wants("render.static_scene.")) {
    return;
  }
  NodeRun run(view);
  SyntheticMoment moment = MakeSyntheticMoment(view, 12.0);
  const int steps = report->quick() ? 60 : 150;
  double cpu_ms = 0;
  double began_ms = 0;
  for (int k = -10; k < steps; ++k) {
    if (k == 0) {
      began_ms = CpuMs(CLOCK_MONOTONIC);
    }
    for (int frame = 0; frame < 3; ++frame) {
      run.Publish(&moment);
    }
    const double before = CpuMs(CLOCK_PROCESS_CPUTIME_ID);
    run.Step(1 + k / 30.0);
    if (k >= 0) {
      cpu_ms += CpuMs(CLOCK_PROCESS_CPUTIME_ID) - before;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(32));
  }
  report->Add("render.static_scene.cpu_pct", 100 * cpu_ms / (CpuMs(CLOCK_MONOTONIC) - began_ms), "%");
}

/// Time from the stamp of the newest pose to the end of the drawing that shows it; every step is drawn.
void PoseToFrame(const SceneView& scene, benchmark::Report* report) {
  if (!report->Wants("render.pose_to_frame_ms")) {
    return;
  }
  SceneView view = scene;
  view.render.width = 1280;
  view.render.height = 720;
  view.render.png_rate_Hz = 240;
  NodeRun run(view);
  SyntheticMoment moment = MakeSyntheticMoment(view, 12.0);
  const std::vector<float> rest = moment.tissue.xyz;
  std::vector<double> latency_ms;
  const int settling = 60, steps = report->quick() ? 20 : 60;
  for (int k = 0; k < settling + steps; ++k) {
    Sway(rest, k, &moment.tissue.xyz);
    moment.tools.tools[1].p_WT.z() += 1e-4f;
    run.Publish(&moment);
    // The servo's stamps are up to a millisecond old when a step takes them.
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    run.Step(1 + k / 30.0);
    if (k >= settling) {
      latency_ms.push_back(1e-6 * static_cast<double>(MonotonicNs() - moment.tools.stamp.stamp_ns));
    }
  }
  report->Add("render.pose_to_frame_ms_p50", benchmark::Quantile(latency_ms, 0.5), "ms");
}

}  // namespace
}  // namespace fulcrum::render

int main(int argc, char** argv) {
  using namespace fulcrum;
  benchmark::Report report(argc, argv);
  if (!report.Wants("render.")) {
    return 0;
  }
  try {
    const scene::SceneData data = scene::BuildProcedural(scene::BuiltIn());
    const SceneView view = data.View();
    for (const StereoLayout layout : {StereoLayout::kNone, StereoLayout::kSideBySide}) {
      render::FullScene(view, layout, 960, 540, &report);
      render::FullScene(view, layout, 1280, 720, &report);
      render::FullScene(view, layout, 1920, 1080, &report);
    }
    render::ReadBack(view, &report);
    render::Edges(view, &report);
    render::CutFigures(view, &report);
    render::Flicker(view, &report);
    render::Smoothing(view, &report);
    render::LookFigures(view, &report);
    render::Uploads(view, &report);
    render::Embedding(view, &report);
    render::StaticScene(view, &report);
    render::PoseToFrame(view, &report);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_render: %s\n", error.what());
    return 1;
  }
  return 0;
}
