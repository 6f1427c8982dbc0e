#include "services/scene/anatomy/dicom_outline.h"

// DCMTK wants this one first.
#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctag.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <string_view>
#include <vector>

#include "services/base/core/error.h"

namespace fulcrum::scene {
namespace {

namespace fs = std::filesystem;

constexpr int kMostLevels = 32;             ///< Segmentations have about 6.
constexpr std::size_t kMostTags = 4000000;  ///< 100,000 frames have 3 million.
constexpr std::size_t kPreamble_B = 128;
constexpr std::string_view kMagic = "DICM";
constexpr std::uint32_t kUnknownLength = 0xffffffff;
constexpr std::uint32_t kItem = 0xfffee000, kEndOfItem = 0xfffee00d, kEndOfSequence = 0xfffee0dd;
constexpr std::uint32_t kMediaClass = 0x00020002, kTransferSyntax = 0x00020010, kPixelData = 0x7fe00010;

/// Those that have two bytes of padding and four of length; the others have two of length.
constexpr std::array<std::string_view, 13> kLong = {"OB", "OD", "OF", "OL", "OV", "OW", "SQ",
                                                    "SV", "UC", "UN", "UR", "UT", "UV"};
constexpr std::array<std::string_view, 21> kShort = {"AE", "AS", "AT", "CS", "DA", "DS", "DT", "FD", "FL", "IS", "LO",
                                                     "LT", "PN", "SH", "SL", "SS", "ST", "TM", "UI", "UL", "US"};

std::string TagText(std::uint32_t tag) {
  char text[16];
  std::snprintf(text, sizeof(text), "(%04x,%04x)", tag >> 16, tag & 0xffff);
  return text;
}

class Outline {
 public:
  explicit Outline(const fs::path& file) : file_(file) {
    errno = 0;
    in_.open(file, std::ios::binary);
    if (!in_) RefuseUnreadable(errno);
    std::error_code error;
    size_ = fs::file_size(file, error);
    if (error) RefuseUnreadable(error.value());
  }

  /// The group of elements before the data, always explicit and little-endian.
  void ReadMeta() {
    at_ = kPreamble_B + kMagic.size();
    std::uint64_t announced_end = 0;
    std::uint32_t last = 0;
    // The group's number comes first. What follows may be written in another way.
    while (at_ < size_ && std::memcmp(Peek(2), "\x02\x00", 2) == 0) {
      const Header header = ReadHeader(true, size_);
      Check(header, last, size_);
      last = header.tag;
      if (header.length == kUnknownLength || std::string_view(header.vr, 2) == "SQ") {
        Refuse("element " + TagText(header.tag) + " of the file's header is a sequence; valid: a value");
      }
      if (header.tag == 0x00020000 && header.length == 4) {
        announced_end = Number(4);
        announced_end += at_;
        continue;
      }
      if (header.tag == kMediaClass) media_class_ = Text(header.length);
      if (header.tag == kTransferSyntax) transfer_syntax_ = Text(header.length);
      Skip(header.length);
    }
    if (announced_end != 0 && announced_end != at_) {
      Refuse("its header ends at byte " + std::to_string(at_) + ", FileMetaInformationGroupLength (0002,0000) says " +
             std::to_string(announced_end) + ": the file is damaged; export it again");
    }
  }

  void ReadData() {
    const bool is_implicit = transfer_syntax_ == "1.2.840.10008.1.2";
    if (!is_implicit && transfer_syntax_ != "1.2.840.10008.1.2.1") {
      Refuse("has TransferSyntaxUID (0002,0010) '" + transfer_syntax_ +
             "'; valid: 1.2.840.10008.1.2 and 1.2.840.10008.1.2.1 (uncompressed, little-endian). Convert it by "
             "'dcmconv +te IN OUT', or 'dcmdrle IN OUT' if it is compressed");
    }
    Elements(size_, false, 0, !is_implicit);
  }

  [[nodiscard]] const std::string& media_class() const { return media_class_; }

 private:
  struct Header {
    std::uint32_t tag = 0, length = 0;
    char vr[2] = {'U', 'N'};
  };

  [[noreturn]] void Refuse(const std::string& reason) const { throw InputError(file_.string() + ": " + reason); }
  /// `error`: errno; 0: unknown.
  [[noreturn]] void RefuseUnreadable(int error) const {
    Refuse("cannot be read at byte " + std::to_string(at_) + (error != 0 ? ": " : "") +
           (error != 0 ? std::strerror(error) : "") + "; check its permissions and its disk, or copy it again");
  }

  [[noreturn]] void RefuseOpen(const std::string& what) const {
    Refuse("ends " + what + " of unknown length at byte " + std::to_string(at_) +
           " without its delimiter: it is cut short or damaged; export or copy it again");
  }

  /// The next bytes, at most 64, without moving on.
  const char* Peek(std::size_t count) {
    if (count > size_ - at_) {
      Refuse("ends at byte " + std::to_string(size_) + " within an element: it is cut short; export or copy it again");
    }
    if (at_ < window_at_ || at_ + count > window_at_ + window_.size()) {
      window_at_ = at_;
      window_.resize(static_cast<std::size_t>(std::min<std::uint64_t>(kWindow_B, size_ - at_)));
      errno = 0;
      in_.seekg(static_cast<std::streamoff>(at_));
      if (!in_.read(window_.data(), static_cast<std::streamsize>(window_.size()))) RefuseUnreadable(errno);
    }
    return window_.data() + (at_ - window_at_);
  }
  std::uint32_t Number(std::size_t bytes) {
    const char* data = Peek(bytes);
    std::uint32_t number = 0;
    for (std::size_t i = 0; i < bytes; ++i) number |= static_cast<std::uint32_t>(data[i] & 0xff) << (8 * i);
    at_ += bytes;
    return number;
  }
  std::uint32_t Tag() {
    const std::uint32_t group = Number(2);
    return group << 16 | Number(2);
  }
  /// A UID has at most 64 characters, padded by a zero.
  std::string Text(std::uint32_t length) {
    const std::string text(Peek(std::min<std::uint32_t>(length, 64)), std::min<std::uint32_t>(length, 64));
    return text.substr(0, text.find_first_not_of("0123456789."));
  }
  void Skip(std::uint32_t bytes) {
    if (bytes > size_ - at_) Peek(static_cast<std::size_t>(size_ - at_) + 1);
    at_ += bytes;
  }

  /// The header of an element that lies before `end`.
  Header ReadHeader(bool is_explicit, std::uint64_t end) {
    if (++tags_ > kMostTags) {
      Refuse("has more than " + std::to_string(kMostTags) + " elements; split the segmentation into several files");
    }
    Header header;
    const std::uint64_t begin = at_;
    header.tag = Tag();
    const bool has_type = is_explicit && header.tag >> 16 != 0xfffe;
    if (has_type) {
      std::memcpy(header.vr, Peek(2), 2);
      at_ += 2;
    }
    const std::string_view vr(header.vr, 2);
    if (!has_type) {
      header.length = Number(4);
    } else if (std::find(kLong.begin(), kLong.end(), vr) != kLong.end()) {
      Number(2);
      header.length = Number(4);
    } else if (std::find(kShort.begin(), kShort.end(), vr) != kShort.end()) {
      header.length = Number(2);
    } else {
      Refuse("element " + TagText(header.tag) + " at byte " + std::to_string(begin) +
             " has a type (VR) that DICOM does not know: the file is damaged; export it again");
    }
    if (at_ > end) {
      Refuse("element " + TagText(header.tag) + " at byte " + std::to_string(begin) + " exceeds what contains it by " +
             std::to_string(at_ - end) + " bytes: the file is damaged; export it again");
    }
    return header;
  }

  /// What every element must satisfy after the one with tag `last`.
  void Check(const Header& header, std::uint32_t last, std::uint64_t end) const {
    if (header.tag >> 16 == 0xfffe || header.tag <= last) {
      Refuse("element " + TagText(header.tag) + " before byte " + std::to_string(at_) + " follows " + TagText(last) +
             "; valid: in the order of their tags, each once. The file is damaged; export it again");
    }
    if (header.length != kUnknownLength && header.length > end - at_) {
      Refuse("element " + TagText(header.tag) + " at byte " + std::to_string(at_) + " has " +
             std::to_string(header.length) + " bytes, but " + std::to_string(end - at_) +
             " are left: the file is cut short or damaged; export or copy it again");
    }
  }

  /// Whether an element of known length without a type is a sequence. DCMTK takes the type from its dictionary, and any
  /// value may begin as an item does. Of one that the dictionary does not know, and of private ones, the beginning
  /// decides.
  bool HasItems(const Header& header, std::uint64_t end) {
    if (header.tag == kPixelData) return false;
    if (header.length < 8 || end - at_ < 4 || std::memcmp(Peek(4), "\xfe\xff\x00\xe0", 4) != 0) return false;
    const auto group = static_cast<Uint16>(header.tag >> 16), element = static_cast<Uint16>(header.tag & 0xffff);
    const DcmEVR type = DcmTag(group, element).getEVR();
    return group % 2 == 1 || type == EVR_SQ || type == EVR_UNKNOWN;
  }

  /// Elements up to `end`, or up to the delimiter of an item of unknown length.
  void Elements(std::uint64_t end, bool is_delimited, int level, bool is_explicit) {
    std::uint32_t last = 0;
    while (at_ < end) {
      const Header header = ReadHeader(is_explicit, end);
      if (is_delimited && header.tag == kEndOfItem && header.length == 0) return;
      Check(header, last, end);
      last = header.tag;
      const bool has_unknown_length = header.length == kUnknownLength;
      const std::string_view vr(header.vr, 2);
      if (has_unknown_length && header.tag == kPixelData) {
        Refuse("PixelData (7fe0,0010) is compressed; write it uncompressed, as 'dcmdrle IN OUT' does");
      }
      if (has_unknown_length && is_explicit && vr != "SQ" && vr != "UN") {
        Refuse("element " + TagText(header.tag) + " before byte " + std::to_string(at_) +
               " is a value without a length: the file is damaged; export it again");
      }
      const bool has_items = !is_explicit && !has_unknown_length && HasItems(header, end);
      // One of unknown type is implicit within.
      if (has_unknown_length || (is_explicit && vr == "SQ") || has_items) {
        Items(has_unknown_length ? end : at_ + header.length, has_unknown_length, level, is_explicit && vr != "UN");
      } else {
        at_ += header.length;
      }
    }
    if (is_delimited) RefuseOpen("an item");
  }

  void Items(std::uint64_t end, bool is_delimited, int level, bool is_explicit) {
    if (level >= kMostLevels) {
      Refuse("has sequences within sequences at byte " + std::to_string(at_) + "; valid: at most " +
             std::to_string(kMostLevels) + " levels");
    }
    while (at_ < end) {
      const Header header = ReadHeader(is_explicit, end);
      if (is_delimited && header.tag == kEndOfSequence && header.length == 0) return;
      const bool has_unknown_length = header.length == kUnknownLength;
      if (header.tag != kItem || (!has_unknown_length && header.length > end - at_)) {
        Refuse("has " + TagText(header.tag) + " of " + std::to_string(header.length) + " bytes before byte " +
               std::to_string(at_) +
               "; valid: an item (fffe,e000) within its sequence. The file is damaged; export "
               "it again");
      }
      Elements(has_unknown_length ? end : at_ + header.length, has_unknown_length, level + 1, is_explicit);
    }
    if (is_delimited) RefuseOpen("a sequence");
  }

  static constexpr std::size_t kWindow_B = 65536;

  const fs::path file_;
  std::ifstream in_;
  std::uint64_t size_ = 0, at_ = 0, window_at_ = 0;
  std::vector<char> window_;
  std::size_t tags_ = 0;
  std::string media_class_, transfer_syntax_;
};

}  // namespace

bool IsDicom(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  char bytes[kPreamble_B + 4] = {};
  return in.read(bytes, sizeof(bytes)) && std::string_view(bytes + kPreamble_B, 4) == kMagic;
}

std::string DicomClass(const fs::path& file) {
  if (!IsDicom(file)) return "";
  try {
    Outline outline(file);
    outline.ReadMeta();
    return outline.media_class();
  } catch (const InputError&) {
    return "";
  }
}

void CheckDicomOutline(const fs::path& file) {
  Outline outline(file);
  outline.ReadMeta();
  outline.ReadData();
}

}  // namespace fulcrum::scene
