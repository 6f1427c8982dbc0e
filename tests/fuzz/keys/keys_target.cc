// Any bytes as a certificate, a private key or a signed document. An input that begins as one of these files is used as
// such a file. In any other input the first byte selects the kind of file whose binary content the rest is; the content
// is packed into text as in the file, because changes of the text alone seldom reach the content. Keys and documents
// must belong to the certificate and authority of the corpus, made for this and used nowhere else.
#include <openssl/evp.h>

#include <algorithm>

#include "services/base/core/error.h"
#include "services/transport/keys/authority.h"
#include "tests/fuzz/target.h"

// Only the address sanitizer looks for leaks; gcc and clang report it in different ways.
#if defined(__has_feature)
#if __has_feature(address_sanitizer)
#define FULCRUM_FINDS_LEAKS
#endif
#elif defined(__SANITIZE_ADDRESS__)
#define FULCRUM_FINDS_LEAKS
#endif
#ifdef FULCRUM_FINDS_LEAKS
#include <sanitizer/lsan_interface.h>
#endif

namespace fulcrum::fuzz {
namespace {

constexpr std::time_t kNow = 1'800'000'000;
constexpr const char* kCorpus = FULCRUM_SOURCE_DIR "/tests/fuzz/corpus/keys/";
constexpr std::string_view kDocumentBegin = "MIME-Version";

std::string Read(const std::string& name) {
  const Bytes bytes = ReadFile(kCorpus + name);
  return {bytes.begin(), bytes.end()};
}

/// Base64 in lines of 64 characters.
std::string InText(Input content) {
  std::string all(content.size() * 2 + 8, '\0'), lines;
  all.resize(static_cast<std::size_t>(
      EVP_EncodeBlock(reinterpret_cast<unsigned char*>(all.data()), content.data(), static_cast<int>(content.size()))));
  constexpr std::size_t kLine = 64;
  for (std::size_t at = 0; at < all.size(); at += kLine) lines.append(all, at, kLine).append("\n");
  return lines;
}
/// The inverse, of the lines between two marks.
Bytes FromText(const std::string& file, const std::string& begin, const std::string& end) {
  const std::size_t from = file.find(begin) + begin.size();
  std::string text = file.substr(from, file.find(end, from) - from);
  std::erase_if(text, [](char c) { return c == '\n' || c == '\r'; });
  Bytes content(text.size());
  const int size = EVP_DecodeBlock(content.data(), reinterpret_cast<const unsigned char*>(text.data()),
                                   static_cast<int>(text.size()));
  content.resize(size < 0 ? 0
                          : static_cast<std::size_t>(size) -
                                static_cast<std::size_t>(std::count(text.begin(), text.end(), '=')));
  return content;
}

enum Kind : std::uint8_t { kCertificate, kKey, kDocument };
constexpr int kKinds = 3;

class Keys final : public Target {
 public:
  Outcome Offer(Input input) override {
    if (input.empty()) return Outcome::kRefused;
    const std::string_view text = TextOf(input);
    try {
      if (text.starts_with("-----BEGIN CERTIFICATE")) {
        CheckCertificate(std::string(text));
      } else if (text.starts_with("-----BEGIN")) {
        keys::VerifyKey(std::string(text), certificate_, "it");
      } else if (text.starts_with(kDocumentBegin)) {
        CheckDocument(std::string(text));
      } else {
        const std::string packed = InText(input.subspan(1));
        switch (static_cast<Kind>(input[0] % kKinds)) {
          case kCertificate:
            CheckCertificate("-----BEGIN CERTIFICATE-----\n" + packed + "-----END CERTIFICATE-----\n");
            break;
          case kKey:
            keys::VerifyKey("-----BEGIN PRIVATE KEY-----\n" + packed + "-----END PRIVATE KEY-----\n", certificate_,
                            "it");
            break;
          case kDocument:
            CheckDocument(document_.substr(0, document_content_) + packed + document_.substr(document_end_));
            break;
        }
      }
      return Outcome::kAccepted;
    } catch (const InputError& refusal) {
      Promise(std::string_view(refusal.what()).starts_with("it: "), "a refusal that does not name the file");
      return Outcome::kRefused;
    }
  }
  std::vector<Seed> Seeds() override {
    const auto binary = [](Kind kind, Bytes content) {
      content.insert(content.begin(), kind);
      return content;
    };
    return {
        {"certificate_binary", binary(kCertificate, FromText(certificate_, "CERTIFICATE-----", "-----END"))},
        {"key_binary", binary(kKey, FromText(Read("good_key"), "BEGIN PRIVATE KEY-----", "-----END"))},
        {"document_binary",
         binary(kDocument, FromText(document_.substr(document_content_, document_end_ - document_content_), "", "-"))}};
  }

 private:
  void CheckCertificate(const std::string& text) const {
    (void)keys::FactsOf(text, "it");
    keys::VerifyCertificate(text, authority_, kNow, "it");
  }
  void CheckDocument(const std::string& text) const {
#ifdef FULCRUM_FINDS_LEAKS
    // PKCS7_verify of OpenSSL 3.0 does not free its copy of the document when the signature cannot be read, which
    // occurs once per start.
    const __lsan::ScopedDisabler leaks;
#endif
    const std::string signed_text = keys::VerifySigned(text, authority_, "it");
    Promise(signed_text == content_, "a document was accepted that the authority has not signed");
  }

  const std::string authority_ = Read("good_authority"), certificate_ = Read("good_certificate"),
                    document_ = Read("good_document");
  const std::string content_ = keys::VerifySigned(document_, authority_, "it");
  /// Place of the signature in the document's text.
  const std::size_t document_end_ = document_.rfind("\n\n--") + 1,
                    document_content_ = document_.rfind("\n\n", document_end_ - 2) + 2;
};

}  // namespace

std::unique_ptr<Target> MakeKeys() { return std::make_unique<Keys>(); }

}  // namespace fulcrum::fuzz
