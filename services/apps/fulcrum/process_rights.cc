#include "services/apps/fulcrum/process_rights.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>

#include "services/apps/fulcrum/commands.h"

namespace fulcrum::supervisor::cli {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> WordsOf(const fs::path& process) {
  std::ifstream in(process / "cmdline", std::ios::binary);
  std::vector<std::string> words;
  for (std::string word; std::getline(in, word, '\0');) words.push_back(word);
  return words;
}

std::string FieldOf(const std::string& status, const std::string& key) {
  std::istringstream lines(status);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with(key + ":\t")) return line.substr(key.size() + 2);
  }
  return {};
}

bool IsOurs(const std::string& program) { return program == "fulcrum" || IsProgram(program); }

}  // namespace

bool ProcessRights::Has(const std::string& word) const {
  return std::find(words.begin(), words.end(), word) != words.end();
}

std::string ProcessRights::ValueOf(const std::string& option) const {
  for (auto word = words.begin(); word != words.end(); ++word) {
    if (*word == option && std::next(word) != words.end()) return *std::next(word);
    if (word->starts_with(option + "=")) return word->substr(option.size() + 1);
  }
  return {};
}

std::vector<ProcessRights> FulcrumProcesses() {
  std::vector<ProcessRights> found;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator("/proc", error)) {
    const std::string number = entry.path().filename();
    if (number.find_first_not_of("0123456789") != std::string::npos) continue;
    struct stat owner {};
    if (::stat(entry.path().c_str(), &owner) != 0 || owner.st_uid != ::getuid()) continue;
    ProcessRights process;
    process.words = WordsOf(entry.path());
    if (process.words.empty()) continue;
    process.pid = static_cast<pid_t>(std::stol(number));
    process.name = fs::path(process.words.front()).filename();
    if (!IsOurs(process.name) || process.pid == ::getpid()) continue;
    std::ifstream in(entry.path() / "status");
    const std::string status{std::istreambuf_iterator<char>(in), {}};
    if (FieldOf(status, "State").starts_with("Z")) continue;
    process.filtered = FieldOf(status, "Seccomp") == "2";
    process.no_new_privileges = FieldOf(status, "NoNewPrivs") == "1";
    process.capabilities = std::strtoull(FieldOf(status, "CapEff").c_str(), nullptr, 16);
    found.push_back(std::move(process));
  }
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
  return found;
}

}  // namespace fulcrum::supervisor::cli
