// Ports: the interface of a node to the bus. There are three backends: DDS, in-process, recorded log. A node class
// holds references to ports and does not depend on the backend.
#pragma once

#include <cstdint>
#include <functional>

#include "services/base/core/messages.h"

namespace fulcrum::bus {

struct InputStats {
  bool matched = false;  ///< At least one live writer.
  std::uint64_t received = 0;
  std::uint64_t lost = 0;            ///< Gaps in the sequence within one epoch.
  std::uint64_t rejected = 0;        ///< Samples that did not pass the gate.
  std::int64_t newest_stamp_ns = 0;  ///< 0: none yet.
};

struct OutputStats {
  std::uint64_t written = 0;
  std::uint64_t failed = 0;  ///< write() threw, blocked past its limit or had no room.
};

/// Receives T. To be used by one thread at a time.
template <class T>
class Input {
 public:
  virtual ~Input() = default;
  /// Takes the newest unread sample and drops older ones. False if there is no unread sample. `sample` keeps its
  /// buffers, so that a steady stream does not allocate.
  [[nodiscard]] virtual bool TakeLatest(T* sample) = 0;
  /// Takes the oldest unread sample. For events and commands, where each one counts.
  [[nodiscard]] virtual bool TakeNext(T* sample) = 0;
  [[nodiscard]] virtual InputStats stats() const = 0;
};

/// Publishes T. To be used by one thread at a time.
template <class T>
class Output {
 public:
  virtual ~Output() = default;
  /// False when the sample could not be sent: counted, never thrown.
  virtual bool Write(const T& sample) noexcept = 0;
  /// False: the topic has no reader, so no sample needs to be built.
  [[nodiscard]] virtual bool has_readers() const noexcept = 0;
  [[nodiscard]] virtual OutputStats stats() const = 0;
};

/// Publishes a large topic (TissueFrame, TemperaturePatch, Picture) by writing it in the memory from which it is read.
template <class T>
class LoanOutput : public Output<T> {
 public:
  using Fill = std::function<void(typename T::View)>;
  /// `fill` writes header and payload in place, in shared memory where the backend has it. False as for Write.
  virtual bool WriteInPlace(const Fill& fill) noexcept = 0;
};

/// Type of the output for T: LoanOutput for large topics, Output for others.
template <class T>
struct OutputOf {
  using type = Output<T>;
};
template <class T>
requires requires { typename T::View; }
struct OutputOf<T> {
  using type = LoanOutput<T>;
};

}  // namespace fulcrum::bus
