// Typed exceptions for bad input at start-up. Run-time failures are counted and published, never thrown.
#pragma once

#include <stdexcept>
#include <string>

namespace fulcrum {

/// A file or an option that cannot be used: says where, what, which values are valid and what to do.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Two parts that do not belong together: another scene, another schema, another version.
class MismatchError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace fulcrum
