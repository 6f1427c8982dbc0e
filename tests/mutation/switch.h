// Faults that are chosen when a program starts. deploy/mutate compiles many faults into one copy of the source, each
// behind a switch of this header; FULCRUM_FAULT=N turns fault N on. Products never include this.
#pragma once

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <initializer_list>
#include <type_traits>

// A switch compares what the source compares, in a template, where literals have lost their value.
#pragma GCC diagnostic ignored "-Wparentheses"
#pragma GCC diagnostic ignored "-Wsign-compare"
#pragma GCC diagnostic ignored "-Wnarrowing"
#pragma GCC diagnostic ignored "-Wunused-variable"
#pragma GCC diagnostic ignored "-Wunused-const-variable"

namespace fulcrum::mutation {

inline constexpr int kMostFaults = 1 << 16;
/// FULCRUM_FAULT=-2: no fault; the number of each switch that is reached is appended to the file FULCRUM_FAULT_FILE.
inline constexpr int kRecord = -2;

/// The fault that is on; -1: none.
inline const int kFault = std::getenv("FULCRUM_FAULT") != nullptr ? std::atoi(std::getenv("FULCRUM_FAULT")) : -1;

inline void Record(int fault) noexcept {
  static std::atomic<bool> seen[kMostFaults];
  if (fault < 0 || fault >= kMostFaults || seen[fault].load(std::memory_order_relaxed) || seen[fault].exchange(true))
    return;
  // At once and without the heap: a test may crash, or forbid allocations here.
  const char* name = std::getenv("FULCRUM_FAULT_FILE");
  const int file = name != nullptr ? open(name, O_WRONLY | O_CREAT | O_APPEND, 0644) : -1;
  if (file < 0) return;
  char text[16];
  const int size = std::snprintf(text, sizeof text, "%d\n", fault);
  if (write(file, text, static_cast<std::size_t>(size)) != size) std::abort();
  close(file);
}

/// Whether a fault is on.
inline bool Faulty(int fault) noexcept {
  if (kFault == kRecord) [[unlikely]]
    Record(fault);
  return kFault == fault;
}

/// The value of an expression of Eigen, whose type differs with its operator; any other value itself.
template <class T>
auto Plain(T&& value) {
  if constexpr (requires { typename std::remove_cvref_t<T>::PlainObject; }) {
    return typename std::remove_cvref_t<T>::PlainObject(value);
  } else {
    return std::remove_cvref_t<T>(value);
  }
}

/// `a - Place<'-'>{n} - b` stands for `a - b` with the fault `a + b`: the precedence stays that of the operator.
template <char kOperator>
struct Place {
  int fault;
};
template <char kOperator, class A>
struct Half {
  A& a;
  int fault;
};

#define FULCRUM_FAULT_OF_OPERATOR(name, right, wrong)                                                \
  template <class A>                                                                                 \
  Half<name, const std::remove_reference_t<A>> operator right(A&& a, Place<name> place) {            \
    return {a, place.fault};                                                                         \
  }                                                                                                  \
  template <class A, class B>                                                                        \
  auto operator right(Half<name, A> half, B&& b) {                                                   \
    static_assert(std::is_same_v<decltype(Plain(half.a right b)), decltype(Plain(half.a wrong b))>); \
    return Faulty(half.fault) ? Plain(half.a wrong b) : Plain(half.a right b);                       \
  }
FULCRUM_FAULT_OF_OPERATOR('-', -, +)
FULCRUM_FAULT_OF_OPERATOR('+', +, -)
FULCRUM_FAULT_OF_OPERATOR('<', <, <=)
FULCRUM_FAULT_OF_OPERATOR('l', <=, <)
FULCRUM_FAULT_OF_OPERATOR('>', >, >=)
FULCRUM_FAULT_OF_OPERATOR('g', >=, >)
FULCRUM_FAULT_OF_OPERATOR('=', ==, !=)
FULCRUM_FAULT_OF_OPERATOR('!', !=, ==)
#undef FULCRUM_FAULT_OF_OPERATOR

template <class T>
T Max(int fault, const T& a, const T& b) {
  return Faulty(fault) ? std::min(a, b) : std::max(a, b);
}
template <class T>
T Max(int fault, std::initializer_list<T> values) {
  return Faulty(fault) ? std::min(values) : std::max(values);
}
template <class T>
T Min(int fault, const T& a, const T& b) {
  return Faulty(fault) ? std::max(a, b) : std::min(a, b);
}
template <class T>
T Min(int fault, std::initializer_list<T> values) {
  return Faulty(fault) ? std::max(values) : std::min(values);
}

}  // namespace fulcrum::mutation
