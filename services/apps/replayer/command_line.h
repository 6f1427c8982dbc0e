// The command line of replayer as it was typed: options, values, help. What they mean together: options.h.
#pragma once

#include <boost/program_options.hpp>
#include <string>
#include <vector>

namespace fulcrum::replay {

class CommandLine {
 public:
  /// Throws InputError when there is no such option or a value cannot be read.
  CommandLine(int argc, char** argv);

  /// Whether the option was given; always true of one with a default value.
  [[nodiscard]] bool Has(const char* option) const { return values_.count(option) != 0; }
  /// Of an option that was given or has a default value.
  template <class T>
  [[nodiscard]] const T& ValueOf(const char* option) const {
    return values_[option].as<T>();
  }
  [[nodiscard]] const std::string& TextOf(const char* option) const { return ValueOf<std::string>(option); }
  /// All values of an option that may be repeated; empty when it was not given.
  [[nodiscard]] std::vector<std::string> TextsOf(const char* option) const;

  /// What --help prints: usage, options, exit codes.
  [[nodiscard]] std::string Help() const;

 private:
  boost::program_options::options_description options_{"Options"};
  boost::program_options::variables_map values_;
};

}  // namespace fulcrum::replay
