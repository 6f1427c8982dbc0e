// A compiled scene: refused, or mapped to a view that passes the validation again. An input that begins as such a file
// is used as one; any other is a list of patches over a valid one (Patch). Sizes and checksums are corrected before the
// file is opened; otherwise checks beyond them would not be reached.
#include <cstring>

#include "services/base/core/error.h"
#include "services/base/core/hash.h"
#include "services/scene/builder/build.h"
#include "services/scene/format/scene_file.h"
#include "services/scene/format/sections.h"
#include "services/scene/format/validate.h"
#include "tests/fuzz/scene/tiny_scene.h"
#include "tests/fuzz/target.h"

namespace fulcrum::fuzz {
namespace {

constexpr std::string_view kMagic = "FULCSCN\n";
// Places in the header and in an entry of the table (services/scene/format/scene_file.cc).
constexpr std::size_t kCountAt = 12, kFileBytesAt = 16, kContentHashAt = 24, kTableChecksumAt = 32, kHeader_B = 40;
constexpr std::size_t kEntry_B = 56, kName_B = 24, kOffsetAt = 24, kBytesAt = 32, kChecksumAt = 48;

std::uint64_t NumberAt(const Bytes& file, std::size_t at) {
  std::uint64_t number = 0;
  std::memcpy(&number, file.data() + at, sizeof number);
  return number;
}
void PutAt(Bytes* file, std::size_t at, std::uint64_t number) {
  std::memcpy(file->data() + at, &number, sizeof number);
}

struct Section {
  std::size_t entry = 0;
  std::span<const std::byte> bytes;
};

/// The sections that lie within the file, in file order.
std::vector<Section> SectionsOf(const Bytes& file) {
  std::vector<Section> sections;
  std::uint32_t count = 0;
  std::memcpy(&count, file.data() + kCountAt, sizeof count);
  const std::size_t fitting = std::min<std::size_t>(count, (file.size() - kHeader_B) / kEntry_B);
  for (std::size_t i = 0; i < fitting; ++i) {
    const std::size_t entry = kHeader_B + i * kEntry_B;
    const std::uint64_t offset = NumberAt(file, entry + kOffsetAt), bytes = NumberAt(file, entry + kBytesAt);
    if (offset > file.size() || bytes > file.size() - offset) continue;
    sections.push_back({entry, std::as_bytes(std::span(file)).subspan(offset, bytes)});
  }
  return sections;
}

void Reseal(Bytes* file) {
  if (file->size() < kHeader_B) return;
  PutAt(file, kFileBytesAt, file->size());
  const std::vector<Section> sections = SectionsOf(*file);
  const auto named = [&](std::string_view name) {
    for (const Section& section : sections) {
      const char* const text = reinterpret_cast<const char*>(file->data() + section.entry);
      if (std::string_view(text, ::strnlen(text, kName_B)) == name) return section.bytes;
    }
    return std::span<const std::byte>();
  };
  // As ContentHash, over the bytes.
  Hash64 content;
  content.AddValue(scene::kSceneContentVersion);
  content.Add(named("scene"));
  SceneView view;
  scene::ForEachUsualSection(view, [&](const char* name, auto&) { content.Add(named(name)); });
  scene::ForEachBodySection(view, [&]<class T>(const char* name, std::span<const T>&) {
    const std::span<const std::byte> bytes = named(name);
    if (bytes.empty()) return;
    if constexpr (std::is_same_v<T, Attachment> || std::is_same_v<T, SheetPart>) {
      std::vector<T> elements(bytes.size() / sizeof(T));
      std::memcpy(static_cast<void*>(elements.data()), bytes.data(), elements.size() * sizeof(T));
      scene::AddToHash(elements, &content);
    } else {
      content.Add(bytes);
    }
  });
  if (!named("stereo").empty()) content.Add(named("stereo"));
  for (const Section& section : sections) {
    Hash64 hash;
    hash.Add(section.bytes);
    PutAt(file, section.entry + kChecksumAt, hash.value());
  }
  PutAt(file, kContentHashAt, content.value());
  std::uint32_t count = 0;
  std::memcpy(&count, file->data() + kCountAt, sizeof count);
  const std::size_t table_B = std::min(count * kEntry_B, file->size() - kHeader_B);
  Hash64 table;
  const auto bytes = std::as_bytes(std::span(*file));
  table.Add(bytes.first(kTableChecksumAt));
  table.Add(bytes.subspan(kHeader_B, table_B));
  PutAt(file, kTableChecksumAt, table.value());
}

class CompiledScene final : public Target {
 public:
  Outcome Offer(Input input) override {
    Bytes file(input.begin(), input.end());
    if (!TextOf(input).starts_with(kMagic)) {
      file = good_;
      Patch(input, &file);
    }
    Reseal(&file);
    memory_.Write(file);
    try {
      const scene::SceneFile read(memory_.path());
      const auto fault = scene::FindFault(read.view());
      Promise(!fault, "a scene with a fault was accepted");
      Promise(scene::ContentHash(read.view()) == read.view().hash, "a scene with another hash was accepted");
      (void)read.source_yaml();
      return Outcome::kAccepted;
    } catch (const InputError&) {
    } catch (const MismatchError&) {
    }
    return Outcome::kRefused;
  }
  std::vector<Seed> Seeds() override { return {{"unchanged", {0}}, {"tiny", good_}}; }

 private:
  static Bytes Compile(const scene::SceneSettings& settings) {
    const ScratchFolder folder;
    (void)scene::WriteSceneFile(scene::BuildProcedural(settings), "name: tiny\n", folder.path() / "scene");
    return ReadFile(folder.path() / "scene");
  }

  const Bytes good_ = Compile(TinyScene());
  MemoryFile memory_;
};

}  // namespace

std::unique_ptr<Target> MakeCompiledScene() { return std::make_unique<CompiledScene>(); }

}  // namespace fulcrum::fuzz
