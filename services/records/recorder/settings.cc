#include "services/records/recorder/settings.h"

#include <cstdlib>
#include <filesystem>
#include <map>
#include <string>

#include "services/base/core/error.h"
#include "services/nodes/app/version.h"
#include "services/records/recording/free_name.h"
#include "services/transport/bus/hex.h"
#include "services/transport/bus/schema.h"

namespace fulcrum::recorder {
namespace {

double ParseKeep(const std::string& text) {
  char* end = nullptr;
  const double keep_s = std::strtod(text.c_str(), &end);
  constexpr double kMostKept_s = 3600;
  if (*end != '\0' || !(keep_s >= 0 && keep_s <= kMostKept_s)) {
    throw InputError("--keep " + text + ": must be 0 to 3600 seconds");
  }
  return keep_s;
}

std::map<std::string, recording::TextMap> MetadataOf(app::NodeApp* app) {
  const app::NodeOptions& options = app->options();
  return {
      {"session",
       {{"id", options.session.filename()},
        {"scene", app->scene().name},
        {"scene_file", std::filesystem::absolute(options.scene)},
        {"scene_hash", bus::Hex(app->scene().hash)}}},
      {"versions", {{"fulcrum", app::kVersion}, {"schema_hash", bus::Hex(bus::SchemaHash())}}},
      {"cart", {{"yaml", config::CartToYaml(app->cart())}}},
  };
}

}  // namespace

RecorderSettings TakeSettings(app::NodeApp* app) {
  app::NodeOptions& options = app->options();
  RecorderSettings settings;
  if (const std::filesystem::path file = options.TakeValue("--file", ""); !file.empty()) {
    settings.file = recording::FreeName(file);
  }
  settings.keep_s = ParseKeep(options.TakeValue("--keep", "0"));
  if (settings.file.empty() && settings.keep_s == 0) {
    throw InputError("nothing to do: give --file FILE, --keep SECONDS or both");
  }
  settings.keep_free_B = static_cast<std::uint64_t>(1e6 * app->cart().recorder.keep_free_MB);
  settings.library = std::string("fulcrum ") + app::kVersion;
  settings.metadata = MetadataOf(app);
  return settings;
}

}  // namespace fulcrum::recorder
