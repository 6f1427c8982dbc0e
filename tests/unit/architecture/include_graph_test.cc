// The include graph: the rooms have one order, and each includes only rooms before it, so that no circle can arise.
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

/// From the lowest room up. A room may include those before it. Only the last ones, each an executable, may include a
/// node's folder.
const std::vector<std::string> kRooms = {"services/core",      "services/runtime",     "services/config",
                                         "services/bus",       "services/bus/convert", "services/keys",
                                         "services/bus/dds",   "services/scene",       "services/recording",
                                         "services/app",       "services/link",        "services/assessment",
                                         "services/log_tools", "services/recorder",    "services/supervisor",
                                         "services/console",   "services/soak",        "services/scene_compiler",
                                         "services/replayer",  "services/apps/fulcrum"};
const std::set<std::string> kNodes = {"physics_node", "haptics_node", "handle_bridge", "render_node", "thermal_node"};
const std::set<std::string> kJoinNodes = {"services/replayer"};
/// What a node's folder may include of the services: up to the class that makes its ports.
const std::string kHighestOfNodes = "services/app";

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

struct Include {
  std::string from, to;  ///< Files, from the root.
};

std::vector<Include> Includes() {
  static const std::regex line(R"re(^\s*#include "([^"]+)")re");
  std::vector<Include> found;
  for (const char* top : {"services", "physics_node", "haptics_node", "handle_bridge", "render_node", "thermal_node"}) {
    for (const auto& entry : fs::recursive_directory_iterator(fs::path(FULCRUM_SOURCE_DIR) / top)) {
      const std::string ending = entry.path().extension();
      if (ending != ".h" && ending != ".cc") continue;
      std::ifstream file(entry.path());
      const std::string from = fs::relative(entry.path(), FULCRUM_SOURCE_DIR);
      for (std::string text; std::getline(file, text);) {
        if (std::smatch match; std::regex_search(text, match, line)) found.push_back({from, match[1]});
      }
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
      EXPECT_TRUE(kJoinNodes.contains(from)) << include.from << " includes " << include.to << " of a node";
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
  // Folders from which nothing leads on are taken away, again and again: what is left is in a circle, or above one.
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
    ADD_FAILURE() << folder << " is in a circle with, or above one of:" << text;
  }
}

}  // namespace
}  // namespace fulcrum
