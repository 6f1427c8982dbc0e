// Any bytes as a DICOM segmentation: read to a valid label map or refused. Bytes that do not begin as such a file would
// go to the reader of NIfTI, so the mark is put where it belongs.
#include <algorithm>
#include <random>

#include "tests/fuzz/scene/dicom_samples.h"
#include "tests/fuzz/target.h"

namespace fulcrum::fuzz {
namespace {

class Dicom final : public Target {
 public:
  Outcome Offer(Input input) override {
    if (input.size() < 132) return Outcome::kRefused;
    Bytes bytes(input.begin(), input.end());
    std::memcpy(bytes.data() + 128, "DICM", 4);
    file_.Write(bytes);
    return ReadAnyDicom(file_.path()) ? Outcome::kAccepted : Outcome::kRefused;
  }
  /// Another digit in place of one, or a low bit: lengths and order of the elements mostly stay right.
  Bytes Mutate(Input input, unsigned seed) override {
    std::mt19937 random(seed);
    Bytes bytes(input.begin(), input.end());
    for (unsigned k = 0; k <= seed % 3 && bytes.size() > 132; ++k) {
      const auto from = bytes.begin() + static_cast<std::ptrdiff_t>(132 + random() % (bytes.size() - 132));
      const auto digit = std::find_if(from, bytes.end(), [](std::uint8_t b) { return b >= '0' && b <= '9'; });
      if (random() % 4 == 0) {
        *from = static_cast<std::uint8_t>(*from ^ (1u << random() % 3));
      } else if (digit != bytes.end()) {
        *digit = static_cast<std::uint8_t>("0123456789.-"[random() % 12]);
      }
    }
    return bytes;
  }
  std::vector<Seed> Seeds() override { return DicomSamples(); }
  std::vector<std::string> Words() override {
    return {"BINARY", "FRACTIONAL", "1.2.840.10008.1.2", "1.2.840.10008.1.2.1", "UN", "SQ", "OB", "OW", "DS", "1e9"};
  }

 private:
  MemoryFile file_;
};

}  // namespace

std::unique_ptr<Target> MakeDicom() { return std::make_unique<Dicom>(); }

}  // namespace fulcrum::fuzz
