// The files of a key folder: private, and complete or absent. Internal to services/transport/keys.
#pragma once

#include <filesystem>
#include <string>

namespace fulcrum::keys {

inline constexpr const char* kRemedy = "; make new ones with fulcrum keys init";

/// Content of a file. Throws InputError with the reason and what to do.
[[nodiscard]] std::string Read(const std::filesystem::path& file);
/// Throws InputError if users other than the owner can read or change the file or folder.
void CheckPrivate(const std::filesystem::path& path, bool folder);
/// Makes a file with mode 0600. Where root makes it, it belongs to the owner of its folder, who runs the cart. Throws
/// InputError if it exists.
void Write(const std::filesystem::path& file, const std::string& text);
/// Makes or replaces a file as Write does. A process that reads it meanwhile reads the old or the new one, whole.
void Replace(const std::filesystem::path& file, const std::string& text);
/// As Replace, but the file belongs to the user of this process.
void ReplaceOwn(const std::filesystem::path& file, const std::string& text);
[[nodiscard]] bool HasFile(const std::filesystem::path& file);
/// Makes a folder with mode 0700. Throws InputError if it exists or its parent does not.
void MakePrivateFolder(const std::filesystem::path& folder);

}  // namespace fulcrum::keys
