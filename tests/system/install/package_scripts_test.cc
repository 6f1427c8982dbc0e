// What the package's scripts do around an installation and an upgrade: they run with programs that only note their
// call.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <regex>
#include <string>

#include "tests/support/cart.h"
#include "tests/support/program.h"

namespace fulcrum {
namespace {

namespace fs = std::filesystem;
using testing::Program;
using testing::ReadFile;

const fs::path kDeploy = fs::path(FULCRUM_SOURCE_DIR) / "deploy";

class PackageScripts : public ::testing::Test {
 protected:
  PackageScripts() {
    std::string name = (fs::temp_directory_path() / "fulcrum_scripts_XXXXXX").string();
    EXPECT_NE(::mkdtemp(name.data()), nullptr);
    folder_ = name;
    fs::create_directories(folder_ / "run/systemd/system");
    fs::create_directories(folder_ / "bin");
    SetState("inactive");
    for (const char* program :
         {"deb-systemd-invoke", "udevadm", "runuser", "systemd-sysusers", "systemd-tmpfiles", "systemctl"}) {
      std::ofstream(folder_ / "bin" / program)
          << "#!/bin/sh\necho " << program << " \"$@\" >>" << Calls().string() << "\n[ \"$1\" != is-active ] || { cat "
          << State().string() << "; grep -qx active " << State().string() << "; }\n";
      fs::permissions(folder_ / "bin" / program, fs::perms::owner_all);
    }
  }
  ~PackageScripts() override { fs::remove_all(folder_); }

  fs::path Calls() const { return folder_ / "calls"; }
  fs::path State() const { return folder_ / "state"; }
  /// What systemctl says of each unit.
  void SetState(const std::string& state) const { std::ofstream(State()) << state << "\n"; }
  /// Runs a script whose /run is a folder of this test; returns the calls that it makes.
  std::string Run(const std::string& script, const std::string& argument) {
    const std::string text = std::regex_replace(ReadFile(kDeploy / "packaging" / script), std::regex(" /(run|proc)/"),
                                                " " + folder_.string() + "/$1/");
    std::ofstream(folder_ / script) << text;
    fs::remove(Calls());
    Program run("/usr/bin/env",
                {"PATH=" + (folder_ / "bin").string() + ":/usr/bin:/bin", "sh", folder_ / script, argument});
    EXPECT_EQ(run.End(0), 0) << run.Said();
    return fs::exists(Calls()) ? ReadFile(Calls()) : "";
  }

  fs::path folder_;
};

TEST_F(PackageScripts, AnUpgradeStartsTheConsoleAgainIfItRan) {
  const std::string start = "deb-systemd-invoke start fulcrum-console.service";
  EXPECT_EQ(Run("postinst", "configure").find(start), std::string::npos) << "not by the first installation";
  SetState("active");
  EXPECT_NE(Run("prerm", "upgrade").find("deb-systemd-invoke stop"), std::string::npos);
  EXPECT_NE(Run("postinst", "configure").find(start), std::string::npos);
  EXPECT_EQ(Run("postinst", "configure").find(start), std::string::npos) << "once";
  (void)Run("prerm", "upgrade");
  EXPECT_NE(Run("postinst", "abort-upgrade").find(start), std::string::npos);
  (void)Run("prerm", "remove");
  EXPECT_EQ(Run("postinst", "configure").find(start), std::string::npos);
  SetState("inactive");
  (void)Run("prerm", "upgrade");
  EXPECT_EQ(Run("postinst", "configure").find(start), std::string::npos) << "it did not run";
}

// The host of an older release than the cart's ends, and waits for its next start when it is upgraded.
TEST_F(PackageScripts, AnUpgradeStartsAHostAgainThatTheOldReleaseCouldNotKeepRunning) {
  const std::string start = "deb-systemd-invoke start fulcrum-host.service";
  for (const char* state : {"failed", "activating"}) {
    SetState(state);
    (void)Run("prerm", "upgrade");
    const std::string calls = Run("postinst", "configure");
    EXPECT_NE(calls.find(start), std::string::npos) << state;
    EXPECT_LT(calls.find("systemctl reset-failed fulcrum-host.service"), calls.find(start)) << state;
  }
}

TEST_F(PackageScripts, RulesAreAppliedToEveryDeviceThatIsPluggedInAlready) {
  const std::string rules = ReadFile(kDeploy / "udev" / "60-fulcrum.rules"), calls = Run("postinst", "configure");
  const std::regex subsystem("SUBSYSTEM[!=]=\"([^\"]+)\"");
  int found = 0;
  for (auto at = std::sregex_iterator(rules.begin(), rules.end(), subsystem); at != std::sregex_iterator(); ++at) {
    EXPECT_NE(calls.find("--subsystem-match=" + (*at)[1].str()), std::string::npos) << (*at)[1] << "\n" << calls;
    ++found;
  }
  EXPECT_GE(found, 3);
}

}  // namespace
}  // namespace fulcrum
