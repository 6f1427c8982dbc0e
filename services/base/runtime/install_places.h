// Where the parts of an installation are, from the place of the running program: a build tree, /usr, and a copy of
// /usr anywhere else work alike.
#pragma once

#include <filesystem>

namespace fulcrum::runtime {

/// Of the running program, links resolved: the nodes and the compiler lie beside it.
[[nodiscard]] std::filesystem::path ProgramFolder();

/// Holds scenes/ and carts/: <prefix>/share/fulcrum, or deploy/ of the source tree.
[[nodiscard]] std::filesystem::path ShareFolder();

/// Cart of this machine, "/etc/fulcrum/cart.yaml"; empty in a build tree. The file may be missing.
[[nodiscard]] std::filesystem::path MachineCart();

/// The same rules for any folder of programs; "/usr/libexec/fulcrum" is an installed one.
[[nodiscard]] std::filesystem::path ShareFolderOf(const std::filesystem::path& programs);
[[nodiscard]] std::filesystem::path MachineCartOf(const std::filesystem::path& programs);

}  // namespace fulcrum::runtime
