// DICOM segmentations, written by DCMTK: orientation and spacing against the same phantom as NIfTI, frames in any
// order, overlaps, refusals.
#include <dcmtk/config/osconfig.h>
// DCMTK wants that one first.
#include <dcmtk/dcmdata/dcdeftag.h>
#include <dcmtk/dcmdata/dcfilefo.h>
#include <dcmtk/dcmdata/dcsequen.h>
#include <dcmtk/dcmdata/dcuid.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <sstream>

#include "services/scene/anatomy/dicom_outline.h"
#include "services/scene/anatomy/import_anatomy.h"
#include "services/scene/readers/mesh_io.h"
#include "tests/support/dicom_segmentation_writer.h"
#include "tests/unit/anatomy/phantom.h"

namespace fulcrum::scene {
namespace {

namespace fs = std::filesystem;
using fulcrum::testing::DicomOptions;
using fulcrum::testing::DicomSegments;
using fulcrum::testing::SegmentsOf;
using fulcrum::testing::WriteDicomSegmentation;

/// Of the first no slice is a multiple of 8 voxels: frames of single bits do not begin at bytes.
constexpr std::array<int, 3> kSize{37, 35, 29}, kWholeBytes{40, 36, 29};
const Vec3d kSpacing(1.0, 1.25, 1.5);

class DicomSegmentation : public Segmentation {
 protected:
  fs::path WriteDicom(const DicomSegments& segments, const DicomOptions& options = {}) {
    WriteDicomSegmentation(folder_ / "x.dcm", segments, options);
    return folder_ / "x.dcm";
  }
  LabelMap ReadAsDicom(const LabelMap& map, const DicomOptions& options = {}) {
    return ReadLabelMap(WriteDicom(SegmentsOf(map), options));
  }
  LabelMap ReadAsNifti(const LabelMap& map) {
    const Eigen::Affine3d ras(fulcrum::testing::WFromRas().transpose() * map.W_from_index);
    return ReadLabelMap(
        Write("x.nii", fulcrum::testing::NiftiBytes(map, fulcrum::testing::NiftiHeader(map, ras, false))));
  }
  /// The refusal of x.dcm after `change`.
  std::string RefusalOf(const std::function<void(DcmDataset*)>& change,
                        E_TransferSyntax syntax = EXS_LittleEndianExplicit) {
    WriteDicom(SegmentsOf(Phantom(Mat3d::Identity())));
    DcmFileFormat file;
    EXPECT_TRUE(file.loadFile((folder_ / "x.dcm").c_str()).good());
    EXPECT_TRUE(file.loadAllDataIntoMemory().good());
    change(file.getDataset());
    EXPECT_TRUE(file.saveFile((folder_ / "y.dcm").c_str(), syntax).good());
    return Refusal([&] { (void)ReadLabelMap(folder_ / "y.dcm"); });
  }
  static LabelMap Phantom(const Mat3d& directions, const std::array<int, 3>& size = kSize) {
    return Fill(size, Around(directions * kSpacing.asDiagonal(), size), Mark);
  }
};

/// Item `number` of the functional groups of frame `frame`.
DcmItem* Group(DcmDataset* data, int frame, const DcmTagKey& key) {
  DcmItem *item = nullptr, *group = nullptr;
  EXPECT_TRUE(data->findAndGetSequenceItem(DCM_PerFrameFunctionalGroupsSequence, item, frame).good());
  EXPECT_TRUE(item->findAndGetSequenceItem(key, group).good());
  return group;
}
DcmItem* SharedGroup(DcmDataset* data, const DcmTagKey& key) {
  DcmItem *item = nullptr, *group = nullptr;
  EXPECT_TRUE(data->findAndGetSequenceItem(DCM_SharedFunctionalGroupsSequence, item).good());
  EXPECT_TRUE(item->findAndGetSequenceItem(key, group).good());
  return group;
}
/// Adds to a number of frame `frame`'s position [mm].
void Move(DcmDataset* data, int frame, unsigned axis, double by_mm) {
  DcmItem* position = Group(data, frame, DCM_PlanePositionSequence);
  std::ostringstream text;
  for (unsigned a = 0; a < 3; ++a) {
    Float64 value = 0;
    EXPECT_TRUE(position->findAndGetFloat64(DCM_ImagePositionPatient, value, a).good());
    text << (a > 0 ? "\\" : "") << value + (a == axis ? by_mm : 0);
  }
  EXPECT_TRUE(position->putAndInsertString(DCM_ImagePositionPatient, text.str().c_str()).good());
}

TEST_F(DicomSegmentation, ThePhantomIsThatOfNifti) {
  // All 24 directions of storage that a frame can have, and two oblique ones.
  std::vector<Mat3d> frames;
  std::array<int, 3> order{0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Mat3d m = Mat3d::Zero();
      for (int a = 0; a < 3; ++a) m(order[static_cast<std::size_t>(a)], a) = (signs >> a & 1) != 0 ? -1 : 1;
      if (m.determinant() > 0) frames.push_back(m);
    }
  } while (std::next_permutation(order.begin(), order.end()));
  frames.emplace_back(Eigen::AngleAxisd(0.7, Vec3d(1, 2, -1).normalized()).toRotationMatrix());
  frames.emplace_back(Eigen::AngleAxisd(-1.9, Vec3d(3, -1, 2).normalized()).toRotationMatrix());
  ASSERT_EQ(frames.size(), 26u);
  for (std::size_t f = 0; f < frames.size(); ++f) {
    const LabelMap phantom = Phantom(frames[f], f % 2 == 0 ? kSize : kWholeBytes);
    DicomOptions options;
    options.writes_empty = true;
    options.states_spacing = f % 4 < 2;
    options.planes_of_frames = f % 3 == 0;
    options.is_implicit = f % 5 == 0;
    options.shuffled = static_cast<unsigned>(f);
    const LabelMap read = ReadAsDicom(phantom, options), nifti = ReadAsNifti(phantom);
    ASSERT_EQ(read.size, nifti.size) << "frame " << f;
    EXPECT_EQ(read.labels, nifti.labels) << "frame " << f;
    // NIfTI has 24 bits of mantissa, a decimal string of DICOM 16 characters.
    EXPECT_LT((read.W_from_index.matrix() - nifti.W_from_index.matrix()).cwiseAbs().maxCoeff(), 1e-5) << "frame " << f;
    // Left, cranial and anterior of the middle, whatever both readers do.
    for (int mark = 1; mark <= 3; ++mark) {
      Vec3d sum = Vec3d::Zero();
      int count = 0;
      for (int k = 0; k < read.size[2]; ++k) {
        for (int j = 0; j < read.size[1]; ++j) {
          for (int i = 0; i < read.size[0]; ++i) {
            if (read.labels[read.Index(i, j, k)] != mark) continue;
            sum += read.W_from_index * Vec3d(i, j, k);
            ++count;
          }
        }
      }
      ASSERT_GT(count, 0);
      EXPECT_LT((sum / count - 14 * Vec3d::Unit(mark - 1)).norm(), 0.7) << "frame " << f << ", mark " << mark;
    }
  }
}

TEST_F(DicomSegmentation, EmptyFramesMayBeMissing) {
  const Mat3d oblique = Eigen::AngleAxisd(0.7, Vec3d(1, 2, -1).normalized()).toRotationMatrix();
  // Two balls, of which the slices between are empty.
  const LabelMap phantom =
      Fill(kSize, Eigen::Affine3d(Around(oblique * kSpacing.asDiagonal(), kSize)), [&](const Vec3d& p) {
        const Vec3d away = 14 * oblique.col(2);
        return (p - away).norm() < 4 ? 1 : (p + away).norm() < 5 ? 2 : 0;
      });
  for (const bool states_spacing : {true, false}) {
    DicomOptions options;
    options.states_spacing = states_spacing;
    options.shuffled = 5;
    const LabelMap read = ReadAsDicom(phantom, options);
    EXPECT_LT(read.size[2], kSize[2]);
    EXPECT_EQ(CountLabels(read), CountLabels(phantom));
    const Eigen::Affine3d phantom_from_read = phantom.W_from_index.inverse() * read.W_from_index;
    for (int k = 0; k < read.size[2]; ++k) {
      const Vec3d at = phantom_from_read * Vec3d(3, 5, k);
      ASSERT_LT((at - at.array().round().matrix()).norm(), 1e-4);
      for (int v = 0; v < kSize[0] * kSize[1]; ++v) {
        const std::size_t in_slice = static_cast<std::size_t>(v);
        ASSERT_EQ(read.labels[read.Index(0, 0, k) + in_slice],
                  phantom.labels[phantom.Index(0, 0, static_cast<int>(std::lround(at.z()))) + in_slice]);
      }
    }
  }
}

TEST_F(DicomSegmentation, SharesAreLabelledFromTheHalfOn) {
  for (const int largest : {1, 200, 255}) {
    DicomSegments segments;
    segments.size = {16, 16, 3};
    segments.segments.push_back({"Shares", {}});
    std::vector<std::uint16_t> expected;
    for (int v = 0; v < 16 * 16 * 3; ++v) {
      const int share = v % (largest + 1);
      segments.segments[0].voxels.push_back(static_cast<std::uint8_t>(share));
      expected.push_back(2 * share >= largest ? 1 : 0);
    }
    DicomOptions options;
    options.largest = largest;
    EXPECT_EQ(ReadLabelMap(WriteDicom(segments, options)).labels, expected) << largest;
  }
}

TEST_F(DicomSegmentation, TheHighestNumberCountsWhereSegmentsOverlap) {
  DicomSegments segments;
  segments.size = {8, 8, 4};
  // 1 everywhere, 2 in half of it, 3 in a quarter that lies in 2.
  for (const int period : {1, 2, 4}) {
    DicomSegments::Segment& segment = segments.segments.emplace_back();
    segment.name = "Every " + std::to_string(period);
    for (int v = 0; v < 256; ++v) segment.voxels.push_back(v % period == 0 ? 1 : 0);
  }
  for (const unsigned shuffled : {0u, 1u, 2u}) {
    DicomOptions options;
    options.shuffled = shuffled;
    const fs::path file = WriteDicom(segments, options);
    const LabelMap all = ReadLabelMap(file);
    EXPECT_EQ(CountLabels(all), (std::map<int, std::size_t>{{1, 128}, {2, 64}, {3, 64}}));
    ASSERT_EQ(all.segments.size(), 3u);
    EXPECT_EQ(all.segments[0].name, "Every 1");
    EXPECT_EQ(all.segments[0].voxels, 256u);
    EXPECT_EQ(all.segments[0].covered, 128u);
    EXPECT_EQ(all.segments[1].covered, 64u);
    EXPECT_EQ(all.segments[2].covered, 0u);
    const LabelMap two = ReadLabelMap(file, {1, 3});
    EXPECT_EQ(CountLabels(two), (std::map<int, std::size_t>{{1, 192}, {3, 64}})) << "what is not used covers nothing";
  }
}

TEST_F(DicomSegmentation, OtherEncodingsAreReadOrNamed) {
  EXPECT_EQ(RefusalOf([](DcmDataset*) {}), "");
  EXPECT_EQ(RefusalOf([](DcmDataset*) {}, EXS_LittleEndianImplicit), "");
  EXPECT_EQ(ReadLabelMap(folder_ / "y.dcm").labels, ReadLabelMap(folder_ / "x.dcm").labels);
  for (const E_TransferSyntax syntax : {EXS_DeflatedLittleEndianExplicit, EXS_BigEndianExplicit}) {
    const std::string refusal = RefusalOf([](DcmDataset*) {}, syntax);
    EXPECT_NE(refusal.find("TransferSyntaxUID (0002,0010) '1.2.840.10008.1.2."), std::string::npos) << refusal;
    EXPECT_NE(refusal.find("dcmconv +te"), std::string::npos) << refusal;
  }
  // A name in Latin-1.
  const std::string refusal = RefusalOf([](DcmDataset* data) {
    DcmItem* segment = nullptr;
    (void)data->putAndInsertString(DCM_SpecificCharacterSet, "ISO_IR 100");
    (void)data->findAndGetSequenceItem(DCM_SegmentSequence, segment);
    (void)segment->putAndInsertString(DCM_SegmentLabel, "Gef\xe4\xdf \x1b[31m");
  });
  EXPECT_EQ(refusal, "");
  EXPECT_EQ(ReadLabelMap(folder_ / "y.dcm").segments[0].name.substr(0, 7), "Gef\xc3\xa4\xc3\x9f");
  EXPECT_EQ(ReadLabelMap(folder_ / "y.dcm").segments[0].name.find('\x1b'), std::string::npos);
}

TEST_F(DicomSegmentation, WhatIsNoSegmentationOfAVolumeIsRefused) {
  const auto text = [](const DcmTagKey& key, const char* value) {
    return [key, value](DcmDataset* data) { EXPECT_TRUE(data->putAndInsertString(key, value).good()); };
  };
  const auto number = [](const DcmTagKey& key, Uint16 value) {
    return [key, value](DcmDataset* data) { EXPECT_TRUE(data->putAndInsertUint16(key, value).good()); };
  };
  const auto shared = [](const DcmTagKey& group, const DcmTagKey& key, const std::string& value) {
    return
        [=](DcmDataset* data) { EXPECT_TRUE(SharedGroup(data, group)->putAndInsertString(key, value.c_str()).good()); };
  };
  const struct {
    std::function<void(DcmDataset*)> change;
    std::string reason;
  } cases[] = {
      {text(DCM_SOPClassUID, UID_CTImageStorage), "is '1.2.840.10008.5.1.4.1.1.2' (CTImageStorage)"},
      {text(DCM_SOPClassUID, "1.2.840.10008.5.1.4.1.1.66.7"), "(LabelMapSegmentationStorage)"},
      {number(DCM_InConcatenationTotalNumber, 3), "InConcatenationTotalNumber (0020,9163) is '3'; valid: 1: this is"},
      {text(DCM_ConcatenationUID, "1.2.3"), "InConcatenationTotalNumber (0020,9163) is missing; valid: 1: this is"},
      {number(DCM_InConcatenationNumber, 1), "InConcatenationTotalNumber (0020,9163) is missing; valid: 1: this is"},
      {text(DCM_SegmentationType, "FRACTIONAL"), "BitsAllocated (0028,0100) is '1'; valid: 8"},
      {text(DCM_SegmentationType, "LABELMAP"), "SegmentationType (0062,0001) is 'LABELMAP'; valid: BINARY or"},
      {number(DCM_BitsAllocated, 16), "BitsAllocated (0028,0100) is '16'; valid: 1"},
      {number(DCM_HighBit, 7), "HighBit (0028,0102) is '7'; valid: 0"},
      {number(DCM_Rows, 5000), "Rows (0028,0010) is '5000'; valid: 2 to 4096"},
      {number(DCM_Rows, 34), "PixelData (7fe0,0010) has "},
      {text(DCM_NumberOfFrames, "2000000000"), "NumberOfFrames (0028,0008) is '2000000000'; valid: 1 to 1000000"},
      {text(DCM_NumberOfFrames, "3"), "NumberOfFrames (0028,0008) is 3; valid: that of the items"},
      {text(DCM_NumberOfFrames, "many"), "NumberOfFrames (0028,0008) is 'many'"},
      {[](DcmDataset* d) { delete d->remove(DCM_PixelData); }, "PixelData (7fe0,0010) has 0 bytes"},
      {[](DcmDataset* d) { delete d->remove(DCM_Rows); }, "Rows (0028,0010) is missing"},
      {[](DcmDataset* d) { delete d->remove(DCM_SegmentSequence); }, "SegmentSequence (0062,0002) is missing"},
      {[](DcmDataset* d) { delete d->remove(DCM_PerFrameFunctionalGroupsSequence); },
       "that of the items of PerFrameFunctionalGroupsSequence (5200,9230), 0. The"},
      {[](DcmDataset* d) { delete d->remove(DCM_SharedFunctionalGroupsSequence); },
       "frame 1 has no PlaneOrientationSequence (0020,9116)"},
      {shared(DCM_PixelMeasuresSequence, DCM_PixelSpacing, "0\\1"), "PixelSpacing (0028,0030) is 0 mm; valid: 0.01"},
      {shared(DCM_PixelMeasuresSequence, DCM_PixelSpacing, "1"), "PixelSpacing (0028,0030) is '1'; valid: 2 numbers"},
      {shared(DCM_PixelMeasuresSequence, DCM_PixelSpacing, "1\\nan"), "PixelSpacing (0028,0030) is '1\\nan'"},
      {shared(DCM_PixelMeasuresSequence, DCM_PixelSpacing, std::string(200, '0') + "1\\1.25"),
       "of at most 64 characters each"},
      {shared(DCM_PixelMeasuresSequence, DCM_SpacingBetweenSlices, "4"), "valid: equal steps"},
      {shared(DCM_PlaneOrientationSequence, DCM_ImageOrientationPatient, "1\\0\\0\\0.1\\1\\0"), "at a right angle"},
      {shared(DCM_PlaneOrientationSequence, DCM_ImageOrientationPatient, "1\\0\\0\\0\\0\\0"), "of length 1"},
      {[](DcmDataset* d) { Move(d, 1, 1, 0.4); }, "frame 2: ImagePositionPatient (0020,0032) is "},
      {[](DcmDataset* d) { Move(d, 1, 0, 1.0); }, "beside the others"},
      {[](DcmDataset* d) { Move(d, 0, 1, 9600); },  // 6400 slices, and up to 28 more or less.
       " mm by ImagePositionPatient (0020,0032): 6"},
      {[](DcmDataset* d) {
         delete SharedGroup(d, DCM_PixelMeasuresSequence)->remove(DCM_SpacingBetweenSlices);
         Move(d, 1, 1, 0.4);
       },
       "equal slices, as 3D Slicer does, or let it state SpacingBetweenSlices (0018,0088)"},
      {[](DcmDataset* d) { Move(d, 0, 1, 9e8); }, "3 numbers up to 1e6"},
      {[](DcmDataset* d) {
         (void)Group(d, 1, DCM_SegmentIdentificationSequence)->putAndInsertUint16(DCM_ReferencedSegmentNumber, 9);
       },
       "frame 2: ReferencedSegmentNumber (0062,000b) is 9; valid: a number of SegmentSequence"},
      {[](DcmDataset* d) {
         DcmItem* segment = nullptr;
         (void)d->findAndGetSequenceItem(DCM_SegmentSequence, segment, 1);
         (void)segment->putAndInsertUint16(DCM_SegmentNumber, 1);
       },
       "SegmentNumber (0062,0004) is 1 twice"},
      {[](DcmDataset* d) { Move(d, 1, 1, -1.5); }, "both of segment 1 in one slice"},
  };
  for (const auto& c : cases) {
    const std::string refusal = RefusalOf(c.change);
    EXPECT_NE(refusal.find(c.reason), std::string::npos) << "expected: " << c.reason << "\ngot: " << refusal;
    EXPECT_EQ(refusal.find((folder_ / "y.dcm").string() + ": "), 0u) << refusal;
    EXPECT_EQ(refusal.find('\n'), std::string::npos) << refusal;
  }
}

TEST_F(DicomSegmentation, ThePlacesOfSlicesAreChecked) {
  DicomSegments segments;
  DicomOptions options;
  options.states_spacing = false;
  const auto refusal = [&](int slices, double spacing_mm) {
    segments.size = {8, 8, slices};
    segments.lps_from_index.linear() = Vec3d(1, 1, spacing_mm).asDiagonal();
    segments.segments = {{"All", std::vector<std::uint8_t>(static_cast<std::size_t>(64 * slices), 1)}};
    return Refusal([&] { (void)ReadLabelMap(WriteDicom(segments, options)); });
  };
  EXPECT_EQ(refusal(3, 100), "");
  const std::string wide = refusal(3, 150), single = refusal(1, 2);
  EXPECT_NE(wide.find("are 150 mm apart by ImagePositionPatient (0020,0032); valid: 0.01 to 100 mm"), std::string::npos)
      << wide;
  EXPECT_NE(single.find("all its frames lie in one slice by ImagePositionPatient (0020,0032); valid: 2 to 4096 slices"),
            std::string::npos)
      << single;
}

TEST_F(DicomSegmentation, AValueMayBeginAsAnItemDoes) {
  // Without types (VR) bytes do not tell a value from a sequence.
  const std::string item("\xfe\xff\x00\xe0\xf0\xff\xff\x7f", 8), text = "What is derived";
  EXPECT_EQ(
      RefusalOf(
          [&](DcmDataset* d) { EXPECT_TRUE(d->putAndInsertString(DCM_DerivationDescription, text.c_str()).good()); },
          EXS_LittleEndianImplicit),
      "");
  std::ifstream in(folder_ / "y.dcm", std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(in), {}};
  const std::size_t text_at = bytes.find(text), pixels_at = bytes.find(std::string("\xe0\x7f\x10\x00", 4));
  ASSERT_NE(text_at, std::string::npos);
  ASSERT_NE(pixels_at, std::string::npos);
  bytes.replace(text_at, item.size(), item);
  bytes.replace(pixels_at + 8, item.size(), item);
  EXPECT_EQ(Refusal([&] { (void)ReadLabelMap(Write("z.dcm", bytes)); }), "");
  // A sequence must hold items.
  const std::size_t segments_at = bytes.find(std::string("\x62\x00\x02\x00", 4));
  ASSERT_NE(segments_at, std::string::npos);
  bytes.replace(segments_at + 4, 4, "\x20\x00\x00\x00", 4);
  bytes.replace(segments_at + 8, item.size(), item);
  const std::string refusal = Refusal([&] { (void)ReadLabelMap(Write("z.dcm", bytes)); });
  EXPECT_NE(refusal.find("valid: an item (fffe,e000) within its sequence"), std::string::npos) << refusal;
}

TEST_F(DicomSegmentation, CutOrEndlessFilesAreRefused) {
  WriteDicom(SegmentsOf(Phantom(Mat3d::Identity())));
  std::ifstream in(folder_ / "x.dcm", std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  for (std::size_t length = 132; length < bytes.size(); length += 1 + length / 97) {
    const fs::path file = Write("cut.dcm", bytes.substr(0, length));
    const std::string refusal = Refusal([&] { (void)ReadLabelMap(file); });
    EXPECT_NE(refusal, "") << length;
    EXPECT_EQ(refusal.find('\n'), std::string::npos) << refusal;
  }
  // DCMTK alone would overflow its stack.
  const std::size_t data_at = bytes.find(std::string("\x08\x00\x05\x00", 4)) != std::string::npos
                                  ? bytes.find(std::string("\x08\x00\x05\x00", 4))
                                  : bytes.find(std::string("\x08\x00\x08\x00", 4));
  ASSERT_NE(data_at, std::string::npos);
  std::string deep = bytes.substr(0, data_at);
  for (int level = 0; level < 100000; ++level) {
    deep += std::string("\x08\x00\x40\x11SQ\0\0\xff\xff\xff\xff\xfe\xff\x00\xe0\xff\xff\xff\xff", 20);
  }
  EXPECT_NE(Refusal([&] { (void)ReadLabelMap(Write("deep.dcm", deep)); }).find("at most 32 levels"), std::string::npos);
  std::string wide = bytes.substr(0, data_at) + std::string("\x08\x00\x40\x11SQ\0\0\xff\xff\xff\xff", 12);
  for (int item = 0; item < 4000001; ++item) wide += std::string("\xfe\xff\x00\xe0\x00\x00\x00\x00", 8);
  EXPECT_NE(Refusal([&] { (void)ReadLabelMap(Write("wide.dcm", wide)); }).find("more than 4000000 elements"),
            std::string::npos);
}

TEST_F(DicomSegmentation, OfAFolderTheFileIsNamed) {
  fs::create_directories(folder_ / "export");
  std::ofstream(folder_ / "export" / "notes.txt") << "none";
  const auto refusals = [&] {
    return Refusal([&] { (void)SuggestLabelUses(folder_ / "export"); }) + " | " +
           Refusal([&] { (void)ReadLabelMap(folder_ / "export"); });
  };
  EXPECT_NE(refusals().find("Give one file: a DICOM segmentation or a NIfTI"), std::string::npos) << refusals();
  EXPECT_NE(RefusalOf([](DcmDataset* d) { (void)d->putAndInsertString(DCM_SOPClassUID, UID_CTImageStorage); }), "");
  fs::rename(folder_ / "y.dcm", folder_ / "export" / "IM0001");
  EXPECT_NE(refusals().find("holds DICOM files, but no segmentation"), std::string::npos) << refusals();
  fs::rename(folder_ / "x.dcm", folder_ / "export" / "IM0002");
  const std::string named = "Give the one file of the segmentation: " + (folder_ / "export" / "IM0002").string();
  EXPECT_NE(refusals().find(named), refusals().rfind(named)) << refusals();
  EXPECT_NE(refusals().find(named), std::string::npos) << refusals();
}

TEST_F(DicomSegmentation, NamesOfSegmentsAreSuggested) {
  DicomSegments segments;
  segments.size = {6, 6, 6};
  for (const char* name : {"Rectum, distal", "A name with more than thirty-one letters", "../..", "Rectum, distal",
                           "A name with more than thirty-one letters", "A name with more than thirty-one letters"}) {
    segments.segments.push_back({name, std::vector<std::uint8_t>(216, 1)});
  }
  // Content decides, not the name of the file.
  WriteDicomSegmentation(folder_ / "labels.nii.gz", segments);
  const std::string suggested = SuggestLabelUses(folder_ / "labels.nii.gz");
  EXPECT_NE(suggested.find("{label: 1, name: Rectum__distal,"), std::string::npos) << suggested;
  EXPECT_NE(suggested.find("{label: 3, name: label3,"), std::string::npos) << suggested;
  EXPECT_NE(suggested.find("# 0.216 ml, of it 0.216 in segments with higher numbers"), std::string::npos) << suggested;
  EXPECT_NE(suggested.find("# 0.216 ml\n"), std::string::npos) << "nothing covers the last one";
  std::ofstream(folder_ / "labels.yaml") << suggested;
  EXPECT_EQ(ReadLabelUses(folder_ / "labels.yaml").uses.size(), 6u) << suggested;
}

TEST_F(DicomSegmentation, ASegmentationBecomesAScene) {
  const Eigen::Affine3d W = Around(Vec3d(3, 3, 4).asDiagonal(), {32, 32, 32});
  LabelMap map = Fill({32, 32, 32}, W, [](const Vec3d& p) {
    if (std::hypot(p.x(), p.z()) < 15 && std::abs(p.y()) < 44) return 2;
    return (p - Vec3d(30, 10, 0)).norm() < 14 ? 3 : 0;  // To the left.
  });
  DicomSegments segments = SegmentsOf(map);
  segments.segments[0] = {"Body", std::vector<std::uint8_t>(map.labels.size(), 1)};
  segments.segments[1].name = "Rectum & more";
  // Numbers that cover the organ, one used and one not.
  for (std::size_t v = 0; v < map.labels.size(); v += 7) {
    if (map.labels[v] == 2) segments.segments[2].voxels[v] = 1;
  }
  segments.segments.push_back({"Body", std::vector<std::uint8_t>(map.labels.size(), 1)});
  const fs::path file = WriteDicom(segments);
  std::ofstream(folder_ / "labels.yaml")
      << "labels:\n  - {label: 2, name: rectum, organ: true}\n  - {label: 3, name: ball, role: other}\n";
  std::string said;
  const auto reports = ImportAnatomyFiles({"patient", file, folder_ / "labels.yaml", folder_ / "patient"},
                                          [&](const std::string& line) { said += line + "\n"; });
  ASSERT_EQ(reports.size(), 2u);
  EXPECT_NE(said.find("segment 2 (Rectum & more): "), std::string::npos) << said;
  std::ifstream page(folder_ / "patient" / "report.html");
  const std::string html{std::istreambuf_iterator<char>(page), {}};
  EXPECT_NE(html.find("rectum – Rectum &amp; more"), std::string::npos) << html;
  EXPECT_NE(html.find("voxels of rectum also belong to a segment with a higher number"), std::string::npos) << html;
  const MeshFile ball = ReadMesh(folder_ / "patient" / "ball.ply");
  double left = 0;
  for (const Vec3d& p : ball.vertices) left = std::max(left, p.x());
  EXPECT_NEAR(left, 44, 4);
  std::ofstream(folder_ / "labels.yaml")
      << "labels:\n  - {label: 2, name: rectum, organ: true}\n  - {label: 4, name: body, role: other}\n";
  EXPECT_NE(Refusal([&] {
              (void)ImportAnatomyFiles({"patient", file, folder_ / "labels.yaml", folder_ / "other"}, {});
            }).find("leave that one out of the map"),
            std::string::npos);
}

}  // namespace
}  // namespace fulcrum::scene
