#include "services/records/recording/mcap_index.h"

#include <libdeflate.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <span>

#include "services/base/core/byte_stream.h"
#include "services/base/core/error.h"
#include "services/records/recording/mcap_format.h"

namespace fulcrum::recording {
namespace {

/// Size of a footer [B]: start of the summary, start of its offsets, checksum.
constexpr std::uint64_t kFooterBytes = 20;
constexpr std::uint64_t kTail = kRecordHead + kFooterBytes + kMcapMagic.size();
constexpr std::uint64_t kMostSummaryBytes = std::uint64_t{1} << 30;

class IndexCheck {
 public:
  explicit IndexCheck(const std::filesystem::path& file)
      : in_(file, std::ios::binary), size_(in_ ? std::filesystem::file_size(file) : 0) {
    if (!in_) throw InputError(file.string() + ": cannot be read");
  }

  void Run() {
    const std::vector<std::uint8_t> tail = Read(size_ < kTail ? 0 : size_ - kTail, kTail);
    ByteReader footer(tail);
    const auto opcode = footer.Number<std::uint8_t>();
    const auto length = footer.Number<std::uint64_t>();
    const auto start = footer.Number<std::uint64_t>();
    (void)footer.Number<std::uint64_t>();
    const auto crc = footer.Number<std::uint32_t>();
    if (!footer.good() || opcode != static_cast<std::uint8_t>(Opcode::kFooter) || length != kFooterBytes ||
        start > size_ - kTail || size_ - start > kMostSummaryBytes) {
      return Problem("no footer: the file was not closed");
    }
    const std::vector<std::uint8_t> summary = Read(start, size_ - start);
    const std::size_t covered = summary.size() - kMcapMagic.size() - sizeof crc;
    if (crc != 0 && libdeflate_crc32(0, summary.data(), covered) != crc) {
      Problem("the checksum of the summary is wrong");
    }
    ByteReader records{std::span(summary).first(summary.size() - kTail)};
    while (!records.empty() && records.good()) {
      const auto kind = records.Number<std::uint8_t>();
      const std::span<const std::uint8_t> content = records.Take(records.Number<std::uint64_t>());
      if (kind == static_cast<std::uint8_t>(Opcode::kChunkIndex)) CheckChunk(content);
      if (kind == static_cast<std::uint8_t>(Opcode::kStatistics)) {
        ByteReader statistics(content);
        stated_ = statistics.Number<std::uint64_t>();
      }
    }
    if (!records.good()) Problem("the summary ends within a record");
    if (stated_ != messages_) {
      Problem("the statistics count " + std::to_string(stated_) + " messages, the indexes " +
              std::to_string(messages_));
    }
  }

  [[nodiscard]] std::uint64_t messages() const { return messages_; }
  [[nodiscard]] std::vector<std::string>& problems() { return problems_; }

 private:
  void Problem(std::string what) {
    if (problems_.size() < kMostProblems) problems_.push_back(std::move(what));
  }

  std::vector<std::uint8_t> Read(std::uint64_t at, std::uint64_t size) {
    std::vector<std::uint8_t> bytes(at > size_ ? 0 : std::min(size, size_ - at));
    in_.clear();
    in_.seekg(static_cast<std::streamoff>(at));
    in_.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    return bytes;
  }

  /// Length of the record at `at`, without its head; reports a problem if it is of another kind.
  std::uint64_t LengthAt(std::uint64_t at, Opcode kind) {
    const std::vector<std::uint8_t> head = Read(at, kRecordHead);
    ByteReader from(head);
    const auto opcode = from.Number<std::uint8_t>();
    const auto length = from.Number<std::uint64_t>();
    if (from.good() && opcode == static_cast<std::uint8_t>(kind) && length <= size_ - at) return length;
    Problem("an index points at byte " + std::to_string(at) + ", where there is no such record");
    return 0;
  }

  void CheckChunk(std::span<const std::uint8_t> content) {
    ByteReader index(content);
    (void)index.Take(2 * sizeof(std::uint64_t));  // First and last time.
    const auto start = index.Number<std::uint64_t>();
    const auto length = index.Number<std::uint64_t>();
    ByteReader offsets{index.Take(index.Number<std::uint32_t>())};
    if (LengthAt(start, Opcode::kChunk) + kRecordHead != length) {
      Problem("the index of the chunk at byte " + std::to_string(start) + " gives another length");
    }
    while (!offsets.empty() && offsets.good()) {
      const auto channel = offsets.Number<std::uint16_t>();
      const auto at = offsets.Number<std::uint64_t>();
      const std::uint64_t size = LengthAt(at, Opcode::kMessageIndex);
      const std::vector<std::uint8_t> bytes = Read(at + kRecordHead, size);
      ByteReader entries(bytes);
      const bool same = entries.Number<std::uint16_t>() == channel;
      const auto entry_bytes = entries.Number<std::uint32_t>();
      if (size == 0) continue;
      if (!entries.good() || !same)
        Problem("the message index at byte " + std::to_string(at) + " is of another channel");
      messages_ += entry_bytes / (2 * sizeof(std::uint64_t));
    }
    if (!index.good() || !offsets.good()) Problem("a chunk index is too short");
  }

  std::ifstream in_;
  const std::uint64_t size_;
  std::uint64_t messages_ = 0, stated_ = 0;
  std::vector<std::string> problems_;
};

}  // namespace

std::vector<std::string> CheckIndex(const std::filesystem::path& file, std::uint64_t* messages) {
  IndexCheck check(file);
  check.Run();
  *messages = check.messages();
  return std::move(check.problems());
}

}  // namespace fulcrum::recording
