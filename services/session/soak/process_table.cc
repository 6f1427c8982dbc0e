#include "services/session/soak/process_table.h"

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>

namespace fulcrum::soak {
namespace {

namespace fs = std::filesystem;

/// Value of the field `key` in a status file of the kernel.
std::string FieldOf(const std::string& status, const std::string& key) {
  const std::size_t at = status.find("\n" + key + ":\t");
  if (at == std::string::npos) return {};
  const std::size_t begin = at + key.size() + 3;
  return status.substr(begin, status.find('\n', begin) - begin);
}

std::string StatusOf(const fs::path& process) {
  std::ifstream in(process / "status");
  std::ostringstream text;
  text << '\n' << in.rdbuf();
  return text.str();
}

bool IsZombie(const std::string& status) { return FieldOf(status, "State").starts_with("Z"); }

}  // namespace

std::optional<std::uint64_t> ResidentBytes(pid_t process) {
  const std::string status = StatusOf("/proc/" + std::to_string(process));
  const std::string resident = FieldOf(status, "VmRSS");  // "   1234 kB"
  if (resident.empty() || IsZombie(status)) return {};
  return std::stoull(resident) * 1024;
}

std::map<std::string, pid_t> ChildrenOf(pid_t parent) {
  std::map<std::string, pid_t> children;
  const std::string wanted = std::to_string(parent);
  for (const auto& entry : fs::directory_iterator("/proc")) {
    const std::string name = entry.path().filename();
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    const std::string status = StatusOf(entry.path());
    if (FieldOf(status, "PPid") != wanted || IsZombie(status)) continue;
    children.emplace(status.substr(status.find('\t') + 1, status.find('\n', 1) - status.find('\t') - 1),
                     static_cast<pid_t>(std::stol(name)));
  }
  return children;
}

ProcessorTimes ReadProcessorTimes() {
  // proc(5): user nice system idle iowait irq softirq steal. Time of guests is part of user and nice.
  constexpr int kColumns = 8;
  std::ifstream in("/proc/stat");
  std::string name;
  in >> name;
  ProcessorTimes times;
  for (int column = 0; column < kColumns && in >> times.stolen; ++column) times.all += times.stolen;
  return times;
}

}  // namespace fulcrum::soak
