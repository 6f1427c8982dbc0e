// Folders of an installation, relative to the running program: valid for a build tree, /usr, and a copy of /usr
// elsewhere.
#pragma once

#include <filesystem>

namespace fulcrum::runtime {

/// Folder of the running program, links resolved; it also contains the nodes and the compiler.
[[nodiscard]] std::filesystem::path ProgramFolder();

/// Folder that contains scenes/ and carts/: <prefix>/share/fulcrum, or deploy/ of the source tree.
[[nodiscard]] std::filesystem::path ShareFolder();

/// Cart file of this machine, "/etc/fulcrum/cart.yaml"; empty in a build tree. The file may be missing.
[[nodiscard]] std::filesystem::path MachineCart();

/// Share folder for any folder of programs; "/usr/libexec/fulcrum" is an installed one.
[[nodiscard]] std::filesystem::path ShareFolderOf(const std::filesystem::path& programs);
[[nodiscard]] std::filesystem::path MachineCartOf(const std::filesystem::path& programs);

}  // namespace fulcrum::runtime
