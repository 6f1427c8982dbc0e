#include "services/transport/link/scene_transfer.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <fstream>
#include <string>
#include <system_error>
#include <utility>

#include "services/base/core/error.h"
#include "services/base/core/hash.h"
#include "services/scene/format/scene_file.h"
#include "services/transport/bus/gate.h"

namespace fulcrum::link {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kWindow = 8;                    ///< Pieces requested at a time.
constexpr std::int64_t kPatience_ns = 1'000'000'000;  ///< After this the request or its answer counts as lost.

}  // namespace

FileFacts FactsOf(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  Hash64 hash;
  FileFacts facts;
  // A multiple of eight, so that the hash does not depend on the boundaries of the pieces.
  std::vector<char> piece(kSceneChunk_B);
  while (stream.read(piece.data(), static_cast<std::streamsize>(piece.size())) || stream.gcount() > 0) {
    hash.Add(std::as_bytes(std::span(piece).first(static_cast<std::size_t>(stream.gcount()))));
    facts.size_B += static_cast<std::uint64_t>(stream.gcount());
  }
  if (facts.size_B == 0 || facts.size_B > kLargestScene_B) {
    throw InputError(file.string() + ": " + std::to_string(facts.size_B) +
                     " bytes; a scene that can go to another host has 1 to " + std::to_string(kLargestScene_B));
  }
  facts.checksum = hash.value();
  return facts;
}

SceneFetch::SceneFetch(const Offer& offer)
    : hash_(offer.scene_hash),
      checksum_(offer.scene_checksum),
      bytes_(offer.scene_B),
      have_((offer.scene_B + kSceneChunk_B - 1) / kSceneChunk_B, false) {}

std::vector<SceneAsk> SceneFetch::TakeAsks(std::int64_t now_ns) {
  std::vector<SceneAsk> asks;
  const auto ask = [&](std::size_t piece) {
    asked_ns_[piece] = now_ns;
    asks.push_back({hash_, piece * kSceneChunk_B});
  };
  for (const auto& [piece, asked_ns] : asked_ns_) {
    if (now_ns - asked_ns > kPatience_ns) ask(piece);
  }
  while (asked_ns_.size() < kWindow && next_ < have_.size()) ask(next_++);
  return asks;
}

bool SceneFetch::Take(const SceneAsk& where, std::span<const std::uint8_t> bytes) {
  const std::size_t piece = where.offset / kSceneChunk_B;
  if (where.scene_hash != hash_ || piece >= have_.size() ||
      bytes.size() != std::min<std::uint64_t>(kSceneChunk_B, bytes_.size() - where.offset)) {
    return false;
  }
  asked_ns_.erase(piece);
  if (have_[piece]) return true;
  std::copy(bytes.begin(), bytes.end(), bytes_.begin() + static_cast<std::ptrdiff_t>(where.offset));
  have_[piece] = true;
  ++have_count_;
  return true;
}

bool SceneFetch::checksum_ok() const {
  Hash64 hash;
  for (std::size_t at = 0; at < bytes_.size(); at += kSceneChunk_B) {
    hash.Add(std::as_bytes(std::span(bytes_).subspan(at, std::min(kSceneChunk_B, bytes_.size() - at))));
  }
  return complete() && hash.value() == checksum_;
}

fs::path CachedScene(const fs::path& cache, std::uint64_t hash) {
  std::array<char, 17> name{};
  std::snprintf(name.data(), name.size(), "%016llx", static_cast<unsigned long long>(hash));
  return cache / (std::string(name.data()) + ".fulcrum");
}

bool IsScene(const fs::path& file, std::uint64_t hash) {
  if (!fs::exists(file)) return false;
  try {
    return scene::SceneFile(file).view().hash == hash;
  } catch (const std::exception&) {
    return false;  // Incomplete or of another version: fetched again.
  }
}

void MakeRoomForScene(const fs::path& cache) {
  constexpr std::size_t kDigits = 16;
  const auto now = fs::file_time_type::clock::now();
  std::vector<std::pair<fs::file_time_type, fs::path>> scenes;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(cache, ignored)) {
    const std::string name = entry.path().filename();
    if (name.find_first_not_of("0123456789abcdef") != kDigits || !name.ends_with(".fulcrum")) continue;
    // A time in the future counts as the oldest: the clock was wrong when that scene was stored.
    const auto stored = entry.last_write_time(ignored);
    scenes.emplace_back(stored <= now ? stored : fs::file_time_type::min(), entry.path());
  }
  std::ranges::sort(scenes);
  for (std::size_t i = 0; i + kMostCachedScenes <= scenes.size(); ++i) fs::remove(scenes[i].second, ignored);
}

void CheckReceivedScene(const SceneView& scene, const Offer& offer) {
  const std::string name = scene.name;
  if (name == offer.scene_name && IsPlainName(name, bus::kMaxSceneName)) return;
  throw InputError("the received scene does not have the offered name \"" + offer.scene_name +
                   "\"; it is not used, because the name of a scene becomes a part of paths");
}

void StoreScene(const SceneFetch& fetch, const fs::path& cache) {
  if (!fetch.checksum_ok()) throw InputError("the received scene is damaged; it is fetched again");
  const fs::path file = CachedScene(cache, fetch.scene_hash());
  const fs::path part = file.string() + "." + std::to_string(::getpid()) + ".part";
  std::error_code error;
  fs::create_directories(cache, error);
  std::ofstream stream(part, std::ios::binary);
  stream.write(reinterpret_cast<const char*>(fetch.bytes().data()), static_cast<std::streamsize>(fetch.bytes().size()));
  stream.close();
  if (!stream) {
    fs::remove(part, error);
    throw InputError("cannot write " + part.string() +
                     "; is the disk full, or does the folder belong to another user?");
  }
  if (!IsScene(part, fetch.scene_hash())) {
    fs::remove(part, error);
    throw MismatchError("this build cannot read the scene of the other host; use the same release on both hosts");
  }
  MakeRoomForScene(cache);
  fs::rename(part, file);
}

}  // namespace fulcrum::link
