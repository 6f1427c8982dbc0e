// The folder with the keys of a cart: made, read and checked here.
//
//   authority.pem              certificate of the authority; its private key is not kept anywhere
//   governance.p7s             what holds in the domain, signed; governance-encrypted.p7s the same with encryption
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

/// Where they lie when nobody says otherwise: ~/.config/fulcrum/keys.
[[nodiscard]] std::filesystem::path DefaultKeyFolder();

/// The files that one participant needs.
struct KeyFiles {
  std::filesystem::path authority, governance, certificate, key, permissions;
};
[[nodiscard]] KeyFiles KeyFilesOf(const std::filesystem::path& folder, std::string_view identity, bool encrypt);

/// Makes the folder (mode 0700) with a new authority and an identity for everybody of the table. Throws InputError when
/// there is one already, unless `force`, which replaces it whole: what the old authority vouched for is worth nothing
/// then.
void MakeKeyFolder(const std::filesystem::path& folder, const Validity& validity, bool force);

/// The same into a folder that is there, by an authority of the caller's.
void FillKeyFolder(const std::filesystem::path& folder, const Authority& authority, const Validity& validity);

/// Throws InputError when `identity` cannot join with the keys of this folder: missing, unreadable, open to others,
/// not of one authority, expired, changed, or with other rights than this version has. Says file, reason, what to do.
/// @return validity of the certificate.
Validity CheckIdentity(const std::filesystem::path& folder, std::string_view identity, bool encrypt, std::time_t now);

/// Common name of the authority. Throws InputError.
[[nodiscard]] std::string AuthorityName(const std::filesystem::path& folder);

/// One participant of the table, as the folder has it.
struct IdentityState {
  const bus::AccessRole* role = nullptr;
  bool present = false;  ///< At least one of its files is there.
  Validity validity;
  std::string problem;  ///< Empty: can join.
};
/// Throws InputError when the folder or the authority's own files are of no use.
[[nodiscard]] std::vector<IdentityState> InspectKeyFolder(const std::filesystem::path& folder, std::time_t now);

/// "2030-01-31".
[[nodiscard]] std::string DateOf(std::time_t time);

}  // namespace fulcrum::keys
