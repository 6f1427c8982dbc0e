// One picture of one frame's images, for people.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "services/apps/replayer/channels.h"

namespace fulcrum::replay {

class DatasetSheet {
 public:
  /// An image of the frame by the name of its folder.
  void Add(const std::string& folder, const Channel& channel) { channels_.insert_or_assign(folder, channel); }

  /// Left, depth, normals, instances, flow and temperature in colours, each at half its size. Writes nothing without
  /// images. Throws InputError.
  void Write(const std::filesystem::path& file) const;

 private:
  std::map<std::string, Channel> channels_;
};

}  // namespace fulcrum::replay
