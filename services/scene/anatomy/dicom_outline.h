// The outline of a DICOM file: how its elements nest, checked before DCMTK reads it. DCMTK 3.6.7 recurses
// into each level of nesting, so that 400 kB of nested sequences overflow its stack; it searches where elements are out
// of order, which takes a time of the square of their number; and it holds each element in some hundred bytes.
#pragma once

#include <filesystem>
#include <string>

namespace fulcrum::scene {

/// "DICM" stands at byte 128.
bool IsDicom(const std::filesystem::path& file);

/// MediaStorageSOPClassUID (0002,0002), for a look at a file; empty: no DICOM file, or a damaged one.
std::string DicomClass(const std::filesystem::path& file);

/// Reads the headers of all elements. Throws InputError "file: reason; valid" for a file that is cut short, compressed
/// or big-endian, nests deeper than 32 levels, holds more than 4 million elements, or has an element out of order or
/// longer than what contains it.
void CheckDicomOutline(const std::filesystem::path& file);

}  // namespace fulcrum::scene
