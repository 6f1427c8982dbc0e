// mutants FILE                    lists the faults that could be made in FILE: `INDEX LINE KIND OLD -> NEW`, one a line
// mutants FILE INDEX:NUMBER ...   writes FILE with these faults behind switches of these numbers to standard output
#include <charconv>
#include <fstream>
#include <iostream>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

#include "tests/mutation/faults.h"
#include "tests/mutation/switches.h"

int main(int argc, char** argv) {
  if (argc < 2) {
    std::cerr << "usage: mutants FILE [INDEX:NUMBER ...]\n";
    return 2;
  }
  std::ifstream file(argv[1]);
  if (!file) {
    std::cerr << "mutants: " << argv[1] << ": cannot be read\n";
    return 2;
  }
  const std::string source{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  const std::vector<fulcrum::mutation::Fault> faults = fulcrum::mutation::FaultsOf(source);
  if (argc == 2) {
    for (std::size_t i = 0; i < faults.size(); ++i) {
      std::cout << i << ' ' << fulcrum::mutation::Describe(source, faults[i]) << '\n';
    }
    return 0;
  }
  std::vector<fulcrum::mutation::Switch> switches;
  for (int i = 2; i < argc; ++i) {
    const std::string_view text = argv[i];
    const std::size_t colon = text.find(':');
    std::size_t index = faults.size();
    int number = -1;
    if (colon != std::string_view::npos) {
      std::from_chars(text.data(), text.data() + colon, index);
      std::from_chars(text.data() + colon + 1, text.data() + text.size(), number);
    }
    if (index >= faults.size() || number < 0) {
      std::cerr << "mutants: " << argv[1] << ": no fault and switch " << text
                << "; valid: INDEX:NUMBER with an index below " << faults.size() << " and a number from 0\n";
      return 2;
    }
    switches.push_back({faults[index], number});
  }
  std::cout << fulcrum::mutation::WithSwitches(source, switches, argv[1]);
  return 0;
}
