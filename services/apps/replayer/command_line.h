// The command line of replayer: options, values, help. options.h checks their combinations.
#pragma once

#include <boost/program_options.hpp>
#include <string>
#include <vector>

namespace fulcrum::replay {

class CommandLine {
 public:
  /// Parses the command line. Throws InputError on an unknown option or an invalid value.
  CommandLine(int argc, char** argv);

  /// True when the option was given; always true for an option with a default value.
  [[nodiscard]] bool Has(const char* option) const { return values_.count(option) != 0; }
  /// True when the option was given, also for an option with a default value.
  [[nodiscard]] bool IsGiven(const char* option) const { return Has(option) && !values_[option].defaulted(); }
  /// Value of an option that was given or has a default value.
  template <class T>
  [[nodiscard]] const T& ValueOf(const char* option) const {
    return values_[option].as<T>();
  }
  [[nodiscard]] const std::string& TextOf(const char* option) const { return ValueOf<std::string>(option); }
  /// All values of an option that may be repeated; empty when it was not given.
  [[nodiscard]] std::vector<std::string> TextsOf(const char* option) const;

  /// Text of --help: usage, options, exit codes.
  [[nodiscard]] std::string Help() const;

 private:
  boost::program_options::options_description options_{"Options"};
  boost::program_options::variables_map values_;
};

}  // namespace fulcrum::replay
