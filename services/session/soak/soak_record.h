// What a soak saw: memory, rates and drift of each process over time, what was done to them, how it ended. Pure.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "services/base/core/messages.h"
#include "services/session/soak/chaos_plan.h"
#include "services/session/supervisor/session_record.h"

namespace fulcrum::soak {

/// Most that a soak may show, else it has failed.
struct Limits {
  double rss_growth_MB = 20;
  std::uint64_t not_finite = 0;
  int crashes = 0;
};

/// One process from its start to its end.
struct Life {
  std::string program;
  std::int32_t process = 0;
  bool was_killed = false;  ///< By us.
  bool has_ended = false;
  supervisor::Curve memory_MB;  ///< Resident.
  supervisor::Curve rate_pct;   ///< Of the rate asked for, over the last second.
  supervisor::Curve drift_ms;   ///< How far its count of periods is from the clock since it was first heard.
  std::uint64_t first_ticks = 0;
  std::int64_t first_ns = 0;  ///< 0: not heard yet.
};

class SoakRecord {
 public:
  /// A process is new when it has not been seen before.
  void AddMemory(double time_s, const std::string& program, std::int32_t process, std::uint64_t resident_B);
  /// For its rate and drift. Disregarded for a process whose memory has not been seen.
  void AddHealth(double time_s, const Health& health);
  void AddBlow(const Blow& blow, std::int32_t process);
  /// These are the processes that live now: who is missing has ended.
  void SetAlive(const std::vector<std::int32_t>& processes);
  /// Samples that no reader may use: a number that is not finite, or beyond its range. A count since the start.
  void SetRefused(std::uint64_t samples) { refused_ = samples; }
  /// The session is over, as it should be or not.
  void End(double time_s, bool well, const std::string& verdict);

  [[nodiscard]] const std::vector<Life>& lives() const { return lives_; }
  [[nodiscard]] const std::vector<Blow>& blows() const { return blows_; }
  [[nodiscard]] double duration_s() const { return duration_s_; }
  [[nodiscard]] const std::string& verdict() const { return verdict_; }
  [[nodiscard]] std::uint64_t refused() const { return refused_; }
  /// Processes that ended while nobody had hurt them, and a session that did not end well.
  [[nodiscard]] int crashes() const { return crashes_; }
  [[nodiscard]] int Count(BlowKind kind) const;
  /// Growth of one process [MB]: the median of its last ten seconds less the median of ten seconds from half a minute
  /// after its start on. 0 for a shorter life: a start is no leak. Shorter sessions have shorter times, in proportion.
  [[nodiscard]] double GrowthOf(const Life& life) const;
  [[nodiscard]] double LargestGrowth_MB() const;
  /// The lowest median rate of a program [% of what is asked for].
  [[nodiscard]] double LowestRate_pct() const;
  /// The farthest that a process is from the clock at its end [ms].
  [[nodiscard]] double LargestDrift_ms() const;
  [[nodiscard]] bool Passes(const Limits& limits) const;

  /// Of the processors' time, what the host of a virtual machine gave to others [%].
  void SetStolen(double stolen_pct) { stolen_pct_ = stolen_pct; }
  [[nodiscard]] double stolen_pct() const { return stolen_pct_; }

 private:
  [[nodiscard]] Life* Find(std::int32_t process);

  std::vector<Life> lives_;
  std::vector<Blow> blows_;
  double duration_s_ = 0, stolen_pct_ = 0;
  std::uint64_t refused_ = 0;
  int crashes_ = 0;
  bool ended_ = false;
  std::string verdict_;
};

struct SoakFigure {
  const char* key;
  double value;
  const char* unit;
};
[[nodiscard]] std::vector<SoakFigure> FiguresOf(const SoakRecord& record);

}  // namespace fulcrum::soak
