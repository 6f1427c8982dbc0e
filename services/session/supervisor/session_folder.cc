#include "services/session/supervisor/session_folder.h"

#include <fcntl.h>
#include <unistd.h>

#include <fstream>
#include <sstream>
#include <thread>

#include "services/base/core/error.h"
#include "services/base/runtime/private_file.h"

namespace fulcrum::supervisor {
namespace {

namespace fs = std::filesystem;

std::string UtcNow(const char* format) {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  ::gmtime_r(&now, &utc);
  char text[64];
  return {text, std::strftime(text, sizeof(text), format, &utc)};
}

std::string Indent(const std::string& text) {
  std::istringstream stream(text);
  std::string indented, line;
  while (std::getline(stream, line)) {
    indented += line.empty() ? "\n" : "  " + line + "\n";
  }
  return indented;
}

/// A name that does not exist yet, since two sessions may start within one second.
fs::path FreshFolder(const fs::path& out, const std::string& name) {
  for (int attempt = 1;; ++attempt) {
    fs::path folder = out / (attempt == 1 ? name : name + "-" + std::to_string(attempt));
    if (runtime::MakePrivateFolder(folder)) {
      return folder;
    }
  }
}

}  // namespace

void WriteFile(const fs::path& file, const std::string& text) {
  // Made with its mode, so that no other user can open it in between; an existing file keeps its own.
  if (const int fd = ::open(file.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600); fd >= 0) ::close(fd);
  std::ofstream stream(file, std::ios::binary);
  stream << text;
  stream.close();
  if (!stream) {
    throw InputError("cannot write " + file.string() + ": check free disk space and the permissions of the folder");
  }
}

void PointTo(const fs::path& link, const fs::path& folder) {
  fs::path next = link;
  next += ".next";
  std::error_code error;
  fs::remove(next, error);
  fs::create_symlink(folder, next, error);
  if (!error) fs::rename(next, link, error);
  if (error) throw InputError("cannot make " + link.string() + ": " + error.message());
}

SessionFolder MakeSessionFolder(const fs::path& out, const fs::path& scene_file, const scene::SceneFile& scene,
                                const config::CartConfig& cart, const std::string& run_yaml) {
  SessionFolder folder;
  try {
    fs::create_directories(out);
    folder.path = fs::absolute(FreshFolder(fs::canonical(out), UtcNow("%Y%m%d-%H%M%S-") + scene.view().name));
    folder.session_id = folder.path.filename();
    folder.started_utc = UtcNow("%Y-%m-%d %H:%M:%S UTC");
    folder.logs = folder.path / "logs";
    folder.frames = folder.path / "frames";
    fs::create_directory(folder.logs);
    fs::create_directory(folder.frames);
    // The session has its own name for the scene file: a node that is restarted must map the same file, even after the
    // scene was compiled again.
    folder.scene = folder.path / "scene.fulcrum";
    std::error_code no_link;
    fs::create_hard_link(scene_file, folder.scene, no_link);
    if (no_link) {
      fs::copy_file(scene_file, folder.scene);
    }
    const fs::path latest = folder.path.parent_path() / "latest";
    std::error_code ignored;  // The link is a convenience, and some file systems have no links.
    if (fs::is_symlink(latest) || !fs::exists(latest)) {
      fs::remove(latest, ignored);
      fs::create_symlink(folder.session_id, latest, ignored);
    }
  } catch (const fs::filesystem_error& error) {
    throw InputError(std::string("session folder: ") + error.what());
  }
  folder.cart = folder.path / "cart.yaml";
  WriteFile(folder.cart, config::CartToYaml(cart));
  folder.configuration =
      "run:\n" + run_yaml + "cart:\n" + Indent(config::CartToYaml(cart)) + "scene:\n" + Indent(scene.source_yaml());
  WriteFile(folder.path / "configuration.yaml", folder.configuration);
  return folder;
}

void RemoveCheckpoints(const SessionFolder& folder) {
  for (const auto& entry : fs::directory_iterator(folder.path)) {
    std::error_code ignored;
    if (entry.path().extension() == ".checkpoint") fs::remove(entry.path(), ignored);
  }
}

std::string DescribeMachine() {
  std::ifstream cpuinfo("/proc/cpuinfo");
  std::string line, model = "unknown CPU";
  while (std::getline(cpuinfo, line)) {
    if (line.starts_with("model name")) {
      model = line.substr(line.find(':') + 2);
      break;
    }
  }
  return model + ", " + std::to_string(std::thread::hardware_concurrency()) + " threads";
}

}  // namespace fulcrum::supervisor
