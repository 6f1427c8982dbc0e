#include "services/transport/keys/authority.h"

#include <openssl/bio.h>
#include <openssl/ec.h>
#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/pkcs7.h>
#include <openssl/rand.h>
#include <openssl/x509.h>
#include <openssl/x509v3.h>

#include <algorithm>
#include <cstdio>
#include <stdexcept>
#include <type_traits>

#include "services/base/core/error.h"

namespace fulcrum::keys {
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
using Name = std::unique_ptr<X509_NAME, Free<X509_NAME_free>>;
using Number = std::unique_ptr<BIGNUM, Free<BN_free>>;
using Revocations = std::unique_ptr<X509_CRL, Free<X509_CRL_free>>;
using Revoked = std::unique_ptr<X509_REVOKED, Free<X509_REVOKED_free>>;
using Time = std::unique_ptr<ASN1_TIME, Free<ASN1_TIME_free>>;
using Extension = std::unique_ptr<X509_EXTENSION, Free<X509_EXTENSION_free>>;
using Store = std::unique_ptr<X509_STORE, Free<X509_STORE_free>>;
using StoreContext = std::unique_ptr<X509_STORE_CTX, Free<X509_STORE_CTX_free>>;
using Pkcs7 = std::unique_ptr<PKCS7, Free<PKCS7_free>>;

constexpr int kSerialBits = 127;
constexpr long kVersion3 = 2;
constexpr long kListVersion2 = 1;

/// Last error of OpenSSL.
std::string Reason() {
  const unsigned long code = ERR_peek_last_error();
  const char* text = code == 0 ? nullptr : ERR_reason_error_string(code);
  ERR_clear_error();
  return text == nullptr ? "unknown reason" : text;
}

/// For calls that fail only for lack of memory or entropy.
template <class T>
T Must(T result, const char* what) {
  bool good = false;
  if constexpr (std::is_arithmetic_v<T>) {
    good = result > 0;
  } else {
    good = result != nullptr;
  }
  if (!good) throw std::runtime_error(std::string("OpenSSL: ") + what + ": " + Reason());
  return result;
}

Bio ToRead(const std::string& text) {
  return Bio(Must(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())), "buffer"));
}
Bio ToWrite() { return Bio(Must(BIO_new(BIO_s_mem()), "buffer")); }

std::string TextOf(const Bio& bio) {
  char* data = nullptr;
  const long size = BIO_get_mem_data(bio.get(), &data);
  return size > 0 ? std::string(data, static_cast<std::size_t>(size)) : std::string();
}

std::string Pem(X509* certificate) {
  const Bio out = ToWrite();
  Must(PEM_write_bio_X509(out.get(), certificate), "write a certificate");
  return TextOf(out);
}

std::string Pem(EVP_PKEY* key) {
  const Bio out = ToWrite();
  Must(PEM_write_bio_PrivateKey(out.get(), key, nullptr, nullptr, 0, nullptr, nullptr), "write a key");
  return TextOf(out);
}

Certificate ReadCertificate(const std::string& pem, const std::string& what) {
  ERR_clear_error();
  Certificate certificate(PEM_read_bio_X509(ToRead(pem).get(), nullptr, nullptr, nullptr));
  if (!certificate) throw InputError(what + ": is no certificate (PEM): " + Reason());
  return certificate;
}

std::string Pem(X509_CRL* revocations) {
  const Bio out = ToWrite();
  Must(PEM_write_bio_X509_CRL(out.get(), revocations), "write a revocation list");
  return TextOf(out);
}

Key ReadKey(const std::string& pem, const std::string& what) {
  ERR_clear_error();
  // A key with a password must not ask for it on the terminal.
  const auto no_password = [](char*, int, int, void*) { return -1; };
  Key key(PEM_read_bio_PrivateKey(ToRead(pem).get(), nullptr, no_password, nullptr));
  if (!key) throw InputError(what + ": is no private key (PEM, without a password): " + Reason());
  return key;
}

Revocations ReadRevocations(const std::string& pem, X509* authority, const std::string& what) {
  ERR_clear_error();
  Revocations list(PEM_read_bio_X509_CRL(ToRead(pem).get(), nullptr, nullptr, nullptr));
  if (!list) throw InputError(what + ": is no revocation list (PEM): " + Reason());
  if (X509_CRL_verify(list.get(), X509_get0_pubkey(authority)) != 1) {
    throw InputError(what + ": was not signed by this authority, or was changed since: " + Reason());
  }
  return list;
}

Name NameOf(const std::string& common_name) {
  Name name(Must(X509_NAME_new(), "name"));
  Must(X509_NAME_add_entry_by_txt(name.get(), "CN", MBSTRING_UTF8,
                                  reinterpret_cast<const unsigned char*>(common_name.data()),
                                  static_cast<int>(common_name.size()), -1, 0),
       "name");
  return name;
}

std::string CommonName(const X509_NAME* name) {
  std::array<char, 256> text{};
  const int size = X509_NAME_get_text_by_NID(name, NID_commonName, text.data(), text.size());
  return size > 0 ? std::string(text.data(), static_cast<std::size_t>(size)) : std::string();
}

std::time_t TimeOf(const ASN1_TIME* time) {
  std::tm parts{};
  return ASN1_TIME_to_tm(time, &parts) == 1 ? timegm(&parts) : 0;
}

void AddExtension(X509* certificate, X509* issuer, int kind, const char* value) {
  X509V3_CTX context;
  X509V3_set_ctx(&context, issuer, certificate, nullptr, nullptr, 0);
  const Extension extension(Must(X509V3_EXT_conf_nid(nullptr, &context, kind, value), "extension"));
  Must(X509_add_ext(certificate, extension.get(), -1), "extension");
}

std::string RandomHex() {
  std::array<unsigned char, 4> bytes{};
  Must(RAND_bytes(bytes.data(), bytes.size()), "random bytes");
  std::array<char, 9> text{};
  std::snprintf(text.data(), text.size(), "%02x%02x%02x%02x", bytes[0], bytes[1], bytes[2], bytes[3]);
  return text.data();
}

Key NewKey() { return Key(Must(EVP_EC_gen("P-256"), "new key")); }

Certificate NewCertificate(const std::string& name, EVP_PKEY* key, const Validity& validity) {
  Certificate certificate(Must(X509_new(), "new certificate"));
  Must(X509_set_version(certificate.get(), kVersion3), "version");
  const Number serial(Must(BN_new(), "serial number"));
  Must(BN_rand(serial.get(), kSerialBits, BN_RAND_TOP_ONE, BN_RAND_BOTTOM_ANY), "serial number");
  Must(BN_to_ASN1_INTEGER(serial.get(), X509_get_serialNumber(certificate.get())), "serial number");
  Must(ASN1_TIME_set(X509_getm_notBefore(certificate.get()), validity.from), "time");
  Must(ASN1_TIME_set(X509_getm_notAfter(certificate.get()), validity.until), "time");
  Must(X509_set_subject_name(certificate.get(), NameOf(name).get()), "subject");
  Must(X509_set_pubkey(certificate.get(), key), "public key");
  return certificate;
}

Store StoreWith(const std::string& authority) {
  Store store(Must(X509_STORE_new(), "store"));
  Must(X509_STORE_add_cert(store.get(), ReadCertificate(authority, "the authority's certificate").get()), "store");
  return store;
}

}  // namespace

struct Authority::Impl {
  Key key;
  Certificate certificate;
};

Authority::Authority(const Validity& validity) : impl_(std::make_unique<Impl>()) {
  impl_->key = NewKey();
  X509* certificate =
      (impl_->certificate = NewCertificate("Fulcrum authority " + RandomHex(), impl_->key.get(), validity)).get();
  Must(X509_set_issuer_name(certificate, X509_get_subject_name(certificate)), "issuer");
  AddExtension(certificate, certificate, NID_basic_constraints, "critical,CA:TRUE,pathlen:0");
  AddExtension(certificate, certificate, NID_key_usage, "critical,keyCertSign,cRLSign,digitalSignature");
  Must(X509_sign(certificate, impl_->key.get(), EVP_sha256()), "sign a certificate");
  certificate_ = Pem(certificate);
}

Authority::Authority(const std::string& certificate, const std::string& key, const std::string& what)
    : impl_(std::make_unique<Impl>()), certificate_(certificate) {
  impl_->key = ReadKey(key, what);
  impl_->certificate = ReadCertificate(certificate, "the authority's certificate");
  if (X509_check_private_key(impl_->certificate.get(), impl_->key.get()) != 1) {
    ERR_clear_error();
    throw InputError(what + ": is not the key of the authority \"" +
                     CommonName(X509_get_subject_name(impl_->certificate.get())) + "\"");
  }
}

Authority::~Authority() = default;

std::string Authority::private_key() const { return Pem(impl_->key.get()); }

Identity Authority::Issue(const std::string& name, const Validity& validity) const {
  const Key key = NewKey();
  const Certificate certificate = NewCertificate(name, key.get(), validity);
  Must(X509_set_issuer_name(certificate.get(), X509_get_subject_name(impl_->certificate.get())), "issuer");
  AddExtension(certificate.get(), impl_->certificate.get(), NID_basic_constraints, "critical,CA:FALSE");
  AddExtension(certificate.get(), impl_->certificate.get(), NID_key_usage, "critical,digitalSignature,keyAgreement");
  Must(X509_sign(certificate.get(), impl_->key.get(), EVP_sha256()), "sign a certificate");
  return {Pem(certificate.get()), Pem(key.get())};
}

std::string Authority::Sign(const std::string& document) const {
  // The library verifies with PKCS7_TEXT: the content must be text/plain.
  constexpr int kFlags = PKCS7_TEXT | PKCS7_DETACHED;
  const Bio in = ToRead(document);
  const Pkcs7 signature(
      Must(PKCS7_sign(impl_->certificate.get(), impl_->key.get(), nullptr, in.get(), kFlags), "sign"));
  Must(BIO_reset(in.get()), "rewind");
  const Bio out = ToWrite();
  Must(SMIME_write_PKCS7(out.get(), signature.get(), in.get(), kFlags), "write a signed document");
  return TextOf(out);
}

std::string Authority::NewRevocations() const {
  const Revocations list(Must(X509_CRL_new(), "new revocation list"));
  Must(X509_CRL_set_version(list.get(), kListVersion2), "version");
  Must(X509_CRL_set_issuer_name(list.get(), X509_get_subject_name(impl_->certificate.get())), "issuer");
  // Valid as long as the authority: a list that is not valid (yet) would keep everybody off the bus.
  Must(X509_CRL_set1_lastUpdate(list.get(), X509_get0_notBefore(impl_->certificate.get())), "time");
  Must(X509_CRL_set1_nextUpdate(list.get(), X509_get0_notAfter(impl_->certificate.get())), "time");
  Must(X509_CRL_sign(list.get(), impl_->key.get(), EVP_sha256()), "sign a revocation list");
  return Pem(list.get());
}

std::string Authority::Revoke(const std::string& revocations, const std::string& certificate,
                              const std::string& what) const {
  const Revocations list = ReadRevocations(revocations, impl_->certificate.get(), what);
  const Certificate bad = ReadCertificate(certificate, "the certificate to revoke");
  Revoked entry(Must(X509_REVOKED_new(), "new revocation"));
  Must(X509_REVOKED_set_serialNumber(entry.get(), X509_get_serialNumber(bad.get())), "serial number");
  const Time now(Must(ASN1_TIME_set(nullptr, std::time(nullptr)), "time"));
  Must(X509_REVOKED_set_revocationDate(entry.get(), now.get()), "time");
  Must(X509_CRL_add0_revoked(list.get(), entry.get()), "add a revocation");
  (void)entry.release();
  Must(X509_CRL_sort(list.get()), "sort");
  Must(X509_CRL_sign(list.get(), impl_->key.get(), EVP_sha256()), "sign a revocation list");
  return Pem(list.get());
}

AddressHead AddressHeadOf(const std::string& name) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned int size = 0;
  Must(X509_NAME_digest(NameOf(name).get(), EVP_sha256(), digest.data(), &size), "hash");
  // DDS Security 1.1, table 52: a one bit, then the first 47 of the hash.
  AddressHead head{};
  for (std::size_t i = 0; i < head.size(); ++i) {
    const unsigned carry = i == 0 ? 0x80u : (unsigned{digest[i - 1]} << 7 & 0xffu);
    head[i] = static_cast<std::uint8_t>(carry | unsigned{digest[i]} >> 1);
  }
  return head;
}

CertificateFacts FactsOf(const std::string& pem, const std::string& what) {
  const Certificate certificate = ReadCertificate(pem, what);
  return {CommonName(X509_get_subject_name(certificate.get())),
          CommonName(X509_get_issuer_name(certificate.get())),
          {TimeOf(X509_get0_notBefore(certificate.get())), TimeOf(X509_get0_notAfter(certificate.get()))}};
}

void VerifyCertificate(const std::string& pem, const std::string& authority, std::time_t now, const std::string& what) {
  const Certificate certificate = ReadCertificate(pem, what);
  const Store store = StoreWith(authority);
  const StoreContext context(Must(X509_STORE_CTX_new(), "store"));
  Must(X509_STORE_CTX_init(context.get(), store.get(), certificate.get(), nullptr), "store");
  X509_STORE_CTX_set_time(context.get(), 0, now);
  if (X509_verify_cert(context.get()) == 1) return;
  const int error = X509_STORE_CTX_get_error(context.get());
  ERR_clear_error();
  throw InputError(what + ": " + X509_verify_cert_error_string(error));
}

bool IsRevoked(const std::string& certificate, const std::string& revocations, const std::string& authority,
               const std::string& what) {
  const Certificate issuer = ReadCertificate(authority, "the authority's certificate");
  const Revocations list = ReadRevocations(revocations, issuer.get(), what);
  X509_REVOKED* entry = nullptr;
  const Certificate asked = ReadCertificate(certificate, "a certificate");
  return X509_CRL_get0_by_serial(list.get(), &entry, X509_get_serialNumber(asked.get())) == 1;
}

void VerifyKey(const std::string& pem, const std::string& certificate, const std::string& what) {
  const Key key = ReadKey(pem, what);
  if (X509_check_private_key(ReadCertificate(certificate, what).get(), key.get()) != 1) {
    ERR_clear_error();
    throw InputError(what + ": is not the key of the certificate beside it");
  }
}

std::string VerifySigned(const std::string& signed_document, const std::string& authority, const std::string& what) {
  ERR_clear_error();
  BIO* content = nullptr;
  const Pkcs7 signature(SMIME_read_PKCS7(ToRead(signed_document).get(), &content));
  const Bio owned(content);
  if (!signature) throw InputError(what + ": is no signed document (S/MIME): " + Reason());
  const Bio out = ToWrite();
  if (PKCS7_verify(signature.get(), nullptr, StoreWith(authority).get(), content, out.get(), PKCS7_TEXT) != 1) {
    throw InputError(what + ": was not signed by this authority, or was changed since: " + Reason());
  }
  std::string text = TextOf(out);
  std::erase(text, '\r');  // S/MIME ends its lines so.
  return text;
}

}  // namespace fulcrum::keys
