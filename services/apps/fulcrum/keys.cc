#include <cstdio>
#include <ctime>

#include "services/apps/fulcrum/commands.h"
#include "services/base/core/error.h"
#include "services/transport/bus/topics.h"
#include "services/transport/keys/authority.h"
#include "services/transport/keys/key_folder.h"

namespace fulcrum::supervisor::cli {
namespace {

namespace po = boost::program_options;

constexpr std::time_t kDay_s = 24 * 3600;

std::string Labels(bus::TopicSet set) {
  if (set == bus::access::kAll) return "everything";
  std::string text;
  for (const bus::TopicRole& role : bus::kTopicRoles) {
    if (!bus::Contains(set, role.id)) continue;
    text += text.empty() ? "" : ", ";
    text += bus::TopicLabel(role.id);
  }
  return text.empty() ? "nothing" : text;
}

std::string DaysLeft(std::time_t until, std::time_t now) {
  return keys::DateOf(until) + " (" + std::to_string((until - now + kDay_s / 2) / kDay_s) + " days)";
}

ExitCode Init(const std::filesystem::path& folder, int days, bool force) {
  const std::time_t now = std::time(nullptr);
  keys::MakeKeyFolder(folder, {now, now + days * kDay_s}, force);
  std::printf(
      "%s: new keys for %zu participants, valid until %s\n\n"
      "Next: add this line to the cart file, and copy the folder unchanged to every other host of the cart:\n\n"
      "  security: {keys: %s}\n\n"
      "Anyone who has the folder can join. The authority's private key was not stored: no further keys can be made.\n",
      folder.c_str(), bus::kAccessRoles.size(), keys::DateOf(now + days * kDay_s).c_str(),
      std::filesystem::absolute(folder).lexically_normal().c_str());
  return ExitCode::kDone;
}

ExitCode Show(const std::filesystem::path& folder) {
  const std::time_t now = std::time(nullptr);
  const auto states = keys::InspectKeyFolder(folder, now);
  std::printf("%s: %s\n\n", folder.c_str(), keys::AuthorityName(folder).c_str());
  for (const keys::IdentityState& state : states) {
    const std::string until = !state.present           ? "not in this folder"
                              : !state.problem.empty() ? "unusable, see fulcrum keys check"
                                                       : "until " + DaysLeft(state.validity.until, now);
    std::printf("%-14s %s\n               writes %s\n               reads  %s\n", state.role->identity.data(),
                until.c_str(), Labels(state.role->writes).c_str(), Labels(state.role->reads).c_str());
  }
  return ExitCode::kDone;
}

ExitCode Check(const std::filesystem::path& folder) {
  const std::time_t now = std::time(nullptr);
  bool good = true;
  for (const keys::IdentityState& state : keys::InspectKeyFolder(folder, now)) {
    if (!state.problem.empty()) {
      good = false;
      std::printf("✗ %s: %s\n", state.role->identity.data(), state.problem.c_str());
    } else if (!state.present) {
      std::printf("– %s: not in this folder, so it cannot join from this host\n", state.role->identity.data());
    } else {
      std::printf("✓ %s until %s\n", state.role->identity.data(), DaysLeft(state.validity.until, now).c_str());
    }
  }
  return good ? ExitCode::kDone : ExitCode::kBadUsage;
}

}  // namespace

ExitCode Keys(const Words& words) {
  constexpr int kMostDays = 3650;
  po::options_description options;
  options.add_options()("days", po::value<int>()->value_name("N")->default_value(365),
                        "init: validity of the keys [days], 1 to 3650")(
      "force", "init: replace existing keys; every host of the cart then needs the new ones");
  const Arguments arguments = Parse("keys", words, options, {"action", "folder"});
  if (arguments.help) {
    std::printf(
        "\nDefault of DIR: %s\n\n"
        "  init   make an authority and a certificate, key and permissions for every participant of a cart\n"
        "  show   list the participants of a folder with validity and rights\n"
        "  check  check whether every participant in it can join now; exit code 2 if not\n\n"
        "A cart is secured by one line of its cart file: security: {keys: DIR}\n",
        keys::DefaultKeyFolder().c_str());
    return ExitCode::kDone;
  }
  const auto& values = arguments.values;
  const std::string action = values.count("action") != 0 ? values["action"].as<std::string>() : "";
  const std::filesystem::path folder = values.count("folder") != 0
                                           ? std::filesystem::path(values["folder"].as<std::string>())
                                           : keys::DefaultKeyFolder();
  const int days = values["days"].as<int>();
  if (days < 1 || days > kMostDays) throw InputError("--days " + std::to_string(days) + ": must be 1 to 3650");
  if (action == "init") return Init(folder, days, values.count("force") != 0);
  if (action == "show") return Show(folder);
  if (action == "check") return Check(folder);
  throw InputError("keys: invalid action \"" + action + "\"; valid: init, show, check; see fulcrum help keys");
}

}  // namespace fulcrum::supervisor::cli
