// The subcommands of `fulcrum`, one file each. Each takes the words after its name and throws InputError or
// MismatchError for errors that the user can correct.
#pragma once

#include <boost/program_options.hpp>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "services/base/core/exit_code.h"

namespace fulcrum::supervisor::cli {

using Words = std::vector<std::string>;

ExitCode Up(const Words& words);
ExitCode Host(const Words& words);
ExitCode Soak(const Words& words);
ExitCode Status(const Words& words);
ExitCode Top(const Words& words);
ExitCode Restart(const Words& words);
ExitCode Swap(const Words& words);
ExitCode Down(const Words& words);
ExitCode Dump(const Words& words);
ExitCode Generator(const Words& words);
ExitCode Log(const Words& words);
ExitCode TestNode(const Words& words);
ExitCode Validate(const Words& words);
ExitCode Keys(const Words& words);
ExitCode Doctor(const Words& words);
ExitCode Inputs(const Words& words);
ExitCode Console(const Words& words);
ExitCode Reference(const Words& words);
ExitCode Scene(const Words& words);
ExitCode ImportAnatomy(const Words& words);
ExitCode Assess(const Words& words);
ExitCode Trainee(const Words& words);
ExitCode Questionnaire(const Words& words);
ExitCode Profile(const Words& words);
ExitCode Help(const Words& words);
ExitCode Version(const Words& words);

struct CommandEntry {
  const char* name;
  const char* usage;    ///< Text after "fulcrum ".
  const char* purpose;  ///< One sentence.
  const char* example;  ///< Text after "fulcrum ".
  ExitCode (*run)(const Words&);
};
[[nodiscard]] std::span<const CommandEntry> Commands();

/// Runs the command that the first word names: a subcommand, help, version, or another program of the installation,
/// which then replaces this process. Throws InputError when there is no such command, and what the subcommand throws.
ExitCode Dispatch(const Words& words);

/// Parsed options of one subcommand.
struct Arguments {
  boost::program_options::variables_map values;
  bool help = false;  ///< --help was given, and the help was printed.
};
/// Parses the words of a subcommand; "--help" is added to its options. `positional` names the words without an option,
/// for example {"scene"}. Throws InputError.
[[nodiscard]] Arguments Parse(const char* command, const Words& words,
                              const boost::program_options::options_description& options,
                              const std::vector<const char*>& positional = {});

/// Adds --domain.
void AddDomain(boost::program_options::options_description* options);
/// Value of --domain. Throws InputError when it is out of range.
[[nodiscard]] int DomainOf(const Arguments& arguments, int fallback);
/// Value of --domain, else that of the cart file (CartOf), else this user's own: the domain in which `fulcrum up` with
/// the same options runs. Throws InputError when it is out of range or the cart file has a fault.
[[nodiscard]] int DomainOf(const Arguments& arguments);

/// Adds --link-domain.
void AddLinkDomain(boost::program_options::options_description* options);
/// Domain of the link to another host: the value of --link-domain, else of the domain that --domain or the cart file
/// (CartOf) gives, else the usual one. Throws InputError when the cart file has a fault.
[[nodiscard]] int LinkDomainOf(const Arguments& arguments);

/// Adds --cart.
void AddCart(boost::program_options::options_description* options);
/// Value of --cart, else the cart file of this machine if it has one; empty: all hardware is simulated.
[[nodiscard]] std::filesystem::path CartOf(const Arguments& arguments);

/// The other programs of the installation.
[[nodiscard]] std::span<const char* const> Programs();
[[nodiscard]] bool IsProgram(const std::string& name);
/// Replaces this process by one of them. @param words its name, then its arguments. Throws InputError when it cannot be
/// started.
[[noreturn]] void Become(const Words& words);

/// Folder of compiled scenes: beside the programs in a build tree, else in the user's cache.
[[nodiscard]] std::filesystem::path SceneCache(const std::filesystem::path& programs);
/// Folder "fulcrum" in an XDG base directory of the user: in `variable`, or else in `fallback` in the home folder.
[[nodiscard]] std::filesystem::path UserFolder(const char* variable, const char* fallback);
/// Adds --database.
void AddDatabase(boost::program_options::options_description* options);
/// Value of --database, else the default file.
[[nodiscard]] std::filesystem::path DatabaseOf(const Arguments& arguments);

/// True when standard output is a pipe or socket whose other end is closed.
[[nodiscard]] bool ReaderIsGone();
/// True when nobody reads standard output any more, or it could not be written: the end of a loop that prints, since
/// SIGPIPE is ignored.
[[nodiscard]] bool OutputHasEnded();

/// Sends a command to the supervisor of the domain and prints its reply. Throws InputError when none runs there.
ExitCode Ask(int domain, const std::string& verb, const std::string& argument);

}  // namespace fulcrum::supervisor::cli
