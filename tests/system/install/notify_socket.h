// The receiving end of sd_notify, in place of systemd.
#pragma once

#include <filesystem>
#include <string>

namespace fulcrum::testing {

class NotifySocket {
 public:
  explicit NotifySocket(const std::filesystem::path& path);
  ~NotifySocket();
  NotifySocket(const NotifySocket&) = delete;
  NotifySocket& operator=(const NotifySocket&) = delete;

  /// All that has come so far, a line each.
  [[nodiscard]] const std::string& Heard();
  /// True when one of the lines begins so.
  [[nodiscard]] bool HasHeard(const std::string& beginning);
  void Forget() { heard_ = "\n"; }

 private:
  int fd_;
  std::string heard_ = "\n";
};

}  // namespace fulcrum::testing
