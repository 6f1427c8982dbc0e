#include "services/session/console/greeting.h"

#include <qrencode.h>

#include <memory>

namespace fulcrum::console {
namespace {

// Light modules around a code without which readers do not find it (ISO/IEC 18004 asks for four; two are read as well
// from a screen and leave room for the text).
constexpr int kMargin = 2;

struct FreeCode {
  void operator()(QRcode* code) const { QRcode_free(code); }
};

}  // namespace

std::string QrCode(const std::string& text) {
  const std::unique_ptr<QRcode, FreeCode> code(QRcode_encodeString(text.c_str(), 0, QR_ECLEVEL_L, QR_MODE_8, 1));
  if (!code) return {};
  const int width = code->width;
  const auto dark = [&](int x, int y) {
    return x >= 0 && y >= 0 && x < width && y < width && (code->data[y * width + x] & 1u) != 0;
  };
  std::string lines;
  for (int y = -kMargin; y < width + kMargin; y += 2) {
    // Black on white whatever the colours of the terminal are. A character shows two modules, one above the other.
    lines += "\033[30;107m";
    for (int x = -kMargin; x < width + kMargin; ++x) {
      const bool upper = dark(x, y), lower = dark(x, y + 1);
      lines += upper && lower ? "\u2588" : upper ? "\u2580" : lower ? "\u2584" : " ";
    }
    lines += "\033[0m\n";
  }
  return lines;
}

std::string Greeting(const GreetingFacts& facts, bool terminal) {
  const std::string opened = facts.address + "#" + facts.token;
  std::string text = "open " + (terminal ? opened : facts.address + "#TOKEN") + "\n";
  if (terminal && !facts.fingerprint.empty()) text += QrCode(opened);
  text += (terminal ? "token in " : "TOKEN is the line in ") + facts.token_file.string() + "\n";
  if (!facts.fingerprint.empty()) {
    text += "certificate made on this machine" + std::string(facts.new_fingerprint ? ", new" : "") +
            "; compare what the browser shows before you accept it:\n  SHA-256 " + facts.fingerprint + "\n";
  }
  return text + "Ctrl-C ends the console; a running session goes on\n";
}

}  // namespace fulcrum::console
