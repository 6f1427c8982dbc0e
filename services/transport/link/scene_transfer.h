// Transfer of the compiled scene from the cart's host to another one: requested in pieces, checked, cached by its hash.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <span>
#include <vector>

#include "services/base/core/scene_view.h"
#include "services/transport/link/codec/packet.h"

namespace fulcrum::link {

/// Size of an offered file and the Hash64 of its bytes. Throws InputError.
struct FileFacts {
  std::uint64_t size_B = 0, checksum = 0;
};
[[nodiscard]] FileFacts FactsOf(const std::filesystem::path& file);

/// Requests the missing pieces, a few at a time, and repeats requests that are not answered.
class SceneFetch {
 public:
  explicit SceneFetch(const Offer& offer);

  /// Pieces to request now.
  [[nodiscard]] std::vector<SceneAsk> TakeAsks(std::int64_t now_ns);
  /// Stores a piece; false if it is no piece of this scene.
  bool Take(const SceneAsk& where, std::span<const std::uint8_t> bytes);
  [[nodiscard]] bool complete() const { return have_count_ == have_.size(); }
  /// Whether the checksum of the bytes is correct, once the file is complete.
  [[nodiscard]] bool checksum_ok() const;
  [[nodiscard]] double progress() const { return static_cast<double>(have_count_) / static_cast<double>(have_.size()); }
  [[nodiscard]] std::span<const std::uint8_t> bytes() const { return bytes_; }
  [[nodiscard]] std::uint64_t scene_hash() const { return hash_; }

 private:
  std::uint64_t hash_, checksum_;
  std::vector<std::uint8_t> bytes_;
  std::vector<bool> have_;
  std::size_t have_count_ = 0, next_ = 0;
  std::map<std::size_t, std::int64_t> asked_ns_;  ///< Time of the last request, by piece.
};

/// Path of a scene in the cache: `<cache>/<hash>.fulcrum`.
[[nodiscard]] std::filesystem::path CachedScene(const std::filesystem::path& cache, std::uint64_t hash);
/// Whether the file is complete and is the scene with this hash.
[[nodiscard]] bool IsScene(const std::filesystem::path& file, std::uint64_t hash);
/// Scenes that the cache keeps: the newest. With kLargestScene_B this bounds the disk space.
inline constexpr std::size_t kMostCachedScenes = 8;
/// Throws InputError unless the received scene has the offered name, which is a plain name: the name becomes a part of
/// paths.
void CheckReceivedScene(const SceneView& scene, const Offer& offer);
/// Removes the oldest received scenes, so that the cache keeps kMostCachedScenes after one more is added.
void MakeRoomForScene(const std::filesystem::path& cache);
/// Makes room in the cache and writes the fetched scene into it, atomically. Throws
/// InputError if it is not the offered scene or cannot be written.
void StoreScene(const SceneFetch& fetch, const std::filesystem::path& cache);

}  // namespace fulcrum::link
