#include "services/scene/format/scene_file.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>
#include <string_view>

#include "services/base/core/error.h"
#include "services/base/core/hash.h"
#include "services/scene/format/sections.h"
#include "services/scene/format/validate.h"

namespace fulcrum::scene {
namespace {

// Layout: header, section table, then the sections, each on a multiple of kAlignment. Little-endian, in the byte order
// of the x86-64 machines that read it. Increase kSceneFileVersion with every change of a structure in scene_view.h.
constexpr std::size_t kAlignment = 64;
constexpr char kMagic[8] = {'F', 'U', 'L', 'C', 'S', 'C', 'N', '\n'};
constexpr const char* kFixedSection = "scene";
constexpr const char* kSourceSection = "source_yaml";
// One StereoParams, of scenes with a stereo picture only.
constexpr const char* kStereoSection = "stereo";
constexpr std::uint32_t kMaxSections = 64;

struct FileHeader {
  char magic[8];
  std::uint32_t version;
  std::uint32_t section_count;
  std::uint64_t file_bytes;
  std::uint64_t content_hash;
  std::uint64_t table_checksum;  ///< Of this header up to this field, and of the section table.
};
static_assert(sizeof(FileHeader) == 40);

struct SectionEntry {
  char name[24];
  std::uint64_t offset;
  std::uint64_t bytes;
  std::uint64_t element_bytes;
  std::uint64_t checksum;
};
static_assert(sizeof(SectionEntry) == 56);

/// All members of a SceneView that are no arrays, without padding, so that equal scenes have equal bytes.
struct FixedTool {
  std::uint32_t kind;
  Vec3f p_WP;
  float shaft_radius_m, shaft_length_m, tip_radius_m, tip_length_m, traction_N;
};
struct FixedPart {
  char name[64];
  PhysicsParams physics;
  ThermalParams thermal;
  RenderParams render;
  HapticsParams haptics;
  Breathing breathing;
  AssessmentParams assessment;
  MembraneGrid membrane;
  Index tube_vertex_count;
  FixedTool tools[kMaxTools];
  float script_duration_s;
  std::uint32_t node_mask;
};
static_assert(sizeof(FixedPart) == 64 + sizeof(PhysicsParams) + sizeof(ThermalParams) + sizeof(RenderParams) +
                                       sizeof(HapticsParams) + sizeof(Breathing) + sizeof(AssessmentParams) +
                                       sizeof(MembraneGrid) + 4 + kMaxTools * 36 + 8);

FixedPart ToFixed(const SceneView& view) {
  FixedPart fixed{};
  std::memcpy(fixed.name, view.name, sizeof(fixed.name));
  fixed.physics = view.physics;
  fixed.thermal = view.thermal;
  fixed.render = view.render;
  fixed.haptics = view.haptics;
  fixed.breathing = view.breathing;
  fixed.assessment = view.assessment;
  fixed.membrane = view.membrane;
  fixed.tube_vertex_count = view.tube_vertex_count;
  for (int i = 0; i < kMaxTools; ++i) {
    const ToolDescription& t = view.tools[i];
    fixed.tools[i] = {static_cast<std::uint32_t>(t.kind),
                      t.p_WP,
                      t.shaft_radius_m,
                      t.shaft_length_m,
                      t.tip_radius_m,
                      t.tip_length_m,
                      t.traction_N};
  }
  fixed.script_duration_s = view.script_duration_s;
  fixed.node_mask = view.node_mask;
  return fixed;
}

void FromFixed(const FixedPart& fixed, SceneView* view) {
  std::memcpy(view->name, fixed.name, sizeof(fixed.name));
  view->physics = fixed.physics;
  view->thermal = fixed.thermal;
  view->render = fixed.render;
  view->haptics = fixed.haptics;
  view->breathing = fixed.breathing;
  view->assessment = fixed.assessment;
  view->membrane = fixed.membrane;
  view->tube_vertex_count = fixed.tube_vertex_count;
  for (int i = 0; i < kMaxTools; ++i) {
    const FixedTool& t = fixed.tools[i];
    // A kind that does not fit is refused by the validation.
    const auto kind = static_cast<ToolKind>(std::min<std::uint32_t>(t.kind, 255));
    view->tools[i] = {kind, t.p_WP, t.shaft_radius_m, t.shaft_length_m, t.tip_radius_m, t.tip_length_m, t.traction_N};
  }
  view->script_duration_s = fixed.script_duration_s;
  view->node_mask = fixed.node_mask;
}

std::uint64_t HashOf(std::span<const std::byte> bytes) {
  Hash64 hash;
  hash.Add(bytes);
  return hash.value();
}

std::uint64_t TableChecksum(const FileHeader& header, std::span<const SectionEntry> table) {
  Hash64 hash;
  hash.Add(std::as_bytes(std::span(&header, 1)).first(offsetof(FileHeader, table_checksum)));
  hash.Add(std::as_bytes(table));
  return hash.value();
}

bool HasStereo(const SceneView& view) { return view.stereo.layout != StereoLayout::kNone; }

std::size_t Align(std::size_t offset) { return (offset + kAlignment - 1) / kAlignment * kAlignment; }

struct Payload {
  std::string name;
  std::span<const std::byte> bytes;
  std::size_t element_bytes;
};

}  // namespace

void AddToHash(std::span<const Attachment> attachments, Hash64* hash) {
  constexpr std::size_t kGlued_B = offsetof(Attachment, normal);
  std::vector<std::byte> glued;
  std::vector<Vec3f> normals;
  bool slides = false;
  for (const Attachment& a : attachments) {
    const auto bytes = std::as_bytes(std::span(&a, 1)).first(kGlued_B);
    glued.insert(glued.end(), bytes.begin(), bytes.end());
    normals.push_back(a.normal);
    slides = slides || !a.normal.isZero(0.0f);
  }
  hash->Add(std::span<const std::byte>(glued));
  if (slides) hash->Add(std::as_bytes(std::span<const Vec3f>(normals)));
}

void AddToHash(std::span<const SheetPart> sheets, Hash64* hash) {
  constexpr std::size_t kOfTissue_B = offsetof(SheetPart, thickness_m);
  std::vector<std::byte> of_tissue, of_heat;
  bool own = false;
  for (const SheetPart& sheet : sheets) {
    const auto bytes = std::as_bytes(std::span(&sheet, 1));
    of_tissue.insert(of_tissue.end(), bytes.begin(), bytes.begin() + kOfTissue_B);
    of_heat.insert(of_heat.end(), bytes.begin() + kOfTissue_B, bytes.end());
    own = own || sheet.thickness_m != 0.0f || sheet.conductivity_W_mK != 0.0f || sheet.sigma_S_m != 0.0f;
  }
  hash->Add(std::span<const std::byte>(of_tissue));
  if (own) hash->Add(std::span<const std::byte>(of_heat));
}

std::uint64_t ContentHash(const SceneView& view) {
  Hash64 hash;
  hash.AddValue(kSceneContentVersion);
  const FixedPart fixed = ToFixed(view);
  hash.Add(std::as_bytes(std::span(&fixed, 1)));
  const auto add = [&]<class T>(const char*, std::span<const T> span) {
    if constexpr (std::is_same_v<T, Attachment> || std::is_same_v<T, SheetPart>) {
      AddToHash(span, &hash);
    } else {
      hash.Add(std::as_bytes(span));
    }
  };
  ForEachUsualSection(view, add);
  // A scene without them keeps the hash that it had before there were any.
  ForEachBodySection(view, [&]<class T>(const char* name, std::span<const T> span) {
    if (!span.empty()) add(name, span);
  });
  if (HasStereo(view)) hash.Add(std::as_bytes(std::span(&view.stereo, 1)));
  return hash.value();
}

std::uint64_t WriteSceneFile(const SceneData& scene, const std::string& source_yaml,
                             const std::filesystem::path& file) {
  return WriteSceneFile(scene.View(), source_yaml, file);
}

std::uint64_t WriteSceneFile(const SceneView& view, const std::string& source_yaml, const std::filesystem::path& file) {
  if (const auto fault = FindFault(view)) {
    throw InputError("scene '" + std::string(view.name) + "': section '" + fault->section + "': " + fault->reason);
  }
  const FixedPart fixed = ToFixed(view);
  std::vector<Payload> payloads{{kFixedSection, std::as_bytes(std::span(&fixed, 1)), sizeof(fixed)}};
  ForEachSection(view, [&]<class T>(const char* name, std::span<const T> span) {
    payloads.push_back({name, std::as_bytes(span), sizeof(T)});
  });
  if (HasStereo(view)) {
    payloads.push_back({kStereoSection, std::as_bytes(std::span(&view.stereo, 1)), sizeof(StereoParams)});
  }
  payloads.push_back({kSourceSection, std::as_bytes(std::span(source_yaml)), 1});

  FileHeader header{};
  std::memcpy(header.magic, kMagic, sizeof(kMagic));
  header.version = kSceneFileVersion;
  header.section_count = static_cast<std::uint32_t>(payloads.size());
  header.content_hash = ContentHash(view);
  std::vector<SectionEntry> table(payloads.size());
  std::size_t offset = Align(sizeof(header) + table.size() * sizeof(SectionEntry));
  for (std::size_t i = 0; i < payloads.size(); ++i) {
    SectionEntry& entry = table[i];
    payloads[i].name.copy(entry.name, sizeof(entry.name) - 1);
    entry.offset = offset;
    entry.bytes = payloads[i].bytes.size();
    entry.element_bytes = payloads[i].element_bytes;
    entry.checksum = HashOf(payloads[i].bytes);
    offset = Align(offset + entry.bytes);
  }
  header.file_bytes = offset;
  header.table_checksum = TableChecksum(header, table);

  std::string bytes(header.file_bytes, '\0');
  std::memcpy(bytes.data(), &header, sizeof(header));
  std::memcpy(bytes.data() + sizeof(header), table.data(), table.size() * sizeof(SectionEntry));
  for (std::size_t i = 0; i < payloads.size(); ++i) {
    if (!payloads[i].bytes.empty()) {
      std::memcpy(bytes.data() + table[i].offset, payloads[i].bytes.data(), payloads[i].bytes.size());
    }
  }
  const std::filesystem::path temporary = file.string() + ".part" + std::to_string(getpid());
  {
    std::ofstream out(temporary, std::ios::binary);
    out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    out.close();
    if (!out) {
      std::error_code ignored;
      std::filesystem::remove(temporary, ignored);
      throw InputError(file.string() + ": cannot be written (" + std::strerror(errno) + ")");
    }
  }
  std::error_code error;
  std::filesystem::rename(temporary, file, error);
  if (error) {
    std::error_code ignored;
    std::filesystem::remove(temporary, ignored);
    throw InputError(file.string() + ": cannot be written (" + error.message() + ")");
  }
  return header.content_hash;
}

// ---------------------------------------------------------------------------------------------------------- read

struct SceneFile::Impl {
  ~Impl() {
    if (data != nullptr) {
      munmap(const_cast<std::byte*>(data), size);
    }
  }

  void Map();
  void Read();
  [[nodiscard]] const SectionEntry& Find(const std::string& section, std::size_t element_bytes) const;
  void ReadStereo();
  [[noreturn]] void Refuse(const std::string& section, const std::string& reason) const {
    throw InputError(file.string() + ": section '" + section + "': " + reason +
                     "; compile the scene again with scene_compiler");
  }

  std::filesystem::path file;
  const std::byte* data = nullptr;
  std::size_t size = 0;
  std::vector<SectionEntry> table;
  SceneView view;
};

void SceneFile::Impl::Map() {
  const int descriptor = open(file.c_str(), O_RDONLY | O_CLOEXEC);
  struct stat status {};
  if (descriptor < 0 || fstat(descriptor, &status) != 0) {
    const std::string reason = std::strerror(errno);
    if (descriptor >= 0) {
      close(descriptor);
    }
    throw InputError(file.string() + ": cannot be opened (" + reason + ")");
  }
  size = static_cast<std::size_t>(status.st_size);
  if (!S_ISREG(status.st_mode) || size < sizeof(FileHeader)) {
    close(descriptor);
    throw InputError(file.string() + ": not a compiled scene (" + std::to_string(size) +
                     " bytes, the header alone has " + std::to_string(sizeof(FileHeader)) + ")");
  }
  void* mapped = mmap(nullptr, size, PROT_READ, MAP_PRIVATE, descriptor, 0);
  const int mapping_error = errno;
  close(descriptor);
  if (mapped == MAP_FAILED) {
    throw InputError(file.string() + ": cannot be mapped (" + std::strerror(mapping_error) + ")");
  }
  data = static_cast<const std::byte*>(mapped);
}

const SectionEntry& SceneFile::Impl::Find(const std::string& section, std::size_t element_bytes) const {
  for (const SectionEntry& entry : table) {
    if (section == entry.name) {
      if (entry.element_bytes != element_bytes || entry.bytes % element_bytes != 0) {
        throw MismatchError(file.string() + ": section '" + section + "': elements of " +
                            std::to_string(entry.element_bytes) + " bytes, this build has " +
                            std::to_string(element_bytes) + "; compile the scene again with scene_compiler");
      }
      return entry;
    }
  }
  Refuse(section, "missing");
}

void SceneFile::Impl::Read() {
  FileHeader header;
  std::memcpy(&header, data, sizeof(header));
  if (std::memcmp(header.magic, kMagic, sizeof(kMagic)) != 0) {
    throw InputError(file.string() +
                     ": not a compiled scene (it does not begin with FULCSCN); compile the YAML with "
                     "scene_compiler");
  }
  if (header.version != kSceneFileVersion) {
    throw MismatchError(file.string() + ": scene file version " + std::to_string(header.version) +
                        ", this build reads version " + std::to_string(kSceneFileVersion) +
                        "; compile the scene again with scene_compiler");
  }
  if (header.file_bytes != size) {
    Refuse("header", "the file has " + std::to_string(size) + " bytes, but its header requires " +
                         std::to_string(header.file_bytes) + ": it was cut short or added to");
  }
  if (header.section_count > kMaxSections || size < sizeof(header) + header.section_count * sizeof(SectionEntry)) {
    Refuse("header", std::to_string(header.section_count) + " sections; valid: at most " +
                         std::to_string(kMaxSections) + " that fit the file");
  }
  table.resize(header.section_count);
  if (!table.empty()) {
    std::memcpy(table.data(), data + sizeof(header), table.size() * sizeof(SectionEntry));
  }
  if (TableChecksum(header, table) != header.table_checksum) {
    Refuse("header", "the checksum of header and section table is wrong: the file was altered");
  }
  for (SectionEntry& entry : table) {
    entry.name[sizeof(entry.name) - 1] = 0;
    if (entry.offset % kAlignment != 0 || entry.offset > size || entry.bytes > size - entry.offset) {
      Refuse(entry.name, "lies outside the file");
    }
    if (HashOf({data + entry.offset, entry.bytes}) != entry.checksum) {
      Refuse(entry.name, "the checksum is wrong: the file was altered");
    }
  }
  const SectionEntry& fixed_entry = Find(kFixedSection, sizeof(FixedPart));
  if (fixed_entry.bytes != sizeof(FixedPart)) {
    Refuse(kFixedSection, "there must be exactly one");
  }
  FromFixed(*reinterpret_cast<const FixedPart*>(data + fixed_entry.offset), &view);
  ForEachSection(view, [&]<class T>(const char* name, std::span<const T>& span) {
    const SectionEntry& entry = Find(name, sizeof(T));
    span = {reinterpret_cast<const T*>(data + entry.offset), entry.bytes / sizeof(T)};
  });
  ReadStereo();
  if (const auto fault = FindFault(view)) {
    Refuse(fault->section, fault->reason);
  }
  view.hash = header.content_hash;
  if (ContentHash(view) != header.content_hash) {
    Refuse("header", "the content hash is wrong: the file was altered");
  }
}

void SceneFile::Impl::ReadStereo() {
  const auto named = [](const SectionEntry& entry) { return std::string_view(entry.name) == kStereoSection; };
  if (std::ranges::none_of(table, named)) return;
  const SectionEntry& entry = Find(kStereoSection, sizeof(StereoParams));
  if (entry.bytes != sizeof(StereoParams)) Refuse(kStereoSection, "there must be exactly one");
  view.stereo = *reinterpret_cast<const StereoParams*>(data + entry.offset);
}

SceneFile::SceneFile(const std::filesystem::path& file) : impl_(std::make_unique<Impl>()) {
  impl_->file = file;
  impl_->Map();
  impl_->Read();
}

SceneFile::~SceneFile() = default;

const SceneView& SceneFile::view() const { return impl_->view; }

std::string SceneFile::source_yaml() const {
  const SectionEntry& entry = impl_->Find(kSourceSection, 1);
  return {reinterpret_cast<const char*>(impl_->data + entry.offset), entry.bytes};
}

}  // namespace fulcrum::scene
