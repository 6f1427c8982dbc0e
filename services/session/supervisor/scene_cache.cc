#include "services/session/supervisor/scene_cache.h"

#include <signal.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <set>
#include <thread>

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

/// Words of the YAML that may name a file or folder.
std::vector<std::string> PathWords(const std::string& yaml) {
  constexpr std::string_view kSeparators = " \t\r\n\"',[]{}";
  constexpr std::size_t kLongestName = 255;
  std::vector<std::string> words;
  for (std::size_t begin = 0; (begin = yaml.find_first_not_of(kSeparators, begin)) != std::string::npos;) {
    const std::size_t end = std::min(yaml.find_first_of(kSeparators, begin), yaml.size());
    const std::string word = yaml.substr(begin, end - begin);
    begin = end;
    if (word.find_first_of("./") != std::string::npos && word.size() <= kLongestName) {
      words.push_back(word);
    }
  }
  // Quoted names may hold separators.
  for (std::size_t begin = 0; (begin = yaml.find_first_of("\"'", begin)) != std::string::npos;) {
    const std::size_t end = yaml.find_first_of(std::string{yaml[begin], '\n'}, begin + 1);
    if (end != std::string::npos && yaml[end] == yaml[begin] && end - begin - 1 <= kLongestName) {
      words.push_back(yaml.substr(begin + 1, end - begin - 1));
    }
    begin = std::min(end, yaml.size() - 1) + 1;
  }
  return words;
}

/// Every word that names an existing file, in the scene's folder, the data folder or a folder that the YAML names,
/// counts as an input: a superfluous input costs a compilation, a missing one would run an outdated anatomy.
void AddFilesNamedIn(const std::string& yaml, const fs::path& folder, const SceneRequest& request,
                     std::set<fs::path>* seen, std::set<fs::path>* folders, Hash64* hash) {
  folders->insert(folder);
  const fs::path& data = request.data;
  const std::vector<std::string> words = PathWords(yaml);
  std::vector<fs::path> bases{folder};
  if (!data.empty()) {
    bases.push_back(data);
  }
  std::error_code error;
  for (const std::string& word : words) {
    if (fs::is_directory(folder / word, error)) {
      bases.push_back(folder / word);
    }
  }
  // The name of a shipped scene as base.
  constexpr std::string_view kBase = "\nbase:";
  if (const std::size_t at = ("\n" + yaml).find(kBase); at != std::string::npos) {
    const std::size_t begin = yaml.find_first_not_of(" \t\"'", at + kBase.size() - 1);
    const std::string name =
        begin == std::string::npos ? "" : yaml.substr(begin, yaml.find_first_of(" \t\r\n\"'#", begin) - begin);
    const fs::path named = request.library / (name + ".yaml");
    if (fs::is_regular_file(folder / name, error)) {
      AddFile(hash, folder / name);
      folders->insert((folder / name).parent_path());
    }
    if (fs::is_regular_file(named, error) && seen->insert(fs::canonical(named, error)).second) {
      AddFile(hash, fs::canonical(named, error));
      AddFilesNamedIn(ReadText(named), fs::canonical(named, error).parent_path(), request, seen, folders, hash);
    }
  }
  for (const std::string& word : words) {
    for (const fs::path& base : bases) {
      if (fs::is_regular_file(base / word, error)) {
        AddFile(hash, base / word);
        // A base scene may name further files.
        if (fs::path(word).extension() == ".yaml" && seen->insert(fs::canonical(base / word, error)).second) {
          AddFilesNamedIn(ReadText(base / word), (base / word).parent_path(), request, seen, folders, hash);
        }
      }
    }
  }
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
  fs::path shipped = request.library / (request.name + ".yaml");
  if (request.name.find('/') == std::string::npos && fs::is_regular_file(shipped, error)) {
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
  // Materials are looked for beside the scene and its bases.
  std::set<fs::path> seen, folders{request.library.parent_path()};
  AddFilesNamedIn(yaml, source.parent_path(), request, &seen, &folders, &hash);
  for (const fs::path& folder : folders) AddMaterials(folder, &hash);
  std::array<char, 24> key{};
  std::snprintf(key.data(), key.size(), "-%016llx", static_cast<unsigned long long>(hash.value()));
  fs::path target = request.cache / (source.stem().string() + key.data() + ".fulcrum");
  if (!fs::is_regular_file(target)) {
    std::error_code error;
    fs::create_directories(request.cache, error);
    if (error) {
      throw InputError("cannot make " + request.cache.string() + ": " + error.message());
    }
    Compile(request, source, target);
  }
  return target;
}

}  // namespace fulcrum::supervisor
