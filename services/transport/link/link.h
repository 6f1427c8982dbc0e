// Joins the buses of two hosts without any change to the nodes: topics that nodes of the other host read are sent
// there, and what those nodes publish is republished here. See DESIGN.md.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "services/transport/bus/dds/far_participant.h"
#include "services/transport/bus/dds/participant.h"
#include "services/transport/link/channels.h"
#include "services/transport/link/codec/clock_filter.h"
#include "services/transport/link/codec/packet.h"
#include "services/transport/link/inbox.h"
#include "services/transport/link/refusal_log.h"
#include "services/transport/link/scene_transfer.h"

namespace fulcrum::link {

struct LinkSettings {
  bus::FarSettings far;
  double picture_rate_Hz = 30;  ///< Rate of TissueFrame on its way to the other host.
  std::optional<Offer> offer;   ///< Cart only: session and nodes for the other host.
  std::filesystem::path scene;  ///< Cart only: the compiled scene of the offer.
};

/// Figures of a link, for Health and log.
struct LinkStatus {
  bool connected = false;  ///< A packet of the other side arrived within the last second.
  bool insecure = false;   ///< The link has no keys.
  bool known = false;      ///< The clock offset is known.
  double offset_us = 0;    ///< Their CLOCK_MONOTONIC minus ours.
  double round_trip_us = 0;
  double drift_ppm = 0;
  double sent_kB_per_s = 0, received_kB_per_s = 0;
  double tissue_kB_per_s = 0;  ///< Share of TissueFrame in the traffic, both ways together.
  std::uint64_t lost = 0;      ///< Chunks and samples that did not arrive.
  /// Packets, samples and datagrams that were refused: malformed, of another session or of an earlier link, of topics
  /// or nodes that the other side may not write, from another address.
  std::uint64_t refused = 0;
  std::uint64_t rebuilt = 0;  ///< How often the connection was made anew.
  double silence_s = 0;       ///< Time since the last packet of the other side.
  std::string error;          ///< One line for the operator; empty if there is no error.
};

class Link {
 public:
  /// Starts to connect to the other side. Throws InputError.
  explicit Link(const LinkSettings& settings);
  ~Link();
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;

  /// Carries topics between `local` and the other host. Call once. @param far_nodes bit per NodeId: nodes of the other
  /// host.
  void Join(bus::DdsParticipant* local, std::uint32_t far_nodes);
  /// Removes all ports from the bus that was joined. Call before that bus is destroyed if it ends before the link.
  void Leave();
  /// Sends the message that the session has ended. The link itself runs until its destruction.
  void SendBye();

  [[nodiscard]] const LinkSettings& settings() const { return settings_; }
  [[nodiscard]] LinkStatus status();
  /// Host only: the newest offer, with a number that grows when another session begins.
  struct Session {
    std::uint64_t number = 0;  ///< 0: none yet.
    bool over = false;
    Offer offer;
  };
  [[nodiscard]] Session session();
  /// One line if the other side uses another schema or wire version, or if the cart does not accept our keys; otherwise
  /// empty.
  [[nodiscard]] std::string mismatch();
  /// Participants that tried to connect without the keys of this link, addresses other than the peer's, and what the
  /// other side sent although it may not: each listed once.
  [[nodiscard]] bus::Refusals refusals();

  /// Host only: fetches the scene of the offer into the cache. Call until it returns true; the file is then complete.
  [[nodiscard]] bool FetchScene(const Offer& offer, const std::filesystem::path& cache, double* progress);

 private:
  struct Channel {
    std::unique_ptr<Outgoing> out;
    std::unique_ptr<Incoming> in;
    std::int64_t unwanted_since_ns = 0;
    std::uint32_t number = 0;  ///< Of the last sample or chunk of an `out` that was removed.
  };

  void Run(const std::stop_token& stop);
  // Stages of a cycle, called with the mutex held.
  void TakePackets(std::int64_t now);
  void Take(const Inbox::Packet& packet);
  void TakePulse(std::span<const std::uint8_t> body, std::int64_t heard_ns);
  void TakeChannel(PacketKind kind, std::span<const std::uint8_t> body);
  void TakeOffer(const Envelope& envelope, std::span<const std::uint8_t> body);
  void ServeScene(std::span<const std::uint8_t> body);
  [[nodiscard]] bool IsOfPeer(std::uint64_t epoch, std::int64_t now);
  [[nodiscard]] bool IsOfSession(const Envelope& envelope) const;
  void FollowWishes(std::uint32_t wanted, std::int64_t now);
  std::int64_t PumpChannels(std::int64_t now);
  void SendPulse(std::int64_t now);
  [[nodiscard]] bool IsWanted(TopicId topic, const Incoming& in) const;
  void WatchSilence(std::int64_t now);
  void CountRates(std::int64_t now);

  bool Send(bus::FarLane lane, PacketKind kind, const std::function<void(std::vector<std::uint8_t>*)>& put);
  void Connect();

  const LinkSettings settings_;
  const std::uint64_t epoch_;

  Inbox inbox_;

  std::mutex mutex_;  ///< Guards all members below except the thread.
  std::unique_ptr<bus::FarParticipant> far_;
  bus::DdsParticipant* local_ = nullptr;
  std::array<Channel, kTopicCount> channels_;
  LinkContext context_;
  ClockFilter clock_;
  std::uint64_t their_epoch_ = 0;
  std::uint32_t wished_ = 0;  ///< Bit per TopicId, from the last pulse of the other side.
  std::int64_t heard_ns_ = 0, heard_pulse_ns_ = 0, heard_sent_ns_ = 0;
  /// A pulse of this release was taken: packets of another one are then no reason to end the session. A host forgets it
  /// when the cart is started again, because that begins another session.
  bool proved_ = false;
  std::int64_t connected_ns_ = 0;  ///< When the present participant was made.
  int attempts_ = 0;               ///< Participants made since the last packet of the other side.
  std::int64_t next_pulse_ns_ = 0;
  Session session_;
  std::uint64_t session_key_ = 0;     ///< Of our packets; 0: no session yet.
  std::uint64_t joined_session_ = 0;  ///< Key of the session whose topics are carried; 0: none.
  /// Answers that may still be given before the next pulse is sent: a peer cannot make this side read and send more.
  struct Allowance {
    int offers = 0, pieces = 0;
  };
  Allowance allowance_;
  bool asks_offer_ = false;  ///< Host only: packets of another session arrive.
  bool bye_ = false;
  std::optional<SceneFetch> fetch_;
  std::string mismatch_, error_;
  std::uint64_t rebuilt_ = 0;
  std::uint64_t overflowed_ = 0;  ///< Packets for which the inbox had no room.
  std::uint64_t dropped_ = 0;     ///< Datagrams from other addresses, of the participants before the present one.
  RefusalLog refused_;            ///< Since the start.
  struct Traffic {
    std::uint64_t sent_B = 0, received_B = 0, tissue_B = 0;
  };
  Traffic traffic_, traffic_before_;
  std::int64_t rates_ns_ = 0;
  LinkStatus rates_;
  std::vector<std::uint8_t> packet_;
  std::jthread thread_;
};

}  // namespace fulcrum::link
