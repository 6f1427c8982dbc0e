// The DDS backend of the ports. Internal to services/transport/bus/dds.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <functional>
#include <span>
#include <thread>
#include <utility>
#include <vector>

#include "services/transport/bus/convert/convert.h"
#include "services/transport/bus/dds/abandoned_mutex.h"
#include "services/transport/bus/dds/audience.h"
#include "services/transport/bus/dds/session_check.h"
#include "services/transport/bus/dds/type_support.h"
#include "services/transport/bus/gate.h"
#include "services/transport/bus/input_account.h"
#include "services/transport/bus/port.h"
#include "services/transport/bus/topics.h"

namespace fulcrum::bus::dds {

namespace fast = eprosima::fastdds::dds;
using ReturnCode = eprosima::fastrtps::types::ReturnCode_t;

/// A writer of a small topic leaves no sooner than this after its last sample: the library drops samples that are still
/// in a raw input's socket (chained_transport.h, 8 ms) when it learns that their writer has left.
constexpr std::chrono::milliseconds kLinger{40};

/// Counts the live endpoints on the other side; querying the reader or writer itself would take its lock on every tick.
class ReaderEvents final : public fast::DataReaderListener {
 public:
  explicit ReaderEvents(std::function<void()> notify) : notify_(std::move(notify)) {}
  void on_subscription_matched(fast::DataReader*, const fast::SubscriptionMatchedStatus& status) override {
    count_.store(status.current_count, std::memory_order_relaxed);  // relaxed: an independent value that orders nothing
  }
  void on_data_available(fast::DataReader*) override { notify_(); }
  [[nodiscard]] bool any() const noexcept { return count_.load(std::memory_order_relaxed) > 0; }
  /// Events to receive: without `notify` a sample causes no call.
  [[nodiscard]] fast::StatusMask mask() const {
    fast::StatusMask mask = fast::StatusMask::subscription_matched();
    if (notify_) mask << fast::StatusMask::data_available();
    return mask;
  }

 private:
  const std::function<void()> notify_;
  std::atomic<int> count_{0};
};

class WriterEvents final : public fast::DataWriterListener {
 public:
  explicit WriterEvents(Audience* audience) : audience_(audience) { audience_->Add(this); }
  ~WriterEvents() override { audience_->Remove(this); }
  WriterEvents(const WriterEvents&) = delete;
  WriterEvents& operator=(const WriterEvents&) = delete;
  void on_publication_matched(fast::DataWriter*, const fast::PublicationMatchedStatus& status) override {
    count_.store(status.current_count, std::memory_order_relaxed);  // as above
    const auto reader = eprosima::fastrtps::rtps::iHandle2GUID(status.last_subscription_handle);
    audience_->Count(this, reader.guidPrefix, status.current_count_change);
  }
  [[nodiscard]] bool any() const noexcept { return count_.load(std::memory_order_relaxed) > 0; }

 private:
  Audience* audience_;
  std::atomic<int> count_{0};
};

/// Owns a DataReader and its counters.
template <class T>
class InputBase : public Input<T> {
 public:
  InputBase(fast::Subscriber* subscriber, fast::Topic* topic, const fast::DataReaderQos& qos,
            std::function<void()> notify, SessionCheck* check)
      : events_(std::move(notify)),
        check_(check),
        subscriber_(subscriber),
        reader_(subscriber->create_datareader(topic, qos, &events_, events_.mask())),
        account_(kQualityOf<T>.gap_is_loss, RoleOf<T>().one_owner()) {}
  ~InputBase() override {
    if (reader_ == nullptr) return;
    reader_->set_listener(nullptr);
    subscriber_->delete_datareader(reader_);
  }
  InputBase(const InputBase&) = delete;
  InputBase& operator=(const InputBase&) = delete;

  [[nodiscard]] bool ok() const { return reader_ != nullptr; }
  InputStats stats() const override { return account_.stats(events_.any()); }

 protected:
  /// steady_clock is CLOCK_MONOTONIC, the clock of all stamps.
  [[nodiscard]] bool IsOfOwner(const T& sample) noexcept {
    return account_.IsOfOwner(StampOf(sample), std::chrono::steady_clock::now().time_since_epoch().count());
  }

  ReaderEvents events_;
  SessionCheck* check_;
  fast::Subscriber* subscriber_;
  fast::DataReader* reader_;
  InputAccount account_;
};

/// Input of a small topic: deserialises into one object that it keeps.
template <class T>
class DdsInput final : public InputBase<T> {
 public:
  using InputBase<T>::InputBase;

  bool TakeLatest(T* sample) override {
    bool found = false;
    while (TakeNext(sample)) found = true;
    return found;
  }

  bool TakeNext(T* sample) override {
    while (TakeWire()) {
      // Bytes that could not be decoded leave no sequence number: they are rejected below.
      if (wire_.stamp().number() != 0 && this->check_->IsForeign(wire_.stamp().session())) continue;
      FromWire(wire_, &candidate_);
      if (PassesGate(candidate_) && this->IsOfOwner(candidate_)) {
        this->account_.Accept(StampOf(candidate_));
        std::swap(*sample, candidate_);
        return true;
      }
      this->account_.Reject(StampOf(candidate_));
    }
    return false;
  }

 private:
  /// Takes the next valid sample into wire_.
  bool TakeWire() {
    for (;;) {
      try {
        fast::SampleInfo info;
        if (this->reader_->take_next_sample(&wire_, &info) != ReturnCode::RETCODE_OK) return false;
        if (info.valid_data) return true;
      } catch (...) {
        this->account_.Reject();
        return false;
      }
    }
  }

  WireOf<T> wire_;
  T candidate_;
};

/// Input of a large topic. A sample is copied out of the shared memory while the library holds the reader's lock
/// (LoanType::deserialize): when the writer's process has ended, the library removes that memory from this process,
/// also beneath a loan.
template <Loanable T>
class DdsInput<T> final : public InputBase<T> {
 public:
  /// @param loan_B size of the topic's type in this participant.
  DdsInput(std::size_t loan_B, fast::Subscriber* subscriber, fast::Topic* topic, const fast::DataReaderQos& qos,
           std::function<void()> notify, SessionCheck* check)
      : InputBase<T>(subscriber, topic, qos, std::move(notify), check), bytes_(loan_B) {}

  bool TakeLatest(T* sample) override {
    bool found = false;
    while (TakeNext(sample)) found = true;
    return found;
  }

  bool TakeNext(T* sample) override {
    while (TakeBytes()) {
      if (this->check_->IsForeign(SessionOf(bytes_))) continue;
      if (FromLoan(bytes_, &candidate_) && PassesGate(candidate_) && this->IsOfOwner(candidate_)) {
        this->account_.Accept(StampOf(candidate_));
        std::swap(*sample, candidate_);
        return true;
      }
      this->account_.Reject();
    }
    return false;
  }

 private:
  /// Takes the next valid sample into bytes_.
  bool TakeBytes() {
    fast::SampleInfo info;
    do {
      if (this->reader_->take_next_sample(bytes_.data(), &info) != ReturnCode::RETCODE_OK) return false;
    } while (!info.valid_data);
    return true;
  }

  std::vector<std::byte> bytes_;
  T candidate_;
};

/// Owns a DataWriter and its counters, which the writing thread writes and the health thread reads.
template <class T>
class OutputBase : public OutputOf<T>::type {
 public:
  OutputBase(fast::Publisher* publisher, fast::Topic* topic, const fast::DataWriterQos& qos, Audience* audience,
             std::uint64_t session)
      : session_(session),
        events_(audience),
        publisher_(publisher),
        writer_(publisher->create_datawriter(topic, qos, &events_, fast::StatusMask::publication_matched())) {}
  ~OutputBase() override {
    if (writer_ == nullptr) return;
    writer_->set_listener(nullptr);
    publisher_->delete_datawriter(writer_);
  }
  OutputBase(const OutputBase&) = delete;
  OutputBase& operator=(const OutputBase&) = delete;

  [[nodiscard]] bool ok() const { return writer_ != nullptr; }
  bool has_readers() const noexcept override { return events_.any(); }
  OutputStats stats() const override {
    return {written_.load(std::memory_order_relaxed), failed_.load(std::memory_order_relaxed)};
  }

 protected:
  bool Count(bool sent) noexcept {
    (sent ? written_ : failed_).fetch_add(1, std::memory_order_relaxed);
    return sent;
  }

  const std::uint64_t session_;  ///< For the stamp of each sample.
  WriterEvents events_;
  fast::Publisher* publisher_;
  fast::DataWriter* writer_;

 private:
  std::atomic<std::uint64_t> written_{0};
  std::atomic<std::uint64_t> failed_{0};
};

template <class T>
class DdsOutput final : public OutputBase<T> {
 public:
  using OutputBase<T>::OutputBase;
  ~DdsOutput() override {
    if (this->has_readers()) std::this_thread::sleep_until(last_write_ + kLinger);
  }
  DdsOutput(const DdsOutput&) = delete;
  DdsOutput& operator=(const DdsOutput&) = delete;

  bool Write(const T& sample) noexcept override {
    last_write_ = std::chrono::steady_clock::now();
    try {
      if (!ToWire(sample, &wire_)) return this->Count(false);
      wire_.stamp().session(this->session_);
      return this->Count(this->writer_->write(&wire_));
    } catch (...) {
      return this->Count(false);
    }
  }

 private:
  WireOf<T> wire_;
  std::chrono::steady_clock::time_point last_write_{};
};

template <Loanable T>
class DdsOutput<T> final : public OutputBase<T> {
 public:
  /// @param loan_B size of the topic's type.
  DdsOutput(std::size_t loan_B, fast::Publisher* publisher, fast::Topic* topic, const fast::DataWriterQos& qos,
            Audience* audience, std::uint64_t session)
      : OutputBase<T>(publisher, topic, qos, audience, session), loan_B_(loan_B) {}

  bool Write(const T& sample) noexcept override {
    return Lend([&sample](std::span<std::byte> loan) { return ToLoan(sample, loan); });
  }

  bool WriteInPlace(const typename LoanOutput<T>::Fill& fill) noexcept override {
    return Lend([&](std::span<std::byte> loan) {
      fill(OpenLoan(loan.data(), &draft_));
      return CloseLoan(draft_, loan);
    });
  }

 private:
  template <class Fill>
  bool Lend(const Fill& fill) noexcept {
    const BoundedLocks patience;
    void* loan = nullptr;
    try {
      using Init = fast::DataWriter::LoanInitializationKind;
      if (this->writer_->loan_sample(loan, Init::NO_LOAN_INITIALIZATION) != ReturnCode::RETCODE_OK) {
        return this->Count(false);
      }
      const bool filled = fill(std::span(static_cast<std::byte*>(loan), loan_B_));
      if (filled) SetSessionOfLoan(this->session_, static_cast<std::byte*>(loan));
      if (filled && this->writer_->write(loan)) return this->Count(true);
    } catch (...) {
      // Counted below; the loan is returned.
    }
    try {
      if (loan != nullptr) this->writer_->discard_loan(loan);
    } catch (...) {
      // The pool has lost one place; if it is empty, the next loans fail and are counted.
    }
    return this->Count(false);
  }

  const std::size_t loan_B_;
  T draft_;
};

}  // namespace fulcrum::bus::dds
