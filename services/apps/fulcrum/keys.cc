#include <unistd.h>

#include <cstdio>
#include <ctime>

#include "services/apps/fulcrum/commands.h"
#include "services/base/core/error.h"
#include "services/transport/bus/dds/shared_memory.h"
#include "services/transport/bus/hex.h"
#include "services/transport/bus/schema.h"
#include "services/transport/bus/topics.h"
#include "services/transport/keys/authority.h"
#include "services/transport/keys/issuing.h"
#include "services/transport/keys/key_folder.h"

namespace fulcrum::supervisor::cli {
namespace {

namespace fs = std::filesystem;
namespace po = boost::program_options;

constexpr std::time_t kDay_s = 24 * 3600;

constexpr const char* kActions =
    "  init [DIR]     make an authority and a certificate, key and permissions for every participant of a cart. The\n"
    "                 authority's private key is stored beside the folder, in DIR.authority. Keep it on one machine "
    "or\n"
    "                 offline and do not copy it to other hosts; delete it to forbid new identities for good\n"
    "  show [DIR]     list the participants of a folder with validity and rights\n"
    "  check [DIR]    check whether every participant in it can join now; exit code 2 if not\n"
    "  issue NAME     make keys for a tool of somebody else, which may write and read the named topics and no other.\n"
    "                 A topic with one owner follows its newest writer: whoever may write it can replace its node.\n"
    "                 A running session admits the tool at once\n"
    "  revoke NAME    put the certificate of NAME on the revocation list of the folder. The bus reads the list when a\n"
    "                 participant starts: participants that run already admit NAME until they end (fulcrum restart for "
    "a\n"
    "                 node, else the next session). Copy revoked.pem to the other hosts of the cart\n\n"
    "issue and revoke change the keys of the session that runs in --domain, or those of the folder --keys.\n"
    "A cart is secured by one line of its cart file: security: {keys: DIR}\n";

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

ExitCode Init(const fs::path& folder, int days, bool force) {
  const std::time_t now = std::time(nullptr);
  keys::MakeKeyFolder(folder, {now, now + days * kDay_s}, force);
  std::printf(
      "%s: new keys for %zu participants, valid until %s\n\n"
      "Next: add this line to the cart file, and copy the folder unchanged to every other host of the cart:\n\n"
      "  security: {keys: %s}\n\n"
      "Anyone who has the folder can join. The authority's private key is in %s:\n"
      "keep it on this machine or offline. It admits further tools (fulcrum keys issue) and revokes keys; delete it "
      "to\n"
      "forbid new identities for good.\n",
      folder.c_str(), bus::kAccessRoles.size(), keys::DateOf(now + days * kDay_s).c_str(),
      fs::absolute(folder).lexically_normal().c_str(), keys::AuthorityKeyFile(folder).c_str());
  if (::geteuid() == 0) {
    std::printf(
        "\nThe folder is root's, and only its owner can start a cart with it. Give it to the user who runs the cart; "
        "the\nservices run as user fulcrum:\n\n  sudo chown -R fulcrum: %s\n",
        fs::absolute(folder).lexically_normal().c_str());
  }
  return ExitCode::kDone;
}

ExitCode Show(const fs::path& folder) {
  const std::time_t now = std::time(nullptr);
  const auto states = keys::InspectKeyFolder(folder, now);
  std::error_code ignored;
  const bool can_issue = fs::exists(keys::AuthorityKeyFile(folder), ignored);
  std::printf("%s: %s%s\n\n", folder.c_str(), keys::AuthorityName(folder).c_str(),
              can_issue ? "" : "; its private key is not on this machine: nothing can be issued or revoked here");
  for (const keys::IdentityState& state : states) {
    const std::string until = !state.present           ? "not in this folder"
                              : state.revoked          ? "revoked"
                              : !state.problem.empty() ? "unusable, see fulcrum keys check"
                                                       : "until " + DaysLeft(state.validity.until, now);
    const char* guest = !state.guest ? "" : state.has_key ? "guest, " : "guest, key handed over, ";
    std::printf("%-14s %s%s\n               writes %s\n               reads  %s\n", state.identity.c_str(), guest,
                until.c_str(), Labels(state.writes).c_str(), Labels(state.reads).c_str());
  }
  return ExitCode::kDone;
}

ExitCode Check(const fs::path& folder) {
  const std::time_t now = std::time(nullptr);
  bool good = true;
  for (const keys::IdentityState& state : keys::InspectKeyFolder(folder, now)) {
    const char* name = state.identity.c_str();
    if (state.guest && state.revoked) {
      std::printf("– %s: revoked\n", name);
    } else if (!state.problem.empty()) {
      good = false;
      std::printf("✗ %s: %s\n", name, state.problem.c_str());
    } else if (!state.present) {
      std::printf("– %s: not in this folder, so it cannot join from this host\n", name);
    } else {
      std::printf("✓ %s until %s\n", name, DaysLeft(state.validity.until, now).c_str());
    }
  }
  return good ? ExitCode::kDone : ExitCode::kBadUsage;
}

/// The keys that --keys names, or those of the running session.
bus::Security KeysOf(const Arguments& arguments) {
  if (arguments.values.count("keys") != 0) return {arguments.values["keys"].as<std::string>()};
  const int domain = DomainOf(arguments);
  const fs::path memory = bus::SharedMemoryDirectory(domain);
  bus::Security session = bus::AnnouncedSecurity(memory, {});
  if (!session.on()) session.keys = memory / "keys";
  std::error_code ignored;
  if (!fs::exists(session.keys / "authority.pem", ignored)) {
    throw InputError("no session with keys runs in domain " + std::to_string(domain) +
                     "; give --domain of one that runs, or --keys with a folder of fulcrum keys init");
  }
  return session;
}

/// Where the tool finds the number of the session.
fs::path SessionFileFor(const fs::path& out, const Arguments& arguments) {
  const bool handed_over = !out.empty() && arguments.values.count("keys") == 0;
  return (handed_over ? fs::absolute(out) : bus::SharedMemoryDirectory(DomainOf(arguments))) / "session";
}

ExitCode Issue(const Arguments& arguments, const std::string& name, int days) {
  const auto topics = [&](const char* option) {
    const auto given = arguments.values.find(option);
    return given == arguments.values.end()
               ? bus::TopicSet{0}
               : keys::TopicsNamed(given->second.as<std::string>(), std::string("--") + option);
  };
  const std::time_t now = std::time(nullptr);
  keys::GuestOrder order{name, topics("write"), topics("read"), {now, now + days * kDay_s}};
  if (arguments.values.count("out") != 0) order.out = arguments.values["out"].as<std::string>();
  const bus::Security cart = KeysOf(arguments);
  const keys::Validity validity = keys::IssueGuest(cart.keys, order);
  // The number of the running session, without which its samples would be dropped. A guest of a lasting folder needs it
  // for each session: issued again, or as the user of the session.
  if (!order.out.empty() && arguments.values.count("keys") == 0) {
    bus::HandOverSession(bus::SharedMemoryDirectory(DomainOf(arguments)), order.out);
  }
  const fs::path folder = fs::absolute(order.out.empty() ? cart.keys : order.out).lexically_normal();
  std::printf(
      "%s may write %s and read %s, until %s.\n\n"
      "It joins with DdsSettings.security {.keys = \"%s\", .identity = \"%s\"}%s\n",
      name.c_str(), Labels(order.writes).c_str(), Labels(order.reads).c_str(), keys::DateOf(validity.until).c_str(),
      folder.c_str(), name.c_str(), cart.encrypt ? " and .encrypt = true" : "");
  std::printf(
      "Without the library: the type of fulcrum/TOPIC is fulcrum/TOPIC#%s, the number of the session is the\n"
      "first line of %s (idl/README.md, \"A program of your own\").\n",
      bus::Hex(bus::SchemaHash()).c_str(), SessionFileFor(order.out, arguments).c_str());
  if (!order.out.empty()) std::printf("Hand that folder over by a private way: whoever has it is %s.\n", name.c_str());
  return ExitCode::kDone;
}

ExitCode Revoke(const Arguments& arguments, const std::string& name) {
  const bus::Security cart = KeysOf(arguments);
  keys::Revoke(cart.keys, name);
  std::printf(
      "%s: revoked in %s\n"
      "Participants that start from now on refuse it. Those that run admit it until they end: restart the nodes "
      "(fulcrum\n"
      "restart NODE), or end the session to be sure. Copy revoked.pem to the other hosts of the cart.\n",
      name.c_str(), keys::KeyFilesOf(cart.keys, name, false).revocations.c_str());
  return ExitCode::kDone;
}

}  // namespace

ExitCode Keys(const Words& words) {
  constexpr int kMostDays = 3650;
  po::options_description options;
  options.add_options()("days", po::value<int>()->value_name("N")->default_value(365),
                        "init, issue: validity of the keys [days], 1 to 3650; at most that of the authority")(
      "force", "init: replace existing keys; every host of the cart then needs the new ones")(
      "read", po::value<std::string>()->value_name("TOPICS"),
      "issue: topics that NAME may read, such as Health,ToolState")(
      "write", po::value<std::string>()->value_name("TOPICS"), "issue: topics that NAME may write")(
      "out", po::value<std::string>()->value_name("DIR"),
      "issue: new folder with all that the tool needs, to hand over; the private key is then only there")(
      "keys", po::value<std::string>()->value_name("DIR"), "issue, revoke: a folder of fulcrum keys init");
  AddDomain(&options);
  const Arguments arguments = Parse("keys", words, options, {"action", "subject"});
  if (arguments.help) {
    std::printf("\nDefault of DIR: %s\n\n%s", keys::DefaultKeyFolder().c_str(), kActions);
    return ExitCode::kDone;
  }
  const auto& values = arguments.values;
  const auto word = [&](const char* name) {
    return values.count(name) != 0 ? values[name].as<std::string>() : std::string();
  };
  const std::string action = word("action"), subject = word("subject");
  const fs::path folder = subject.empty() ? keys::DefaultKeyFolder() : fs::path(subject);
  const int days = values["days"].as<int>();
  if (days < 1 || days > kMostDays) throw InputError("--days " + std::to_string(days) + ": must be 1 to 3650");
  if (action == "init") return Init(folder, days, values.count("force") != 0);
  if (action == "show") return Show(folder);
  if (action == "check") return Check(folder);
  if (action == "issue") return Issue(arguments, subject, days);
  if (action == "revoke") return Revoke(arguments, subject);
  throw InputError("keys: invalid action \"" + action +
                   "\"; valid: init, show, check, issue, revoke; see fulcrum help keys");
}

}  // namespace fulcrum::supervisor::cli
