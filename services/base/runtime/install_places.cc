#include "services/base/runtime/install_places.h"

namespace fulcrum::runtime {
namespace {

namespace fs = std::filesystem;

bool IsInstalled(const fs::path& programs) {
  return programs.filename() == "fulcrum" && programs.parent_path().filename() == "libexec";
}

fs::path PrefixOf(const fs::path& programs) { return programs.parent_path().parent_path(); }

}  // namespace

fs::path ProgramFolder() { return fs::read_symlink("/proc/self/exe").parent_path(); }

// In a build tree CMake makes share/fulcrum a link to deploy/.
fs::path ShareFolderOf(const fs::path& programs) {
  return (IsInstalled(programs) ? PrefixOf(programs) : programs.parent_path()) / "share" / "fulcrum";
}

fs::path MachineCartOf(const fs::path& programs) {
  if (!IsInstalled(programs)) return {};
  const fs::path prefix = PrefixOf(programs);
  // The configuration of /usr is in /etc.
  return (prefix.filename() == "usr" ? prefix.parent_path() : prefix) / "etc" / "fulcrum" / "cart.yaml";
}

fs::path ShareFolder() { return ShareFolderOf(ProgramFolder()); }
fs::path MachineCart() { return MachineCartOf(ProgramFolder()); }

}  // namespace fulcrum::runtime
