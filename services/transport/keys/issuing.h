// What the authority of a key folder does after the folder was made: admits guests and revokes certificates. And the
// keys of one session, which are made when it starts and removed when it ends.
#pragma once

#include <filesystem>
#include <string>

#include "services/transport/keys/key_folder.h"

namespace fulcrum::keys {

/// Makes the keys of one session: the folder (mode 0700) and the private key of its authority beside it. Replaces what
/// an earlier session has left there. The parent must exist. Takes milliseconds; throws InputError.
void MakeSessionKeys(const std::filesystem::path& folder, const Validity& validity);
/// Removes both; nothing there is no error.
void RemoveSessionKeys(const std::filesystem::path& folder) noexcept;

/// The authority of the folder. Throws InputError if its private key is not on this machine.
[[nodiscard]] Authority OpenAuthority(const std::filesystem::path& folder);

/// Topics of a list such as "Health,ToolState", of `option`. Throws InputError with all valid names.
[[nodiscard]] bus::TopicSet TopicsNamed(const std::string& list, const std::string& option);

struct GuestOrder {
  std::string name;
  bus::TopicSet writes = 0, reads = 0;
  Validity validity;               ///< Ends with that of the authority at the latest.
  std::filesystem::path out = {};  ///< New folder to hand over, with the private key; empty: the key stays here.
};
/// Issues an identity for a tool of somebody else. Participants that run admit it at once. Throws InputError if the
/// name is not valid or has an identity that is neither revoked nor expired.
/// @return validity of the certificate.
Validity IssueGuest(const std::filesystem::path& folder, const GuestOrder& order);

/// Puts the identity's certificate on the revocation list of the folder. Participants that start from then on refuse
/// it; the library reads the list only then. Throws InputError if the folder has no such certificate, or it is revoked.
void Revoke(const std::filesystem::path& folder, const std::string& identity);

}  // namespace fulcrum::keys
