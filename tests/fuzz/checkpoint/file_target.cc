// The file around a checkpoint's payload: two slots with sequence and checksum. Any bytes as patches over a valid file
// (Patch). The first byte selects the slots whose checksums are then corrected; without that, checks beyond the
// checksum would not be reached.
#include <cstring>

#include "services/base/core/error.h"
#include "services/base/core/hash.h"
#include "services/base/runtime/checkpoint.h"
#include "tests/fuzz/target.h"

namespace fulcrum::fuzz {
namespace {

constexpr std::uint64_t kScene = 7;
constexpr std::uint32_t kLayout = 1;
constexpr std::size_t kCapacity = 300, kPage = 4096, kStride = 2 * kPage;  ///< The payload takes one page.

void Reseal(std::size_t slot, Bytes* file) {
  const std::size_t at = kPage + slot * kStride;
  if (file->size() < at + kStride) return;
  std::uint64_t sequence = 0, bytes = 0;
  std::memcpy(&sequence, file->data() + at, sizeof sequence);
  std::memcpy(&bytes, file->data() + at + 8, sizeof bytes);
  Hash64 hash;
  hash.AddValue(sequence);
  hash.AddLong(std::as_bytes(std::span(*file)).subspan(at + kPage, std::min<std::uint64_t>(bytes, kPage)));
  const std::uint64_t checksum = hash.value();
  std::memcpy(file->data() + at + 16, &checksum, sizeof checksum);
}

class CheckpointFileTarget final : public Target {
 public:
  CheckpointFileTarget() {
    {
      runtime::CheckpointFile file(path_, kScene, kLayout, kCapacity);
      for (const std::string_view text : {"what a node keeps", "what it keeps later"}) {
        std::memcpy(file.Begin().data(), text.data(), text.size());
        file.Commit(text.size());
      }
    }
    good_ = ReadFile(path_);
  }
  Outcome Offer(Input input) override {
    Bytes content = good_;
    if (!input.empty()) {
      Patch(input.subspan(1), &content);
      for (std::size_t slot = 0; slot < 2; ++slot) {
        if ((input[0] >> slot & 1u) != 0) Reseal(slot, &content);
      }
    }
    WriteFile(path_, content);
    const std::uint64_t newest = runtime::NewestSequence(path_);
    const auto peeked = runtime::CheckpointFile::Peek(path_, kScene, kLayout, kCapacity);
    runtime::CheckpointFile file(path_, kScene, kLayout, kCapacity);
    const auto latest = file.Latest();
    const auto previous = file.Previous();
    Promise(!latest || latest->payload.size() <= kCapacity, "a payload larger than the capacity");
    Promise(!previous || (latest && previous->payload.size() <= kCapacity), "a payload before none");
    Promise(!latest || static_cast<std::int64_t>(latest->sequence - newest) <= 0, "a slot newer than the newest");
    // Peek reads what remains of a truncated file; the node then begins anew.
    if (latest) {
      Promise(peeked.has_value() &&
                  std::equal(peeked->begin(), peeked->end(), latest->payload.begin(), latest->payload.end()),
              "Peek and the node read different slots");
    }
    // The node's next checkpoint is kept for any content of the file.
    file.Begin()[0] = std::byte{42};
    file.Commit(1);
    const auto after = runtime::CheckpointFile::Peek(path_, kScene, kLayout, kCapacity);
    Promise(after && after->size() == 1 && (*after)[0] == std::byte{42}, "the next checkpoint is lost");
    return latest ? Outcome::kAccepted : Outcome::kRefused;
  }
  std::vector<Seed> Seeds() override { return {{"unchanged", {0}}, {"resealed", {3}}}; }

 private:
  const ScratchFolder folder_;
  const std::filesystem::path path_ = folder_.path() / "checkpoint";
  Bytes good_;
};

}  // namespace

std::unique_ptr<Target> MakeCheckpointFile() { return std::make_unique<CheckpointFileTarget>(); }

}  // namespace fulcrum::fuzz
