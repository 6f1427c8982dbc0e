// The folder with the keys of a cart: made, read and checked here.
//
//   authority.pem              certificate of the authority; its private key is not kept
//   governance.p7s             rules of the domain, signed; governance-encrypted.p7s the same with encryption
//   NAME.pem NAME.key NAME.p7s certificate, private key and permissions of one participant
//   (services/transport/bus/access.h)
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "services/transport/keys/authority.h"
#include "services/transport/keys/documents.h"

namespace fulcrum::keys {

/// Default place of the keys: ~/.config/fulcrum/keys; without a home directory /etc/fulcrum/keys.
[[nodiscard]] std::filesystem::path DefaultKeyFolder();

/// The files that one participant needs.
struct KeyFiles {
  std::filesystem::path authority, governance, certificate, key, permissions;
};
[[nodiscard]] KeyFiles KeyFilesOf(const std::filesystem::path& folder, std::string_view identity, bool encrypt);

/// Makes the folder (mode 0700) with a new authority and an identity for every role of the table. Throws InputError if
/// the folder has keys already, unless `force`: then the whole folder is replaced, and certificates of the old
/// authority are no longer accepted.
void MakeKeyFolder(const std::filesystem::path& folder, const Validity& validity, bool force);

/// Fills an existing folder with identities issued by `authority`.
void FillKeyFolder(const std::filesystem::path& folder, const Authority& authority, const Validity& validity);

/// Throws InputError when `identity` cannot join with the keys of this folder: missing, unreadable, readable by other
/// users, not of one authority, expired, changed, or with other rights than this version needs. The message contains
/// file, reason and what to do.
/// @return validity of the certificate.
Validity CheckIdentity(const std::filesystem::path& folder, std::string_view identity, bool encrypt, std::time_t now);

/// Common name of the authority. Throws InputError.
[[nodiscard]] std::string AuthorityName(const std::filesystem::path& folder);

/// State of one participant of the table in the folder.
struct IdentityState {
  const bus::AccessRole* role = nullptr;
  bool present = false;  ///< At least one of its files is there.
  Validity validity;
  std::string problem;  ///< Empty: the participant can join.
};
/// Throws InputError when the folder or the authority's own files cannot be used.
[[nodiscard]] std::vector<IdentityState> InspectKeyFolder(const std::filesystem::path& folder, std::time_t now);

/// Date in UTC, as "2030-01-31".
[[nodiscard]] std::string DateOf(std::time_t time);

}  // namespace fulcrum::keys
