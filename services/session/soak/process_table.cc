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

/// Time at which a process was started, in ticks of the kernel since its own start; nullopt when it has ended.
/// Numbers of processes begin again at the small ones, so that they do not tell which is older.
std::optional<std::uint64_t> StartOf(const fs::path& process) {
  constexpr int kStart = 22, kAfterName = 3;  // Fields of proc(5), counted from 1.
  std::ifstream in(process / "stat");
  std::string line;
  std::getline(in, line);
  const std::size_t name_end = line.rfind(')');  // The name may contain anything.
  if (name_end == std::string::npos) return {};
  std::istringstream fields(line.substr(name_end + 1));
  std::string field;
  for (int i = kAfterName; i < kStart; ++i) fields >> field;
  std::uint64_t start = 0;
  return fields >> start ? std::optional(start) : std::nullopt;
}

bool IsZombie(const std::string& status) { return FieldOf(status, "State").starts_with("Z"); }

}  // namespace

std::optional<std::uint64_t> ResidentBytes(pid_t process) {
  const std::string status = StatusOf("/proc/" + std::to_string(process));
  const std::string resident = FieldOf(status, "VmRSS");  // "   1234 kB"
  if (resident.empty() || IsZombie(status)) return {};
  return std::stoull(resident) * 1024;
}

std::map<std::string, pid_t> ChildrenOf(pid_t parent, const fs::path& processes) {
  struct Child {
    std::uint64_t start;
    pid_t process;
  };
  std::map<std::string, Child> oldest;
  const std::string wanted = std::to_string(parent);
  for (const auto& entry : fs::directory_iterator(processes)) {
    const std::string name = entry.path().filename();
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    const std::string status = StatusOf(entry.path());
    if (FieldOf(status, "PPid") != wanted || IsZombie(status)) continue;
    const std::optional<std::uint64_t> start = StartOf(entry.path());
    if (!start) continue;  // It has just ended.
    const Child child{*start, static_cast<pid_t>(std::stol(name))};
    const auto [found, is_new] = oldest.emplace(FieldOf(status, "Name"), child);
    if (!is_new && child.start < found->second.start) found->second = child;
  }
  std::map<std::string, pid_t> children;
  for (const auto& [program, child] : oldest) children.emplace(program, child.process);
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
