// fulcrum log: tools that read and compare recordings.
#include <algorithm>
#include <array>
#include <cstdio>
#include <iostream>
#include <limits>

#include "services/apps/fulcrum/commands.h"
#include "services/base/core/error.h"
#include "services/records/log_tools/cut_map.h"
#include "services/records/log_tools/cut_picture.h"
#include "services/records/log_tools/merge.h"
#include "services/records/log_tools/tools.h"
#include "services/records/recording/recorded_scene.h"
#include "services/scene/format/scene_file.h"
#include "services/session/supervisor/session_folder.h"

namespace fulcrum::supervisor::cli {
namespace {

namespace fs = std::filesystem;
namespace po = boost::program_options;
using Files = std::vector<fs::path>;

struct Tool {
  const char* name;
  const char* usage;  ///< Text after "fulcrum log ".
  const char* purpose;
  void (*add_options)(po::options_description*);
  ExitCode (*run)(const po::variables_map&, const Files&);
};

// -------------------------------------------------------------------------------------------------- options

void NoOptions(po::options_description*) {}

void AddFilter(po::options_description* options) {
  options->add_options()                                                                                        //
      ("topic", po::value<std::vector<std::string>>()->value_name("NAME"), "only this topic; may be repeated")  //
      ("from", po::value<double>()->value_name("SECONDS"),
       "only messages from this time on [s]; 0 is the first message of the file (default: the beginning)")  //
      ("to", po::value<double>()->value_name("SECONDS"), "only messages up to this time [s] (default: the end)");
}

void AddCatOptions(po::options_description* options) {
  AddFilter(options);
  options->add_options()("full", "print all elements of long lists");
}

log_tools::Filter FilterOf(const po::variables_map& values) {
  log_tools::Filter filter;
  if (values.count("topic") != 0) {
    const auto& topics = values["topic"].as<std::vector<std::string>>();
    filter.topics = {topics.begin(), topics.end()};
  }
  if (values.count("from") != 0) {
    filter.from_s = values["from"].as<double>();
  }
  if (values.count("to") != 0) {
    filter.to_s = values["to"].as<double>();
  }
  return filter;
}

// ---------------------------------------------------------------------------------------------------- tools

ExitCode Info(const po::variables_map&, const Files& files) {
  for (const fs::path& file : files) {
    log_tools::PrintInfo(file, &std::cout);
  }
  return ExitCode::kDone;
}

ExitCode List(const po::variables_map&, const Files& folders) {
  for (const fs::path& folder : folders.empty() ? Files{"out"} : folders) {
    log_tools::PrintList(folder, &std::cout);
  }
  return ExitCode::kDone;
}

ExitCode Cat(const po::variables_map& values, const Files& files) {
  constexpr std::size_t kLongest = 24;
  const std::size_t longest = values.count("full") != 0 ? std::numeric_limits<std::size_t>::max() : kLongest;
  for (const fs::path& file : files) {
    log_tools::PrintMessages(file, FilterOf(values), longest, &std::cout);
  }
  return ExitCode::kDone;
}

void AddExportOptions(po::options_description* options) {
  AddFilter(options);
  options->add_options()("out", po::value<std::string>()->value_name("DIR"),
                         "folder of the tables (default: FILE with -tables instead of its extension)");
}

ExitCode Export(const po::variables_map& values, const Files& files) {
  for (const fs::path& file : files) {
    const fs::path beside = fs::path(file).replace_extension() += "-tables";
    const fs::path folder = values.count("out") != 0 ? fs::path(values["out"].as<std::string>()) : beside;
    for (const fs::path& table : log_tools::ExportTables(file, FilterOf(values), folder)) {
      std::cout << table.string() << '\n';
    }
  }
  return ExitCode::kDone;
}

ExitCode Verify(const po::variables_map&, const Files& files) {
  ExitCode worst = ExitCode::kDone;
  for (const fs::path& file : files) {
    worst = std::max(worst, log_tools::Verify(file, &std::cout));
  }
  return worst;
}

void AddDiffOptions(po::options_description* options) {
  AddFilter(options);
  options->add_options()("without", po::value<std::string>()->value_name("FIELD")->default_value(""),
                         "ignore this field in all messages, for example stamp");
}

ExitCode Diff(const po::variables_map& values, const Files& files) {
  if (files.size() != 2) {
    throw InputError("diff needs two files, got " + std::to_string(files.size()) + "; see fulcrum log diff --help");
  }
  return log_tools::Diff(files[0], files[1], FilterOf(values), values["without"].as<std::string>(), &std::cout);
}

void AddRecoverOptions(po::options_description* options) {
  options->add_options()("out", po::value<std::string>()->value_name("FILE"),
                         "recovered file (default: FILE with -recovered in its name)");
}

ExitCode Recover(const po::variables_map& values, const Files& files) {
  if (values.count("out") != 0 && files.size() != 1) {
    throw InputError("--out names one file, but " + std::to_string(files.size()) +
                     " are to be recovered; give one FILE");
  }
  for (const fs::path& file : files) {
    fs::path mended = file;
    mended.replace_filename(file.stem().string() + "-recovered" + file.extension().string());
    if (values.count("out") != 0) {
      mended = values["out"].as<std::string>();
    }
    for (const std::string& wrong : log_tools::Recover(file, mended)) {
      std::cout << "! " << wrong << '\n';
    }
    std::cout << mended.string() << '\n';
  }
  return ExitCode::kDone;
}

ExitCode Merge(const po::variables_map&, const Files& files) {
  if (files.size() < 2) {
    throw InputError("merge needs the file to write and at least one recording; see fulcrum log merge --help");
  }
  const log_tools::MergeResult result = log_tools::Merge({files.begin() + 1, files.end()}, files[0]);
  for (const std::string& note : result.notes) {
    std::cout << "! " << note << '\n';
  }
  std::cout << files[0].string() << ": " << result.messages << " messages\n";
  return ExitCode::kDone;
}

void AddMapOptions(po::options_description* options) {
  options->add_options()  //
      ("out", po::value<std::string>()->value_name("FILE"),
       "picture to write (default: cut.png beside the recording)")                              //
      ("json", po::value<std::string>()->value_name("FILE"), "also write the figures to FILE")  //
      ("scene", po::value<std::string>()->value_name("FILE")->default_value(""),
       "compiled scene (default: scene.fulcrum beside the recording)");
}

ExitCode Map(const po::variables_map& values, const Files& files) {
  if (files.size() != 1) {
    throw InputError("map needs one file, got " + std::to_string(files.size()) + "; see fulcrum log map --help");
  }
  const fs::path scene_file = recording::BesideRecording(values["scene"].as<std::string>(), files[0], "scene.fulcrum");
  if (scene_file.empty()) {
    throw InputError("no scene.fulcrum beside " + files[0].string() +
                     ": give the compiled scene of that session with --scene");
  }
  const scene::SceneFile scene(scene_file);
  const log_tools::CutMap map = log_tools::ReadCutMap(files[0], scene.view());
  const fs::path picture = values.count("out") != 0 ? fs::path(values["out"].as<std::string>())
                                                    : fs::path(files[0]).replace_filename("cut.png");
  WriteFile(picture, log_tools::DrawCutMap(map, std::string(scene.view().name) + "  " + map.recorded.session_id));
  if (values.count("json") != 0) {
    WriteFile(values["json"].as<std::string>(), log_tools::FiguresJson(map));
  }
  for (const auto& [name, value] : log_tools::FigureList(map.figures)) {
    std::printf("%-22s %10.3f\n", name.c_str(), value);
  }
  std::printf("%s\n", picture.c_str());
  return ExitCode::kDone;
}

void AddVideoOptions(po::options_description* options) {
  options->add_options()  //
      ("out", po::value<std::string>()->value_name("FILE"),
       "MP4 file to write (default: video.mp4 beside recording.mcap, FILE with .mp4 for another name)")  //
      ("until", po::value<std::string>()->value_name("SECONDS"),
       "end at this session time [s] (default: the end of the recording)")  //
      ("scene", po::value<std::string>()->value_name("FILE"),
       "compiled scene (default: scene.fulcrum beside the recording)");
}

/// The program `replayer` contains the renderer.
ExitCode Video(const po::variables_map& values, const Files& files) {
  if (files.size() != 1) {
    throw InputError("video needs one file, got " + std::to_string(files.size()) + "; see fulcrum log video --help");
  }
  // Of a session folder its video; recordings of many sessions may lie side by side in another folder.
  const fs::path beside = files[0].filename() == "recording.mcap" ? fs::path(files[0]).replace_filename("video.mp4")
                                                                  : fs::path(files[0]).replace_extension(".mp4");
  const std::string video = values.count("out") != 0 ? values["out"].as<std::string>() : beside.string();
  Words command{"replayer", files[0].string(), "--video=" + video};
  for (const char* name : {"until", "scene"}) {
    if (values.count(name) != 0) command.push_back(std::string("--") + name + '=' + values[name].as<std::string>());
  }
  Become(command);
}

constexpr std::array kTools{
    Tool{"info", "info FILE...", "Print the content of a recording: session, topics, rates, losses.", NoOptions, Info},
    Tool{"list", "list [FOLDER...]", "List the recordings in a folder (default: out), oldest first.", NoOptions, List},
    Tool{"cat", "cat FILE... [options]", "Print the messages as JSON, one per line.", AddCatOptions, Cat},
    Tool{"export", "export FILE... [options]", "Write one CSV table per topic.", AddExportOptions, Export},
    Tool{"verify", "verify FILE...",
         "Check checksums, indexes, decoding, gates and sequences; exit code 1 when a check fails.", NoOptions, Verify},
    Tool{"diff", "diff FILE FILE [options]", "Print the first difference of each topic; exit code 1 when there is one.",
         AddDiffOptions, Diff},
    Tool{"recover", "recover FILE... [options]",
         "Copy the readable part of a truncated or damaged file to a valid one.", AddRecoverOptions, Recover},
    Tool{"merge", "merge OUT FILE...",
         "Join the recordings of one session, after its recorder was restarted, into the file OUT.", NoOptions, Merge},
    Tool{"map", "map FILE [options]", "Draw a map of the cut and print its figures.", AddMapOptions, Map},
    Tool{"video", "video FILE [options]",
         "Draw the session as a video (H.264, 30 pictures a second, chapters). Needs ffmpeg.", AddVideoOptions, Video},
};

void PrintTools() {
  std::cout << "usage: fulcrum log TOOL FILE... [options]\n\nReads recordings of sessions.\n\n";
  for (const Tool& tool : kTools) {
    std::cout << "  " << tool.name << std::string(9 - std::string_view(tool.name).size(), ' ') << tool.purpose << '\n';
  }
  std::cout << "\nfulcrum log TOOL --help prints the options of one tool.\n\n"
               "Example:\n  fulcrum log cat out/latest/recording.mcap --topic ThermalEvent --to 20\n";
}

ExitCode Run(const Tool& tool, const Words& words) {
  po::options_description visible("Options"), all;
  tool.add_options(&visible);
  visible.add_options()("help", "print this text");
  all.add(visible).add_options()("file", po::value<std::vector<std::string>>());
  po::positional_options_description places;
  places.add("file", -1);
  po::variables_map values;
  try {
    const auto style = po::command_line_style::default_style & ~po::command_line_style::allow_guessing;
    po::store(po::command_line_parser(words).options(all).positional(places).style(style).run(), values);
  } catch (const po::error& error) {
    throw InputError(std::string(error.what()) + "; see fulcrum log " + tool.name + " --help");
  }
  if (values.count("help") != 0) {
    std::cout << "usage: fulcrum log " << tool.usage << "\n\n" << tool.purpose << "\n\n" << visible;
    return ExitCode::kDone;
  }
  Files files;
  if (values.count("file") != 0) {
    for (const std::string& file : values["file"].as<std::vector<std::string>>()) {
      files.emplace_back(file);
    }
  }
  if (files.empty() && std::string_view(tool.usage).find("FILE") != std::string_view::npos) {
    throw InputError(std::string("FILE is missing; see fulcrum log ") + tool.name + " --help");
  }
  return tool.run(values, files);
}

}  // namespace

ExitCode Log(const Words& words) {
  if (words.empty() || words[0] == "--help") {
    PrintTools();
    return words.empty() ? ExitCode::kBadUsage : ExitCode::kDone;
  }
  const auto* tool =
      std::find_if(kTools.begin(), kTools.end(), [&](const Tool& known) { return words[0] == known.name; });
  if (tool == kTools.end()) {
    throw InputError("unknown tool \"" + words[0] + "\"; fulcrum log --help lists the valid ones");
  }
  return Run(*tool, {words.begin() + 1, words.end()});
}

}  // namespace fulcrum::supervisor::cli
