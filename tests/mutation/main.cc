// mutants FILE           lists the faults that could be made in FILE: `NUMBER LINE KIND OLD -> NEW`, one a line
// mutants FILE NUMBER    writes FILE with that fault to standard output
#include <charconv>
#include <fstream>
#include <iostream>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

#include "tests/mutation/faults.h"

int main(int argc, char** argv) {
  if (argc < 2 || argc > 3) {
    std::cerr << "usage: mutants FILE [NUMBER]\n";
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
  const std::string_view text = argv[2];
  std::size_t number = faults.size();
  std::from_chars(text.data(), text.data() + text.size(), number);
  if (number >= faults.size()) {
    std::cerr << "mutants: " << argv[1] << ": no fault " << text << "; valid: 0 to below " << faults.size() << '\n';
    return 2;
  }
  std::cout << WithFault(source, faults[number]);
  return 0;
}
