// The record of a soak: memory, rate and drift of each process over time, the blows, the end of the session. Pure.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "services/base/core/messages.h"
#include "services/session/soak/chaos_plan.h"
#include "services/session/supervisor/session_record.h"

namespace fulcrum::soak {

/// Largest values with which a soak passes.
struct Limits {
  double rss_growth_MB = 20;
  std::uint64_t not_finite = 0;
  int crashes = 0;
};

/// One process from its start to its end.
struct Life {
  std::string program;
  std::int32_t process = 0;
  bool was_killed = false;  ///< A blow killed it.
  bool has_ended = false;
  supervisor::Curve memory_MB;  ///< Resident memory.
  supervisor::Curve rate_pct;   ///< Share of the requested rate over the last second.
  supervisor::Curve drift_ms;   ///< Deviation of its count of periods from the clock, since its first Health.
  std::uint64_t first_ticks = 0;
  std::int64_t first_ns = 0;  ///< Time of its first Health [ns]; 0: none yet.
};

class SoakRecord {
 public:
  /// Adds a sample of a process; an unknown process begins a new Life.
  void AddMemory(double time_s, const std::string& program, std::int32_t process, std::uint64_t resident_B);
  /// Adds rate and drift of a process. Ignored for a process without a sample of memory.
  void AddHealth(double time_s, const Health& health);
  void AddBlow(const Blow& blow, std::int32_t process);
  /// Sets the processes that exist now; every other process has ended.
  void SetAlive(const std::vector<std::int32_t>& processes);
  /// Sets the count, since the start, of samples that a gate refused: a number was not finite or out of range.
  void SetRefused(std::uint64_t samples) { refused_ = samples; }
  /// Ends the record. `well`: the session ended as it should.
  void End(double time_s, bool well, const std::string& verdict);

  [[nodiscard]] const std::vector<Life>& lives() const { return lives_; }
  [[nodiscard]] const std::vector<Blow>& blows() const { return blows_; }
  [[nodiscard]] double duration_s() const { return duration_s_; }
  [[nodiscard]] const std::string& verdict() const { return verdict_; }
  [[nodiscard]] std::uint64_t refused() const { return refused_; }
  /// Number of processes that ended although no blow had killed them, plus one when the session did not end well.
  [[nodiscard]] int crashes() const { return crashes_; }
  [[nodiscard]] int Count(BlowKind kind) const;
  /// Growth of one process [MB]: median of its last ten seconds minus median of the ten seconds that begin half a
  /// minute after its start. 0 for a process that ends before: memory taken at the start is no leak. In shorter
  /// sessions these times are shorter in proportion.
  [[nodiscard]] double GrowthOf(const Life& life) const;
  [[nodiscard]] double LargestGrowth_MB() const;
  /// Lowest median rate of a program [% of the requested rate].
  [[nodiscard]] double LowestRate_pct() const;
  /// Largest deviation of a process from the clock at its end [ms].
  [[nodiscard]] double LargestDrift_ms() const;
  [[nodiscard]] bool Passes(const Limits& limits) const;

  /// Share of the processors' time in which the host of a virtual machine ran other guests [%].
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
