#include <poll.h>
#include <unistd.h>

#include <climits>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <optional>

#include "services/apps/fulcrum/commands.h"
#include "services/base/config/cart.h"
#include "services/base/config/strict_yaml.h"
#include "services/base/core/error.h"
#include "services/base/runtime/install_places.h"
#include "services/transport/link/options.h"

namespace fulcrum::supervisor::cli {
namespace po = boost::program_options;

Arguments Parse(const char* command, const Words& words, const po::options_description& options,
                const std::vector<const char*>& positional) {
  po::options_description visible("Options");
  visible.add(options);
  visible.add_options()("help", "print this text");
  po::options_description all;
  all.add(visible);
  po::positional_options_description places;
  for (const char* name : positional) {
    all.add_options()(name, po::value<std::string>());
    places.add(name, 1);
  }
  Arguments arguments;
  try {
    const auto style = po::command_line_style::default_style & ~po::command_line_style::allow_guessing;
    po::store(po::command_line_parser(words).options(all).positional(places).style(style).run(), arguments.values);
  } catch (const po::error& error) {
    throw InputError(std::string(error.what()) + "; see fulcrum help " + command);
  }
  if (arguments.values.count("help") != 0) {
    arguments.help = true;
    for (const CommandEntry& entry : Commands()) {
      if (std::string_view(entry.name) == command) {
        std::cout << "usage: fulcrum " << entry.usage << "\n\n" << entry.purpose << "\n";
        std::cout << "\nExample:\n  fulcrum " << entry.example << "\n";
      }
    }
    std::cout << "\n" << visible;
  }
  return arguments;
}

void AddDomain(po::options_description* options) {
  options->add_options()(
      "domain", po::value<int>()->value_name("N"),
      ("DDS domain of the cart, 1 to 100 (default: that of the cart file, of --cart or the installation's, else " +
       std::to_string(config::DefaultDomain()) + ", of this user)")
          .c_str());
}

int DomainOf(const Arguments& arguments, int fallback) {
  const int domain = arguments.values.count("domain") != 0 ? arguments.values["domain"].as<int>() : fallback;
  if (domain < 1 || domain > 100) {
    throw InputError("--domain " + std::to_string(domain) + ": must be 1 to 100");
  }
  return domain;
}

int DomainOf(const Arguments& arguments) {
  // A cart file with a fault must not keep anyone from a session whose domain is given.
  if (arguments.values.count("domain") != 0) return DomainOf(arguments, 0);
  const std::filesystem::path cart = CartOf(arguments);
  return cart.empty() ? config::DefaultDomain() : config::LoadCart(cart).domain;
}

void AddLinkDomain(po::options_description* options) {
  options->add_options()(
      "link-domain", po::value<int>()->value_name("N"),
      ("DDS domain between the hosts, 101 to 200, the same on both (default: 100 more than the domain that --domain or "
       "the cart file gives, else " +
       std::to_string(link::kUsualLinkDomain) + ")")
          .c_str());
}

int LinkDomainOf(const Arguments& arguments) {
  std::optional<int> domain;
  if (arguments.values.count("domain") != 0) {
    domain = DomainOf(arguments, 0);
  } else if (const std::filesystem::path cart = CartOf(arguments); !cart.empty()) {
    if (config::StrictYaml::FromFile(cart).root().Has("domain")) domain = config::LoadCart(cart).domain;
  }
  return link::LinkDomain(arguments.values.count("link-domain") != 0 ? arguments.values["link-domain"].as<int>() : 0,
                          domain);
}

void AddCart(po::options_description* options) {
  options->add_options()(
      "cart", po::value<std::string>()->value_name("FILE"),
      "cart file (default: /etc/fulcrum/cart.yaml of an installation, else all hardware is simulated)");
}

std::filesystem::path CartOf(const Arguments& arguments) {
  if (arguments.values.count("cart") != 0) {
    return std::filesystem::absolute(arguments.values["cart"].as<std::string>());
  }
  const std::filesystem::path machine = runtime::MachineCart();
  return std::filesystem::exists(machine) ? machine : std::filesystem::path();
}

std::filesystem::path UserFolder(const char* variable, const char* fallback) {
  const char* own = std::getenv(variable);
  const char* home = std::getenv("HOME");
  if (own != nullptr && *own == '/') {
    return std::filesystem::path(own) / "fulcrum";
  }
  return (home != nullptr ? std::filesystem::path(home) / fallback : std::filesystem::temp_directory_path()) /
         "fulcrum";
}

void AddDatabase(po::options_description* options) {
  options->add_options()(
      "database", po::value<std::string>()->value_name("FILE"),
      "database of the trainees' scores (default: fulcrum/trainees.sqlite in $XDG_STATE_HOME or ~/.local/state)");
}

std::filesystem::path DatabaseOf(const Arguments& arguments) {
  return arguments.values.count("database") != 0
             ? std::filesystem::absolute(arguments.values["database"].as<std::string>())
             : UserFolder("XDG_STATE_HOME", ".local/state") / "trainees.sqlite";
}

bool ReaderIsGone() {
  pollfd output{STDOUT_FILENO, 0, 0};
  return ::poll(&output, 1, 0) == 1 && (output.revents & (POLLERR | POLLHUP)) != 0;
}

bool OutputHasEnded() { return std::ferror(stdout) != 0 || ReaderIsGone(); }

}  // namespace fulcrum::supervisor::cli
