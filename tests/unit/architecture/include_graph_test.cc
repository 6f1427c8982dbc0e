// The include graph: the rooms have one order, and each includes only rooms before it, so that no cycle can arise.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

namespace fulcrum {
namespace {

namespace fs = std::filesystem;

/// Floors of the services with their rooms, from the ground up. A room may include those before it, whatever their
/// floor, so that no cycle can arise.
struct Floor {
  const char* name;
  std::vector<std::string> rooms;
};
const std::vector<Floor> kFloors = {
    {"base", {"core", "runtime", "config", "picture"}},
    {"scene", {"format", "builder", "readers", "compiler", "anatomy"}},
    {"transport", {"control", "bus", "bus/convert", "keys", "bus/dds", "link"}},
    {"nodes", {"app"}},
    {"records", {"recording", "recorder", "log_tools"}},
    {"session", {"assessment", "training", "supervisor", "console", "soak"}},
    {"apps", {"scene_compiler", "replayer", "fulcrum"}},
};

std::vector<std::string> Rooms() {
  std::vector<std::string> rooms;
  for (const Floor& floor : kFloors) {
    for (const std::string& room : floor.rooms) rooms.push_back("services/" + std::string(floor.name) + "/" + room);
  }
  return rooms;
}
const std::vector<std::string> kRooms = Rooms();
const std::set<std::string> kNodes = {"physics_node", "haptics_node", "handle_bridge", "render_node", "thermal_node"};
/// The floor whose executables combine others: only it may include a node's folder.
const std::string kJoinsNodes = "services/apps/";
/// Limit of what a node's folder may include of the services: up to the class that makes its ports.
const std::string kHighestOfNodes = "services/nodes/app";
constexpr std::size_t kLongestFile = 500, kLongestMain = 60;  ///< [lines]

/// The room of a path from the root; empty: none of the product's.
std::string RoomOf(const std::string& path) {
  std::string best;
  for (const std::string& room : kRooms) {
    if (path.starts_with(room + "/") && room.size() > best.size()) best = room;
  }
  if (!best.empty()) return best;
  const std::string top = path.substr(0, path.find('/'));
  return kNodes.contains(top) ? top : std::string();
}

std::size_t FloorOf(const std::string& room) {
  return static_cast<std::size_t>(std::find(kRooms.begin(), kRooms.end(), room) - kRooms.begin());
}

/// Sources below these folders, from the root.
std::vector<std::string> Sources(const std::vector<std::string>& tops) {
  std::vector<std::string> sources;
  for (const std::string& top : tops) {
    for (const auto& entry : fs::recursive_directory_iterator(fs::path(FULCRUM_SOURCE_DIR) / top)) {
      const std::string ending = entry.path().extension();
      if (ending == ".h" || ending == ".cc") sources.push_back(fs::relative(entry.path(), FULCRUM_SOURCE_DIR));
    }
  }
  return sources;
}

std::vector<std::string> SourcesOfTheProduct() {
  std::vector<std::string> tops(kNodes.begin(), kNodes.end());
  tops.emplace_back("services");
  return Sources(tops);
}

std::vector<std::string> LinesOf(const std::string& source) {
  std::ifstream file(fs::path(FULCRUM_SOURCE_DIR) / source);
  std::vector<std::string> lines;
  for (std::string line; std::getline(file, line);) lines.push_back(line);
  return lines;
}

struct Include {
  std::string from, to;  ///< Paths relative to the root.
};

std::vector<Include> Includes() {
  static const std::regex directive(R"re(^\s*#include "([^"]+)")re");
  std::vector<Include> found;
  for (const std::string& from : SourcesOfTheProduct()) {
    for (const std::string& line : LinesOf(from)) {
      if (std::smatch match; std::regex_search(line, match, directive)) found.push_back({from, match[1]});
    }
  }
  return found;
}

TEST(IncludeGraph, EverySourceOfTheServicesIsInARoom) {
  for (const Include& include : Includes()) EXPECT_NE(RoomOf(include.from), "") << include.from;
}

TEST(IncludeGraph, RoomsIncludeDownwardsOnly) {
  for (const Include& include : Includes()) {
    const std::string from = RoomOf(include.from), to = RoomOf(include.to);
    if (to.empty() || from == to) continue;
    if (kNodes.contains(to)) {
      EXPECT_TRUE(from.starts_with(kJoinsNodes)) << include.from << " includes " << include.to << " of a node";
    } else if (kNodes.contains(from)) {
      EXPECT_LE(FloorOf(to), FloorOf(kHighestOfNodes)) << include.from << " includes " << include.to;
    } else {
      EXPECT_LT(FloorOf(to), FloorOf(from)) << include.from << " includes upwards: " << include.to;
    }
  }
}

TEST(IncludeGraph, FoldersOfANodeDoNotIncludeEachOtherInACircle) {
  std::map<std::string, std::set<std::string>> graph;
  for (const Include& include : Includes()) {
    const std::string from = fs::path(include.from).parent_path(), to = fs::path(include.to).parent_path();
    if (!kNodes.contains(RoomOf(include.from)) || RoomOf(include.from) != RoomOf(include.to) || from == to) continue;
    graph[from].insert(to);
  }
  // Folders without edges to others are removed repeatedly: the rest is in a cycle or includes one.
  for (bool taken = true; taken;) {
    taken = false;
    for (auto& [folder, targets] : graph) {
      taken |= std::erase_if(targets, [&](const std::string& to) { return !graph.contains(to); }) > 0;
    }
    taken |= std::erase_if(graph, [](const auto& entry) { return entry.second.empty(); }) > 0;
  }
  for (const auto& [folder, targets] : graph) {
    std::string text;
    for (const std::string& target : targets) text += " " + target;
    ADD_FAILURE() << folder << " is in an include cycle, or leads to one through:" << text;
  }
}

TEST(Sources, NoFileIsLongerThanFitsAReadersHead) {
  std::vector<std::string> sources = SourcesOfTheProduct();
  const std::vector<std::string> tests = Sources({"tests"});
  sources.insert(sources.end(), tests.begin(), tests.end());
  for (const std::string& source : sources) EXPECT_LE(LinesOf(source).size(), kLongestFile) << source;
}

TEST(Sources, AMainOnlyJoins) {
  for (const std::string& source : SourcesOfTheProduct()) {
    if (!source.ends_with("/main.cc")) continue;
    EXPECT_LE(LinesOf(source).size(), kLongestMain) << source;
  }
}

}  // namespace
}  // namespace fulcrum
