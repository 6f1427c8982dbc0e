#include "services/apps/replayer/lerobot.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

#include "services/apps/replayer/new_folder.h"
#include "services/apps/replayer/parquet_file.h"
#include "services/apps/replayer/projector.h"
#include "services/apps/replayer/recorded_kinematics.h"
#include "services/apps/replayer/report_format.h"
#include "services/apps/replayer/video.h"
#include "services/apps/replayer/video_file.h"
#include "services/base/core/error.h"
#include "services/scene/format/scene_file.h"

namespace fulcrum::replay {
namespace {

namespace fs = std::filesystem;

constexpr const char* kCamera = "observation.images.endoscope";
constexpr int kEpisodesInChunk = 1000;
constexpr int kPicturesInGroup = 2;  // LeRobot's loader seeks single pictures.
/// A row's time is a float. LeRobot refuses steps that differ from 1/30 s by more than 1e-4 s, and from 1,024 s on
/// floats are 1.2e-4 s apart.
constexpr double kLongestEpisode_s = 1000;
constexpr std::size_t kPixelStep = 16;  // Of the statistics of the pictures, as in LeRobot every few pixels only.

/// Least, greatest, mean and standard deviation of each dimension.
class Statistics {
 public:
  explicit Statistics(std::size_t dimensions) : of_(dimensions) {}
  void Add(std::size_t dimension, double value) {
    Dimension& to = of_[dimension];
    to.low = std::min(to.low, value);
    to.high = std::max(to.high, value);
    // Welford 1962: exact also where the mean is large against the deviation.
    const double before = value - to.mean;
    to.mean += before / ++to.count;
    to.squares += before * (value - to.mean);
  }
  /// As JSON; pictures have an array of one row and column for each channel.
  [[nodiscard]] std::string Text(bool picture, std::uint64_t count) const {
    const auto list = [&](const auto& value) {
      std::string text;
      for (const Dimension& each : of_) {
        text += (text.empty() ? "" : ", ") + Format(picture ? "[[%.9g]]" : "%.9g", value(each));
      }
      return "[" + text + "]";
    };
    return "{\"min\": " + list([](const Dimension& d) { return d.low; }) +
           ", \"max\": " + list([](const Dimension& d) { return d.high; }) +
           ", \"mean\": " + list([](const Dimension& d) { return d.mean; }) +
           ", \"std\": " + list([](const Dimension& d) { return std::sqrt(d.squares / d.count); }) +
           Format(", \"count\": [%llu]}", static_cast<unsigned long long>(count));
  }

 private:
  struct Dimension {
    double low = std::numeric_limits<double>::infinity(), high = -low, mean = 0, squares = 0, count = 0;
  };
  std::vector<Dimension> of_;
};

/// What a row of states and one of actions has.
struct Layout {
  explicit Layout(const SceneView& scene) : width(scene.render.width), height(scene.render.height) {
    for (std::size_t k = 0; k < kMaxTools; ++k) {
      const ToolKind kind = scene.tools[k].kind;
      if (!TouchesTissue(kind)) continue;
      tools.push_back(k);
      const char* name = kind == ToolKind::kHook          ? "hook"
                         : kind == ToolKind::kScissors    ? "scissors"
                         : kind == ToolKind::kSuction     ? "suction"
                         : kind == ToolKind::kClipApplier ? "clip_applier"
                                                          : "grasper";
      for (const char* value : {"x", "y", "z", "qx", "qy", "qz", "qw", "jaw", "force"}) {
        names.push_back(Format("%s%zu.%s", name, k, value));
        if (std::string_view(value) != "force") action_names.push_back(names.back());
      }
    }
    for (const char* pedal : {"pedal.cut", "pedal.coag", "pedal.blend"}) {
      names.emplace_back(pedal);
      action_names.emplace_back(pedal);
    }
  }
  bool operator==(const Layout&) const = default;

  std::uint32_t width, height;
  std::vector<std::size_t> tools;
  std::vector<std::string> names, action_names;
};

void AppendRow(const Layout& layout, const KinematicState& state, bool action, std::vector<float>* to) {
  const auto add = [to](double value) { to->push_back(static_cast<float>(value)); };
  for (const std::size_t k : layout.tools) {
    const KinematicState::Tool& tool = state.tools[k];
    for (int i = 0; i < 3; ++i) add(tool.tip_W[i]);
    for (const double q : {tool.q_WT.x(), tool.q_WT.y(), tool.q_WT.z(), tool.q_WT.w()}) add(q);
    add(tool.jaw_rad);
    if (!action) add(tool.force_N);
  }
  for (const std::uint8_t pedal : {kPedalCut, kPedalCoag, kPedalBlend}) add((state.pedals & pedal) != 0 ? 1 : 0);
}

std::string StatisticsOf(const ParquetColumn& column) {
  const std::size_t length = std::max<std::size_t>(1, column.length);
  Statistics statistics(length);
  std::uint64_t count = 0;
  std::visit(
      [&](const auto& values) {
        for (std::size_t i = 0; i < values.size(); ++i) statistics.Add(i % length, static_cast<double>(values[i]));
        count = values.size() / length;
      },
      column.values);
  return statistics.Text(false, count);
}

/// The file is there as a whole or as it was before.
void Replace(const fs::path& file, std::string_view bytes) {
  const fs::path part = file.string() + ".part";
  std::ofstream out(part, std::ios::binary);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  out.close();
  std::error_code error;
  if (out) fs::rename(part, file, error);
  if (out && !error) return;
  std::error_code ignored;
  fs::remove(part, ignored);
  throw InputError(file.string() + ": cannot be written; is the disk full?");
}

std::string JsonList(const std::vector<std::string>& texts) {
  std::string list;
  for (const std::string& text : texts) list += (list.empty() ? "" : ", ") + JsonString(text);
  return "[" + list + "]";
}

constexpr double kPeriod_s = 1.0 / kVideoRate_Hz;

double TimeOf(std::uint64_t frame) { return static_cast<double>(frame) / kVideoRate_Hz; }

/// Finds before the first picture what would end the work in hours. The samples are read again for the episode: those
/// of all recordings may not fit into memory.
void Check(const fs::path& recording, const SceneView& scene, double until_s) {
  const std::string leave_out = "; or leave out " + recording.string();
  try {
    const PictureNumbers rows(recording, ReadSpan(recording, scene), until_s, kPeriod_s);
    const double length_s = TimeOf(rows.count - 1);
    if (length_s > kLongestEpisode_s) {
      throw InputError(
          recording.string() +
          Format(": an episode of %.1f s; valid: 0 to %.0f s, because the time of a row is a 32-bit number. "
                 "Give --until %.0f",
                 length_s, kLongestEpisode_s, std::floor(TimeOf(rows.first) + kLongestEpisode_s)));
    }
    (void)ReadKinematics(recording, scene, TimeOf(rows.first + rows.count - 1));
  } catch (const InputError& error) {
    throw InputError(error.what() + leave_out);
  } catch (const MismatchError& error) {
    throw MismatchError(error.what() + leave_out);
  }
}

/// Of the two quaternions of an orientation those near the ones before.
void KeepSigns(const KinematicState& before, KinematicState* state) {
  for (std::size_t k = 0; k < kMaxTools; ++k) {
    Eigen::Quaterniond& q_WT = state->tools[k].q_WT;
    if (q_WT.dot(before.tools[k].q_WT) < 0) q_WT.coeffs() = -q_WT.coeffs();
  }
}

struct Episode {
  std::vector<KinematicState> states;  ///< By picture.
  Statistics colours{3};
};

/// Draws the video of a session.
Episode DrawEpisode(const fs::path& recording, const SceneView& scene, double until_s, const fs::path& file,
                    const std::function<void(double)>& progress) {
  SceneView drawn = scene;
  drawn.stereo = {};  // One picture, whatever display the session had.
  Projector projector(recording, drawn);
  const PictureNumbers rows(recording, projector.span(), until_s, kPeriod_s);
  const Kinematics kinematics = ReadKinematics(recording, drawn, TimeOf(rows.first + rows.count - 1));
  render::Bitmap picture;
  projector.GoTo(TimeOf(rows.first));
  if (!projector.Draw(&picture)) throw std::runtime_error(recording.string() + ": has no tissue to show");
  Episode episode;
  VideoFile video(file, picture.width, picture.height, kVideoRate_Hz, kPicturesInGroup);
  for (std::uint64_t i = 0; i < rows.count; ++i) {
    const double time_s = TimeOf(rows.first + i);
    projector.GoTo(time_s);
    RenderReplay& replay = projector.replay();
    KinematicState state = kinematics.At(replay.session_start_ns() + std::llround(1e9 * time_s));
    if (i > 0) KeepSigns(episode.states.back(), &state);
    ShowInstruments(state, drawn, &replay.node());
    replay.node().DrawFrom(replay.node().camera(), &picture);
    video.Add(picture);
    for (std::size_t p = 0; p + 2 < picture.rgb.size(); p += 3 * kPixelStep) {
      for (std::size_t k = 0; k < 3; ++k) episode.colours.Add(k, picture.rgb[p + k] / 255.0);
    }
    episode.states.push_back(state);
    if (progress) progress(time_s);
  }
  video.Finish(std::string(drawn.name), {}, TimeOf(rows.count));
  return episode;
}

/// @param first_index of all episodes' rows.
std::vector<ParquetColumn> ColumnsOf(const Episode& episode, const Layout& layout, std::int64_t number,
                                     std::int64_t first_index, std::int64_t task) {
  const std::size_t rows = episode.states.size();
  std::vector<float> states, actions, times;
  std::vector<std::int64_t> frames, indices;
  std::vector<bool> done(rows, false);
  done.back() = true;
  for (std::size_t i = 0; i < rows; ++i) {
    AppendRow(layout, episode.states[i], false, &states);
    AppendRow(layout, episode.states[std::min(i + 1, rows - 1)], true, &actions);
    times.push_back(static_cast<float>(TimeOf(i)));
    frames.push_back(static_cast<std::int64_t>(i));
    indices.push_back(first_index + static_cast<std::int64_t>(i));
  }
  return {{"observation.state", std::move(states), layout.names.size()},
          {"action", std::move(actions), layout.action_names.size()},
          {"timestamp", std::move(times)},
          {"frame_index", std::move(frames)},
          {"episode_index", std::vector<std::int64_t>(rows, number)},
          {"index", std::move(indices)},
          {"task_index", std::vector<std::int64_t>(rows, task)},
          {"next.done", std::move(done)}};
}

class LerobotSet {
 public:
  LerobotSet(fs::path folder, const Layout& layout) : folder_(std::move(folder)), layout_(layout) { Make("meta"); }

  void Add(const LerobotSettings::Session& session, const SceneView& scene, double until_s,
           const std::function<void(double)>& progress) {
    const auto number = static_cast<int>(episodes_);
    const std::string chunk = Format("chunk-%03d", number / kEpisodesInChunk), file = Format("episode_%06d", number);
    Make(fs::path("data") / chunk);
    Make(fs::path("videos") / chunk / kCamera);
    const Episode episode = DrawEpisode(session.recording, scene, until_s,
                                        folder_ / "videos" / chunk / kCamera / (file + ".mp4"), progress);
    const std::uint64_t frames = episode.states.size();
    const std::size_t task = TaskNumber(session.task.empty() ? std::string(scene.name) : session.task);
    const auto columns =
        ColumnsOf(episode, layout_, number, static_cast<std::int64_t>(result_.frames), static_cast<std::int64_t>(task));
    const std::vector<std::uint8_t> table = ParquetOf(columns);
    Replace(folder_ / "data" / chunk / (file + ".parquet"),
            {reinterpret_cast<const char*>(table.data()), table.size()});
    lines_ += Format("{\"episode_index\": %d, \"tasks\": [", number) + JsonString(tasks_[task]) +
              Format("], \"length\": %llu}\n", static_cast<unsigned long long>(frames));
    statistics_ +=
        Format("{\"episode_index\": %d, \"stats\": {\"%s\": ", number, kCamera) + episode.colours.Text(true, frames);
    for (const ParquetColumn& column : columns) {
      statistics_ += ", " + JsonString(column.name) + ": " + StatisticsOf(column);
    }
    statistics_ += "}}\n";
    ++episodes_;
    result_.frames += frames;
    result_.duration_s += static_cast<double>(frames) / kVideoRate_Hz;
    WriteMeta();
  }
  [[nodiscard]] const LerobotResult& result() const { return result_; }

 private:
  void Make(const fs::path& below) {
    std::error_code error;
    fs::create_directories(folder_ / below, error);
    if (error) throw InputError(folder_.string() + ": cannot be made: " + error.message());
  }
  std::size_t TaskNumber(const std::string& task) {
    const auto found = std::find(tasks_.begin(), tasks_.end(), task);
    if (found != tasks_.end()) return static_cast<std::size_t>(found - tasks_.begin());
    tasks_.push_back(task);
    return tasks_.size() - 1;
  }
  /// After video and table of each episode, info.json last: in a set that was interrupted, the episodes that it counts
  /// are whole.
  void WriteMeta() const {
    std::string tasks;
    for (std::size_t i = 0; i < tasks_.size(); ++i) {
      tasks += Format("{\"task_index\": %zu, \"task\": ", i) + JsonString(tasks_[i]) + "}\n";
    }
    Replace(folder_ / "meta/tasks.jsonl", tasks);
    Replace(folder_ / "meta/episodes.jsonl", lines_);
    Replace(folder_ / "meta/episodes_stats.jsonl", statistics_);
    Replace(folder_ / "meta/info.json", InfoText());
  }
  [[nodiscard]] std::string InfoText() const {
    const int width = VideoSize(static_cast<int>(layout_.width)), height = VideoSize(static_cast<int>(layout_.height));
    const auto vector = [](const char* name, const std::vector<std::string>& names) {
      return Format("    \"%s\": {\"dtype\": \"float32\", \"shape\": [%zu], \"names\": ", name, names.size()) +
             JsonList(names) + "},\n";
    };
    std::string text = Format(
        "{\n  \"codebase_version\": \"v2.1\",\n  \"robot_type\": \"fulcrum\",\n  \"total_episodes\": %zu,\n"
        "  \"total_frames\": %llu,\n  \"total_tasks\": %zu,\n  \"total_videos\": %zu,\n  \"total_chunks\": %zu,\n",
        episodes_, static_cast<unsigned long long>(result_.frames), tasks_.size(), episodes_,
        (episodes_ + kEpisodesInChunk - 1) / kEpisodesInChunk);
    text += Format("  \"chunks_size\": %d,\n  \"fps\": %d,\n  \"splits\": {\"train\": \"0:%zu\"},\n", kEpisodesInChunk,
                   kVideoRate_Hz, episodes_);
    text +=
        "  \"data_path\": \"data/chunk-{episode_chunk:03d}/episode_{episode_index:06d}.parquet\",\n"
        "  \"video_path\": \"videos/chunk-{episode_chunk:03d}/{video_key}/episode_{episode_index:06d}.mp4\",\n"
        "  \"features\": {\n";
    text += Format(
        "    \"%s\": {\"dtype\": \"video\", \"shape\": [%d, %d, 3], \"names\": [\"height\", \"width\", "
        "\"channels\"],\n",
        kCamera, height, width);
    text += Format(
        "      \"info\": {\"video.fps\": %d, \"video.height\": %d, \"video.width\": %d, \"video.channels\": 3, "
        "\"video.codec\": \"h264\", \"video.pix_fmt\": \"yuv420p\", \"video.is_depth_map\": false, "
        "\"has_audio\": false}},\n",
        kVideoRate_Hz, height, width);
    text += vector("observation.state", layout_.names) + vector("action", layout_.action_names);
    text += "    \"timestamp\": {\"dtype\": \"float32\", \"shape\": [1], \"names\": null},\n";
    for (const char* name : {"frame_index", "episode_index", "index", "task_index"}) {
      text += Format("    \"%s\": {\"dtype\": \"int64\", \"shape\": [1], \"names\": null},\n", name);
    }
    return text + "    \"next.done\": {\"dtype\": \"bool\", \"shape\": [1], \"names\": null}\n  }\n}\n";
  }

  const fs::path folder_;
  const Layout& layout_;
  std::vector<std::string> tasks_;
  std::size_t episodes_ = 0;
  std::string lines_, statistics_;
  LerobotResult result_;
};

}  // namespace

void ShowInstruments(const KinematicState& state, const SceneView& scene, render::RenderNode* node) {
  for (std::size_t k = 0; k < kMaxTools; ++k) {
    if (!TouchesTissue(scene.tools[k].kind)) continue;
    ToolSample sample = node->tools().tools[k];
    sample.p_WT = state.tools[k].tip_W.cast<float>();
    sample.q_WT = state.tools[k].q_WT.cast<float>();
    node->view().SetTool(static_cast<int>(k), sample);
    node->view().SetJaw(static_cast<int>(k), static_cast<float>(state.tools[k].jaw_rad));
  }
}

LerobotResult MakeLerobot(const LerobotSettings& settings, const std::function<void(double)>& progress) {
  RefuseFilled(settings.folder);
  std::optional<Layout> layout;
  for (const auto& session : settings.sessions) {
    const scene::SceneFile scene(session.scene);
    const Layout own(scene.view());
    if (own.tools.empty()) throw InputError(session.recording.string() + ": has no instruments");
    if (layout.value_or(own) != own) {
      throw InputError(session.recording.string() + ": has other instruments or another size of the picture than " +
                       settings.sessions.front().recording.string() + "; make a set for each");
    }
    layout = own;
  }
  for (const auto& session : settings.sessions) {
    const scene::SceneFile scene(session.scene);
    Check(session.recording, scene.view(), settings.until_s);
  }
  LerobotSet set(settings.folder, *layout);
  for (const auto& session : settings.sessions) {
    const scene::SceneFile scene(session.scene);
    set.Add(session, scene.view(), settings.until_s, progress);
  }
  return set.result();
}

}  // namespace fulcrum::replay
