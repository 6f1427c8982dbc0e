// An authority that vouches for the participants of a cart, and what it issues. OpenSSL does all of it.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>

#include "services/transport/keys/documents.h"

namespace fulcrum::keys {

struct Identity {
  std::string certificate;  ///< PEM.
  std::string key;          ///< PEM, private.
};

/// Elliptic keys (P-256). Its private key is in memory only: who has none cannot issue in its name.
class Authority {
 public:
  /// Named at random, so that two authorities are told apart by name.
  explicit Authority(const Validity& validity);
  ~Authority();
  Authority(const Authority&) = delete;
  Authority& operator=(const Authority&) = delete;

  [[nodiscard]] const std::string& certificate() const { return certificate_; }
  /// @param name common name of the subject.
  [[nodiscard]] Identity Issue(const std::string& name, const Validity& validity) const;
  /// S/MIME, as DDS Security asks for.
  [[nodiscard]] std::string Sign(const std::string& document) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
  std::string certificate_;
};

/// First six bytes of the address of a participant that has authenticated under this common name: the library derives
/// them from the subject of the certificate, and peers check it.
using AddressHead = std::array<std::uint8_t, 6>;
[[nodiscard]] AddressHead AddressHeadOf(const std::string& name);

/// What can be said of a certificate without trusting it.
struct CertificateFacts {
  std::string subject;  ///< Common name.
  std::string issuer;   ///< Common name.
  Validity validity;
};

/// The rest throws InputError with `what` (a file) and the reason.
[[nodiscard]] CertificateFacts FactsOf(const std::string& certificate, const std::string& what);
/// The authority's certificate vouches for it, at this time.
void VerifyCertificate(const std::string& certificate, const std::string& authority, std::time_t now,
                       const std::string& what);
void VerifyKey(const std::string& key, const std::string& certificate, const std::string& what);
/// The document inside, if the authority has signed it.
[[nodiscard]] std::string VerifySigned(const std::string& signed_document, const std::string& authority,
                                       const std::string& what);

}  // namespace fulcrum::keys
