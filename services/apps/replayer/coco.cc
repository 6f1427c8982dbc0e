#include "services/apps/replayer/coco.h"

#include <algorithm>
#include <map>

#include "services/apps/replayer/report_format.h"
#include "services/base/core/error.h"

namespace fulcrum::replay {
namespace {

/// Pixels, half open, from the upper left.
struct Box {
  int left, top, right, bottom;
  std::uint64_t area = 0;
};

std::map<int, Box> Boxes(const Channel& instances) {
  std::map<int, Box> boxes;
  for (int y = 0; y < instances.height; ++y) {
    for (int x = 0; x < instances.width; ++x) {
      const int instance = instances.values[static_cast<std::size_t>(y) * static_cast<std::size_t>(instances.width) +
                                            static_cast<std::size_t>(x)];
      if (instance == 0) continue;
      Box& box = boxes.try_emplace(instance, Box{x, y, x + 1, y + 1}).first->second;
      box = {std::min(box.left, x), std::min(box.top, y), std::max(box.right, x + 1), std::max(box.bottom, y + 1),
             box.area + 1};
    }
  }
  return boxes;
}

std::string Joined(const std::vector<std::uint32_t>& values) {
  std::string text;
  for (const std::uint32_t value : values) text += (text.empty() ? "" : ",") + std::to_string(value);
  return text;
}

}  // namespace

std::vector<std::uint32_t> RunLengths(const Channel& instances, int instance) {
  std::vector<std::uint32_t> runs{0};
  bool inside = false;
  for (int x = 0; x < instances.width; ++x) {
    for (int y = 0; y < instances.height; ++y) {
      const bool is = instances.values[static_cast<std::size_t>(y) * static_cast<std::size_t>(instances.width) +
                                       static_cast<std::size_t>(x)] == instance;
      if (is != inside) runs.push_back(0);
      inside = is;
      ++runs.back();
    }
  }
  return runs;
}

CocoFile::CocoFile(const std::filesystem::path& file) : file_(file), out_(file) {
  out_ << "{\"info\": {\"description\": \"Fulcrum, simulated laparoscopy\"},\n\"categories\": [";
  for (int k = 1; k < kTruthClasses; ++k) {
    const auto what = static_cast<TruthClass>(k);
    out_ << (k > 1 ? "," : "") << "\n  {\"id\": " << k << ", \"name\": \"" << NameOf(what)
         << "\", \"supercategory\": \"" << (IsTool(what) ? "instrument" : "tissue") << "\"}";
  }
  out_ << "],\n\"annotations\": [";
  if (!out_) throw InputError(file.string() + ": cannot be written");
}

void CocoFile::Add(int image, const std::string& file_name, const Truth& truth) {
  const int width = truth.camera().width, height = truth.camera().height;
  images_ += Format("%s\n  {\"id\": %d, \"file_name\": \"%s\", \"width\": %d, \"height\": %d}",
                    images_.empty() ? "" : ",", image, file_name.c_str(), width, height);
  const Channel instances = truth.Instances(), classes = truth.Classes();
  std::map<int, int> class_of;
  for (std::size_t i = 0; i < instances.values.size(); ++i) class_of[instances.values[i]] = classes.values[i];
  for (const auto& [instance, box] : Boxes(instances)) {
    out_ << (annotations_ > 0 ? "," : "") << "\n  "
         << Format(
                "{\"id\": %llu, \"image_id\": %d, \"category_id\": %d, \"instance\": %d, \"iscrowd\": 0, "
                "\"bbox\": [%d, %d, %d, %d], \"area\": %llu, \"segmentation\": {\"size\": [%d, %d], \"counts\": [",
                static_cast<unsigned long long>(annotations_ + 1), image, class_of[instance], instance, box.left,
                box.top, box.right - box.left, box.bottom - box.top, static_cast<unsigned long long>(box.area), height,
                width)
         << Joined(RunLengths(instances, instance)) << "]}}";
    ++annotations_;
  }
}

void CocoFile::Finish() {
  out_ << "],\n\"images\": [" << images_ << "]}\n";
  if (!out_.flush()) throw InputError(file_.string() + ": cannot be written; is the disk full?");
}

}  // namespace fulcrum::replay
