#include "services/apps/replayer/command_line.h"

#include <sstream>
#include <thread>

#include "services/base/config/cart.h"
#include "services/base/core/error.h"

namespace fulcrum::replay {
namespace {

namespace po = boost::program_options;

constexpr const char* kUsage =
    R"(usage: replayer RECORDING --into NODE... [options]
       replayer RECORDING --live [--only NODE... | --except NODE...] [options]
       replayer RECORDING --film
       replayer RECORDING --video FILE [options]
       replayer RECORDING --dataset DIR [options]
       replayer RECORDING... --lerobot DIR [options]
       replayer RECORDING --test NODE [--expect HASH] [--assert EXPR...] [options]

Replays a recorded session: nodes compute its ticks again from exactly the recorded inputs, and after each tick their
state hash is compared with the recorded one. A node stops at its first difference, which is reported with tick, topic,
field and index. Needs no bus, no devices and no real time. With --into render the pictures are drawn again.

  replayer out/latest/recording.mcap --into physics thermal haptics

With --set the nodes are replayed twice, with the original and with the changed parameters of the scene. In both replays
they receive each other's outputs, and the differences in positions, forces, temperature and cut are reported.

  replayer out/latest/recording.mcap --into physics thermal --set physics.grip_force_N=4

With --console the replay is controlled by commands: go, pause, step, seek forward and back.

With --live the recorded topics are published on the bus in real time, as in the live session: as input of a node under
development, or in place of a node.

  replayer out/latest/recording.mcap --live --except physics

With --film the pictures are drawn for a program: it writes session times to the standard input, a line each, and reads
from the standard output "TIME BYTES" and a JPEG file of BYTES bytes for each (0: the picture has not changed). The first
line is "end TIME". Any order of times is possible; a step back takes longer.

With --video the session becomes a video: H.264 in an MP4 file, 30 pictures a second in the scene's size, with a chapter
for each use of the generator and each warning. Needs the program ffmpeg. fulcrum log video does the same.

  replayer out/latest/recording.mcap --video video.mp4

With --dataset the session becomes a data set for machine learning: pictures of a left and a right camera with depth,
normals, optical flow, classes, instances, temperature, damage and water of each pixel, COCO annotations, calibration,
and poses, forces and keypoints of the instruments. The manual's page dataset.md describes the files.

  replayer out/latest/recording.mcap --dataset dataset --every 0.2

With --lerobot sessions become a set for robot learning in the layout of LeRobot v2.1: each recording is an episode,
with a video of 30 pictures a second and a table of states and actions of the instruments. Needs the program ffmpeg. The
same page describes it.

  replayer out/2*/recording.mcap --lerobot lerobot

With --test one node computes all ticks of the session, also after states that differ, and its figures are checked
against --expect and --assert; --junit writes the result for a CI system. Without --expect and --assert each state must
equal the recorded one. fulcrum test-node does the same.

  replayer out/latest/recording.mcap --test thermal --assert "cut_length_mm > 30" --junit thermal.xml

)";

constexpr const char* kExitCodes =
    "\nExit codes: 0 all states equal, 1 a state differs or the recording is incomplete, 2 bad usage or file,\n"
    "3 the recording is of another scene. With --test: 0 passed, 1 failed.\n";

void AddOptions(po::options_description* options) {
  options->add_options()  //
      ("into", po::value<std::vector<std::string>>()->multitoken()->value_name("NODE"),
       "nodes to replay, one or more of physics, thermal, haptics, render")                    //
      ("film", "draw the pictures of the times that come on the standard input")               //
      ("video", po::value<std::string>()->value_name("FILE"), "write the session as a video")  //
      ("within", po::value<double>()->value_name("S")->default_value(0),
       "video: be ready after this time [s], with fewer different pictures a second if need be, at least one; 0: as "
       "long as it takes")                                                                               //
      ("dataset", po::value<std::string>()->value_name("DIR"), "write a data set into this new folder")  //
      ("every", po::value<double>()->value_name("S")->default_value(0.2, "0.2"),
       "dataset: session time between two pictures, 0.01 to 3600 [s]")  //
      ("baseline", po::value<double>()->value_name("MM")->default_value(5),
       "dataset: distance of the right camera from the left one, 0 (no right pictures) to 100 [mm]")  //
      ("vary", po::value<std::int64_t>()->value_name("N")->default_value(0),
       "dataset: so many data sets in folders of their own, each with another light, tissue and scope; 0: one, as it "
       "was")  //
      ("seed", po::value<std::int64_t>()->value_name("N")->default_value(1),
       "dataset: other numbers give other variations")  //
      ("lerobot", po::value<std::string>()->value_name("DIR"),
       "write a set for robot learning into this new folder")  //
      ("test", po::value<std::vector<std::string>>()->value_name("NODE"),
       "node to test: physics, thermal, haptics or render")  //
      ("expect", po::value<std::string>()->value_name("HASH"),
       "test: expected state hash after the last tick, 16 hexadecimal digits")  //
      ("assert", po::value<std::vector<std::string>>()->value_name("EXPR"),
       "test: FIGURE < | <= | == | != | >= | > NUMBER, over the figures of the node's Health (also as NAME.min and "
       "NAME.max of the session) and ticks, compared, hash_mismatches, starts, session_s, busy_s, step_p50_ms, "
       "step_p99_ms; may be repeated")  //
      ("junit", po::value<std::string>()->value_name("FILE")->default_value(""),
       "test: also write the result as JUnit XML")  //
      ("set", po::value<std::vector<std::string>>()->value_name("SECTION.KEY=VALUE"),
       "into: change a parameter, as in the scene's description; may be repeated")  //
      ("console", "into: read commands from standard input; \"help\" lists them")   //
      ("live", "publish the recorded topics on the bus in real time")               //
      ("only", po::value<std::vector<std::string>>()->multitoken()->value_name("NODE"),
       "live: publish only the topics of these nodes")  //
      ("except", po::value<std::vector<std::string>>()->multitoken()->value_name("NODE"),
       "live: publish the topics of all nodes except these")  //
      ("domain", po::value<int>()->value_name("N")->default_value(config::DefaultDomain()),
       "live: DDS domain, 1 to 100")  //
      ("from", po::value<double>()->value_name("S")->default_value(0),
       "live: start at this time after the first message [s]")  //
      ("frames", po::value<std::string>()->value_name("DIR")->default_value(""),
       "folder for the pictures of render (default: replayed_frames beside the recording; none in a test)")  //
      ("threads",
       po::value<int>()->value_name("N")->default_value(static_cast<int>(std::thread::hardware_concurrency())),
       "threads per step of physics, 1 to 64; the states do not depend on it")  //
      ("rate", po::value<double>()->value_name("X")->default_value(0),
       "speed as a multiple of real time, 0 or more; 0: as fast as possible")  //
      ("until", po::value<double>()->value_name("S")->default_value(-1),
       "end at this session time [s]; negative: end of the recording")  //
      ("scene", po::value<std::string>()->value_name("FILE")->default_value(""),
       "compiled scene (default: scene.fulcrum beside the recording)")  //
      ("cart", po::value<std::string>()->value_name("FILE")->default_value(""),
       "cart file (default: cart.yaml beside the recording); live: only its keys are used (default: those of the "
       "running session)")                                                                                        //
      ("json", po::value<std::string>()->value_name("FILE")->default_value(""), "also write the result as JSON")  //
      ("quiet", "print no progress")                                                                              //
      ("version", "print the version")                                                                            //
      ("help", "print this text");
}

}  // namespace

CommandLine::CommandLine(int argc, char** argv) {
  AddOptions(&options_);
  po::options_description all, hidden;
  hidden.add_options()("recording", po::value<std::vector<std::string>>());
  all.add(options_).add(hidden);
  po::positional_options_description position;
  position.add("recording", -1);
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
