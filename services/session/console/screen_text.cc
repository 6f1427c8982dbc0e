#include "services/session/console/screen_text.h"

namespace fulcrum::console {

void ScreenText::Add(std::string_view bytes) {
  for (const char c : bytes) {
    if (escape_ == Escape::kBegun) {
      escape_ = c == '[' ? Escape::kSequence : Escape::kNone;
    } else if (escape_ == Escape::kSequence) {
      // A sequence ends with a letter. K clears to the right of the cursor: the whole line after a carriage return.
      if (c >= '@' && c <= '~') escape_ = Escape::kNone;
    } else if (c == '\x1b') {
      escape_ = Escape::kBegun;
    } else {
      Put(c);
    }
  }
}

void ScreenText::Put(char c) {
  if (c == '\n') {
    rewind_ = false;
    lines_.emplace_back();
    if (lines_.size() > kMostLines) lines_.pop_front();
  } else if (c == '\r') {
    rewind_ = true;
  } else if (static_cast<unsigned char>(c) >= 0x20 && c != 0x7f) {
    // After a carriage return, programs write the whole line again.
    if (rewind_) lines_.back().clear();
    rewind_ = false;
    if (lines_.back().size() < kLongestLine) lines_.back() += c;
  }
}

std::string ScreenText::Text() const {
  std::string text;
  for (const std::string& line : lines_) {
    if (&line != &lines_.front()) text += '\n';
    text += line;
  }
  return ValidUtf8(text);
}

std::string ValidUtf8(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size();) {
    const auto lead = static_cast<unsigned char>(text[i]);
    const std::size_t length = lead < 0x80                   ? 1
                               : lead >= 0xc2 && lead < 0xe0 ? 2
                               : (lead & 0xf0u) == 0xe0      ? 3
                               : lead >= 0xf0 && lead < 0xf5 ? 4
                                                             : 0;
    bool good = length > 0 && i + length <= text.size();
    std::uint32_t code = length == 1 ? lead : lead & (0x7fu >> length);
    for (std::size_t j = 1; good && j < length; ++j) {
      const auto next = static_cast<unsigned char>(text[i + j]);
      good = (next & 0xc0u) == 0x80;
      code = code << 6 | (next & 0x3fu);
    }
    // Invalid: overlong forms, halves of a surrogate pair, codes beyond the last character.
    good = good && !(length == 3 && (code < 0x800 || (code >= 0xd800 && code < 0xe000))) &&
           !(length == 4 && (code < 0x10000 || code > 0x10ffff));
    out.append(good ? text.substr(i, length) : "?");
    i += good ? length : 1;
  }
  return out;
}

}  // namespace fulcrum::console
