#include "services/apps/scene_compiler/commands.h"

#include <charconv>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "services/base/core/error.h"
#include "services/base/core/exit_code.h"
#include "services/base/runtime/install_places.h"
#include "services/scene/anatomy/import_anatomy.h"
#include "services/scene/builder/quality.h"
#include "services/scene/compiler/compile.h"
#include "services/scene/compiler/new_scene.h"
#include "services/scene/compiler/preview.h"
#include "services/scene/compiler/scene_yaml.h"
#include "services/scene/format/scene_file.h"
#include "services/scene/format/validate.h"

namespace fulcrum::scene_compiler {
namespace {

namespace fs = std::filesystem;

void List(const fs::path& folder) {
  for (const scene::SceneSummary& summary : scene::ListScenes(folder)) {
    std::cout << summary.name << "\t" << summary.file.string() << "\t" << summary.description << "\n";
  }
}

/// Prints each stage with the time since the start.
class Stages {
 public:
  explicit Stages(bool quiet) : quiet_(quiet) {}

  void Say(const std::string& text) const {
    if (!quiet_) std::fprintf(stderr, "%6.2f s  %s\n", seconds(), text.c_str());
  }
  [[nodiscard]] scene::Progress progress() const {
    return [this](const std::string& text) { Say(text); };
  }
  [[nodiscard]] double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  bool quiet_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// Ends the program when its time is over: a mesher has no bound of its own.
class Limit {
 public:
  explicit Limit(double seconds)
      : watch_([this, seconds] {
          std::unique_lock lock(mutex_);
          if (!wake_.wait_for(lock, std::chrono::duration<double>(seconds), [&] { return done_; })) {
            std::fprintf(stderr,
                         "scene_compiler: gave up after %g s. A simpler surface, fewer `target_tets` or a larger "
                         "`min_edge_mm` take less; --limit SECONDS permits more\n",
                         seconds);
            std::_Exit(static_cast<int>(ExitCode::kBadUsage));
          }
        }) {}
  ~Limit() {
    {
      const std::lock_guard lock(mutex_);
      done_ = true;
    }
    wake_.notify_one();
    watch_.join();
  }
  Limit(const Limit&) = delete;
  Limit& operator=(const Limit&) = delete;

 private:
  std::mutex mutex_;
  std::condition_variable wake_;
  bool done_ = false;
  std::thread watch_;
};

void WriteFile(const fs::path& file, const std::string& bytes) {
  std::ofstream out(file, std::ios::binary);
  if (!out.write(bytes.data(), static_cast<std::streamsize>(bytes.size())).flush()) {
    throw InputError(file.string() + ": cannot be written");
  }
}

/// Runs `work`; what fails at a place of the geometry is drawn into `picture`.
template <class Work>
void ShowingFaults(const fs::path& picture, const Work& work) {
  try {
    work();
  } catch (const scene::SpotError& error) {
    std::string shown = "; the place is drawn in " + picture.string();
    try {
      WriteFile(picture, scene::PictureOf(error.spot()));
    } catch (const std::exception&) {  // The reason counts more than its picture.
      shown.clear();
    }
    throw InputError(error.what() + shown);
  }
}

constexpr int kFarthest_mm = 5000;

/// "1,-2.5,3".
std::optional<Vec3d> PointOf(const std::string& option, const std::string& text) {
  if (text.empty()) return std::nullopt;
  Vec3d point;
  const char* at = text.data();
  const char* const end = at + text.size();
  for (int k = 0; k < 3; ++k) {
    const auto [next, error] = std::from_chars(at, end, point[k]);
    if (error != std::errc() || (k < 2 ? next == end || *next != ',' : next != end)) {
      throw InputError(
          std::string(option).append(" '").append(text).append("'; valid: three numbers as in 10,-2.5,40"));
    }
    at = next + 1;
  }
  if (!point.allFinite() || point.cwiseAbs().maxCoeff() > kFarthest_mm) {
    throw InputError(option + " '" + text + "'; valid: numbers of at most " + std::to_string(kFarthest_mm));
  }
  return point;
}

void Preview(const SceneView& view, const std::string& file) {
  if (!file.empty()) WriteFile(file, scene::PreviewOf(view));
}

void Compile(const Arguments& arguments) {
  if (arguments.plain.size() != 1 || (arguments.out.empty() && arguments.preview.empty() && !arguments.check)) {
    throw InputError("SCENE.yaml or --out FILE is missing, or there is more than one SCENE.yaml; see --help");
  }
  const Stages stages(arguments.quiet);
  const Limit limit(arguments.limit_s);
  fs::path fault = !arguments.out.empty()       ? fs::path(arguments.out)
                   : !arguments.preview.empty() ? fs::path(arguments.preview)
                                                : fs::path(arguments.plain[0]).filename();
  fault.replace_extension(".fault.png");
  ShowingFaults(fault, [&] {
    const scene::CompiledScene compiled =
        scene::CompileScene(arguments.plain[0], arguments.data, stages.progress(), arguments.changes);
    Preview(compiled.data.View(), arguments.preview);
    if (const auto bad = scene::FindFault(compiled.data.View())) {
      throw InputError(arguments.plain[0] + ": section '" + bad->section + "': " + bad->reason);
    }
    if (arguments.out.empty()) {
      if (!arguments.quiet) std::cout << scene::Describe(compiled.data.View(), scene::Measure(compiled.data.View()));
      return;
    }
    stages.Say("writing " + arguments.out);
    scene::WriteSceneFile(compiled.data, compiled.effective_yaml, arguments.out);
    const scene::SceneFile written(arguments.out);  // Reads the file back with all checks that a node makes.
    if (!arguments.quiet) {
      stages.Say("done: scene '" + std::string(written.view().name) + "'");
      std::cout << scene::Describe(written.view(), scene::Measure(written.view()));
    }
  });
}

void CheckSceneName(const std::string& option, const std::string& name) {
  if (!scene::IsSceneName(name)) throw InputError(option + " '" + name + "'; valid: " + scene::kSceneNameRule);
}

void MakeNew(const Arguments& arguments) {
  if (arguments.from.empty() || !arguments.plain.empty()) {
    throw InputError("--new NAME needs --from MESH and nothing else; see --help");
  }
  const std::string& name = arguments.new_name;
  CheckSceneName("--new", name);
  const fs::path yaml = arguments.out.empty() ? name + ".yaml" : arguments.out;
  const fs::path picture = fs::path(yaml).replace_extension(".png");
  if (yaml.extension() != ".yaml") throw InputError("--out " + yaml.string() + "; valid: a name that ends in .yaml");
  for (const fs::path& file : {yaml, picture}) {
    if (fs::exists(file)) {
      throw InputError(file.string() + " is there already; remove it, or give another name or --out");
    }
  }
  const Stages stages(arguments.quiet);
  const Limit limit(arguments.limit_s);
  const fs::path folder = yaml.has_parent_path() ? yaml.parent_path() : ".";
  scene::NewScene wanted;
  wanted.name = name;
  wanted.mesh = arguments.from;
  wanted.mesh_text = fs::proximate(arguments.from, folder).string();
  wanted.unit = arguments.unit;
  wanted.at_mm = PointOf("--at", arguments.at_mm);
  wanted.facing = PointOf("--facing", arguments.facing);
  if (wanted.facing && !(wanted.facing->norm() > 0)) throw InputError("--facing must be a direction, not zero");
  ShowingFaults(fs::path(yaml).replace_extension(".fault.png"), [&] {
    WriteFile(yaml, scene::DescribeNewScene(wanted, stages.progress()));
    scene::CompiledScene compiled;
    try {
      compiled = scene::CompileScene(yaml, {}, stages.progress());
    } catch (...) {  // Else the corrected command would find it there already.
      fs::remove(yaml);
      throw;
    }
    stages.Say("wrote " + yaml.string());
    Preview(compiled.data.View(), picture);
    stages.Say("drew " + picture.string());
    if (!arguments.quiet) {
      std::cout << scene::Describe(compiled.data.View(), scene::Measure(compiled.data.View())) << "\nNext: look at "
                << picture.string() << ", then\n  fulcrum up " << yaml.string() << "\n  fulcrum up " << yaml.string()
                << " --window --hands mouse   to operate it yourself\n";
    }
  });
}

void ImportLabels(const Arguments& arguments) {
  const Stages stages(arguments.quiet);
  const Limit limit(arguments.limit_s);
  if (arguments.map.empty()) {
    std::cout << scene::SuggestLabelUses(arguments.anatomy);
    std::fprintf(stderr, "edit these lines, save them as labels.yaml and give --map labels.yaml --out DIR\n");
    return;
  }
  if (arguments.out.empty()) throw InputError("--anatomy needs --out DIR; see --help");
  const fs::path out = arguments.out;
  const std::string name = (out.has_filename() ? out : out.parent_path()).filename().string();
  CheckSceneName("--out", name);
  ShowingFaults(name + ".fault.png", [&] {
    (void)scene::ImportAnatomyFiles({name, arguments.anatomy, arguments.map, out}, stages.progress());
  });
  if (!arguments.quiet) {
    std::cout << "\nNext: look at " << (out / "report.html").string() << ", then\n  fulcrum up "
              << (out / (name + ".yaml")).string() << "\n";
  }
}

}  // namespace

void Run(const Arguments& arguments) {
  if (arguments.help) {
    std::cout << Usage();
  } else if (!arguments.info.empty()) {
    const scene::SceneFile file(arguments.info);
    std::cout << "scene '" << file.view().name << "'\n" << scene::Describe(file.view(), scene::Measure(file.view()));
    Preview(file.view(), arguments.preview);
  } else if (!arguments.anatomy.empty()) {
    ImportLabels(arguments);
  } else if (!arguments.new_name.empty()) {
    MakeNew(arguments);
  } else if (!arguments.source.empty()) {
    std::cout << scene::SceneFile(arguments.source).source_yaml();
  } else if (arguments.list) {
    List(arguments.plain.empty() ? runtime::ShareFolder() / "scenes" : fs::path(arguments.plain[0]));
  } else {
    Compile(arguments);
  }
}

}  // namespace fulcrum::scene_compiler
