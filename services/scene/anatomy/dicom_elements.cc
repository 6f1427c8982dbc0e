#include "services/scene/anatomy/dicom_elements.h"

#include <dcmtk/dcmdata/dcelem.h>
#include <dcmtk/dcmdata/dctag.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "services/base/core/error.h"
#include "services/base/core/utf8.h"

namespace fulcrum::scene {
namespace {

/// Of a decimal string, each value: DICOM allows 16, some programs write more.
constexpr unsigned kMostCharacters = 64;

}  // namespace

std::string DicomElements::Printable(const OFString& value) {
  const std::string text(value.data(), value.size());
  std::string line;
  for (std::size_t at = 0; at < text.size() && line.size() < 61;) {
    const std::size_t length = Utf8Length(text, at);
    const bool is_plain = length > 0 && static_cast<unsigned char>(text[at]) >= ' ' && text[at] != 0x7f;
    line += is_plain ? text.substr(at, length) : "?";
    at += std::max<std::size_t>(length, 1);
  }
  return line;
}

std::string DicomElements::NameOf(const DcmTagKey& key) {
  DcmTag tag(key);
  return std::string(tag.getTagName()) + " " + key.toString().c_str();
}

std::string DicomElements::Number(double value) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.6g", value);
  return text;
}

void DicomElements::Refuse(const std::string& reason) const { throw InputError(path_.string() + ": " + reason); }

void DicomElements::Refuse(const DcmTagKey& key, const std::string& where, const std::string& value,
                           const std::string& valid) const {
  Refuse(where + (where.empty() ? "" : ": ") + NameOf(key) + " is " + value + "; valid: " + valid);
}

std::string DicomElements::Text(DcmItem* item, const DcmTagKey& key) {
  OFString value;
  if (item->findAndGetOFStringArray(key, value).bad()) return "missing";
  return "'" + Printable(value) + "'";
}

int DicomElements::Integer(DcmItem* item, const DcmTagKey& key, int low, int high, const std::string& where) const {
  Uint16 unsigned_value = 0;
  Sint32 value = -1;
  // US, then IS.
  const bool is_read = item->findAndGetUint16(key, unsigned_value).good();
  if (is_read) value = unsigned_value;
  if ((!is_read && item->findAndGetSint32(key, value).bad()) || value < low || value > high) {
    Refuse(key, where, Text(item, key), std::to_string(low) + (low < high ? " to " + std::to_string(high) : ""));
  }
  return static_cast<int>(value);
}

void DicomElements::ReadNumbers(DcmItem* item, const DcmTagKey& key, const std::string& where, unsigned count,
                                double* numbers) const {
  DcmElement* element = nullptr;
  bool is_read = item->findAndGetElement(key, element).good() &&
                 element->getLengthField() <= count * (kMostCharacters + 1) && element->getVM() == count;
  for (unsigned i = 0; i < count && is_read; ++i) {
    is_read = element->getFloat64(numbers[i], i).good() && std::abs(numbers[i]) <= 1e6;
  }
  if (!is_read) {
    Refuse(key, where, Text(item, key),
           std::to_string(count) + (count == 1 ? " number" : " numbers") + " up to 1e6, of at most " +
               std::to_string(kMostCharacters) + " characters each");
  }
}

}  // namespace fulcrum::scene
