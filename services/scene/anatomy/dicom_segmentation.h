// Segmentations as hospitals' systems and 3D Slicer export them: DICOM Segmentation Storage
// (1.2.840.10008.5.1.4.1.1.66.4), DICOM PS3.3 A.51.
#pragma once

#include <filesystem>
#include <set>
#include <string>

#include "services/scene/anatomy/label_map.h"

namespace fulcrum::scene {

/// Reads a file of one bit per voxel (BINARY) or of one byte (FRACTIONAL: labelled from half of MaximumFractionalValue
/// on). Frames are in any order; those that are empty may be missing: slices lie along the normal of the frames at the
/// places that their positions give, in steps of SpacingBetweenSlices or, without it, of the least distance of two.
/// Voxel axes: i along a row, j along a column, k along their cross product. Where segments overlap, that of the
/// highest number counts, because programs number from organs to what lies in them.
/// @param wanted numbers of the segments that are used; empty: all. The others label and cover nothing.
/// @pre IsDicom(file). Throws InputError "file: reason; valid".
LabelMap ReadDicomSegmentation(const std::filesystem::path& file, const std::set<int>& wanted);

/// What to give instead of a folder, as a sentence: the first segmentation in it, if it holds DICOM files.
std::string DicomFolderAdvice(const std::filesystem::path& folder);

}  // namespace fulcrum::scene
