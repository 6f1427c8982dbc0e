#include "services/session/console/screen_text.h"

#include "services/base/core/utf8.h"

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
    const std::size_t length = Utf8Length(text, i);
    out.append(length > 0 ? text.substr(i, length) : "?");
    i += length > 0 ? length : 1;
  }
  return out;
}

}  // namespace fulcrum::console
