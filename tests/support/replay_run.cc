#include "tests/support/replay_run.h"

#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <optional>

#include "tests/support/cart.h"
#include "tests/support/program.h"

namespace fulcrum::testing {

ReplayRun Replay(const std::filesystem::path& recording, const std::vector<std::string>& arguments, double limit_s) {
  const std::filesystem::path json =
      std::filesystem::temp_directory_path() / ("fulcrum-replay-" + std::to_string(::getpid()) + ".json");
  std::vector<std::string> words{recording, "--json", json};
  words.insert(words.end(), arguments.begin(), arguments.end());
  Program program("replayer", words);
  ReplayRun run;
  std::optional<int> code;
  WaitFor(limit_s, [&] { return (code = program.Poll()).has_value(); });
  run.exit_code = code.value_or(-1);
  run.said = program.Said();
  std::ifstream in(json);
  for (std::string line; std::getline(in, line);) {
    const std::size_t begin = line.find('"'), end = line.find('"', begin + 1), colon = line.find(':', end);
    if (begin == std::string::npos || colon == std::string::npos) continue;
    char* rest = nullptr;
    const double value = std::strtod(line.c_str() + colon + 1, &rest);
    if (rest != line.c_str() + colon + 1) run.figures[line.substr(begin + 1, end - begin - 1)] = value;
  }
  std::error_code ignored;
  std::filesystem::remove(json, ignored);
  return run;
}

}  // namespace fulcrum::testing
