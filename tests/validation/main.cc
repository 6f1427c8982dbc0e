// validate: runs the cases of validation.h. A user calls it by `fulcrum validate`.
#include <algorithm>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>
#include <vector>

#include "services/base/core/error.h"
#include "services/base/core/exit_code.h"
#include "services/base/runtime/install_places.h"
#include "tests/validation/validation.h"

namespace fulcrum::validation {
namespace {

namespace fs = std::filesystem;

constexpr const char* kUsage =
    "usage: fulcrum validate [--list] [--out DIR] [CASE...]\n\n"
    "Compare the models with exact solutions, other solvers and experiments: measured, expected, error and tolerance,\n"
    "on the default mesh and on meshes half and twice as fine. All cases take about five minutes.\n\n"
    "  --list     print the cases\n"
    "  --out DIR  folder for validation.html and validation.xml, JUnit (default: out/validation)\n"
    "  --help     print this text\n\n"
    "Exit codes: 0 all within their tolerance, 1 not all, 2 bad use.\n\n"
    "Example:\n"
    "  fulcrum validate tube-pinch boiling-front\n";

std::vector<Case> Chosen(const std::vector<std::string>& names) {
  if (names.empty()) return Cases();
  std::vector<Case> chosen;
  for (const std::string& name : names) {
    const auto found = std::find_if(Cases().begin(), Cases().end(), [&](const Case& c) { return c.name == name; });
    if (found == Cases().end()) throw InputError("no case " + name + "; fulcrum validate --list prints them");
    chosen.push_back(*found);
  }
  return chosen;
}

ExitCode Main(const std::vector<std::string>& words) {
  fs::path out = "out/validation";
  std::vector<std::string> names;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (words[i] == "--help" || words[i] == "-h") {
      std::fputs(kUsage, stdout);
      return ExitCode::kDone;
    }
    if (words[i] == "--list") {
      for (const Case& one : Cases()) std::printf("%-14s  %s\n", one.name.c_str(), one.about.c_str());
      return ExitCode::kDone;
    }
    if (words[i] == "--out") {
      if (++i == words.size()) throw InputError("--out needs a folder");
      out = words[i];
    } else if (words[i].starts_with("--out=")) {
      out = words[i].substr(6);
    } else if (words[i].starts_with("-")) {
      throw InputError("unknown option " + words[i] + "; see fulcrum validate --help");
    } else {
      names.push_back(words[i]);
    }
  }
  const std::vector<Case> cases = Chosen(names);
  const Expectations expected = ReadExpectations(runtime::ShareFolder() / "validation");
  std::error_code failed;
  fs::create_directories(out, failed);
  if (failed) throw InputError(out.string() + ": " + failed.message());
  std::printf("%-6s %-22s %14s %14s %9s of %-6s %9s %9s %6s\n", "", "quantity", "measured", "expected", "error %", "%",
              "half as", "twice as", "order");
  std::vector<Row> rows;
  for (const Case& one : cases) {
    std::fprintf(stderr, "case %td of %zu: %s ...\n", &one - cases.data() + 1, cases.size(), one.name.c_str());
    for (Row& row : RunCase(one, expected)) {
      std::printf("%s\n", Line(row).c_str());
      std::fflush(stdout);
      rows.push_back(std::move(row));
    }
  }
  WriteHtml(rows, out / "validation.html");
  WriteJUnit(rows, out / "validation.xml");
  const auto passed = std::count_if(rows.begin(), rows.end(), [](const Row& row) { return row.passed(); });
  std::printf("%td of %zu quantities within their tolerance: %s\n", passed, rows.size(),
              (out / "validation.html").c_str());
  return passed == static_cast<std::ptrdiff_t>(rows.size()) ? ExitCode::kDone : ExitCode::kFailure;
}

}  // namespace
}  // namespace fulcrum::validation

int main(int argc, char** argv) {
  try {
    return static_cast<int>(fulcrum::validation::Main({argv + 1, argv + argc}));
  } catch (const fulcrum::InputError& error) {
    std::fprintf(stderr, "validate: %s\n", error.what());
    return static_cast<int>(fulcrum::ExitCode::kBadUsage);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "validate: %s\n", error.what());
    return static_cast<int>(fulcrum::ExitCode::kFailure);
  }
}
