// scene_profiler: profiles a compiled scene. A user calls it by `fulcrum profile SCENE`.
#include <cstdio>
#include <exception>

#include "physics_node/profile/profile_command.h"
#include "services/base/core/error.h"

int main(int argc, char** argv) {
  using namespace fulcrum;
  try {
    return static_cast<int>(physics::ProfileCommand({argv + 1, argv + argc}));
  } catch (const InputError& error) {
    std::fprintf(stderr, "profile: %s\n", error.what());
    return static_cast<int>(ExitCode::kBadUsage);
  } catch (const MismatchError& error) {
    std::fprintf(stderr, "profile: %s\n", error.what());
    return static_cast<int>(ExitCode::kMismatch);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "profile: %s\n", error.what());
    return static_cast<int>(ExitCode::kFailure);
  }
}
