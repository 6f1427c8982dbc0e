// One flat JSON object, written key by key.
#pragma once

#include <string>

namespace fulcrum::supervisor {

class FlatJson {
 public:
  void Add(const std::string& key, const std::string& value);
  void Add(const std::string& key, const char* value);
  void Add(const std::string& key, bool value);
  /// A value that is not finite is written as null.
  void Add(const std::string& key, double value);
  [[nodiscard]] std::string text() const { return "{" + body_ + "\n}\n"; }

 private:
  void AddRaw(const std::string& key, const std::string& value);
  std::string body_;
};

}  // namespace fulcrum::supervisor
