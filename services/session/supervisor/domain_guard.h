// One supervisor per user and domain.
#pragma once

namespace fulcrum::supervisor {

/// Holds a name in the abstract socket namespace. The kernel releases it however the process ends, and no file remains.
class DomainGuard {
 public:
  /// Throws InputError when another supervisor holds the domain.
  explicit DomainGuard(int domain);
  ~DomainGuard();
  DomainGuard(const DomainGuard&) = delete;
  DomainGuard& operator=(const DomainGuard&) = delete;

  /// True when a supervisor of this user runs in the domain.
  [[nodiscard]] static bool IsHeld(int domain);

 private:
  int socket_;
};

}  // namespace fulcrum::supervisor
