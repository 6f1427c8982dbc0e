#include "services/session/console/tls_identity.h"

#include <arpa/inet.h>
#include <openssl/bio.h>
#include <openssl/bn.h>
#include <openssl/ec.h>
#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509.h>
#include <openssl/x509v3.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <memory>
#include <stdexcept>

#include "services/base/core/error.h"
#include "services/base/runtime/private_file.h"

namespace fulcrum::console {
namespace {

template <auto free>
struct Free {
  template <class T>
  void operator()(T* object) const {
    free(object);
  }
};
using Bio = std::unique_ptr<BIO, Free<BIO_free_all>>;
using Key = std::unique_ptr<EVP_PKEY, Free<EVP_PKEY_free>>;
using Certificate = std::unique_ptr<X509, Free<X509_free>>;
using Number = std::unique_ptr<BIGNUM, Free<BN_free>>;
using Extension = std::unique_ptr<X509_EXTENSION, Free<X509_EXTENSION_free>>;

constexpr std::time_t kDay = 24 * 3600;
// Longest validity that browsers of Apple accept from an authority of the user's own.
constexpr std::time_t kValidity = 825 * kDay;
constexpr std::time_t kRenewal = 30 * kDay;
constexpr std::size_t kLargestFile = 64 * 1024;
constexpr int kSerialBits = 127;
constexpr long kVersion3 = 2;

/// For calls that fail only for lack of memory or entropy.
void Must(bool good, const char* what) {
  if (!good) throw std::runtime_error(std::string("OpenSSL: cannot make a certificate: ") + what);
}

std::string TextOf(const Bio& bio) {
  char* data = nullptr;
  const long size = BIO_get_mem_data(bio.get(), &data);
  return size > 0 ? std::string(data, static_cast<std::size_t>(size)) : std::string();
}
Bio Reader(const std::string& text) { return Bio(BIO_new_mem_buf(text.data(), static_cast<int>(text.size()))); }

std::string FingerprintOf(const X509* certificate) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned int size = 0;
  Must(X509_digest(certificate, EVP_sha256(), digest.data(), &size) == 1, "hash");
  std::string text;
  for (unsigned int i = 0; i < size; ++i) {
    if (i > 0) text += ':';
    text += "0123456789ABCDEF"[digest[i] >> 4];
    text += "0123456789ABCDEF"[digest[i] & 15u];
  }
  return text;
}

/// True for letters, digits, '-' and '.': what a name may hold without a meaning in OpenSSL's configuration.
bool IsHostName(const std::string& name) {
  return !name.empty() && name.size() <= 253 && std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '-' || c == '.';
  });
}

/// Subject alternative names: browsers read nothing else.
std::string AlternativeNames(const std::vector<std::string>& names) {
  std::array<unsigned char, sizeof(in6_addr)> address{};
  std::string text;
  for (const std::string& name : names) {
    const bool numeric = ::inet_pton(AF_INET, name.c_str(), address.data()) == 1 ||
                         ::inet_pton(AF_INET6, name.c_str(), address.data()) == 1;
    if (!numeric && !IsHostName(name)) continue;
    text += (text.empty() ? "" : ",") + std::string(numeric ? "IP:" : "DNS:") + name;
  }
  return text;
}

void AddExtension(X509* certificate, int kind, const std::string& value) {
  X509V3_CTX context;
  X509V3_set_ctx(&context, certificate, certificate, nullptr, nullptr, 0);
  const Extension extension(X509V3_EXT_conf_nid(nullptr, &context, kind, value.c_str()));
  Must(extension != nullptr && X509_add_ext(certificate, extension.get(), -1) == 1, "extension");
}

/// The identity that the two texts hold. Throws InputError.
TlsIdentity Parsed(std::string certificate, std::string key, const std::filesystem::path& file) {
  ERR_clear_error();
  // A key with a password must not ask for it on the terminal.
  const auto no_password = [](char*, int, int, void*) { return -1; };
  const Certificate parsed(PEM_read_bio_X509(Reader(certificate).get(), nullptr, nullptr, nullptr));
  const Key parsed_key(PEM_read_bio_PrivateKey(Reader(key).get(), nullptr, no_password, nullptr));
  const bool good = parsed && parsed_key && X509_check_private_key(parsed.get(), parsed_key.get()) == 1;
  std::tm begin{}, end{};
  const bool dated = good && ASN1_TIME_to_tm(X509_get0_notBefore(parsed.get()), &begin) == 1 &&
                     ASN1_TIME_to_tm(X509_get0_notAfter(parsed.get()), &end) == 1;
  ERR_clear_error();
  if (!dated) {
    throw InputError(file.string() +
                     ": is no certificate with its key beside it (console.key); remove both files to get new ones");
  }
  std::string fingerprint = FingerprintOf(parsed.get());
  return {std::move(certificate), std::move(key), std::move(fingerprint), ::timegm(&begin), ::timegm(&end)};
}

}  // namespace

TlsIdentity MakeTlsIdentity(const std::vector<std::string>& names, std::time_t now) {
  const Key key(EVP_EC_gen("P-256"));
  const Certificate made(X509_new());
  const Number serial(BN_new());
  Must(key && made && serial, "new key");
  X509* const certificate = made.get();
  Must(BN_rand(serial.get(), kSerialBits, BN_RAND_TOP_ONE, BN_RAND_BOTTOM_ANY) == 1, "serial number");
  Must(BN_to_ASN1_INTEGER(serial.get(), X509_get_serialNumber(certificate)) != nullptr, "serial number");
  Must(X509_set_version(certificate, kVersion3) == 1, "version");
  // An hour ago: the clock of the client may be behind.
  const std::time_t from = now - 3600, until = now + kValidity;
  Must(ASN1_TIME_set(X509_getm_notBefore(certificate), from) != nullptr, "time");
  Must(ASN1_TIME_set(X509_getm_notAfter(certificate), until) != nullptr, "time");
  X509_NAME* const subject = X509_get_subject_name(certificate);
  const auto* common = reinterpret_cast<const unsigned char*>("Fulcrum console");
  Must(X509_NAME_add_entry_by_txt(subject, "CN", MBSTRING_UTF8, common, -1, -1, 0) == 1, "name");
  Must(X509_set_issuer_name(certificate, subject) == 1, "name");
  Must(X509_set_pubkey(certificate, key.get()) == 1, "public key");
  AddExtension(certificate, NID_basic_constraints, "critical,CA:FALSE");
  AddExtension(certificate, NID_key_usage, "critical,digitalSignature");
  AddExtension(certificate, NID_ext_key_usage, "serverAuth");
  if (const std::string alternatives = AlternativeNames(names); !alternatives.empty()) {
    AddExtension(certificate, NID_subject_alt_name, alternatives);
  }
  Must(X509_sign(certificate, key.get(), EVP_sha256()) > 0, "signature");
  const Bio pem(BIO_new(BIO_s_mem())), key_pem(BIO_new(BIO_s_mem()));
  Must(PEM_write_bio_X509(pem.get(), certificate) == 1, "write");
  Must(PEM_write_bio_PrivateKey(key_pem.get(), key.get(), nullptr, nullptr, 0, nullptr, nullptr) == 1, "write");
  return {TextOf(pem), TextOf(key_pem), FingerprintOf(certificate), from, until};
}

TlsIdentity LoadTlsIdentity(const std::filesystem::path& folder, const std::vector<std::string>& names, std::time_t now,
                            bool* made) {
  const std::filesystem::path file = folder / "console.pem", key_file = folder / "console.key";
  std::error_code error;
  const bool stored = std::filesystem::exists(file, error) && std::filesystem::exists(key_file, error);
  if (stored) {
    TlsIdentity identity =
        Parsed(runtime::ReadPrivateFile(file, kLargestFile, "certificate"),
               runtime::ReadPrivateFile(key_file, kLargestFile, "key of the console's certificate"), file);
    *made = identity.until < now + kRenewal || identity.from > now;
    if (!*made) return identity;
  }
  *made = true;
  TlsIdentity identity = MakeTlsIdentity(names, now);
  runtime::WritePrivateFile(key_file, identity.key, "key of the console's certificate");
  runtime::WritePrivateFile(file, identity.certificate, "certificate");
  return identity;
}

}  // namespace fulcrum::console
