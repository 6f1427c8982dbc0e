// The folder with the keys of a cart: made, read and checked here.
//
//   authority.pem              certificate of the authority; its private key lies beside the folder, in DIR.authority
//   revoked.pem                certificates that are no longer accepted, signed
//   governance.p7s             rules of the domain, signed; governance-encrypted.p7s the same with encryption
//   NAME.pem NAME.key NAME.p7s certificate, private key and permissions of one participant
//                              (services/transport/bus/access.h), or of a guest: a tool of somebody else
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
  std::filesystem::path authority, governance, certificate, key, permissions, revocations;
};
[[nodiscard]] KeyFiles KeyFilesOf(const std::filesystem::path& folder, std::string_view identity, bool encrypt);

/// File of the authority's private key: "DIR.authority" beside the folder, because the folder is copied to other hosts.
[[nodiscard]] std::filesystem::path AuthorityKeyFile(const std::filesystem::path& folder);

/// Whether identities may be issued under this name to tools of somebody else: 1 to 32 of a-z, 0-9, "_" and "-", not an
/// identity of the table, not a file of the folder.
[[nodiscard]] bool IsGuestName(std::string_view name);

/// Makes the folder (mode 0700) with a new authority and an identity for every role of the table, and the file of
/// its private key. Throws InputError if the folder has keys already, unless `force`: then folder and file are
/// replaced, and certificates of the old authority are no longer accepted.
void MakeKeyFolder(const std::filesystem::path& folder, const Validity& validity, bool force);

/// Fills an existing folder with identities issued by `authority`.
void FillKeyFolder(const std::filesystem::path& folder, const Authority& authority, const Validity& validity);

/// Throws InputError when `identity` cannot join with the keys of this folder: missing, unreadable, readable by other
/// users, not of one authority, expired, revoked, changed, or with other rights than this version needs. The message
/// contains file, reason and what to do.
/// @return validity of the certificate.
Validity CheckIdentity(const std::filesystem::path& folder, std::string_view identity, bool encrypt, std::time_t now);

/// Common name of the authority. Throws InputError.
[[nodiscard]] std::string AuthorityName(const std::filesystem::path& folder);

/// State of one participant in the folder.
struct IdentityState {
  std::string identity;
  bool guest = false;    ///< Not in the table; its rights are those that the authority has signed.
  bool present = false;  ///< At least one of its files is there.
  bool has_key = false;  ///< False for a guest whose key was handed over.
  bool revoked = false;
  bus::TopicSet writes = 0, reads = 0;
  Validity validity;
  std::string problem;  ///< Empty: the participant can join.
};
/// All participants of the table, then all guests. Throws InputError when the folder or the authority's own files
/// cannot be used.
[[nodiscard]] std::vector<IdentityState> InspectKeyFolder(const std::filesystem::path& folder, std::time_t now);

/// Date in UTC, as "2030-01-31".
[[nodiscard]] std::string DateOf(std::time_t time);

}  // namespace fulcrum::keys
