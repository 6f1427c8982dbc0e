#include "services/scene/anatomy/dicom_segmentation.h"

// DCMTK wants this one first.
#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcdeftag.h>
#include <dcmtk/dcmdata/dcfcache.h>
#include <dcmtk/dcmdata/dcfilefo.h>
#include <dcmtk/dcmdata/dcsequen.h>
#include <dcmtk/dcmdata/dcspchrs.h>
#include <dcmtk/dcmdata/dcuid.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "services/base/core/error.h"
#include "services/scene/anatomy/dicom_elements.h"
#include "services/scene/anatomy/dicom_outline.h"

namespace fulcrum::scene {
namespace {

namespace fs = std::filesystem;

constexpr double kShortest_mm = 0.01, kLongest_mm = 100;  ///< Of a voxel's edge.
/// A frame may lie that much of a voxel beside its place: positions are written with as few as two decimals.
constexpr double kMostOff = 0.05;
constexpr double kSame_mm = kShortest_mm;  ///< Frames nearer to each other are of one slice.
constexpr int kMostFrames = 1'000'000;

void RefuseOtherClass(const fs::path& file, const std::string& uid) {
  if (uid == UID_SegmentationStorage) return;
  const char* known = dcmFindNameOfUID(uid.c_str());
  // Newer than DCMTK 3.6.7.
  const std::string name = uid == "1.2.840.10008.5.1.4.1.1.66.7" ? "LabelMapSegmentationStorage"
                           : known != nullptr                    ? known
                                                                 : "";
  throw InputError(file.string() + ": is a DICOM file of another kind: SOPClassUID (0008,0016) is '" + uid + "'" +
                   (name.empty() ? "" : " (" + name + ")") +
                   "; valid: " UID_SegmentationStorage
                   " (SegmentationStorage). Give the file of the segmentation, exported as binary segmentation: not "
                   "the images that it belongs to, not an RT Structure Set");
}

struct Frame {
  int segment = 0;
  Vec3d corner = Vec3d::Zero();  ///< Centre of the first voxel, LPS [mm].
  double along = 0;              ///< Of the corner along the normal [mm].
  int slice = 0;
};

/// Directions in which i and j grow, LPS.
struct Axes {
  Vec3d row = Vec3d::Zero(), column = Vec3d::Zero();
};

/// Of voxels [mm].
struct Spacing {
  double along_row = 0, along_column = 0;
  std::optional<double> between_slices;
};

/// Functional groups of one frame, or shared by all.
struct Groups {
  std::optional<int> segment;
  std::optional<Vec3d> corner;  ///< LPS [mm]
  std::optional<Axes> axes;
  std::optional<Spacing> spacing;
};

class Reader : private DicomElements {
 public:
  explicit Reader(const fs::path& file) : DicomElements(file) {
    OFLog::configure(OFLogger::OFF_LOG_LEVEL);  // Its messages would go to standard error.
    const OFCondition read = file_.loadFile(OFFilename(file.c_str()), EXS_Unknown, EGL_noChange);
    if (read.bad()) Refuse(std::string("cannot be read as DICOM: ") + read.text() + "; export it again");
    data_ = file_.getDataset();
  }

  LabelMap Read(const std::set<int>& wanted) {
    CheckClass();
    ReadPixelFormat();
    ReadSegments();
    ReadFrames();
    CheckPixelBytes();
    PlaceSlices();
    FillVoxels(wanted);
    return std::move(map_);
  }

 private:
  static std::string Place(std::size_t frame) { return "frame " + std::to_string(frame + 1); }

  void CheckClass() const {
    OFString uid;
    (void)data_->findAndGetOFString(DCM_SOPClassUID, uid);
    RefuseOtherClass(path(), Printable(uid));
    // A part must have the first two, but need not say how many parts there are.
    const bool is_part = data_->tagExists(DCM_ConcatenationUID) || data_->tagExists(DCM_InConcatenationNumber) ||
                         data_->tagExistsWithValue(DCM_InConcatenationTotalNumber);
    const DcmTagKey key = DCM_InConcatenationTotalNumber;
    Uint16 total = 0;
    if (is_part && (data_->findAndGetUint16(key, total).bad() || total != 1)) {
      Refuse(key, "", Text(data_, key), "1: this is a part of a segmentation. Export it as one file");
    }
  }

  void ReadPixelFormat() {
    OFString type;
    (void)data_->findAndGetOFString(DCM_SegmentationType, type);
    if (type != "BINARY" && type != "FRACTIONAL") {
      Refuse(DCM_SegmentationType, "", Text(data_, DCM_SegmentationType), "BINARY or FRACTIONAL");
    }
    is_binary_ = type == "BINARY";
    const int bits = is_binary_ ? 1 : 8;
    (void)Integer(data_, DCM_SamplesPerPixel, 1, 1, "");
    (void)Integer(data_, DCM_BitsAllocated, bits, bits, "");
    (void)Integer(data_, DCM_BitsStored, bits, bits, "");
    (void)Integer(data_, DCM_HighBit, bits - 1, bits - 1, "");
    (void)Integer(data_, DCM_PixelRepresentation, 0, 0, "");
    if (!is_binary_) half_ = (Integer(data_, DCM_MaximumFractionalValue, 1, 255, "") + 1) / 2;
    map_.size[0] = Integer(data_, DCM_Columns, kLeastVoxelsAlong, kMostVoxelsAlong, "");
    map_.size[1] = Integer(data_, DCM_Rows, kLeastVoxelsAlong, kMostVoxelsAlong, "");
  }

  /// Calls `work(item, number from 0)` for each item of a sequence of the data set. Returns their number.
  template <class Work>
  std::size_t ForEachItem(const DcmTagKey& key, const Work& work) const {
    DcmSequenceOfItems* sequence = nullptr;
    if (data_->findAndGetSequence(key, sequence).bad()) return 0;
    std::size_t count = 0;
    // By its number an item is looked for from the first on.
    for (DcmObject* object = nullptr; (object = sequence->nextInContainer(object)) != nullptr; ++count) {
      work(static_cast<DcmItem*>(object), count);
    }
    return count;
  }

  void ReadSegments() {
    DcmSpecificCharacterSet characters;
    OFString set;
    (void)data_->findAndGetOFStringArray(DCM_SpecificCharacterSet, set);
    const bool converts = characters.selectCharacterSet(set).good();
    ForEachItem(DCM_SegmentSequence, [&](DcmItem* item, std::size_t at) {
      const std::string where = "item " + std::to_string(at + 1) + " of SegmentSequence";
      Segment segment;
      segment.number = Integer(item, DCM_SegmentNumber, 1, kMostLabel, where);
      OFString name, converted;
      (void)item->findAndGetOFString(DCM_SegmentLabel, name);
      const bool is_converted = converts && characters.convertString(name, converted).good();
      segment.name = Printable(is_converted ? converted : name);
      map_.segments.push_back(segment);
    });
    if (map_.segments.empty()) Refuse("SegmentSequence (0062,0002) is missing or empty; valid: an item per segment");
    std::sort(map_.segments.begin(), map_.segments.end(),
              [](const Segment& a, const Segment& b) { return a.number < b.number; });
    segment_of_.assign(kMostLabel + 1, -1);
    for (std::size_t s = 0; s < map_.segments.size(); ++s) {
      int& at = segment_of_[static_cast<std::size_t>(map_.segments[s].number)];
      if (at >= 0) {
        Refuse(DCM_SegmentNumber, "", std::to_string(map_.segments[s].number) + " twice", "each number once");
      }
      at = static_cast<int>(s);
    }
  }

  /// What the functional groups of an item say; each may be missing.
  Groups ReadGroups(DcmItem* item, const std::string& where) const {
    const auto find = [&](const DcmTagKey& key) {
      DcmItem* group = nullptr;
      return item->findAndGetSequenceItem(key, group).good() ? group : nullptr;
    };
    Groups groups;
    if (DcmItem* group = find(DCM_SegmentIdentificationSequence)) {
      groups.segment = Integer(group, DCM_ReferencedSegmentNumber, 1, kMostLabel, where);
    }
    if (DcmItem* group = find(DCM_PlanePositionSequence)) {
      groups.corner = Numbers<3>(group, DCM_ImagePositionPatient, where);
    }
    if (DcmItem* group = find(DCM_PlaneOrientationSequence)) groups.axes = ReadAxes(group, where);
    if (DcmItem* group = find(DCM_PixelMeasuresSequence)) groups.spacing = ReadSpacing(group, where);
    return groups;
  }

  Axes ReadAxes(DcmItem* group, const std::string& where) const {
    const auto numbers = Numbers<6>(group, DCM_ImageOrientationPatient, where);
    Axes axes{numbers.head<3>(), numbers.tail<3>()};
    if (std::abs(axes.row.norm() - 1) > 1e-3 || std::abs(axes.column.norm() - 1) > 1e-3 ||
        std::abs(axes.row.dot(axes.column)) > 1e-3) {
      Refuse(DCM_ImageOrientationPatient, where, Text(group, DCM_ImageOrientationPatient),
             "two directions of length 1 at a right angle");
    }
    return axes;
  }

  Spacing ReadSpacing(DcmItem* group, const std::string& where) const {
    const auto edge = [&](double length_mm, const DcmTagKey& key) {
      if (length_mm >= kShortest_mm && length_mm <= kLongest_mm) return length_mm;
      Refuse(key, where, Number(length_mm) + " mm", Number(kShortest_mm) + " to " + Number(kLongest_mm) + " mm");
    };
    const auto numbers = Numbers<2>(group, DCM_PixelSpacing, where);
    Spacing spacing;
    spacing.along_column = edge(numbers[0], DCM_PixelSpacing);
    spacing.along_row = edge(numbers[1], DCM_PixelSpacing);
    if (group->tagExistsWithValue(DCM_SpacingBetweenSlices)) {
      spacing.between_slices = edge(Numbers<1>(group, DCM_SpacingBetweenSlices, where)[0], DCM_SpacingBetweenSlices);
    }
    return spacing;
  }

  /// What a frame says itself, else what is said for all.
  template <class T>
  T OwnOrShared(const std::optional<T>& own, const std::optional<T>& shared, const DcmTagKey& key,
                std::size_t at) const {
    if (own) return *own;
    if (shared) return *shared;
    Refuse(Place(at) + " has no " + NameOf(key) +
           "; valid: one in PerFrameFunctionalGroupsSequence or SharedFunctionalGroupsSequence. Without it the place "
           "in the patient is not known");
  }

  void CheckSamePlane(const Axes& axes, const Spacing& spacing, std::size_t at) const {
    const auto differs = [](double a, double b) { return std::abs(a - b) > 1e-3 * b; };
    const bool is_turned = (axes.row - axes_.row).norm() > 1e-3 || (axes.column - axes_.column).norm() > 1e-3;
    const bool is_scaled = differs(spacing.along_row, spacing_.along_row) ||
                           differs(spacing.along_column, spacing_.along_column) ||
                           spacing.between_slices.has_value() != spacing_.between_slices.has_value() ||
                           (spacing_.between_slices && differs(*spacing.between_slices, *spacing_.between_slices));
    if (is_turned || is_scaled) {
      Refuse(Place(at) + " has another " + (is_turned ? "ImageOrientationPatient (0020,0037)" : "spacing of voxels") +
             " than frame 1; valid: one grid for all. Resample the segmentation to one volume, as 3D Slicer does");
    }
  }

  void ReadFrames() {
    const int count = Integer(data_, DCM_NumberOfFrames, 1, kMostFrames, "");
    // Once: the shared item may be long.
    DcmItem* for_all = nullptr;
    Groups shared;
    if (data_->findAndGetSequenceItem(DCM_SharedFunctionalGroupsSequence, for_all).good() && for_all != nullptr) {
      shared = ReadGroups(for_all, "SharedFunctionalGroupsSequence");
    }
    const std::size_t items = ForEachItem(DCM_PerFrameFunctionalGroupsSequence, [&](DcmItem* item, std::size_t at) {
      if (at >= static_cast<std::size_t>(count)) return;
      const Groups own = ReadGroups(item, Place(at));
      Frame frame;
      frame.segment = OwnOrShared(own.segment, shared.segment, DCM_SegmentIdentificationSequence, at);
      if (segment_of_[static_cast<std::size_t>(frame.segment)] < 0) {
        Refuse(DCM_ReferencedSegmentNumber, Place(at), std::to_string(frame.segment), "a number of SegmentSequence");
      }
      frame.corner = OwnOrShared(own.corner, shared.corner, DCM_PlanePositionSequence, at);
      const Axes axes = OwnOrShared(own.axes, shared.axes, DCM_PlaneOrientationSequence, at);
      const Spacing spacing = OwnOrShared(own.spacing, shared.spacing, DCM_PixelMeasuresSequence, at);
      if (at == 0) {
        axes_ = axes;
        spacing_ = spacing;
      }
      CheckSamePlane(axes, spacing, at);
      frames_.push_back(frame);
    });
    if (items != static_cast<std::size_t>(count)) {
      Refuse(DCM_NumberOfFrames, "", std::to_string(count),
             "that of the items of " + NameOf(DCM_PerFrameFunctionalGroupsSequence) + ", " + std::to_string(items) +
                 ". The file is damaged; export it again");
    }
  }

  void CheckPixelBytes() {
    const auto voxels = static_cast<std::uint64_t>(map_.size[0]) * static_cast<std::uint64_t>(map_.size[1]);
    const std::uint64_t bits = frames_.size() * voxels * (is_binary_ ? 1 : 8);
    const std::uint64_t bytes = (bits + 7) / 8;
    const bool is_there = data_->findAndGetElement(DCM_PixelData, pixels_).good();
    const std::uint64_t length = is_there ? pixels_->getLengthField() : 0;
    // Padded to an even number.
    if (length != bytes && length != bytes + bytes % 2) {
      Refuse("PixelData (7fe0,0010) has " + std::to_string(length) + " bytes; valid: " + std::to_string(bytes) +
             " for " + std::to_string(frames_.size()) + " frames of " + std::to_string(map_.size[0]) + " x " +
             std::to_string(map_.size[1]) + " voxels of " + (is_binary_ ? "1 bit" : "8 bits") +
             ". The file is damaged; export it again");
    }
  }

  /// Gives each frame its slice, and the map its size and place.
  void PlaceSlices() {
    const Vec3d normal = axes_.row.cross(axes_.column).normalized();
    for (Frame& frame : frames_) frame.along = frame.corner.dot(normal);
    std::vector<std::size_t> order(frames_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return frames_[a].along < frames_[b].along; });
    const double step = Step(order), first = frames_[order.front()].along;
    const Vec3d origin = frames_[order.front()].corner;
    for (std::size_t f = 0; f < frames_.size(); ++f) {
      Frame& frame = frames_[f];
      if (std::abs(frame.along - first - step * frame.slice) > kMostOff * step) RefuseSpacing(f, step);
      const Vec3d off = frame.corner - origin;
      const double i = off.dot(axes_.row) / spacing_.along_row, j = off.dot(axes_.column) / spacing_.along_column;
      if (std::max(std::abs(i), std::abs(j)) > kMostOff) {
        Refuse(Place(f) + " lies " + Number(i) + " columns and " + Number(j) +
               " rows beside the others: ImagePositionPatient (0020,0032) is off the normal. Valid: slices behind each "
               "other. Images of a tilted gantry: resample the segmentation to a straight volume, as 3D Slicer does");
      }
    }
    const auto voxels = static_cast<std::size_t>(map_.size[0]) * static_cast<std::size_t>(map_.size[1]) *
                        static_cast<std::size_t>(map_.size[2]);
    if (voxels > kMostVoxels) {
      Refuse("is " + std::to_string(map_.size[0]) + " x " + std::to_string(map_.size[1]) + " x " +
             std::to_string(map_.size[2]) + " voxels; valid: at most " + std::to_string(kMostVoxels) +
             ". Crop or resample the segmentation");
    }
    // Left, posterior, superior become left, cranial, anterior: a rotation, so left stays left.
    Mat3d W_from_lps;
    W_from_lps << 1, 0, 0, 0, 0, 1, 0, -1, 0;
    Mat3d axes;
    axes << axes_.row * spacing_.along_row, axes_.column * spacing_.along_column, normal * step;
    map_.W_from_index.linear() = W_from_lps * axes;
    map_.W_from_index.translation() = W_from_lps * origin;
  }

  [[noreturn]] void RefuseSpacing(std::size_t frame, double step) const {
    Refuse(Place(frame) + ": ImagePositionPatient (0020,0032) is " + Number(frames_[frame].along) +
           " mm along the normal, between slices of " + Number(step) +
           " mm; valid: equal steps. Resample the segmentation to equal slices, as 3D Slicer does" +
           (spacing_.between_slices ? "" : ", or let it state SpacingBetweenSlices (0018,0088)"));
  }

  /// The distance of slices [mm], from frames in their order along the normal; sets their slices and the map's depth.
  double Step(const std::vector<std::size_t>& order) {
    const auto gap_before = [&](std::size_t n) { return frames_[order[n]].along - frames_[order[n - 1]].along; };
    const std::string slices = std::to_string(kLeastVoxelsAlong) + " to " + std::to_string(kMostVoxelsAlong) +
                               " slices. Give the segmentation of a volume";
    std::optional<double> least_gap;
    for (std::size_t n = 1; n < order.size(); ++n) {
      const double gap = gap_before(n);
      if (gap > kSame_mm && (!least_gap || gap < *least_gap)) least_gap = gap;
    }
    if (!least_gap) {
      Refuse("all its frames lie in one slice by ImagePositionPatient (0020,0032); valid: " + slices);
    }
    if (!spacing_.between_slices && *least_gap > kLongest_mm) {
      Refuse("its slices are " + Number(*least_gap) +
             " mm apart by ImagePositionPatient (0020,0032); valid: " + Number(kShortest_mm) + " to " +
             Number(kLongest_mm) + " mm. Resample the segmentation to a finer volume, as 3D Slicer does");
    }
    const double step = spacing_.between_slices.value_or(*least_gap);
    const double depth = frames_[order.back()].along - frames_[order.front()].along;
    double slice = 0;
    for (std::size_t n = 1; n < order.size(); ++n) {
      const double gap = gap_before(n);
      if (gap > kSame_mm) {
        const double steps = std::round(gap / step);
        if (steps < 1 || std::abs(gap - steps * step) > 2 * kMostOff * step) RefuseSpacing(order[n], step);
        slice += steps;
      }
      if (slice >= kMostVoxelsAlong) {
        Refuse("its frames span " + Number(depth) +
               " mm by ImagePositionPatient (0020,0032): " + Number(std::round(depth / step) + 1) + " slices of " +
               Number(step) + " mm; valid: " + slices + ", cropped to its organs");
      }
      frames_[order[n]].slice = static_cast<int>(slice);
    }
    map_.size[2] = static_cast<int>(slice) + 1;
    // Rounding of two positions does not add up over all.
    return depth / slice;
  }

  void FillVoxels(const std::set<int>& wanted) {
    const auto in_slice = static_cast<std::size_t>(map_.size[0]) * static_cast<std::size_t>(map_.size[1]);
    std::vector<std::size_t> order(frames_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    const auto key = [&](std::size_t f) { return std::pair(frames_[f].segment, frames_[f].slice); };
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return key(a) < key(b); });
    for (std::size_t n = 1; n < order.size(); ++n) {
      if (key(order[n]) == key(order[n - 1])) {
        Refuse(Place(order[n - 1]) + " and " + Place(order[n]) + " are both of segment " +
               std::to_string(frames_[order[n]].segment) +
               " in one slice; valid: one of each. Export the segmentation of one time only");
      }
    }
    map_.labels.assign(in_slice * static_cast<std::size_t>(map_.size[2]), 0);
    DcmFileCache cache;
    std::vector<std::uint8_t> bytes;
    for (const std::size_t f : order) {
      const Frame& frame = frames_[f];
      if (!wanted.empty() && !wanted.contains(frame.segment)) continue;
      // Frames of single bits follow each other without padding.
      const std::size_t bits = is_binary_ ? 1 : 8, first = f * in_slice * bits, end = first + in_slice * bits;
      bytes.resize((end + 7) / 8 - first / 8);
      if (pixels_
              ->getPartialValue(bytes.data(), static_cast<Uint32>(first / 8), static_cast<Uint32>(bytes.size()), &cache,
                                EBO_LittleEndian)
              .bad()) {
        Refuse(Place(f) + ": its part of PixelData (7fe0,0010) cannot be read; export the file again");
      }
      Segment& segment = map_.segments[static_cast<std::size_t>(segment_of_[static_cast<std::size_t>(frame.segment)])];
      std::uint16_t* labels = map_.labels.data() + in_slice * static_cast<std::size_t>(frame.slice);
      for (std::size_t v = 0; v < in_slice; ++v) {
        const std::size_t bit = first % 8 + v;
        const bool is_set = is_binary_ ? (bytes[bit / 8] >> (bit % 8) & 1) != 0 : bytes[v] >= half_;
        if (!is_set) continue;
        ++segment.voxels;
        if (labels[v] != 0) ++map_.segments[static_cast<std::size_t>(segment_of_[labels[v]])].covered;
        labels[v] = static_cast<std::uint16_t>(frame.segment);
      }
    }
  }

  DcmFileFormat file_;
  DcmDataset* data_ = nullptr;
  DcmElement* pixels_ = nullptr;
  bool is_binary_ = true;
  int half_ = 1;                 ///< Least value that is labelled.
  std::vector<int> segment_of_;  ///< Of each number its place in the map's list; -1: none.
  std::vector<Frame> frames_;
  Axes axes_;
  Spacing spacing_;
  LabelMap map_;
};

}  // namespace

LabelMap ReadDicomSegmentation(const fs::path& file, const std::set<int>& wanted) {
  // Before anything else: images may be compressed.
  const std::string kind = DicomClass(file);
  if (!kind.empty()) RefuseOtherClass(file, kind);
  CheckDicomOutline(file);
  return Reader(file).Read(wanted);
}

std::string DicomFolderAdvice(const fs::path& folder) {
  constexpr int kMostFiles = 5000;
  int files = 0, of_dicom = 0;
  std::string first;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error); !error && entry != fs::directory_iterator();
       entry.increment(error)) {
    if (++files > kMostFiles) break;
    if (!entry->is_regular_file(error)) continue;
    const std::string kind = DicomClass(entry->path());
    of_dicom += kind.empty() ? 0 : 1;
    const std::string name = entry->path().string();
    if (kind == UID_SegmentationStorage && (first.empty() || name < first)) first = name;
  }
  if (!first.empty()) return "Give the one file of the segmentation: " + first;
  return of_dicom > 0 ? "It holds DICOM files, but no segmentation (SOP class " UID_SegmentationStorage
                        "); give the file of the segmentation, which a program exports apart from the images"
                      : "Give one file: a DICOM segmentation or a NIfTI label map";
}

}  // namespace fulcrum::scene
