#include <algorithm>
#include <iostream>

#include "services/apps/fulcrum/commands.h"
#include "services/base/core/error.h"

namespace fulcrum::supervisor::cli {

ExitCode ImportAnatomy(const Words& words) {
  const char* usage =
      "usage: fulcrum import-anatomy LABELS                          prints a map to be edited\n"
      "       fulcrum import-anatomy LABELS --map LABELS.yaml --out DIR\n\n"
      "Makes a scene of a patient's segmentation. LABELS is a NIfTI label map, a DICOM segmentation (the one\n"
      "file of it, not its images), or a folder with a surface per organ.\n"
      "DIR then holds a mesh per organ, the scene with membrane, tools and script around one of them, its picture,\n"
      "and report.html. Left stays left: the position in the patient comes from the file (NIfTI: sform, qform;\n"
      "DICOM: orientation and position of each frame), for surfaces from the map (axes: LPS, RAS, ...). Where\n"
      "segments of DICOM overlap, the highest number of those in the map counts.\n\n"
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
