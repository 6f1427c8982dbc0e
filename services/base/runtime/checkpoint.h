// Checkpoint file: state that a node cannot recompute after a kill. It has two slots in a memory-mapped file; each
// commit fills the older one and then seals it with sequence and checksum, so that a kill at any moment leaves one
// complete slot.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace fulcrum::runtime {

class CheckpointFile {
 public:
  /// Opens or creates the file. A file of another scene, layout version or capacity is replaced without an error.
  /// Throws InputError if the file cannot be created.
  CheckpointFile(const std::filesystem::path& file, std::uint64_t scene_hash, std::uint32_t layout_version,
                 std::size_t capacity_bytes);
  ~CheckpointFile();
  CheckpointFile(const CheckpointFile&) = delete;
  CheckpointFile& operator=(const CheckpointFile&) = delete;

  /// Newest complete slot of a file that another process may have open, running or stopped. Empty if there is none, or
  /// if the file is of another scene, layout or capacity.
  [[nodiscard]] static std::optional<std::vector<std::byte>> Peek(const std::filesystem::path& file,
                                                                  std::uint64_t scene_hash,
                                                                  std::uint32_t layout_version,
                                                                  std::size_t capacity_bytes);

  struct Loaded {
    std::uint64_t sequence;
    std::span<const std::byte> payload;  ///< Valid until the next Begin().
  };
  /// Newest complete slot, or nothing.
  [[nodiscard]] std::optional<Loaded> Latest() const;
  /// The complete slot before the newest, or nothing.
  [[nodiscard]] std::optional<Loaded> Previous() const;
  /// Empty, or one line for the log: which content of the file could not be used.
  [[nodiscard]] const std::string& complaint() const;

  /// The slot to fill, `capacity_bytes` long.
  [[nodiscard]] std::span<std::byte> Begin();
  /// Seals the first `bytes` bytes of that slot.
  void Commit(std::size_t bytes);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Whether a process has this checkpoint file open.
[[nodiscard]] bool IsInUse(const std::filesystem::path& file);

/// Sequence of the newest sealed slot of a file that another process may be writing; 0 if there is none. Payloads are
/// not read: the result shows the progress of that process, not that its checkpoint is complete.
[[nodiscard]] std::uint64_t NewestSequence(const std::filesystem::path& file);

}  // namespace fulcrum::runtime
