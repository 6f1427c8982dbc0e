#include "services/apps/replayer/dataset.h"

#include <algorithm>
#include <fstream>
#include <future>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "services/apps/replayer/channels.h"
#include "services/apps/replayer/coco.h"
#include "services/apps/replayer/dataset_sheet.h"
#include "services/apps/replayer/frame_text.h"
#include "services/apps/replayer/new_folder.h"
#include "services/apps/replayer/projector.h"
#include "services/apps/replayer/report_format.h"
#include "services/apps/replayer/truth.h"
#include "services/apps/replayer/variation.h"
#include "services/base/core/error.h"

namespace fulcrum::replay {
namespace {

namespace fs = std::filesystem;

constexpr int kWriters = 2;
constexpr const char* kFolders[] = {"left",     "right", "depth",       "normal", "flow",
                                    "instance", "class", "temperature", "damage", "water"};

void MakeFolders(const DatasetSettings& settings) {
  std::error_code error;
  for (const std::string folder : kFolders) {
    if (folder == "right" && settings.baseline_m <= 0) continue;
    fs::create_directories(settings.folder / folder, error);
    if (error) throw InputError(settings.folder.string() + ": cannot be made: " + error.message());
  }
}

std::string FileName(std::uint64_t frame) { return Format("%06llu.png", static_cast<unsigned long long>(frame)); }

class DatasetMaker {
 public:
  DatasetMaker(const DatasetSettings& settings, const SceneView& scene, const render::Look& look)
      : settings_(settings), scene_(scene), projector_(settings.recording, scene, look), writer_(kWriters) {
    projector_.replay().node().view().SetDetail(kTruthDetail);
    const PictureNumbers numbers(settings.recording, projector_.span(), settings.until_s, settings.every_s);
    first_ = numbers.first;
    count_ = numbers.count;
  }

  DatasetResult Make(const std::function<void(double)>& progress) {
    for (std::uint64_t i = 0; i < count_; ++i) {
      const double time_s = static_cast<double>(first_ + i) * settings_.every_s;
      projector_.GoTo(time_s);
      // The first frames show the first tissue if it came later.
      if (i == 0) Begin();
      Add(i, time_s);
      if (progress) progress(time_s);
    }
    images_.get();
    writer_.Finish();
    coco_->Finish();
    if (!frames_.flush()) throw InputError((settings_.folder / "frames.jsonl").string() + ": cannot be written");
    sheet_.Write(settings_.folder / "sheet.png");
    return {count_, static_cast<double>(count_ - 1) * settings_.every_s};
  }

 private:
  void Begin() {
    if (render::Bitmap first; !projector_.Draw(&first)) throw std::runtime_error("the recording has no tissue to show");
    MakeFolders(settings_);
    coco_.emplace(settings_.folder / "coco.json");
    frames_.open(settings_.folder / "frames.jsonl");
  }

  /// Draws a frame. Its ground truth is computed on another thread while the next frame is drawn.
  void Add(std::uint64_t frame, double time_s) {
    render::RenderNode& node = projector_.replay().node();
    const RenderParams camera = node.camera();
    Frame drawn{frame, time_s, {}, {}, FrameState(node, projector_.replay().contact_model()), std::nullopt};
    node.DrawFrom(camera, &drawn.left);
    drawn.moment.emplace(&node.view(), render::MakeLaparoscope(camera), scene_, drawn.left.width, drawn.left.height);
    if (settings_.baseline_m > 0) {
      node.DrawFrom(render::BesideOf(camera, static_cast<float>(settings_.baseline_m)), &drawn.right);
    }
    if (images_.valid()) images_.get();
    images_ = std::async(std::launch::async, [this, given = std::move(drawn)]() mutable { Write(std::move(given)); });
  }

  struct Frame {
    std::uint64_t index;
    double time_s;
    render::Bitmap left, right;
    FrameState state;
    std::optional<Moment> moment;
  };

  void Write(Frame frame) {
    auto truth = std::make_unique<const Truth>(*std::move(frame.moment));
    const std::uint64_t i = frame.index;
    if (i == 0) {
      WriteText(settings_.folder / "calibration.json",
                CalibrationText(truth->camera(), settings_.baseline_m, scene_.solids));
    }
    Write("left", i, FromBitmap(frame.left));
    if (settings_.baseline_m > 0) Write("right", i, FromBitmap(frame.right));
    Write("depth", i, truth->Depth());
    Write("normal", i, truth->Normals());
    Write("class", i, truth->Classes());
    Channel instances = truth->Instances();
    coco_->Add(static_cast<int>(i), "left/" + FileName(i), instances, *truth);
    Write("instance", i, std::move(instances));
    Write("temperature", i, truth->temperature());
    Write("damage", i, truth->damage());
    Write("water", i, truth->water());
    if (before_) Write("flow", i - 1, before_->FlowTo(*truth));
    frames_ << FrameText(i, frame.time_s, frame.state, scene_, *truth) << '\n';
    before_ = std::move(truth);
  }

  void Write(const std::string& folder, std::uint64_t frame, Channel channel) {
    if (frame == count_ / 2) sheet_.Add(folder, channel);
    writer_.Add(std::move(channel), settings_.folder / folder / FileName(frame));
  }

  const DatasetSettings& settings_;
  const SceneView& scene_;
  Projector projector_;
  std::optional<CocoFile> coco_;
  std::ofstream frames_;
  DatasetSheet sheet_;
  std::uint64_t first_ = 0;  // Steps from session time 0 to the first frame.
  std::uint64_t count_ = 0;
  std::unique_ptr<const Truth> before_;
  ChannelWriter writer_;
  std::future<void> images_;  // Last: it uses the others.
};

}  // namespace

DatasetResult MakeDataset(const DatasetSettings& settings, const SceneView& scene,
                          const std::function<void(double)>& progress) {
  RefuseFilled(settings.folder);
  SceneView varied = scene;
  varied.stereo = {};  // A data set has a baseline of its own, and each camera a picture.
  if (settings.variations == 0) return DatasetMaker(settings, varied, {}).Make(progress);
  DatasetResult all;
  std::string said;
  for (std::uint32_t i = 0; i < settings.variations; ++i) {
    const Variation variation = VariationOf(scene, settings.seed, i);
    varied.render = variation.camera;
    DatasetSettings one = settings;
    one.folder = settings.folder / Format("%03u", i);
    const DatasetResult result = DatasetMaker(one, varied, variation.look).Make(progress);
    all.frames += result.frames;
    all.duration_s = result.duration_s;
    // A set of variations that was interrupted names those that are whole.
    said += VariationText(settings.seed, i, variation);
    WriteText(settings.folder / "variations.jsonl", said);
  }
  return all;
}

}  // namespace fulcrum::replay
