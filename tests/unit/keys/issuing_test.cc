// Operations of a key folder's authority after the folder was made.
#include "services/transport/keys/issuing.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <ctime>
#include <fstream>
#include <functional>
#include <iterator>

#include "services/base/core/error.h"

namespace fulcrum::keys {
namespace {

namespace fs = std::filesystem;
using enum TopicId;

constexpr std::time_t kDay_s = 24 * 3600;

Validity For(int days) {
  const std::time_t now = std::time(nullptr);
  return {now, now + days * kDay_s};
}

std::string Content(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

unsigned ModeOf(const fs::path& path) {
  struct stat status {};
  return ::stat(path.c_str(), &status) == 0 ? status.st_mode & 0777u : 0;
}

class Issuing : public ::testing::Test {
 protected:
  Issuing() {
    fs::remove_all(scratch_);
    fs::create_directories(scratch_);
    MakeKeyFolder(folder_, For(30), false);
  }
  ~Issuing() override {
    std::error_code ignored;
    fs::remove_all(scratch_, ignored);
  }

  Validity Issue(const std::string& name, const fs::path& out = {}, int days = 10) const {
    return IssueGuest(folder_,
                      {.name = name, .writes = 0, .reads = bus::SetOf(kHealth), .validity = For(days), .out = out});
  }
  [[nodiscard]] IdentityState StateOf(const std::string& name) const {
    for (const IdentityState& state : InspectKeyFolder(folder_, std::time(nullptr))) {
      if (state.identity == name) return state;
    }
    return {};
  }

  const fs::path scratch_ = fs::temp_directory_path() / ("fulcrum-issuing-" + std::to_string(::getpid()));
  const fs::path folder_ = scratch_ / "keys";
};

/// Message of the InputError that `action` throws; empty: none.
std::string Problem(const std::function<void()>& action) {
  try {
    action();
  } catch (const InputError& problem) {
    return problem.what();
  }
  return {};
}

void ExpectSaid(const std::string& text, const std::vector<std::string>& parts) {
  for (const std::string& part : parts) EXPECT_NE(text.find(part), std::string::npos) << part << " in: " << text;
}

std::string CheckNow(const fs::path& folder, const std::string& identity) {
  return Problem([&] { (void)CheckIdentity(folder, identity, false, std::time(nullptr)); });
}

// The cart runs as the owner of the folder, who cannot read root's files.
TEST_F(Issuing, WhatRootMakesBelongsToTheOwnerOfTheFolder) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can give files away";
  constexpr uid_t kNobody = 65534;
  const auto owner = [](const fs::path& path) {
    struct stat status {};
    return ::stat(path.c_str(), &status) == 0 ? status.st_uid : uid_t{0xffffffff};
  };
  ASSERT_EQ(::chown(folder_.c_str(), kNobody, kNobody), 0);
  for (const auto& entry : fs::directory_iterator(folder_)) ::lchown(entry.path().c_str(), kNobody, kNobody);
  Issue("probe");
  Revoke(folder_, "probe");
  for (const auto& entry : fs::directory_iterator(folder_)) EXPECT_EQ(owner(entry.path()), kNobody) << entry.path();
  EXPECT_EQ(owner(AuthorityKeyFile(folder_)), 0u) << "the private key of the authority stays root's";
}

TEST_F(Issuing, StoresThePrivateKeyBesideTheFolderAndNotInIt) {
  const fs::path file = scratch_ / "keys.authority";
  EXPECT_EQ(AuthorityKeyFile(folder_), file);
  EXPECT_EQ(AuthorityKeyFile(folder_ / ""), file) << "with / at the end";
  EXPECT_EQ(ModeOf(file), 0600u);
  const std::string key = Content(file);
  ASSERT_NE(key.find("PRIVATE KEY"), std::string::npos);
  for (const auto& entry : fs::directory_iterator(folder_)) EXPECT_NE(Content(entry.path()), key) << entry.path();
}

TEST_F(Issuing, ForceReplacesFolderAndPrivateKey) {
  const std::string certificate = Content(folder_ / "authority.pem"), key = Content(AuthorityKeyFile(folder_));
  Issue("probe");
  MakeKeyFolder(folder_ / "", For(30), true);
  EXPECT_NE(Content(folder_ / "authority.pem"), certificate);
  EXPECT_NE(Content(AuthorityKeyFile(folder_)), key);
  EXPECT_FALSE(StateOf("probe").present);
  Issue("probe");
  EXPECT_EQ(CheckNow(folder_, "probe"), "");
}

TEST_F(Issuing, GuestHasTheRightsThatWereNamedAndNoOthers) {
  const Validity validity = IssueGuest(
      folder_,
      {.name = "probe", .writes = bus::SetOf(kHealth), .reads = bus::SetOf(kHealth, kToolState), .validity = For(10)});
  EXPECT_NEAR(static_cast<double>(validity.until), static_cast<double>(For(10).until), 5);
  EXPECT_EQ(CheckNow(folder_, "probe"), "");
  const IdentityState state = StateOf("probe");
  EXPECT_TRUE(state.guest && state.present && state.has_key && !state.revoked) << state.problem;
  EXPECT_EQ(state.writes, bus::SetOf(kHealth));
  EXPECT_EQ(state.reads, bus::SetOf(kHealth, kToolState));
  EXPECT_EQ(ModeOf(folder_ / "probe.key"), 0600u);
}

TEST_F(Issuing, HandedOverFolderIsCompleteAndTheKeyIsOnlyThere) {
  const fs::path out = scratch_ / "theirs";
  Issue("probe", out);
  EXPECT_EQ(ModeOf(out), 0700u);
  EXPECT_EQ(CheckNow(out, "probe"), "");
  EXPECT_FALSE(fs::exists(folder_ / "probe.key"));
  const IdentityState state = StateOf("probe");
  EXPECT_TRUE(state.present && !state.has_key) << "the cart keeps the certificate: it can be revoked by name";
  EXPECT_EQ(state.problem, "");
  ExpectSaid(Problem([&] { Issue("other", out); }), {"theirs", "File exists"});
  EXPECT_FALSE(StateOf("other").present);
}

TEST_F(Issuing, GuestLivesNoLongerThanTheAuthority) {
  EXPECT_NEAR(static_cast<double>(Issue("probe", {}, 3000).until), static_cast<double>(For(30).until), 5);
  EXPECT_EQ(CheckNow(folder_, "probe"), "");
}

TEST_F(Issuing, RefusesNamesThatAreTakenOrUnfit) {
  for (const char* name :
       {"physics_node", "supervisor", "fulcrum", "link", "authority", "governance", "governance-encrypted", "revoked",
        "", "Probe", "a b", "../probe", "probe.x", "abcdefghijklmnopqrstuvwxyz0123456"}) {
    ExpectSaid(Problem([&] { Issue(name); }), {std::string("\"") + name + "\"", "a-z"});
  }
  EXPECT_EQ(Problem([&] { Issue("abcdefghijklmnopqrstuvwxyz_-0123"); }), "");
  Issue("probe");
  ExpectSaid(Problem([&] { Issue("probe"); }), {"probe.pem", "fulcrum keys revoke probe"});
  ExpectSaid(Problem([&] { (void)IssueGuest(folder_, {.name = "idle", .validity = For(1)}); }), {"--read", "--write"});
}

TEST_F(Issuing, ChangedRightsAreNoticed) {
  Issue("probe");
  std::string text = Content(folder_ / "probe.p7s");
  text.replace(text.find("fulcrum/Health"), 14, "fulcrum/ToolSt");
  std::ofstream(folder_ / "probe.p7s", std::ios::trunc) << text;
  ExpectSaid(CheckNow(folder_, "probe"), {"probe.p7s", "changed"});
}

TEST_F(Issuing, PermissionsOfAnotherIdentityAreNoticed) {
  Issue("probe");
  // Signed by the authority, but for a participant with more rights.
  fs::copy_file(folder_ / "recorder.p7s", folder_ / "probe.p7s", fs::copy_options::overwrite_existing);
  ExpectSaid(CheckNow(folder_, "probe"), {"probe.p7s", "issue it again"});
}

TEST_F(Issuing, RevokedIdentityIsRefusedAndShownAndCanBeIssuedAgain) {
  Issue("probe");
  Issue("other");
  Revoke(folder_, "probe");
  ExpectSaid(CheckNow(folder_, "probe"), {"probe.pem", "was revoked", "revoked.pem", "fulcrum keys issue"});
  EXPECT_TRUE(StateOf("probe").revoked);
  EXPECT_EQ(CheckNow(folder_, "other"), "");
  EXPECT_EQ(CheckNow(folder_, "physics_node"), "");
  ExpectSaid(Problem([&] { Revoke(folder_, "probe"); }), {"probe.pem", "revoked already"});
  Issue("probe");
  EXPECT_EQ(CheckNow(folder_, "probe"), "") << "a new certificate has a new number";
  Revoke(folder_, "physics_node");
  ExpectSaid(CheckNow(folder_, "physics_node"), {"was revoked", "fulcrum keys init --force"});
  ExpectSaid(Problem([&] { Revoke(folder_, "nobody"); }), {"nobody.pem", "nothing to revoke"});
  ExpectSaid(Problem([&] { Revoke(folder_, "../x"); }), {"../x", "is no identity"});
}

TEST_F(Issuing, ListOfAnotherAuthorityIsRefused) {
  const fs::path other = scratch_ / "other";
  MakeKeyFolder(other, For(30), false);
  fs::copy_file(other / "revoked.pem", folder_ / "revoked.pem", fs::copy_options::overwrite_existing);
  ExpectSaid(CheckNow(folder_, "physics_node"), {"revoked.pem", "was not signed by this authority"});
  fs::remove(folder_ / "revoked.pem");
  ExpectSaid(CheckNow(folder_, "physics_node"), {"revoked.pem", "No such file"});
}

TEST_F(Issuing, NeedsThePrivateKeyOfThisAuthority) {
  fs::permissions(AuthorityKeyFile(folder_), fs::perms(0640));
  ExpectSaid(Problem([&] { Issue("probe"); }), {"keys.authority", "open to others"});
  fs::remove(AuthorityKeyFile(folder_));
  ExpectSaid(Problem([&] { Issue("probe"); }), {"keys.authority", "nothing can be issued or revoked"});
  ExpectSaid(Problem([&] { Revoke(folder_, "physics_node"); }), {"keys.authority"});
  MakeKeyFolder(scratch_ / "other", For(30), false);
  fs::copy_file(AuthorityKeyFile(scratch_ / "other"), AuthorityKeyFile(folder_));
  ExpectSaid(Problem([&] { Issue("probe"); }), {"keys.authority", "is not the key of the authority"});
}

TEST_F(Issuing, NamesOfTopicsAreChecked) {
  EXPECT_EQ(TopicsNamed("Health", "--read"), bus::SetOf(kHealth));
  EXPECT_EQ(TopicsNamed("Health,TissueFrame", "--read"), bus::SetOf(kHealth, kTissueFrame));
  for (const char* list : {"", "health", "Health,", "Health, ToolState", "fulcrum/Health", "*"}) {
    ExpectSaid(Problem([&] { (void)TopicsNamed(list, "--write"); }), {"--write", "valid", "ToolState", "Health"});
  }
}

TEST_F(Issuing, SessionKeysAreCompleteReplaceOldOnesAndGoWithoutTrace) {
  const fs::path folder = scratch_ / "session";
  MakeSessionKeys(folder, For(2));
  const std::string first = Content(folder / "authority.pem");
  EXPECT_EQ(ModeOf(folder), 0700u);
  EXPECT_EQ(ModeOf(AuthorityKeyFile(folder)), 0600u);
  for (const bus::AccessRole& role : bus::kAccessRoles) {
    for (const bool encrypt : {false, true}) {
      EXPECT_EQ(Problem([&] { (void)CheckIdentity(folder, role.identity, encrypt, std::time(nullptr)); }), "");
    }
  }
  IssueGuest(folder, {.name = "probe", .reads = bus::SetOf(kHealth), .validity = For(365)});
  EXPECT_EQ(CheckNow(folder, "probe"), "");
  MakeSessionKeys(folder, For(2));  // A killed session has left its keys.
  EXPECT_NE(Content(folder / "authority.pem"), first);
  EXPECT_FALSE(fs::exists(folder / "probe.pem"));
  RemoveSessionKeys(folder);
  EXPECT_FALSE(fs::exists(folder));
  EXPECT_FALSE(fs::exists(AuthorityKeyFile(folder)));
  RemoveSessionKeys(folder);
  ExpectSaid(Problem([&] { MakeSessionKeys(scratch_ / "absent" / "session", For(1)); }), {"absent", "cannot be made"});
}

}  // namespace
}  // namespace fulcrum::keys
