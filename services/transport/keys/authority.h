// The authority that certifies the participants of a cart, and what it issues. All cryptography is OpenSSL's.
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

/// Certificate authority with elliptic keys (P-256).
class Authority {
 public:
  /// A new authority. It has a random name, so that two authorities differ by name.
  explicit Authority(const Validity& validity);
  /// The authority with this certificate and private key (PEM). Throws InputError with `what`, the file of the key, if
  /// they do not belong together.
  Authority(const std::string& certificate, const std::string& key, const std::string& what);
  ~Authority();
  Authority(const Authority&) = delete;
  Authority& operator=(const Authority&) = delete;

  [[nodiscard]] const std::string& certificate() const { return certificate_; }
  /// PEM. Whoever has it can issue and revoke.
  [[nodiscard]] std::string private_key() const;
  /// @param name common name of the subject.
  [[nodiscard]] Identity Issue(const std::string& name, const Validity& validity) const;
  /// @return the document signed as S/MIME, the format that DDS Security requires.
  [[nodiscard]] std::string Sign(const std::string& document) const;
  /// A revocation list (PEM) without entries. It is valid as long as the authority.
  [[nodiscard]] std::string NewRevocations() const;
  /// @return `revocations`, a list of this authority, with `certificate` added.
  [[nodiscard]] std::string Revoke(const std::string& revocations, const std::string& certificate,
                                   const std::string& what) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
  std::string certificate_;
};

/// First six bytes of the address of a participant that has authenticated under this common name: the library derives
/// them from the subject of the certificate, and peers check it.
using AddressHead = std::array<std::uint8_t, 6>;
[[nodiscard]] AddressHead AddressHeadOf(const std::string& name);

/// Content of a certificate, read without verifying it.
struct CertificateFacts {
  std::string subject;  ///< Common name.
  std::string issuer;   ///< Common name.
  Validity validity;
};

/// Reads a certificate. Throws InputError with `what` (the file) and the reason, as the functions below do.
[[nodiscard]] CertificateFacts FactsOf(const std::string& certificate, const std::string& what);
/// Throws unless the certificate is signed by the authority and valid at the time `now`.
void VerifyCertificate(const std::string& certificate, const std::string& authority, std::time_t now,
                       const std::string& what);
/// @return whether the certificate is on the authority's revocation list. Throws InputError with `what`, the file of
/// the list, unless the list is signed by the authority.
[[nodiscard]] bool IsRevoked(const std::string& certificate, const std::string& revocations,
                             const std::string& authority, const std::string& what);
void VerifyKey(const std::string& key, const std::string& certificate, const std::string& what);
/// @return the signed document, if the authority has signed it; throws otherwise.
[[nodiscard]] std::string VerifySigned(const std::string& signed_document, const std::string& authority,
                                       const std::string& what);

}  // namespace fulcrum::keys
