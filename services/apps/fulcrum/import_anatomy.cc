#include <algorithm>
#include <iostream>

#include "services/apps/fulcrum/commands.h"
#include "services/base/core/error.h"

namespace fulcrum::supervisor::cli {

ExitCode ImportAnatomy(const Words& words) {
  const char* usage =
      "usage: fulcrum import-anatomy LABELS.nii.gz                            prints a map to be edited\n"
      "       fulcrum import-anatomy LABELS.nii.gz --map LABELS.yaml --out DIR\n\n"
      "Makes a scene of a patient's segmentation, a NIfTI label map: DIR holds a mesh per label, the scene with\n"
      "membrane, tools and script around the organ, its picture, and report.html. Left stays left: the position in\n"
      "the patient comes from the file (sform, qform).\n\n"
      "Example:\n"
      "  fulcrum import-anatomy pelvis.nii.gz > labels.yaml     then give the labels their names and roles\n"
      "  fulcrum import-anatomy pelvis.nii.gz --map labels.yaml --out pelvis && fulcrum up pelvis/pelvis.yaml\n";
  if (words.empty()) throw InputError(std::string("import-anatomy needs LABELS\n") + usage);
  if (std::find(words.begin(), words.end(), "--help") != words.end()) {
    std::cout << usage;
    return ExitCode::kDone;
  }
  Words command{"scene_compiler", "--anatomy"};
  command.insert(command.end(), words.begin(), words.end());
  Become(command);
}

}  // namespace fulcrum::supervisor::cli
