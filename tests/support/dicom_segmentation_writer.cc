#include "tests/support/dicom_segmentation_writer.h"

// DCMTK wants this one first.
#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmfg/fgfracon.h>
#include <dcmtk/dcmfg/fgpixmsr.h>
#include <dcmtk/dcmfg/fgplanor.h>
#include <dcmtk/dcmfg/fgplanpo.h>
#include <dcmtk/dcmiod/iodmacro.h>
#include <dcmtk/dcmseg/segdoc.h>
#include <dcmtk/dcmseg/segment.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <random>
#include <stdexcept>

namespace fulcrum::testing {
namespace {

void Must(const OFCondition& done, const char* what) {
  if (done.bad()) throw std::runtime_error(std::string(what) + ": " + done.text());
}

/// A decimal string of DICOM has at most 16 characters.
OFString Decimal(double value) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.9g", std::abs(value) < 1e-9 ? 0.0 : value);
  return text;
}

struct Frame {
  Uint16 segment = 0;
  int slice = 0;
  std::vector<std::uint8_t> voxels;
};

std::vector<Frame> FramesOf(const DicomSegments& segments, const DicomOptions& options) {
  std::vector<Frame> frames;
  const auto in_slice = static_cast<std::ptrdiff_t>(segments.size[0]) * segments.size[1];
  for (std::size_t s = 0; s < segments.segments.size(); ++s) {
    for (int k = 0; k < segments.size[2]; ++k) {
      const auto first = segments.segments[s].voxels.begin() + in_slice * k;
      Frame frame{static_cast<Uint16>(s + 1), k, {first, first + in_slice}};
      const bool is_empty =
          std::all_of(frame.voxels.begin(), frame.voxels.end(), [](std::uint8_t v) { return v == 0; });
      if (!is_empty || options.writes_empty) frames.push_back(std::move(frame));
    }
  }
  if (options.shuffled != 0) {
    std::mt19937 random(options.shuffled);
    for (std::size_t n = frames.size(); n > 1; --n) std::swap(frames[n - 1], frames[random() % n]);
  }
  return frames;
}

/// A bit per voxel, the first one the lowest, without padding between frames (DICOM PS3.5 8.1.1).
std::vector<std::uint8_t> Packed(const std::vector<Frame>& frames) {
  std::vector<std::uint8_t> bytes((frames.size() * frames.front().voxels.size() + 7) / 8, 0);
  bytes.resize(bytes.size() + bytes.size() % 2, 0);
  std::size_t bit = 0;
  for (const Frame& frame : frames) {
    for (const std::uint8_t voxel : frame.voxels) {
      if (voxel != 0) bytes[bit / 8] |= static_cast<std::uint8_t>(1u << (bit % 8));
      ++bit;
    }
  }
  return bytes;
}

}  // namespace

DicomSegments SegmentsOf(const scene::LabelMap& map) {
  DicomSegments result;
  result.size = map.size;
  result.lps_from_index = Eigen::Affine3d(WFromLps().transpose() * map.W_from_index);
  const int largest = *std::max_element(map.labels.begin(), map.labels.end());
  for (int label = 1; label <= largest; ++label) {
    DicomSegments::Segment& segment = result.segments.emplace_back();
    segment.name = "Segment " + std::to_string(label);
    segment.voxels.resize(map.labels.size());
    for (std::size_t v = 0; v < map.labels.size(); ++v) segment.voxels[v] = map.labels[v] == label ? 1 : 0;
  }
  return result;
}

void WriteDicomSegmentation(const std::filesystem::path& file, const DicomSegments& segments,
                            const DicomOptions& options) {
  OFLog::configure(OFLogger::OFF_LOG_LEVEL);
  const IODGeneralEquipmentModule::EquipmentInfo equipment("Fulcrum", "Test", "1", "1");
  const ContentIdentificationMacro content("1", "LABEL", "", "");
  const auto rows = static_cast<Uint16>(segments.size[1]), columns = static_cast<Uint16>(segments.size[0]);
  DcmSegmentation* made = nullptr;
  Must(options.largest == 0
           ? DcmSegmentation::createBinarySegmentation(made, rows, columns, equipment, content)
           : DcmSegmentation::createFractionalSegmentation(made, rows, columns, DcmSegTypes::SFT_PROBABILITY,
                                                           static_cast<Uint16>(options.largest), equipment, content),
       "create");
  const std::unique_ptr<DcmSegmentation> document(made);
  for (const DicomSegments::Segment& segment : segments.segments) {
    DcmSegment* entry = nullptr;
    Must(DcmSegment::create(entry, segment.name.c_str(), CodeSequenceMacro("T-D000A", "SRT", "Anatomical Structure"),
                            CodeSequenceMacro("T-D000A", "SRT", "Anatomical Structure"), DcmSegTypes::SAT_MANUAL),
         "segment");
    Uint16 number = 0;
    Must(document->addSegment(entry, number), "segment");
  }
  const Mat3d axes = segments.lps_from_index.linear();
  const Vec3d spacing = axes.colwise().norm();
  const Mat3d directions = axes.colwise().normalized();
  const std::unique_ptr<FGPlaneOrientationPatient> orientation(FGPlaneOrientationPatient::createMinimal(
      Decimal(directions(0, 0)), Decimal(directions(1, 0)), Decimal(directions(2, 0)), Decimal(directions(0, 1)),
      Decimal(directions(1, 1)), Decimal(directions(2, 1))));
  FGPixelMeasures measures;
  // Between rows first, that is along j.
  Must(measures.setPixelSpacing(Decimal(spacing[1]) + "\\" + Decimal(spacing[0])), "spacing");
  Must(measures.setSliceThickness(Decimal(spacing[2])), "spacing");
  if (options.states_spacing) Must(measures.setSpacingBetweenSlices(Decimal(spacing[2])), "spacing");
  if (!options.planes_of_frames) {
    Must(document->addForAllFrames(*orientation), "orientation");
    Must(document->addForAllFrames(measures), "spacing");
  }
  IODMultiframeDimensionModule& dimensions = document->getDimensions();
  const OFString uid = "1.2.826.0.1.3680043.10.1";
  Must(dimensions.addDimensionIndex(DCM_ReferencedSegmentNumber, uid, DCM_SegmentIdentificationSequence), "dimension");
  Must(dimensions.addDimensionIndex(DCM_ImagePositionPatient, uid, DCM_PlanePositionSequence), "dimension");
  std::vector<Frame> frames = FramesOf(segments, options);
  for (Frame& frame : frames) {
    const Vec3d corner = segments.lps_from_index * Vec3d(0, 0, frame.slice);
    const std::unique_ptr<FGPlanePosPatient> position(
        FGPlanePosPatient::createMinimal(Decimal(corner.x()), Decimal(corner.y()), Decimal(corner.z())));
    FGFrameContent place;
    Must(place.setDimensionIndexValues(frame.segment, 0), "dimension");
    Must(place.setDimensionIndexValues(static_cast<Uint32>(frame.slice + 1), 1), "dimension");
    OFVector<FGBase*> groups;
    groups.push_back(&place);
    groups.push_back(position.get());
    if (options.planes_of_frames) {
      groups.push_back(orientation.get());
      groups.push_back(&measures);
    }
    Must(document->addFrame(frame.voxels.data(), frame.segment, groups), "frame");
  }
  Must(document->getStudy().setStudyInstanceUID("1.2.826.0.1.3680043.10.2"), "study");
  Must(document->getSeries().setSeriesInstanceUID("1.2.826.0.1.3680043.10.3"), "series");
  Must(document->getSeries().setSeriesNumber("1"), "series");
  Must(document->getFrameOfReference().setFrameOfReferenceUID("1.2.826.0.1.3680043.10.4"), "frame of reference");
  DcmFileFormat result;
  Must(document->writeDataset(*result.getDataset()), "write");
  // DCMTK 3.6.7 puts bits of frames that do not begin at a byte into wrong places (QIICR/dcmqi issue 341).
  if (options.largest == 0 && frames.front().voxels.size() % 8 != 0) {
    const std::vector<std::uint8_t> bytes = Packed(frames);
    Must(result.getDataset()->putAndInsertUint8Array(DCM_PixelData, bytes.data(), bytes.size()), "bits");
  }
  // What would differ each time.
  DcmDataset& data = *result.getDataset();
  Must(data.putAndInsertString(DCM_SOPInstanceUID, "1.2.826.0.1.3680043.10.5"), "UID");
  Must(data.putAndInsertString(DCM_ContentDate, "20260101"), "date");
  Must(data.putAndInsertString(DCM_ContentTime, "120000"), "time");
  Must(result.saveFile(file.c_str(), options.is_implicit ? EXS_LittleEndianImplicit : EXS_LittleEndianExplicit,
                       options.is_implicit ? EET_ExplicitLength : EET_UndefinedLength),
       "save");
}

}  // namespace fulcrum::testing
