// The other participants on the bus: names, schemas, and on a secured cart which ones were refused. Internal to
// services/transport/bus/dds.
#pragma once

#include <fastdds/rtps/common/Guid.h>

#include <cstdint>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "services/transport/bus/access.h"
#include "services/transport/bus/raw_input.h"
#include "services/transport/bus/security.h"

namespace fulcrum::bus::dds {

/// Text that a participant publishes in USER_DATA: "fulcrum <hash> <node> (pid <pid>, uid <uid>) <proof>". The proof is
/// a message authentication code of the text before it, with the number of the session as its key: only a process that
/// can read the cart's private directory can make it.
[[nodiscard]] std::string UserDataOf(const std::string& name, std::uint64_t schema_hash, std::uint64_t session);

/// Compares session and schema of each peer that appears. A peer of another session is counted, named and otherwise
/// disregarded; one of this session with another schema is a mismatch. On a secured cart a peer counts once it has
/// authenticated; the text of an unauthenticated participant is used only to name it.
class PeerWatch final : public eprosima::fastdds::dds::DomainParticipantListener {
 public:
  /// @param leader name of the participant without which no other stays.
  PeerWatch(std::string own_name, std::uint64_t own_hash, const Security& security, std::uint64_t session = 0,
            std::string leader = "supervisor");

  void on_participant_discovery(eprosima::fastdds::dds::DomainParticipant*,
                                eprosima::fastrtps::rtps::ParticipantDiscoveryInfo&& info) override;
  void onParticipantAuthentication(eprosima::fastdds::dds::DomainParticipant*,
                                   eprosima::fastrtps::rtps::ParticipantAuthenticationInfo&& info) override;
  void on_publisher_discovery(eprosima::fastdds::dds::DomainParticipant*,
                              eprosima::fastrtps::rtps::WriterDiscoveryInfo&& info) override;
  void on_subscriber_discovery(eprosima::fastdds::dds::DomainParticipant*,
                               eprosima::fastrtps::rtps::ReaderDiscoveryInfo&& info) override;

  /// Empty, or one line naming a peer of another schema, or a leader that does not accept this participant.
  [[nodiscard]] std::string mismatch();
  [[nodiscard]] Refusals refusals();
  /// Live participants of that name.
  [[nodiscard]] std::vector<eprosima::fastrtps::rtps::GuidPrefix_t> Named(const std::string& name) const;
  /// The process behind an address, also after it has left.
  [[nodiscard]] Peer PeerOf(const eprosima::fastrtps::rtps::GuidPrefix_t& prefix) const;

 private:
  using Prefix = eprosima::fastrtps::rtps::GuidPrefix_t;
  /// A participant that was discovered but has not been admitted (yet).
  struct Stranger {
    std::string text;      ///< Its USER_DATA.
    std::string name;      ///< Its participant name, unverified.
    std::string identity;  ///< Of its keys, once it has authenticated.
    std::string has;       ///< Reason for which its announcement rules it out; empty: it may be admitted.
    std::int64_t since_ns = 0;
    bool is_ours = false;  ///< A Fulcrum program according to its own USER_DATA.
    bool counted = false;
    bool foreign = false;  ///< Of another session.
  };

  /// @param guest identity outside of the table; empty: a participant of the table, or a cart without keys.
  void Admit(const Prefix& prefix, const std::string& text, const std::string& name, const std::string& guest = {});
  void Remove(const Prefix& prefix);
  void Refuse(Stranger* stranger, const std::string& why);
  void Tell(std::string text);
  void CheckEndpoint(const Prefix& prefix, const std::string& topic, bool writes);
  void Forbid(const Prefix& prefix, const std::string& identity, const std::string& what);
  void LookAtStrangers(std::int64_t now_ns);
  /// The library decides from the signed permissions what a guest may do; only its log tells what it has refused.
  void LookAtGuests();

  const std::string own_name_, own_hash_, leader_;
  const Security security_;
  const std::uint64_t session_;
  const std::string authority_;  ///< Name of our authority, as in announcements.
  mutable std::mutex mutex_;
  std::map<Prefix, Peer> peers_;
  std::set<Prefix> living_;
  std::map<Prefix, std::string> mismatches_;
  std::map<Prefix, Stranger> strangers_;
  std::map<Prefix, std::string> guests_;  ///< Identities outside of the table, admitted, also after they have left.
  std::set<std::pair<Prefix, std::string>> forbidden_;  ///< Endpoints that were counted.
  Refusals refusals_;
};

}  // namespace fulcrum::bus::dds
