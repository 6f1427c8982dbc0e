// Joins the buses of two hosts, so that no node knows that a host lies between: what nodes of the other host read goes
// there, what they send is republished here in their name. See DESIGN.md.
#pragma once

#include <array>
#include <condition_variable>
#include <cstdint>
#include <deque>
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
#include "services/transport/link/scene_transfer.h"

namespace fulcrum::link {

struct LinkSettings {
  bus::FarSettings far;
  double picture_rate_Hz = 30;  ///< Of TissueFrame on its way to the other host.
  std::optional<Offer> offer;   ///< The cart's side: what the other host is to do.
  std::filesystem::path scene;  ///< The cart's side: the compiled file of the offer.
};

/// Figures of a link, for Health and people.
struct LinkStatus {
  bool connected = false;  ///< The other side was heard in the last second.
  bool known = false;      ///< The clock offset is known.
  double offset_us = 0;    ///< Their CLOCK_MONOTONIC minus ours.
  double round_trip_us = 0;
  double drift_ppm = 0;
  double sent_kB_per_s = 0, received_kB_per_s = 0;
  double tissue_kB_per_s = 0;  ///< Of it TissueFrame, either way.
  std::uint64_t lost = 0;      ///< Chunks and samples that did not arrive.
  std::uint64_t refused = 0;   ///< Packets or messages that are none.
  std::uint64_t rebuilt = 0;   ///< How often the connection was made anew.
  double silence_s = 0;        ///< Since the other side was heard.
  std::string error;           ///< For people; empty when all is well.
};

class Link {
 public:
  /// Looks for the other side from now on. Throws InputError.
  explicit Link(const LinkSettings& settings);
  ~Link();
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;

  /// Carries topics between `local` and the other host. @param far_nodes bit per NodeId: they run there. Once.
  void Join(bus::DdsParticipant* local, std::uint32_t far_nodes);
  /// Gives up all ports of the bus that was joined: before its end, if that is before the link's.
  void Leave();
  /// Tells the other side that the session is over. The link goes on until its end.
  void SayBye();

  [[nodiscard]] const LinkSettings& settings() const { return settings_; }
  [[nodiscard]] LinkStatus status();
  /// The host's side: the newest offer, with a number that grows when another session begins.
  struct Session {
    std::uint64_t number = 0;  ///< 0: none yet.
    bool over = false;
    Offer offer;
  };
  [[nodiscard]] Session session();
  /// The other side speaks another schema or wire version, or the cart does not accept our keys: one line; empty: all
  /// well.
  [[nodiscard]] std::string mismatch();
  /// Who wanted to be the other side and has not its keys. Each once.
  [[nodiscard]] bus::Refusals refusals();

  /// The host's side: fetches the scene of the offer into the cache; once true it lies there. Call until then.
  [[nodiscard]] bool FetchScene(const Offer& offer, const std::filesystem::path& cache, double* progress);

 private:
  struct Packet {
    bus::FarLane lane;
    std::vector<std::uint8_t> bytes;
    std::int64_t heard_ns;
  };
  struct Channel {
    std::unique_ptr<Outgoing> out;
    std::unique_ptr<Incoming> in;
    std::int64_t unwanted_since_ns = 0;
  };

  void Run(const std::stop_token& stop);
  // Stages of a turn; the mutex is held.
  void TakePackets(std::int64_t now);
  void Take(const Packet& packet);
  void TakePulse(std::span<const std::uint8_t> body, std::int64_t heard_ns);
  void TakeChannel(PacketKind kind, std::span<const std::uint8_t> body);
  void TakeOffer(std::span<const std::uint8_t> body);
  void ServeScene(std::span<const std::uint8_t> body);
  [[nodiscard]] bool IsOfPeer(std::uint64_t epoch, std::int64_t now);
  void FollowWishes(std::uint32_t wanted, std::int64_t now);
  std::int64_t PumpChannels(std::int64_t now);
  void SendPulse(std::int64_t now);
  [[nodiscard]] bool IsWanted(TopicId topic, const Incoming& in) const;
  void WatchSilence(std::int64_t now);
  void CountRates(std::int64_t now);

  bool Send(bus::FarLane lane, PacketKind kind, const std::function<void(std::vector<std::uint8_t>*)>& put);
  void Connect();
  void KeepRefusals();
  void Wake();

  const LinkSettings settings_;
  const std::uint64_t epoch_;

  std::mutex inbox_mutex_;  ///< Guards inbox_ and woken_.
  std::condition_variable_any inbox_news_;
  std::deque<Packet> inbox_;
  bool woken_ = false;
  std::uint64_t overflow_ = 0;

  std::mutex mutex_;  ///< Guards all below but the thread.
  std::unique_ptr<bus::FarParticipant> far_;
  bus::DdsParticipant* local_ = nullptr;
  std::array<Channel, kTopicCount> channels_;
  LinkContext context_;
  ClockFilter clock_;
  std::uint64_t their_epoch_ = 0;
  std::uint32_t wished_ = 0;  ///< Bit per TopicId: by the other side's last pulse.
  std::int64_t heard_ns_ = 0, heard_pulse_ns_ = 0, heard_sent_ns_ = 0;
  std::int64_t connected_ns_ = 0;  ///< When the present participant was made.
  std::int64_t next_pulse_ns_ = 0;
  Session session_;
  bool bye_ = false;
  std::optional<SceneFetch> fetch_;
  std::string mismatch_, error_;
  std::uint64_t refused_ = 0, rebuilt_ = 0;
  bus::Refusals refusals_;  ///< Of all connections.
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
