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

  /// All messages received so far, one per line.
  [[nodiscard]] const std::string& Heard();
  /// True if one of the lines begins with `beginning`.
  [[nodiscard]] bool HasHeard(const std::string& beginning);
  void Forget() { heard_ = "\n"; }

 private:
  int fd_;
  std::string heard_ = "\n";
};

}  // namespace fulcrum::testing
