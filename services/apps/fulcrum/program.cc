#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "services/apps/fulcrum/commands.h"
#include "services/base/core/error.h"
#include "services/base/runtime/install_places.h"

namespace fulcrum::supervisor::cli {

std::span<const char* const> Programs() {
  static constexpr const char* kPrograms[] = {"handle_bridge", "haptics_node", "physics_node",   "thermal_node",
                                              "render_node",   "recorder",     "scene_compiler", "replayer"};
  return kPrograms;
}

bool IsProgram(const std::string& name) {
  return std::any_of(Programs().begin(), Programs().end(), [&](const char* program) { return name == program; });
}

void Become(const Words& words) {
  std::vector<char*> arguments;
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  const std::filesystem::path program = runtime::ProgramFolder() / words[0];
  ::execv(program.c_str(), arguments.data());
  throw InputError("cannot start " + program.string() + ": " + ::strerror(errno));
}

}  // namespace fulcrum::supervisor::cli
