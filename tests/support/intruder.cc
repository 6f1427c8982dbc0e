#include "tests/support/intruder.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/inotify.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <ctime>
#include <fstream>
#include <memory>
#include <optional>
#include <stdexcept>
#include <thread>

#include "services/transport/bus/access.h"
#include "services/transport/bus/dds/participant.h"
#include "services/transport/bus/input_account.h"
#include "services/transport/keys/issuing.h"
#include "services/transport/keys/key_folder.h"
#include "tests/support/cart.h"
#include "tests/support/program.h"
#include "tests/unit/bus/samples.h"

namespace fulcrum::testing {
namespace {

namespace fs = std::filesystem;

constexpr std::time_t kDay_s = 24 * 3600;
// Long enough to start a process, short enough for a test to wait for.
constexpr std::time_t kShortLife_s = 2;
constexpr double kPatience_s = 60;
constexpr int kLongestRead_ms = 5000;
constexpr std::chrono::seconds kShortestForgery(5);

void Write(const fs::path& file, const std::string& text) {
  std::ofstream out(file, std::ios::binary | std::ios::trunc);
  if (!(out << text).flush()) throw std::runtime_error("cannot write " + file.string());
}

fs::path Folder(const fs::path& path) {
  fs::create_directories(path);
  fs::permissions(path, fs::perms::owner_all);
  return path;
}

/// The permissions of the thermal node, changed by hand so that they allow ToolState.
std::string Tampered(const fs::path& keys) {
  std::string text = ReadFile(keys / "thermal_node.p7s");
  const std::string was = "fulcrum/ThermalEvent";
  return text.replace(text.find(was), was.size(), "fulcrum/ToolState");
}

/// A pipe that gives its first reader one document and the next reader another, and so on in turn.
class TwoFacedPipe {
 public:
  TwoFacedPipe(fs::path path, std::string first, std::string second) : path_(std::move(path)) {
    fs::remove(path_);
    if (::mkfifo(path_.c_str(), 0600) != 0) throw std::runtime_error("cannot make " + path_.string());
    thread_ = std::thread([this, texts = std::vector<std::string>{std::move(first), std::move(second)}] {
      const int watch = ::inotify_init1(IN_CLOEXEC);
      ::inotify_add_watch(watch, path_.c_str(), IN_CLOSE_NOWRITE);
      for (std::size_t i = 0;; ++i) {
        const int fd = ::open(path_.c_str(), O_WRONLY | O_CLOEXEC);
        if (stopped_) {
          ::close(fd);
          break;
        }
        const std::string& text = texts[i % texts.size()];
        (void)!::write(fd, text.data(), text.size());
        ::close(fd);
        // One reader must have closed before the next text is written.
        pollfd closed{watch, POLLIN, 0};
        if (::poll(&closed, 1, kLongestRead_ms) > 0) {
          std::array<char, 512> events{};
          (void)!::read(watch, events.data(), events.size());
        }
      }
      ::close(watch);
    });
  }
  ~TwoFacedPipe() {
    stopped_ = true;
    // Unblocks the thread if there was no reader.
    const int fd = ::open(path_.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
    thread_.join();
    ::close(fd);
  }
  TwoFacedPipe(const TwoFacedPipe&) = delete;
  TwoFacedPipe& operator=(const TwoFacedPipe&) = delete;

 private:
  fs::path path_;
  std::atomic<bool> stopped_ = false;
  std::thread thread_;
};

/// The reachable part of a cart: a supervisor that publishes its scene, a physics node that reads ToolState.
class Target {
 public:
  Target(int domain, const fs::path& keys)
      : supervisor_({.domain = domain, .node_name = "supervisor", .security = {keys, "supervisor"}}),
        physics_({.domain = domain, .node_name = "physics_node", .security = {keys, "physics_node"}}) {}

  void Turn() {
    SceneManifest scene = bus::test::Sample<SceneManifest>();
    scene.stamp = stamper_.Next(std::chrono::steady_clock::now().time_since_epoch().count());
    scenes_->Write(scene);
    // As in every node; a participant that leaves before the end is then still recorded.
    (void)supervisor_.refusals();
    (void)physics_.refusals();
    ToolState tool;
    came_through_ |= tools_->TakeNext(&tool) || tools_->stats().matched;
  }
  [[nodiscard]] bool came_through() const { return came_through_; }
  [[nodiscard]] bool Reports(const std::string& name, const std::string& what) const {
    const auto names_it = [&](const std::string& text) {
      return text.find(name) != std::string::npos && text.find(what) != std::string::npos;
    };
    return std::ranges::any_of(supervisor_.refusals().texts, names_it) ||
           std::ranges::any_of(physics_.refusals().texts, names_it);
  }

 private:
  bus::DdsParticipant supervisor_, physics_;
  std::unique_ptr<bus::Output<SceneManifest>> scenes_ = supervisor_.MakeOutput<SceneManifest>();
  std::unique_ptr<bus::Input<ToolState>> tools_ = physics_.MakeInput<ToolState>();
  bus::Stamper stamper_{std::chrono::steady_clock::now().time_since_epoch().count()};
  bool came_through_ = false;
};

struct Running {
  Attempt attempt;
  Program program;
  std::optional<int> code = std::nullopt;  ///< Set once it has ended.

  bool HasEnded() {
    if (!code) code = program.Poll();
    return code.has_value();
  }
};

}  // namespace

std::vector<Attempt> TryAllAttempts(int domain, const fs::path& scratch) {
  const std::time_t now = std::time(nullptr);
  const keys::Validity today{now - kDay_s, now + kDay_s};
  const keys::Authority ours(today), theirs(today);
  const fs::path real = Folder(scratch / "real");
  keys::FillKeyFolder(real, ours, today);
  Write(keys::AuthorityKeyFile(real), ours.private_key());
  fs::permissions(keys::AuthorityKeyFile(real), fs::perms::owner_read | fs::perms::owner_write);
  const auto admit = [&](const std::string& guest, bus::TopicSet writes, bus::TopicSet reads) {
    keys::IssueGuest(real, {guest, writes, reads, today, scratch / guest});
  };
  // The folder is copied before the revocation, so that the guest has the old revocation list.
  admit("revoked_guest", bus::SetOf(TopicId::kToolState), bus::SetOf(TopicId::kSceneManifest));
  keys::Revoke(real, "revoked_guest");
  admit("reading_guest", 0, bus::SetOf(TopicId::kHealth));
  keys::FillKeyFolder(Folder(scratch / "theirs"), theirs, today);
  keys::FillKeyFolder(Folder(scratch / "expired"), ours, {now - 2 * kDay_s, now - kDay_s});
  keys::FillKeyFolder(Folder(scratch / "tampered"), ours, today);
  Write(scratch / "tampered" / "thermal_node.p7s", Tampered(real));
  // State that an attacker can create on its own side: a second authority besides the cart's, and all rights signed by
  // it.
  bus::AccessRole all = *bus::AccessRoleOf("thermal_node");
  all.writes = all.reads = bus::access::kAll;
  const std::string all_rights = theirs.Sign(keys::PermissionsXml(all, today));
  const std::string all_rights_of_guest =
      theirs.Sign(keys::PermissionsXml({"reading_guest", bus::access::kAll, bus::access::kAll}, today));
  Write(scratch / "both.pem", ours.certificate() + theirs.certificate());

  std::vector<Running> running;
  const auto start = [&](const std::string& name, const fs::path& folder, const std::string& identity, int wanted_code,
                         const std::string& wanted_of_cart, const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments{std::to_string(domain), name, folder.string(), identity};
    arguments.insert(arguments.end(), more.begin(), more.end());
    running.push_back(
        {{.name = name, .last_line = "", .wanted_exit_code = wanted_code, .wanted_of_cart = wanted_of_cart},
         Program("security_intruder", arguments)});
  };
  keys::FillKeyFolder(Folder(scratch / "short"), ours, {now - kDay_s, std::time(nullptr) + kShortLife_s});
  start("expires_meanwhile", scratch / "short", "haptics_node", 3, "expired");
  std::this_thread::sleep_for(std::chrono::seconds(kShortLife_s + 1));

  Target target(domain, real);
  const TwoFacedPipe honest_outside(scratch / "pipe1", all_rights, ReadFile(real / "thermal_node.p7s"));
  const TwoFacedPipe tampered_outside(scratch / "pipe2", all_rights, Tampered(real));
  const TwoFacedPipe guest_outside(scratch / "pipe3", all_rights_of_guest,
                                   ReadFile(scratch / "reading_guest" / "reading_guest.p7s"));
  start("no_keys", "-", "-", 3, "has no keys");
  start("other_authority", scratch / "theirs", "haptics_node", 3, "another authority");
  start("encrypts", real, "haptics_node/encrypt", 3, "encrypts");
  start("expired", scratch / "expired", "haptics_node", 2, "");
  start("other_topic", real, "thermal_node", 2, "");
  start("tampered", scratch / "tampered", "thermal_node", 2, "");
  start("forged_other_topic", real, "thermal_node", 0, "may not write fulcrum/ToolState",
        {scratch / "both.pem", scratch / "pipe1"});
  start("revoked", scratch / "revoked_guest", "revoked_guest", 3, "certificate revoked");
  start("revoked_here", real, "revoked_guest", 2, "");
  start("guest_other_topic", scratch / "reading_guest", "reading_guest", 2, "");
  start("forged_guest_other_topic", scratch / "reading_guest", "reading_guest", 0, "may not write fulcrum/ToolState",
        {scratch / "both.pem", scratch / "pipe3"});
  start("forged_tampered", real, "thermal_node", 0, "unusable permissions", {scratch / "both.pem", scratch / "pipe2"});

  // An endpoint is reported by the name in the keys of its process, any other participant by its claimed name.
  const auto reported = [&](const Attempt& attempt) {
    const std::string name = attempt.name == "forged_other_topic"         ? "thermal_node"
                             : attempt.name == "forged_guest_other_topic" ? "the guest reading_guest"
                                                                          : attempt.name;
    return !attempt.wanted_of_cart.empty() && target.Reports(name, attempt.wanted_of_cart);
  };
  const auto begin = std::chrono::steady_clock::now();
  (void)WaitFor(kPatience_s, [&] {
    target.Turn();
    // A forger goes on until it is reported: how soon it meets the cart depends on the machine.
    const bool tried = std::chrono::steady_clock::now() - begin > kShortestForgery;
    for (Running& one : running) {
      const bool forges = one.attempt.wanted_exit_code == 0;
      if (tried && forges && !one.HasEnded() && reported(one.attempt)) one.program.Signal(SIGTERM);
    }
    return std::ranges::count_if(running, [](Running& one) { return !one.HasEnded(); }) == 0;
  });
  std::vector<Attempt> attempts;
  for (Running& one : running) {
    Attempt& attempt = one.attempt;
    attempt.exit_code = one.code ? *one.code : one.program.End(SIGKILL);
    const std::string said = one.program.Said();
    const std::size_t end = said.find_last_not_of('\n');
    attempt.last_line = end == std::string::npos ? "" : said.substr(0, end + 1);
    attempt.last_line = attempt.last_line.substr(attempt.last_line.rfind('\n') + 1);
    attempt.came_through = target.came_through();
    attempt.reported = reported(attempt);
    attempts.push_back(attempt);
  }
  return attempts;
}

}  // namespace fulcrum::testing
