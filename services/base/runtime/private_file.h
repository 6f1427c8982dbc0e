// Files and folders that only their owner can read: secrets, and what is known of a trainee.
#pragma once

#include <filesystem>
#include <string>

namespace fulcrum::runtime {

/// Content of a private file. Throws InputError that begins with `what` and the file when it is missing, longer than
/// `limit` bytes, no plain file, of another user, or readable by other users.
[[nodiscard]] std::string ReadPrivateFile(const std::filesystem::path& file, std::size_t limit,
                                          const std::string& what);
/// Replaces the file by one of mode 0600, as a whole or not at all, and makes its folder (0700) if it is missing.
/// Throws InputError.
void WritePrivateFile(const std::filesystem::path& file, const std::string& text, const std::string& what);
/// Makes the folder with mode 0700 and those above it. @return false when it exists. Throws InputError.
bool MakePrivateFolder(const std::filesystem::path& folder);
/// Takes the rights of other users from an existing file. @return true when they had any. Throws InputError when the
/// file belongs to another user, or is a symbolic link to one.
bool NarrowToOwner(const std::filesystem::path& file);

}  // namespace fulcrum::runtime
