// Who else is on the bus: names, schemas, and on a secured cart who was refused. Internal to
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

/// What a participant says of itself in USER_DATA: "fulcrum <hash> <node> (pid <pid>)".
[[nodiscard]] std::string UserDataOf(const std::string& name, std::uint64_t schema_hash);

/// Compares the schema of each peer that appears. On a secured cart a peer counts once it has authenticated: what
/// others say of themselves is believed only as far as to name them.
class PeerWatch final : public eprosima::fastdds::dds::DomainParticipantListener {
 public:
  /// @param leader name of the participant without which nobody stays.
  PeerWatch(std::string own_name, std::uint64_t own_hash, const Security& security, std::string leader = "supervisor");

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
  /// Those of that name that live.
  [[nodiscard]] std::vector<eprosima::fastrtps::rtps::GuidPrefix_t> Named(const std::string& name) const;
  /// Also of one that is gone by now.
  [[nodiscard]] Peer PeerOf(const eprosima::fastrtps::rtps::GuidPrefix_t& prefix) const;

 private:
  using Prefix = eprosima::fastrtps::rtps::GuidPrefix_t;
  /// Discovered, not (yet) one of us.
  struct Stranger {
    std::string text;  ///< Says of itself.
    std::string name;  ///< Of the participant, the same.
    std::string has;   ///< Why it cannot be one of us, as far as its announcement shows; empty: it may be.
    std::int64_t since_ns = 0;
    bool is_ours = false;  ///< A Fulcrum program, by its own word.
    bool counted = false;
  };

  void Admit(const Prefix& prefix, const std::string& text, const std::string& name);
  void Forget(const Prefix& prefix);
  void Refuse(Stranger* stranger, const std::string& why);
  void Tell(std::string text);
  void CheckEndpoint(const Prefix& prefix, const std::string& topic, bool writes);
  void LookAtStrangers(std::int64_t now_ns);

  const std::string own_name_, own_hash_, leader_;
  const Security security_;
  const std::string authority_;  ///< Name of our authority, as announcements carry it.
  mutable std::mutex mutex_;
  std::map<Prefix, Peer> peers_;
  std::set<Prefix> living_;
  std::map<Prefix, std::string> mismatches_;
  std::map<Prefix, Stranger> strangers_;
  std::set<std::pair<Prefix, std::string>> forbidden_;  ///< Endpoints that were counted.
  Refusals refusals_;
};

}  // namespace fulcrum::bus::dds
