#include "services/apps/replayer/coco.h"

#include <algorithm>

#include "services/apps/replayer/report_format.h"
#include "services/base/core/error.h"

namespace fulcrum::replay {
namespace {

std::string Joined(const std::vector<std::uint32_t>& values) {
  std::string text;
  for (const std::uint32_t value : values) text += (text.empty() ? "" : ",") + std::to_string(value);
  return text;
}

}  // namespace

std::map<int, InstanceMask> InstanceMasks(const Channel& instances) {
  const auto width = static_cast<std::size_t>(instances.width), height = static_cast<std::size_t>(instances.height);
  std::map<int, InstanceMask> masks;
  std::map<int, std::size_t> ends;  // Of the last run of each instance.
  for (std::size_t x = 0; x < width; ++x) {
    for (std::size_t y = 0; y < height;) {
      const std::uint16_t instance = instances.values[y * width + x];
      const std::size_t top = y;
      while (++y < height && instances.values[y * width + x] == instance) {
      }
      if (instance == 0) continue;
      const int left = static_cast<int>(x), low = static_cast<int>(top), high = static_cast<int>(y);
      InstanceMask& mask = masks.try_emplace(instance, InstanceMask{left, low, left + 1, high}).first->second;
      mask.top = std::min(mask.top, low);
      mask.right = left + 1;
      mask.bottom = std::max(mask.bottom, high);
      mask.area += y - top;
      // A run that ends at the foot of a column goes on at the head of the next one.
      std::size_t& end = ends[instance];
      const std::size_t begin = x * height + top, before = begin - end;
      const auto length = static_cast<std::uint32_t>(y - top);
      if (before == 0 && !mask.runs.empty()) {
        mask.runs.back() += length;
      } else {
        mask.runs.insert(mask.runs.end(), {static_cast<std::uint32_t>(before), length});
      }
      end = begin + length;
    }
  }
  for (auto& [instance, mask] : masks) {
    if (const std::size_t rest = width * height - ends[instance]; rest > 0)
      mask.runs.push_back(static_cast<std::uint32_t>(rest));
  }
  return masks;
}

CocoFile::CocoFile(const std::filesystem::path& file) : file_(file), out_(file) {
  out_ << "{\"info\": {\"description\": \"Fulcrum, simulated laparoscopy\"},\n\"categories\": [";
  for (int k = 1; k < kTruthClasses; ++k) {
    const auto what = static_cast<TruthClass>(k);
    out_ << (k > 1 ? "," : "") << "\n  {\"id\": " << k << ", \"name\": \"" << NameOf(what)
         << "\", \"supercategory\": \"" << (IsTool(what) || what == TruthClass::kClip ? "instrument" : "tissue")
         << "\"}";
  }
  out_ << "],\n\"annotations\": [";
  if (!out_) throw InputError(file.string() + ": cannot be written");
}

void CocoFile::Add(int image, const std::string& file_name, const Channel& instances, const Truth& truth) {
  const int width = instances.width, height = instances.height;
  images_ += Format("%s\n  {\"id\": %d, \"file_name\": \"%s\", \"width\": %d, \"height\": %d}",
                    images_.empty() ? "" : ",", image, file_name.c_str(), width, height);
  for (const auto& [instance, mask] : InstanceMasks(instances)) {
    out_ << (annotations_ > 0 ? "," : "") << "\n  "
         << Format(
                "{\"id\": %llu, \"image_id\": %d, \"category_id\": %d, \"instance\": %d, \"iscrowd\": 0, "
                "\"bbox\": [%d, %d, %d, %d], \"area\": %llu, \"segmentation\": {\"size\": [%d, %d], \"counts\": [",
                static_cast<unsigned long long>(annotations_ + 1), image, static_cast<int>(truth.ClassOf(instance)),
                instance, mask.left, mask.top, mask.right - mask.left, mask.bottom - mask.top,
                static_cast<unsigned long long>(mask.area), height, width)
         << Joined(mask.runs) << "]}}";
    ++annotations_;
  }
}

void CocoFile::Finish() {
  out_ << "],\n\"images\": [" << images_ << "]}\n";
  if (!out_.flush()) throw InputError(file_.string() + ": cannot be written; is the disk full?");
}

}  // namespace fulcrum::replay
