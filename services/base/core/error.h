// Typed exceptions for bad input at start-up. Run-time failures are counted and published, never thrown.
#pragma once

#include <stdexcept>
#include <string>

namespace fulcrum {

/// A file or an option that cannot be used. The message contains place, fault, valid values and what to do.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Two parts that do not match: different scenes, schemas or versions.
class MismatchError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace fulcrum
