// The compiled scene from the cart's host to another one: asked for in pieces, checked, kept by its hash.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <span>
#include <vector>

#include "services/transport/link/codec/packet.h"

namespace fulcrum::link {

/// A file as it is offered: its size and the Hash64 of its bytes. Throws InputError.
struct FileFacts {
  std::uint64_t size_B = 0, checksum = 0;
};
[[nodiscard]] FileFacts FactsOf(const std::filesystem::path& file);

/// Asks for what is still missing, a few pieces at a time, and again for what does not come.
class SceneFetch {
 public:
  explicit SceneFetch(const Offer& offer);

  /// The pieces to ask for now.
  [[nodiscard]] std::vector<SceneAsk> TakeAsks(std::int64_t now_ns);
  /// False when it is no piece of this scene.
  bool Take(const SceneAsk& where, std::span<const std::uint8_t> bytes);
  [[nodiscard]] bool complete() const { return have_count_ == have_.size(); }
  /// Of the bytes, when complete.
  [[nodiscard]] bool checksum_ok() const;
  [[nodiscard]] double progress() const { return static_cast<double>(have_count_) / static_cast<double>(have_.size()); }
  [[nodiscard]] std::span<const std::uint8_t> bytes() const { return bytes_; }
  [[nodiscard]] std::uint64_t scene_hash() const { return hash_; }

 private:
  std::uint64_t hash_, checksum_;
  std::vector<std::uint8_t> bytes_;
  std::vector<bool> have_;
  std::size_t have_count_ = 0, next_ = 0;
  std::map<std::size_t, std::int64_t> asked_ns_;  ///< By piece, when.
};

/// `<cache>/<hash>.fulcrum`.
[[nodiscard]] std::filesystem::path CachedScene(const std::filesystem::path& cache, std::uint64_t hash);
/// Whether the file is that scene, whole.
[[nodiscard]] bool IsScene(const std::filesystem::path& file, std::uint64_t hash);
/// Writes what was fetched into the cache; it is there whole or not at all. Throws InputError when it is not the scene
/// that was offered, or cannot be written.
void StoreScene(const SceneFetch& fetch, const std::filesystem::path& cache);

}  // namespace fulcrum::link
