#include "services/apps/replayer/command_line.h"

#include <sstream>
#include <thread>

#include "services/base/core/error.h"

namespace fulcrum::replay {
namespace {

namespace po = boost::program_options;

constexpr const char* kUsage =
    R"(usage: replayer RECORDING --into NODE... [options]
       replayer RECORDING --live [--only NODE... | --except NODE...] [options]
       replayer RECORDING --test NODE [--expect HASH] [--assert EXPR...] [options]

Lets nodes make the ticks of a recorded session again, with exactly the inputs that they had then, and compares their
state with the recorded one after each tick. Stops a node at its first difference and says which tick, topic, field and
index. Needs no bus, no devices and no real time. Into render: the pictures are drawn again.

  replayer out/latest/recording.mcap --into physics thermal haptics

With --set it replays them twice instead, as they were and with a parameter of the scene changed, each time feeding each
other, and reports what the change does to positions, forces, temperature and the cut.

  replayer out/latest/recording.mcap --into physics thermal --set physics.grip_force_N=4

With --console it is led by hand: go, pause, step, seek forward and back.

With --live the recorded topics are published on the bus in real time, as if the session took place: for a node under
development, or in the place of one.

  replayer out/latest/recording.mcap --live --except physics

With --test one node makes all ticks of the session headless, past states that differ, and its figures are held against
what was asked for; --junit writes the result for a CI system. Without --expect and --assert each state must be the
recorded one. fulcrum test-node is the same.

  replayer out/latest/recording.mcap --test thermal --assert "cut_length_mm > 30" --junit thermal.xml

)";

constexpr const char* kExitCodes =
    "\nExit code: 0 every state was the same, 1 a state differed or the recording lacks something, 2 bad usage or "
    "file,\n"
    "3 the recording is of another scene. With --test: 0 passed, 1 failed.\n";

void AddOptions(po::options_description* options) {
  options->add_options()  //
      ("into", po::value<std::vector<std::string>>()->multitoken()->value_name("NODE"),
       "physics, thermal, haptics, render: one or more")                                                          //
      ("test", po::value<std::vector<std::string>>()->value_name("NODE"), "physics, thermal, haptics or render")  //
      ("expect", po::value<std::string>()->value_name("HASH"),
       "test: the state hash after the last tick, 16 hexadecimal digits")  //
      ("assert", po::value<std::vector<std::string>>()->value_name("EXPR"),
       "test: FIGURE < | <= | == | != | >= | > NUMBER, over the figures of the node's Health, each also as NAME.min "
       "and "
       "NAME.max of the session, and ticks, compared, hash_mismatches, starts, session_s, busy_s; as often as "
       "needed")  //
      ("junit", po::value<std::string>()->value_name("FILE")->default_value(""),
       "test: write the result as JUnit XML, too")  //
      ("set", po::value<std::vector<std::string>>()->value_name("SECTION.KEY=VALUE"),
       "a parameter to change, as in the scene's description; as often as needed")  //
      ("console", "read commands from standard input; \"help\" lists them")         //
      ("live", "publish the recorded topics on the bus in real time")               //
      ("only", po::value<std::vector<std::string>>()->multitoken()->value_name("NODE"),
       "live: those of these nodes")  //
      ("except", po::value<std::vector<std::string>>()->multitoken()->value_name("NODE"),
       "live: those of all but these nodes")                                                                         //
      ("domain", po::value<int>()->value_name("N")->default_value(7), "live: DDS domain, 1 to 100")                  //
      ("from", po::value<double>()->value_name("S")->default_value(0), "live: begin so far into the recording [s]")  //
      ("frames", po::value<std::string>()->value_name("DIR")->default_value(""),
       "folder for the pictures of render; default: replayed_frames beside the recording; in a test they are not "
       "kept")  //
      ("threads",
       po::value<int>()->value_name("N")->default_value(static_cast<int>(std::thread::hardware_concurrency())),
       "that share a step of physics; the states do not depend on it")                                           //
      ("rate", po::value<double>()->value_name("X")->default_value(0), "times real time; 0: as fast as it can")  //
      ("until", po::value<double>()->value_name("S")->default_value(-1), "end at this session time [s]")         //
      ("scene", po::value<std::string>()->value_name("FILE")->default_value(""),
       "compiled scene; default: scene.fulcrum beside the recording")  //
      ("cart", po::value<std::string>()->value_name("FILE")->default_value(""),
       "cart configuration; default: cart.yaml beside the recording; live: its keys, by default those of the session "
       "that runs")                                                                                             //
      ("json", po::value<std::string>()->value_name("FILE")->default_value(""), "write the result there, too")  //
      ("quiet", "no progress")                                                                                  //
      ("version", "print the version")                                                                          //
      ("help", "print this");
}

}  // namespace

CommandLine::CommandLine(int argc, char** argv) {
  AddOptions(&options_);
  po::options_description all, hidden;
  hidden.add_options()("recording", po::value<std::string>());
  all.add(options_).add(hidden);
  po::positional_options_description position;
  position.add("recording", 1);
  try {
    const auto style = po::command_line_style::default_style & ~po::command_line_style::allow_guessing;
    po::store(po::command_line_parser(argc, argv).options(all).positional(position).style(style).run(), values_);
  } catch (const po::error& error) {
    throw InputError(std::string(error.what()) + "; see --help");
  }
}

std::vector<std::string> CommandLine::TextsOf(const char* option) const {
  return Has(option) ? ValueOf<std::vector<std::string>>(option) : std::vector<std::string>();
}

std::string CommandLine::Help() const {
  std::ostringstream text;
  text << kUsage << options_ << kExitCodes;
  return text.str();
}

}  // namespace fulcrum::replay
