// Small DICOM segmentations, and what must hold for any bytes that are read as one.
#pragma once

#include <optional>
#include <vector>

#include "services/scene/anatomy/label_map.h"
#include "tests/fuzz/target.h"

namespace fulcrum::fuzz {

/// One of each kind: bits and shares, with and without types of elements, orientation shared or in every frame.
std::vector<Seed> DicomSamples();

/// The file as ReadLabelMap reads it; nothing: it was refused. Throws BrokenPromise.
std::optional<scene::LabelMap> ReadAnyDicom(const std::filesystem::path& file);

}  // namespace fulcrum::fuzz
