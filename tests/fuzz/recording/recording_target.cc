// Any bytes as a recording: read, repaired, checked and printed as the tools of `fulcrum log` do. Checksums are removed
// first (0 stands for none); otherwise checks beyond them would not be reached.
#include <array>
#include <cstring>
#include <map>
#include <sstream>

#include "services/records/recording/mcap_format.h"
#include "services/records/recording/mcap_writer.h"
#include "services/records/recording/point_coding.h"
#include "tests/fuzz/recording/recording_check.h"
#include "tests/fuzz/target.h"
#include "tests/unit/bus/samples.h"

namespace fulcrum::fuzz {
namespace {

constexpr std::size_t kChunkSizeAt = 16, kChunkCrcAt = 24, kChunkHead = 32, kFooterCrcAt = 16, kFooter_B = 20;

void RemoveChecksums(Bytes* file) {
  const auto clear = [&](std::size_t at) { std::memset(file->data() + at, 0, 4); };
  std::size_t at = recording::kMcapMagic.size();
  while (at + recording::kRecordHead <= file->size()) {
    const auto kind = static_cast<recording::Opcode>((*file)[at]);
    std::uint64_t length = 0;
    std::memcpy(&length, file->data() + at + 1, sizeof length);
    const std::size_t content = at + recording::kRecordHead;
    if (length > file->size() - content) return;
    if (kind == recording::Opcode::kFooter && length == kFooter_B) clear(content + kFooterCrcAt);
    if (kind == recording::Opcode::kDataEnd && length == 4) clear(content);
    if (kind == recording::Opcode::kChunk && length >= kChunkHead + 8) {
      clear(content + kChunkCrcAt);
      std::uint32_t packing_B = 0;
      std::memcpy(&packing_B, file->data() + content + kChunkCrcAt + 4, sizeof packing_B);
      // The size of a chunk that is not packed is that of its body.
      const std::uint64_t body = length - kChunkHead - 8;
      if (packing_B == 0) std::memcpy(file->data() + content + kChunkSizeAt, &body, sizeof body);
    }
    at = content + length;
  }
}

class Recording final : public Target {
 public:
  Outcome Offer(Input input) override {
    Bytes file(input.begin(), input.end());
    RemoveChecksums(&file);
    const log_tools::RecordingVerdict verdict = log_tools::CheckRecording(file, folder_.path());
    Promise(verdict.broken.empty(), verdict.broken);
    Print(folder_.path() / "fuzzed.mcap");
    return verdict.decoded > 0 ? Outcome::kAccepted : Outcome::kRefused;
  }
  std::vector<Seed> Seeds() override {
    const std::filesystem::path file = folder_.path() / "seed.mcap";
    std::vector<Seed> seeds;
#define FULCRUM_SEED(T) \
  if (std::optional<Seed> seed = SeedOf<T>(file, #T)) seeds.push_back(std::move(*seed));
    FULCRUM_MESSAGES(FULCRUM_SEED)
#undef FULCRUM_SEED
    seeds.push_back(CodedSeed(file));
    return seeds;
  }

 private:
  /// A recording with one message. None for types whose size makes effective mutations rare.
  template <class T>
  static std::optional<Seed> SeedOf(const std::filesystem::path& file, const std::string& name) {
    constexpr std::size_t kMost_B = 2000;
    Bytes cdr;
    if (!bus::EncodeCdr(bus::test::Sample<T>(), &cdr) || cdr.size() > kMost_B) return std::nullopt;
    {
      recording::McapWriter writer(file, "", "fuzz");
      const auto channel =
          writer.AddChannel(writer.AddSchema(name, "omgidl", ""), "fulcrum/" + name, "cdr", {{"node", "physics_node"}});
      writer.AddMetadata("session", {{"id", "fuzz"}});
      for (std::uint32_t i = 1; i <= 2; ++i) writer.Write(channel, i, i, i, std::as_bytes(std::span(cdr)));
    }
    return Seed{name, ReadFile(file)};
  }
  /// Coded messages: a key, a difference, one relative to the neighbour, one as sent.
  static Seed CodedSeed(const std::filesystem::path& file) {
    constexpr std::size_t kHead_B = 100;  // Encapsulation and TissueFrameHeader.
    std::map<std::string, std::string> metadata{{"node", "physics_node"}};
    recording::PutPointCoding({.head_B = kHead_B}, &metadata);
    {
      recording::McapWriter writer(file, "", "fuzz");
      const auto channel =
          writer.AddChannel(writer.AddSchema("TissueFrame", "omgidl", ""), "fulcrum/TissueFrame", "cdr", metadata);
      std::uint32_t sequence = 0;
      const auto write = [&](std::span<const std::byte> bytes) {
        ++sequence;
        writer.Write(channel, sequence, sequence, sequence, bytes);
      };
      const std::array<float, 6> place{0.1F, 0.2F, 0, 0.11F, 0.2F, 0.01F};
      for (const std::array<float, 6>& moved : std::array<std::array<float, 6>, 3>{
               {{0, 0, 0, 0, 0, 0}, {0, 0, 0, 0, 0, 2e-5F}, {1e-3F, 1e-3F, 0, 1e-3F, 1e-3F, 0}}}) {
        TissueFrame frame;
        frame.header.vertex_count = 2;
        for (std::size_t i = 0; i < place.size(); ++i) frame.xyz.push_back(place[i] + moved[i]);
        Bytes cdr;
        if (bus::EncodeCdr(frame, &cdr)) write(std::as_bytes(std::span(cdr)));
      }
      write(std::as_bytes(std::span(metadata.at("node"))));
    }
    return {"coded", ReadFile(file)};
  }
  void Print(const std::filesystem::path& file) const {
    constexpr std::size_t kLongestList = 8;
    std::ostringstream out;
    const std::filesystem::path tables = folder_.path() / "tables";
    std::filesystem::remove_all(tables);
    const auto tell = [](const auto& tool) {
      try {
        tool();
      } catch (const InputError&) {
        // Reported to the user.
      } catch (const MismatchError&) {
        // Messages of another schema: reported as well.
      }
    };
    tell([&] { log_tools::PrintInfo(file, &out); });
    tell([&] { (void)log_tools::Verify(file, &out); });
    tell([&] { log_tools::PrintMessages(file, {}, kLongestList, &out); });
    tell([&] { (void)log_tools::ExportTables(file, {}, tables); });
    tell([&] { (void)log_tools::Diff(file, file, {}, "", &out); });
  }

  const ScratchFolder folder_;
};

}  // namespace

std::unique_ptr<Target> MakeRecording() { return std::make_unique<Recording>(); }

}  // namespace fulcrum::fuzz
