// The Debian package, unpacked into a folder: its content, systemd's own check of its units, a session as a user starts
// it, and a session whose nodes the test starts as their units define, in place of systemd.

#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <boost/property_tree/json_parser.hpp>
#include <boost/property_tree/ptree.hpp>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <optional>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/cart.h"
#include "tests/support/program.h"
#include "tests/system/install/notify_socket.h"
#include "tests/system/install/unit_file.h"

namespace fulcrum {
namespace {

namespace fs = std::filesystem;
using testing::NotifySocket;
using testing::Program;
using testing::ReadFile;
using testing::UnitFile;
using testing::WaitFor;

constexpr double kStartLimit_s = 60.0;  // compiling the scene and six starts, on a busy machine
constexpr double kEndLimit_s = 60.0;

/// Runs a program to its end and returns its output; a failure of the program fails the test.
std::string Output(const std::string& program, const std::vector<std::string>& arguments) {
  Program run(program, arguments);
  const int code = run.End(0);
  EXPECT_EQ(code, 0) << program << " printed:\n" << run.Said();
  return run.Said();
}

/// Makes and unpacks the package once for all tests.
class InstallTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    std::string name = (fs::temp_directory_path() / "fulcrum_install_XXXXXX").string();
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    folder_ = name;
    // Compression is not tested, because that of a release takes most of the time.
    Output("/usr/bin/env", {FULCRUM_CPACK, "--config", FULCRUM_BUILD_DIR "/CPackConfig.cmake", "-G", "DEB", "-B",
                            folder_ / "package", "-D", "CPACK_DEBIAN_COMPRESSION_TYPE=gzip"});
    for (const auto& entry : fs::directory_iterator(folder_ / "package")) {
      if (entry.path().extension() == ".deb") package_ = entry.path();
    }
    ASSERT_FALSE(package_.empty()) << "cpack made no package";
    Output("/usr/bin/dpkg-deb", {"-x", package_, root_ = folder_ / "root"});
    fs::remove_all(folder_ / "package" / "_CPack_Packages");
  }
  static void TearDownTestSuite() { fs::remove_all(folder_); }

  static fs::path UnitPath(const std::string& name) { return root_ / "lib/systemd/system" / name; }
  static UnitFile Unit(const std::string& name) { return {UnitPath(name), root_}; }
  static std::vector<std::string> NodeUnits() { return Unit("fulcrum-supervisor.service").Words("Wants"); }

  static fs::path folder_, package_, root_;
};
fs::path InstallTest::folder_, InstallTest::package_, InstallTest::root_;

TEST_F(InstallTest, PackageSaysWhatItNeedsAndKeepsTheConfigurationOfTheLab) {
  const std::string control = Output("/usr/bin/dpkg-deb", {"-f", package_});
  EXPECT_NE(control.find("Package: fulcrum\n"), std::string::npos) << control;
  // Libraries found in the programs by dpkg-shlibdeps, and those loaded at run time.
  for (const char* needed :
       {"libfastrtps", "libopenscenegraph", "libserialport", "libsystemd0", "libseccomp2", "libegl-mesa0"}) {
    EXPECT_NE(control.find(needed), std::string::npos) << needed << "\n" << control;
  }
  EXPECT_EQ(control.find("googletest"), std::string::npos);
  for (const std::string& file : testing::SplitWords(Output("/usr/bin/dpkg-deb", {"-I", package_, "conffiles"}))) {
    EXPECT_TRUE(fs::is_regular_file(root_.string() + file)) << file;
  }
  EXPECT_EQ(fs::read_symlink(root_ / "usr/bin/fulcrum"), "../libexec/fulcrum/fulcrum");
  EXPECT_EQ(fs::read_symlink(root_ / "usr/bin/replayer"), "../libexec/fulcrum/replayer");
  EXPECT_TRUE(fs::exists(root_ / "usr/share/man/man1/fulcrum-up.1.gz"));
  // No file may contain paths of the build.
  for (const auto& entry : fs::recursive_directory_iterator(root_)) {
    if (!entry.is_regular_file() || entry.path().extension() == ".gz") continue;
    EXPECT_EQ(ReadFile(entry.path()).find(FULCRUM_BUILD_DIR), std::string::npos) << entry.path();
  }
}

TEST_F(InstallTest, BillOfMaterialsNamesWhatIsLinkedAndCompiledIn) {
  boost::property_tree::ptree bill;
  ASSERT_NO_THROW(boost::property_tree::read_json(root_ / "usr/share/doc/fulcrum/fulcrum.spdx.json", bill));
  EXPECT_EQ(bill.get<std::string>("spdxVersion"), "SPDX-2.3");
  EXPECT_EQ(bill.get<std::string>("dataLicense"), "CC0-1.0");

  std::map<std::string, std::string> ids, licences;  // by name; a part of the package has the name of its program
  std::set<std::string> known{"SPDXRef-DOCUMENT"};
  for (const auto& [key, package] : bill.get_child("packages")) {
    const auto name = package.get<std::string>("name"), id = package.get<std::string>("SPDXID");
    EXPECT_TRUE(known.insert(id).second) << id << " occurs twice";
    EXPECT_FALSE(package.get<std::string>("versionInfo", "").empty()) << name;
    if (id == "SPDXRef-Package-fulcrum" || id.starts_with("SPDXRef-Part-")) {
      EXPECT_EQ(package.get<std::string>("licenseDeclared"), "NONE") << id;
    } else {
      EXPECT_TRUE(package.get<std::string>("externalRefs..referenceLocator").starts_with("pkg:deb/debian/")) << name;
    }
    if (id == "SPDXRef-Package-fulcrum") continue;
    ids[name] = id;
    licences[name] = package.get<std::string>("licenseDeclared");
  }
  std::set<std::string> relations;  // FROM TYPE TO
  for (const auto& [key, relation] : bill.get_child("relationships")) {
    const auto from = relation.get<std::string>("spdxElementId"), to = relation.get<std::string>("relatedSpdxElement");
    EXPECT_TRUE(known.contains(from) && known.contains(to)) << from << " " << to;
    relations.insert(from + " " + relation.get<std::string>("relationshipType") + " " + to);
  }

  // The libraries that dpkg-shlibdeps has found in the programs are listed, too.
  const std::string depends = Output("/usr/bin/dpkg-deb", {"-f", package_, "Depends"});
  for (const std::string& word : testing::SplitWords(std::regex_replace(depends, std::regex(R"(\([^)]*\)|,)"), ""))) {
    if (word == "|" || word == "ffmpeg" || word.starts_with("systemd")) continue;  // Started, not linked.
    EXPECT_TRUE(relations.contains("SPDXRef-Package-fulcrum DEPENDS_ON " + ids[word])) << word;
  }
  for (const char* program : {"fulcrum", "physics_node", "recorder"}) {
    EXPECT_TRUE(relations.contains(ids[program] + " DYNAMIC_LINK " + ids["libfastrtps2.9"])) << program;
  }
  EXPECT_TRUE(relations.contains(ids["render_node"] + " DYNAMIC_LINK " + ids["libopenscenegraph161"]));
  EXPECT_TRUE(relations.contains(ids["physics_node"] + " STATIC_LINK " + ids["libeigen3-dev"]));

  // CGAL is GPL and only in one program: a second one would require a change of THIRD_PARTY.md.
  EXPECT_TRUE(std::regex_search(licences["libcgal-dev"], std::regex(R"(\bGPL-3\.0-or-later)")))
      << licences["libcgal-dev"];
  EXPECT_TRUE(relations.contains(ids["fulcrum_scene_mesh"] + " STATIC_LINK " + ids["libcgal-dev"]));
  for (const auto& [name, id] : ids) {
    if (!id.starts_with("SPDXRef-Part-") || name == "fulcrum_scene_mesh") continue;
    EXPECT_EQ(relations.contains(id + " STATIC_LINK " + ids["libcgal-dev"]), name == "scene_compiler") << name;
    EXPECT_EQ(relations.contains(id + " STATIC_LINK " + ids["fulcrum_scene_mesh"]), name == "scene_compiler") << name;
  }
}

TEST_F(InstallTest, EveryCommandHasAPageOfTheManual) {
  const fs::path pages = root_ / "usr/share/man/man1";
  ASSERT_TRUE(fs::exists(pages / "fulcrum.1.gz")) << "is help2man installed?";
  const std::string help = Output(root_ / "usr/bin/fulcrum", {"--help"});
  const std::string page = Output("/bin/gzip", {"-dc", pages / "fulcrum.1.gz"});
  const std::regex command("\n  ([a-z-]+) +[A-Z]");
  int commands = 0;
  for (std::sregex_iterator found(help.begin(), help.end(), command), end; found != end; ++found, ++commands) {
    const std::string name = (*found)[1];
    EXPECT_TRUE(fs::exists(pages / ("fulcrum-" + name + ".1.gz"))) << name;
    // A paragraph for the command, not only its name.
    const std::string tag = "\n.TP\n.B " + std::regex_replace(name, std::regex("-"), "\\-") + "\n";
    EXPECT_NE(page.find(tag), std::string::npos) << name << "\n" << page;
  }
  EXPECT_GE(commands, 20) << help;
  // The pages name no folder of the machine on which they were built.
  const char* home = std::getenv("HOME");
  for (const auto& entry : fs::directory_iterator(pages)) {
    const std::string text = Output("/bin/gzip", {"-dc", entry.path()});
    EXPECT_EQ(text.find(FULCRUM_BUILD_DIR), std::string::npos) << entry.path();
    if (home != nullptr) {
      EXPECT_EQ(text.find(home + std::string("/.")), std::string::npos) << entry.path();
    }
  }
}

TEST_F(InstallTest, UnitsPassTheCheckOfSystemd) {
  if (::access("/usr/bin/systemd-analyze", X_OK) != 0) GTEST_SKIP() << "systemd-analyze is not installed";
  // The units with the paths of this tree; those of the system itself come from their usual place.
  const fs::path units = folder_ / "units";
  fs::create_directories(units / "fulcrum-.service.d");
  std::vector<std::string> arguments{"SYSTEMD_UNIT_PATH=" + units.string() + ":/lib/systemd/system", "systemd-analyze",
                                     "verify", "--man=no"};
  for (const auto& entry : fs::recursive_directory_iterator(root_ / "lib/systemd/system")) {
    if (!entry.is_regular_file()) continue;
    const fs::path copy = units / fs::relative(entry.path(), root_ / "lib/systemd/system");
    std::ofstream(copy) << std::regex_replace(ReadFile(entry.path()), std::regex("=/usr/"),
                                              "=" + root_.string() + "/usr/");
    if (copy.parent_path() == units) arguments.push_back(copy);
  }
  ASSERT_EQ(arguments.size(), 4u + 10u) << "a target, the supervisor, the console, the host, six nodes";
  EXPECT_EQ(Output("/usr/bin/env", arguments), "") << "systemd reports errors in the units";
}

TEST_F(InstallTest, UnitsLimitWhatEachNodeMayDo) {
  const UnitFile all(root_ / "lib/systemd/system/fulcrum-.service.d/10-fulcrum.conf", root_);
  std::string calls;
  for (const std::string& value : all.Values("SystemCallFilter")) calls += " " + value;
  // Without these calls a node could not confine itself and would only log a warning.
  for (const char* needed : {" seccomp", " landlock_create_ruleset", " landlock_add_rule", " landlock_restrict_self"}) {
    EXPECT_NE(calls.find(needed), std::string::npos) << needed;
  }
  EXPECT_EQ(all.Value("RestrictAddressFamilies"), "AF_UNIX AF_INET AF_NETLINK");
  EXPECT_EQ(all.Value("IPAddressDeny"), "any");
  EXPECT_EQ(all.Value("IPAddressAllow"), "localhost multicast");
  EXPECT_EQ(all.Value("CapabilityBoundingSet"), "");
  EXPECT_EQ(all.Value("ProtectSystem"), "strict");
  EXPECT_EQ(all.Value("LimitCORE"), "0");
  const std::map<std::string, std::string> written{{"recorder", "sessions"}, {"physics", "sessions"},
                                                   {"thermal", "sessions"},  {"render", "sessions"},
                                                   {"handle-bridge", ""},    {"haptics", "all"}};
  for (const auto& [node, below] : written) {
    const UnitFile unit = Unit("fulcrum-" + node + ".service");
    EXPECT_EQ(unit.Value("ReadOnlyPaths").empty(), below == "all") << node;
    EXPECT_EQ(unit.Value("ReadWritePaths").empty(), below != "sessions") << node;
    // No unit adds an address, a call or a capability to those of all units.
    for (const char* key : {"IPAddressAllow", "SystemCallFilter", "CapabilityBoundingSet", "AmbientCapabilities"}) {
      EXPECT_TRUE(unit.Values(key).empty()) << node << " " << key;
    }
    EXPECT_EQ(unit.Values("DeviceAllow").empty(), unit.Value("PrivateDevices") == "yes") << node;
  }
}

/// Whether one of the key's values has the word.
bool Names(const UnitFile& unit, const std::string& key, const std::string& word) {
  for (const std::string& value : unit.Values(key)) {
    const std::vector<std::string> words = testing::SplitWords(value);
    if (std::find(words.begin(), words.end(), word) != words.end()) return true;
  }
  return false;
}

// DeviceAllow= of a kind of device whose driver is not loaded yet is ignored until the unit starts again.
TEST_F(InstallTest, AHandleMayBePluggedInAfterItsUnitHasStarted) {
  const std::map<std::string, std::string> drivers{{"char-ttyUSB", "modprobe@usbserial.service"},
                                                   {"char-ttyACM", "modprobe@cdc_acm.service"}};
  int found = 0;
  for (const auto& entry : fs::directory_iterator(root_ / "lib/systemd/system")) {
    if (entry.path().extension() != ".service") continue;
    const UnitFile unit = Unit(entry.path().filename());
    for (const auto& [device, driver] : drivers) {
      if (!Names(unit, "DeviceAllow", device)) continue;
      ++found;
      EXPECT_TRUE(Names(unit, "Wants", driver)) << entry.path() << " " << driver;
      EXPECT_TRUE(Names(unit, "After", driver)) << entry.path() << " " << driver;
    }
  }
  EXPECT_EQ(found, 7) << "handle-bridge, console and host both, haptics one";
}

TEST_F(InstallTest, WhatServesOtherMachinesSaysHowTheyReachIt) {
  const std::string settings = ReadFile(root_ / "etc/default/fulcrum");
  for (const std::string unit : {"fulcrum-console.service", "fulcrum-host.service"}) {
    EXPECT_NE(settings.find(unit + ".d/20-lab.conf"), std::string::npos) << unit;
    EXPECT_NE(ReadFile(UnitPath(unit)).find(unit + ".d/20-lab.conf"), std::string::npos) << unit;
  }
  EXPECT_NE(settings.find("IPAddressAllow="), std::string::npos);
  // A host ends with each session.
  EXPECT_EQ(Unit("fulcrum-host.service").Value("Restart"), "always");
  // No exit code tells a fault that passes, such as an unplugged cable at the start, from one that stays.
  EXPECT_EQ(Unit("fulcrum-host.service").Value("RestartPreventExitStatus"), "");
  EXPECT_EQ(Unit("fulcrum-host.service").Value("StartLimitIntervalSec"), "0");
}

TEST_F(InstallTest, SessionRunsFromTheInstalledPlaces) {
  const fs::path elsewhere = folder_ / "elsewhere";
  fs::create_directory(elsewhere);
  // The working directory is not writable, not even for root.
  const std::string fulcrum = root_ / "usr/bin/fulcrum";
  const std::string said =
      Output("/usr/bin/env", {"-C", "/proc", "XDG_CACHE_HOME=" + (folder_ / "cache").string(), fulcrum, "up", "small",
                              "--domain", "89", "--seconds", "1", "--out", elsewhere});
  EXPECT_TRUE(fs::exists(elsewhere / "latest/report.html")) << said;
  // Other findings depend on this machine.
  Program program(fulcrum, {"doctor", "--domain", "89"});
  program.End(0);
  const std::string doctor = program.Said();
  EXPECT_NE(doctor.find("all in " + (root_ / "usr/libexec/fulcrum").string()), std::string::npos) << doctor;
  EXPECT_NE(doctor.find((root_ / "etc/fulcrum/cart.yaml").string()), std::string::npos) << doctor;
}

/// One started unit.
class Service {
 public:
  Service(const std::string& name, const UnitFile& unit, const fs::path& folder, const fs::path& runtime)
      : unit_(unit), socket_(folder / (name + ".notify")) {
    const std::string watchdog = unit.Value("WatchdogSec") + "000000";
    environment_ = {"-C", "/proc", "NOTIFY_SOCKET=" + (folder / (name + ".notify")).string(),
                    "WATCHDOG_USEC=" + watchdog, "RUNTIME_DIRECTORY=" + runtime.string()};
    for (const std::string& values : unit.Values("Environment")) {
      for (const std::string& value : testing::SplitWords(values)) environment_.push_back(value);
    }
  }

  void Start() {
    std::vector<std::string> words = environment_;
    for (const std::string& word : unit_.Command()) words.push_back(word);
    socket_.Forget();
    program_ = Program("/usr/bin/env", words);
  }
  [[nodiscard]] bool Heard(const std::string& beginning) { return socket_.HasHeard(beginning); }
  [[nodiscard]] Program& program() { return program_; }
  [[nodiscard]] std::string All() { return program_.Said() + socket_.Heard(); }

 private:
  UnitFile unit_;
  NotifySocket socket_;
  std::vector<std::string> environment_;
  Program program_;
};

TEST_F(InstallTest, SessionOfServicesRunsAsTheUnitsSay) {
  const fs::path runtime = root_ / "run/fulcrum";
  fs::create_directories(runtime);
  fs::create_directories(root_ / "var/lib/fulcrum");
  std::ofstream(root_ / "etc/default/fulcrum")
      << "# as the lab would\nFULCRUM_SCENE=small\nFULCRUM_OPTIONS=--record --domain 84 --seconds 5\n";

  Service supervisor("supervisor", Unit("fulcrum-supervisor.service"), folder_, runtime);
  supervisor.Start();
  // Type=notify: READY starts the units that have this one in After=.
  ASSERT_TRUE(WaitFor(kStartLimit_s, [&] { return supervisor.Heard("READY=1"); })) << supervisor.All();

  std::map<std::string, std::unique_ptr<Service>> nodes;
  for (const std::string& name : NodeUnits()) {
    const UnitFile unit = Unit(name);
    ASSERT_TRUE(fs::exists(unit.Value("ConditionPathExists"))) << name << "\n" << supervisor.All();
    nodes[name] = std::make_unique<Service>(name, unit, folder_, runtime);
    nodes[name]->Start();
  }
  ASSERT_EQ(nodes.size(), 6u);
  for (auto& [name, node] : nodes) {
    ASSERT_TRUE(WaitFor(kStartLimit_s, [node = node.get()] { return node->Heard("READY=1"); })) << name << "\n"
                                                                                                << node->All();
  }
  for (auto& [name, node] : nodes) {
    EXPECT_TRUE(WaitFor(kStartLimit_s, [node = node.get()] { return node->Heard("STATUS=running"); })) << name << "\n"
                                                                                                       << node->All();
    EXPECT_TRUE(node->Heard("WATCHDOG=1")) << name << "\n" << node->All();
  }
  EXPECT_TRUE(supervisor.Heard("WATCHDOG=1")) << supervisor.All();

  // Restart=on-failure.
  Service& physics = *nodes["fulcrum-physics.service"];
  EXPECT_EQ(physics.program().End(SIGKILL), -SIGKILL);
  physics.Start();
  ASSERT_TRUE(WaitFor(kStartLimit_s, [&] { return physics.Heard("STATUS=running"); })) << physics.All();

  std::optional<int> code;
  ASSERT_TRUE(WaitFor(kEndLimit_s, [&] { return (code = supervisor.program().Poll()).has_value(); }))
      << supervisor.All();
  EXPECT_EQ(*code, 0) << supervisor.All();
  EXPECT_TRUE(supervisor.Heard("STOPPING=1"));
  for (auto& [name, node] : nodes) {
    ASSERT_TRUE(
        WaitFor(kEndLimit_s, [&code, node = node.get()] { return (code = node->program().Poll()).has_value(); }))
        << name << " did not end\n"
        << node->All();
    EXPECT_EQ(*code, 0) << name << "\n" << node->All();
    EXPECT_FALSE(fs::exists(Unit(name).Value("ConditionPathExists"))) << name << " would start once more";
  }
  const fs::path session = root_ / "var/lib/fulcrum/sessions/latest";
  EXPECT_TRUE(fs::exists(session / "report.html"));
  EXPECT_TRUE(fs::exists(session / "recording.mcap"));
  const std::string summary = ReadFile(session / "summary.json");
  EXPECT_NE(summary.find("\"physics_node.restarts\": 1,"), std::string::npos) << summary;
  EXPECT_EQ(summary.find("\"physics_node.longest_rejoin_s\": 0,"), std::string::npos) << summary;
}

}  // namespace
}  // namespace fulcrum
