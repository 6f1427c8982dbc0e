#include "services/session/supervisor/scene_cache.h"

#include <signal.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <thread>
#include <utility>

#include "services/base/config/strict_yaml.h"
#include "services/base/core/error.h"
#include "services/base/core/hash.h"
#include "services/base/runtime/child_process.h"
#include "services/base/runtime/realtime.h"

namespace fulcrum::supervisor {
namespace {

namespace fs = std::filesystem;

std::string ReadText(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

void AddFile(Hash64* hash, const fs::path& file) {
  std::error_code error;
  hash->Add(std::string_view(file.native()));
  hash->AddValue(static_cast<std::uint64_t>(fs::file_size(file, error)));
  hash->AddValue(static_cast<std::int64_t>(fs::last_write_time(file, error).time_since_epoch().count()));
}

/// What one description says.
struct DescriptionText {
  std::vector<std::string> values;  ///< Of all keys: some name a file or folder.
  std::string base;
};

/// Nothing of a text that is no description: scene_compiler says what is wrong with it.
DescriptionText TextsOf(const std::string& yaml) {
  try {
    config::StrictYaml description = config::StrictYaml::FromText(yaml, "scene");
    return {description.Values(), description.root().TextOr("base", "")};
  } catch (const InputError&) {
    return {};
  }
}

/// What a description and its bases name.
struct Named {
  std::set<fs::path> descriptions;  ///< The bases.
  std::set<fs::path> folders;       ///< Of the description and its bases.
  std::set<std::string> values;     ///< All that may name a file or folder, of all of them.
};

void AddDescription(const std::string& yaml, const fs::path& folder, const fs::path& library, Named* named) {
  named->folders.insert(folder);
  const DescriptionText said = TextsOf(yaml);
  named->values.insert(said.values.begin(), said.values.end());
  const auto add_base = [&](const fs::path& file) {
    std::error_code error;
    if (!fs::is_regular_file(file, error)) return;
    named->folders.insert(file.parent_path());
    const fs::path whole = fs::canonical(file, error);  // A shipped scene is a link in a build tree.
    if (named->descriptions.insert(whole).second) AddDescription(ReadText(file), whole.parent_path(), library, named);
  };
  if (said.base.empty()) return;
  add_base(folder / said.base);
  add_base(library / (said.base + ".yaml"));
}

/// Every value that names an existing file, in the folder of the scene or a base, in the data folder or in a folder
/// that a value names, counts as an input: a superfluous input costs a compilation, a missing one would run an outdated
/// anatomy.
std::set<fs::path> FilesOf(const Named& named, const fs::path& data) {
  std::error_code error;
  std::set<fs::path> places = named.folders, files = named.descriptions;
  if (!data.empty()) places.insert(data);
  for (const fs::path& folder : named.folders) {
    for (const std::string& value : named.values) {
      if (fs::is_directory(folder / value, error)) places.insert(folder / value);
    }
  }
  for (const fs::path& place : places) {
    for (const std::string& value : named.values) {
      const fs::path file = place / value;
      if (!fs::is_regular_file(file, error)) continue;
      files.insert(file);
      // A mesh of TetGen is read with the files beside it.
      for (const char* other : {".node", ".ele", ".face"}) {
        const fs::path companion = fs::path(file).replace_extension(other);
        if (fs::is_regular_file(companion, error)) files.insert(companion);
      }
    }
  }
  return files;
}

/// Every file of a folder of materials that the scene may name.
void AddMaterials(const fs::path& scenes, Hash64* hash) {
  std::set<fs::path> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(scenes / "materials", error)) files.insert(entry.path());
  for (const fs::path& file : files) AddFile(hash, file);
}

fs::path FindYaml(const SceneRequest& request) {
  std::error_code error;  // A name that is too long is no file either.
  if (fs::is_regular_file(request.name, error)) {
    return request.name;
  }
  if (request.name.find('/') != std::string::npos) {
    throw InputError("no scene \"" + request.name + "\": " + (error ? error.message() : "is no file") +
                     (request.for_services ? "; services do not see /home, /root and /tmp: put scenes and meshes where "
                                             "user fulcrum can read them, for example into /etc/fulcrum/scenes"
                                           : "; give a file, or the name of a shipped scene"));
  }
  fs::path shipped = request.library / (request.name + ".yaml");
  if (fs::is_regular_file(shipped, error)) {
    return fs::canonical(shipped);  // In a build tree a link: meshes are searched relative to the scene's own folder.
  }
  std::string known;
  for (const std::string& name : ShippedScenes(request.library)) {
    known += known.empty() ? name : ", " + name;
  }
  throw InputError("no scene \"" + request.name + "\": give a file, or one of " +
                   (known.empty() ? "those in " + request.library.string() : known));
}

void Compile(const SceneRequest& request, const fs::path& yaml, const fs::path& target) {
  fs::path log = target;
  log += ".log";
  fs::remove(log);
  std::vector<std::string> arguments{yaml.string(), "--out", target.string()};
  if (!request.data.empty()) {
    arguments.insert(arguments.end(), {"--data", request.data.string()});
  }
  for (const std::string& change : request.changes) {
    arguments.insert(arguments.end(), {"--set", change});
  }
  std::printf("compiling scene %s ...\n", yaml.filename().c_str());
  std::fflush(stdout);
  runtime::ChildProcess compiler = runtime::ChildProcess::Start(request.compiler, arguments, log);
  for (;;) {
    if (const auto end = compiler.Poll()) {
      if (end->signal != 0 || end->exit_code != 0) {
        throw InputError("scene " + yaml.string() + " does not compile: scene_compiler " + end->Describe() + "\n" +
                         ReadText(log));
      }
      return;
    }
    if (runtime::ShouldStop()) {
      throw InputError("stopped while compiling the scene");
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

/// Removes the versions of the scene of `newest` that were used longest ago, with what lies beside them: logs,
/// forecasts, and parts of compilations that were interrupted. Keeps `newest`, and counts a time in the future as the
/// oldest: the clock was wrong when that version was used.
void RemoveOldVersions(const fs::path& cache, const std::string& stem, const fs::path& newest) {
  constexpr std::size_t kDigits = 16;  // Of the hash; see ResolveScene.
  struct Version {
    fs::file_time_type used = fs::file_time_type::min();
    std::vector<fs::path> files;
  };
  const auto now = fs::file_time_type::clock::now();
  std::map<std::string, Version> by_key;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(cache, error)) {
    const std::string name = entry.path().filename();
    const std::size_t end = stem.size() + 1 + kDigits;
    if (!name.starts_with(stem + "-") || name.find('.', stem.size()) != end) continue;
    Version& version = by_key[name.substr(0, end)];
    const auto used = entry.last_write_time(error);
    if (used <= now) version.used = std::max(version.used, used);
    version.files.push_back(entry.path());
  }
  by_key[newest.stem()].used = fs::file_time_type::max();
  std::vector<Version> versions;
  for (auto& [key, version] : by_key) versions.push_back(std::move(version));
  std::sort(versions.begin(), versions.end(), [](const Version& a, const Version& b) { return a.used > b.used; });
  for (std::size_t i = kKeptVersions; i < versions.size(); ++i) {
    for (const fs::path& file : versions[i].files) fs::remove(file, error);
  }
}

}  // namespace

std::vector<std::string> ShippedScenes(const fs::path& library) {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(library, error)) {
    if (entry.path().extension() == ".yaml") {
      names.push_back(entry.path().stem());
    }
  }
  std::sort(names.begin(), names.end());
  return names;
}

fs::path ResolveScene(const SceneRequest& request) {
  fs::path source = FindYaml(request);
  if (source.extension() != ".yaml") {
    if (!request.changes.empty()) {
      throw InputError("--set: " + source.string() + " is compiled already; give its description (.yaml)");
    }
    return source;
  }
  const std::string yaml = ReadText(source);
  Hash64 hash;
  hash.Add(std::string_view(yaml));
  hash.Add(std::string_view(request.data.native()));
  for (const std::string& change : request.changes) {
    hash.Add(std::string_view(change + "\n"));
  }
  AddFile(&hash, request.compiler);
  Named named;
  AddDescription(yaml, source.parent_path(), request.library, &named);
  for (const fs::path& file : FilesOf(named, request.data)) AddFile(&hash, file);
  // Materials are looked for beside the scene and its bases.
  named.folders.insert(request.library.parent_path());
  for (const fs::path& folder : named.folders) AddMaterials(folder, &hash);
  std::array<char, 24> key{};
  std::snprintf(key.data(), key.size(), "-%016llx", static_cast<unsigned long long>(hash.value()));
  fs::path target = request.cache / (source.stem().string() + key.data() + ".fulcrum");
  std::error_code error;
  if (fs::is_regular_file(target)) {
    // The time of its last use.
    fs::last_write_time(target, fs::file_time_type::clock::now(), error);
  } else {
    fs::create_directories(request.cache, error);
    if (error) {
      throw InputError("cannot make " + request.cache.string() + ": " + error.message());
    }
    Compile(request, source, target);
    RemoveOldVersions(request.cache, source.stem(), target);
  }
  return target;
}

}  // namespace fulcrum::supervisor
