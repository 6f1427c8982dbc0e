#include "tests/fuzz/scene/dicom_samples.h"

#include "services/base/core/error.h"
#include "tests/support/dicom_segmentation_writer.h"

namespace fulcrum::fuzz {

std::vector<Seed> DicomSamples() {
  testing::DicomSegments segments;
  segments.size = {6, 5, 3};
  segments.lps_from_index = Eigen::Translation3d(-8, 3, 20) * Eigen::AngleAxisd(0.4, Vec3d(1, 2, 2).normalized()) *
                            Eigen::Scaling(Vec3d(0.8, 0.9, 2.5));
  const ScratchFolder folder;
  std::vector<Seed> seeds;
  const auto add = [&](const char* name, const testing::DicomOptions& options) {
    segments.segments.clear();
    for (const int period : {2, 3}) {
      testing::DicomSegments::Segment& segment = segments.segments.emplace_back();
      segment.name = "Every " + std::to_string(period);
      for (int v = 0; v < 90; ++v) {
        segment.voxels.push_back(static_cast<std::uint8_t>(v % period == 0 ? std::max(options.largest, 1) : 0));
      }
    }
    testing::WriteDicomSegmentation(folder.path() / "x.dcm", segments, options);
    seeds.push_back({name, ReadFile(folder.path() / "x.dcm")});
  };
  testing::DicomOptions options;
  add("binary", options);
  options.is_implicit = true;
  options.states_spacing = false;
  add("implicit", options);
  options.planes_of_frames = true;
  options.shuffled = 3;
  options.largest = 200;
  add("fractional_implicit", options);
  options.is_implicit = false;
  options.states_spacing = true;
  add("fractional", options);
  return seeds;
}

std::optional<scene::LabelMap> ReadAnyDicom(const std::filesystem::path& file) {
  try {
    scene::LabelMap map = scene::ReadLabelMap(file);
    std::size_t voxels = 1;
    for (const int n : map.size) {
      Promise(n >= scene::kLeastVoxelsAlong && n <= scene::kMostVoxelsAlong, "size");
      voxels *= static_cast<std::size_t>(n);
    }
    Promise(map.labels.size() == voxels, "a label for each voxel");
    Promise(map.W_from_index.matrix().allFinite() && map.W_from_index.linear().determinant() > 0, "place");
    std::size_t of_segments = 0, labelled = 0;
    for (const scene::Segment& s : map.segments) of_segments += s.voxels - s.covered;
    for (const auto& [label, count] : scene::CountLabels(map)) {
      labelled += count;
      Promise(std::any_of(map.segments.begin(), map.segments.end(),
                          [l = label](const scene::Segment& s) { return s.number == l; }),
              "label of a segment");
    }
    Promise(map.segments.empty() || of_segments == labelled, "counts");
    return map;
  } catch (const InputError& error) {
    const std::string reason = error.what();
    Promise(reason.starts_with(file.string() + ": "), "a refusal names the file");
    Promise(std::none_of(reason.begin(), reason.end(), [](char c) { return static_cast<unsigned char>(c) < ' '; }),
            "a refusal is one line");
    return std::nullopt;
  }
}

}  // namespace fulcrum::fuzz
