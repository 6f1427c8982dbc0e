#include "services/scene/anatomy/dicom_segmentation.h"

// DCMTK wants this one first.
#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcdeftag.h>
#include <dcmtk/dcmdata/dcfcache.h>
#include <dcmtk/dcmdata/dcfilefo.h>
#include <dcmtk/dcmdata/dcsequen.h>
#include <dcmtk/dcmdata/dcspchrs.h>
#include <dcmtk/dcmdata/dctag.h>
#include <dcmtk/dcmdata/dcuid.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <optional>

#include "services/base/core/error.h"
#include "services/base/core/utf8.h"
#include "services/scene/anatomy/dicom_outline.h"

namespace fulcrum::scene {
namespace {

namespace fs = std::filesystem;

constexpr double kShortest_mm = 0.01, kLongest_mm = 100;  ///< Of a voxel's edge.
/// A frame may lie that much of a voxel beside its place: positions are written with as few as two decimals.
constexpr double kMostOff = 0.05;
constexpr double kSame_mm = kShortest_mm;  ///< Frames nearer to each other are of one slice.
constexpr int kMostFrames = 1'000'000;

/// One line of printable UTF-8, at most 64 bytes.
std::string Printable(const OFString& value) {
  const std::string text(value.data(), value.size());
  std::string line;
  for (std::size_t at = 0; at < text.size() && line.size() < 61;) {
    const std::size_t length = Utf8Length(text, at);
    const bool is_plain = length > 0 && static_cast<unsigned char>(text[at]) >= ' ' && text[at] != 0x7f;
    line += is_plain ? text.substr(at, length) : "?";
    at += std::max<std::size_t>(length, 1);
  }
  return line;
}

std::string NameOf(const DcmTagKey& key) {
  DcmTag tag(key);
  return std::string(tag.getTagName()) + " " + key.toString().c_str();
}

std::string Number(double value) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.6g", value);
  return text;
}

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

/// The axes and the spacing of a frame.
struct Plane {
  Vec3d row = Vec3d::Zero(), column = Vec3d::Zero();  ///< Directions in which i and j grow, LPS.
  double along_row = 0, along_column = 0;             ///< Spacing of voxels [mm].
  std::optional<double> between_slices;               ///< [mm]
};

class Reader {
 public:
  explicit Reader(const fs::path& file) : path_(file) {
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
  [[noreturn]] void Refuse(const std::string& reason) const { throw InputError(path_.string() + ": " + reason); }
  [[noreturn]] void Refuse(const DcmTagKey& key, const std::string& where, const std::string& value,
                           const std::string& valid) const {
    Refuse(where + (where.empty() ? "" : ": ") + NameOf(key) + " is " + value + "; valid: " + valid);
  }
  static std::string Place(std::size_t frame) { return "frame " + std::to_string(frame + 1); }

  static std::string Text(DcmItem* item, const DcmTagKey& key) {
    OFString value;
    if (item->findAndGetOFStringArray(key, value).bad()) return "missing";
    return "'" + Printable(value) + "'";
  }

  int Integer(DcmItem* item, const DcmTagKey& key, int low, int high, const std::string& where) const {
    Uint16 unsigned_value = 0;
    Sint32 value = -1;
    // US, then IS.
    const bool is_read = item->findAndGetUint16(key, unsigned_value).good();
    if (is_read) value = unsigned_value;
    if ((!is_read && item->findAndGetSint32(key, value).bad()) || value < low || value > high) {
      Refuse(key, where, Text(item, key), std::to_string(low) + (low < high ? " to " + std::to_string(high) : ""));
    }
    return static_cast<int>(value);
  }

  template <int kCount>
  Eigen::Matrix<double, kCount, 1> Numbers(DcmItem* item, const DcmTagKey& key, const std::string& where) const {
    Eigen::Matrix<double, kCount, 1> numbers;
    DcmElement* element = nullptr;
    bool is_read = item->findAndGetElement(key, element).good() && element->getVM() == kCount;
    for (int i = 0; i < kCount && is_read; ++i) {
      is_read = element->getFloat64(numbers[i], static_cast<unsigned long>(i)).good() && std::abs(numbers[i]) <= 1e6;
    }
    if (!is_read) {
      Refuse(key, where, Text(item, key),
             std::to_string(kCount) + (kCount == 1 ? " number" : " numbers") + " up to 1e6");
    }
    return numbers;
  }

  void CheckClass() const {
    OFString uid;
    (void)data_->findAndGetOFString(DCM_SOPClassUID, uid);
    RefuseOtherClass(path_, Printable(uid));
    if (data_->tagExistsWithValue(DCM_InConcatenationTotalNumber)) {
      const DcmTagKey key = DCM_InConcatenationTotalNumber;
      if (Integer(data_, key, 1, 65535, "") > 1) {
        Refuse(key, "", Text(data_, key), "1: this is a part of a segmentation. Export it as one file");
      }
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

  /// The item of a functional group, of the frame or shared.
  DcmItem* Group(DcmItem* frame, DcmItem* shared, const DcmTagKey& key, std::size_t at) const {
    DcmItem* group = nullptr;
    if (frame->findAndGetSequenceItem(key, group).good() && group != nullptr) return group;
    if (shared != nullptr && shared->findAndGetSequenceItem(key, group).good() && group != nullptr) return group;
    Refuse(Place(at) + " has no " + NameOf(key) +
           "; valid: one in PerFrameFunctionalGroupsSequence or SharedFunctionalGroupsSequence. Without it the place "
           "in the patient is not known");
  }

  Plane ReadPlane(DcmItem* frame, DcmItem* shared, std::size_t at) const {
    Plane plane;
    const auto axes =
        Numbers<6>(Group(frame, shared, DCM_PlaneOrientationSequence, at), DCM_ImageOrientationPatient, Place(at));
    plane.row = axes.head<3>();
    plane.column = axes.tail<3>();
    if (std::abs(plane.row.norm() - 1) > 1e-3 || std::abs(plane.column.norm() - 1) > 1e-3 ||
        std::abs(plane.row.dot(plane.column)) > 1e-3) {
      Refuse(DCM_ImageOrientationPatient, Place(at),
             Text(Group(frame, shared, DCM_PlaneOrientationSequence, at), DCM_ImageOrientationPatient),
             "two directions of length 1 at a right angle");
    }
    DcmItem* measures = Group(frame, shared, DCM_PixelMeasuresSequence, at);
    const auto spacing = Numbers<2>(measures, DCM_PixelSpacing, Place(at));
    plane.along_column = Edge(spacing[0], DCM_PixelSpacing, at);
    plane.along_row = Edge(spacing[1], DCM_PixelSpacing, at);
    if (measures->tagExistsWithValue(DCM_SpacingBetweenSlices)) {
      plane.between_slices =
          Edge(Numbers<1>(measures, DCM_SpacingBetweenSlices, Place(at))[0], DCM_SpacingBetweenSlices, at);
    }
    return plane;
  }
  double Edge(double length_mm, const DcmTagKey& key, std::size_t at) const {
    if (length_mm >= kShortest_mm && length_mm <= kLongest_mm) return length_mm;
    Refuse(key, Place(at), Number(length_mm) + " mm", Number(kShortest_mm) + " to " + Number(kLongest_mm) + " mm");
  }

  void CheckSamePlane(const Plane& plane, std::size_t at) const {
    const auto differs = [](double a, double b) { return std::abs(a - b) > 1e-3 * b; };
    const bool is_turned = (plane.row - plane_.row).norm() > 1e-3 || (plane.column - plane_.column).norm() > 1e-3;
    const bool is_scaled = differs(plane.along_row, plane_.along_row) ||
                           differs(plane.along_column, plane_.along_column) ||
                           plane.between_slices.has_value() != plane_.between_slices.has_value() ||
                           (plane_.between_slices && differs(*plane.between_slices, *plane_.between_slices));
    if (is_turned || is_scaled) {
      Refuse(Place(at) + " has another " + (is_turned ? "ImageOrientationPatient (0020,0037)" : "spacing of voxels") +
             " than frame 1; valid: one grid for all. Resample the segmentation to one volume, as 3D Slicer does");
    }
  }

  void ReadFrames() {
    const int count = Integer(data_, DCM_NumberOfFrames, 1, kMostFrames, "");
    DcmItem* shared = nullptr;
    (void)data_->findAndGetSequenceItem(DCM_SharedFunctionalGroupsSequence, shared);
    const std::size_t items = ForEachItem(DCM_PerFrameFunctionalGroupsSequence, [&](DcmItem* item, std::size_t at) {
      if (at >= static_cast<std::size_t>(count)) return;
      Frame frame;
      frame.segment = Integer(Group(item, shared, DCM_SegmentIdentificationSequence, at), DCM_ReferencedSegmentNumber,
                              1, kMostLabel, Place(at));
      if (segment_of_[static_cast<std::size_t>(frame.segment)] < 0) {
        Refuse(DCM_ReferencedSegmentNumber, Place(at), std::to_string(frame.segment), "a number of SegmentSequence");
      }
      frame.corner =
          Numbers<3>(Group(item, shared, DCM_PlanePositionSequence, at), DCM_ImagePositionPatient, Place(at));
      const Plane plane = ReadPlane(item, shared, at);
      if (at == 0) plane_ = plane;
      CheckSamePlane(plane, at);
      frames_.push_back(frame);
    });
    if (items != static_cast<std::size_t>(count)) {
      Refuse(DCM_NumberOfFrames, "", std::to_string(count),
             "that of the items of PerFrameFunctionalGroupsSequence, " + std::to_string(items) +
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
    const Vec3d normal = plane_.row.cross(plane_.column).normalized();
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
      const double i = off.dot(plane_.row) / plane_.along_row, j = off.dot(plane_.column) / plane_.along_column;
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
    axes << plane_.row * plane_.along_row, plane_.column * plane_.along_column, normal * step;
    map_.W_from_index.linear() = W_from_lps * axes;
    map_.W_from_index.translation() = W_from_lps * origin;
  }

  [[noreturn]] void RefuseSpacing(std::size_t frame, double step) const {
    Refuse(Place(frame) + ": ImagePositionPatient (0020,0032) is " + Number(frames_[frame].along) +
           " mm along the normal, between slices of " + Number(step) +
           " mm; valid: equal steps. Resample the segmentation to equal slices, as 3D Slicer does" +
           (plane_.between_slices ? "" : ", or let it state SpacingBetweenSlices (0018,0088)"));
  }

  /// The distance of slices [mm], from frames in their order along the normal; sets their slices and the map's depth.
  double Step(const std::vector<std::size_t>& order) {
    double step = plane_.between_slices.value_or(kLongest_mm);
    for (std::size_t n = 1; n < order.size() && !plane_.between_slices; ++n) {
      const double gap = frames_[order[n]].along - frames_[order[n - 1]].along;
      if (gap > kSame_mm) step = std::min(step, gap);
    }
    double slice = 0;
    for (std::size_t n = 1; n < order.size(); ++n) {
      const double gap = frames_[order[n]].along - frames_[order[n - 1]].along;
      if (gap > kSame_mm) {
        const double steps = std::round(gap / step);
        if (steps < 1 || std::abs(gap - steps * step) > 2 * kMostOff * step) RefuseSpacing(order[n], step);
        slice += steps;
      }
      if (slice >= kMostVoxelsAlong) break;
      frames_[order[n]].slice = static_cast<int>(slice);
    }
    if (slice + 1 < kLeastVoxelsAlong || slice + 1 > kMostVoxelsAlong) {
      const double depth = frames_[order.back()].along - frames_[order.front()].along;
      Refuse("its " + std::to_string(frames_.size()) + " frames span " + Number(depth) + " mm, in slices of " +
             Number(step) + " mm " + Number(std::floor(depth / step) + 1) +
             " of them; valid: " + std::to_string(kLeastVoxelsAlong) + " to " + std::to_string(kMostVoxelsAlong) +
             ". Give the segmentation of a volume; crop it if it is longer");
    }
    map_.size[2] = static_cast<int>(slice) + 1;
    // Rounding of two positions does not add up over all.
    return (frames_[order.back()].along - frames_[order.front()].along) / slice;
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

  const fs::path path_;
  DcmFileFormat file_;
  DcmDataset* data_ = nullptr;
  DcmElement* pixels_ = nullptr;
  bool is_binary_ = true;
  int half_ = 1;                 ///< Least value that is labelled.
  std::vector<int> segment_of_;  ///< Of each number its place in the map's list; -1: none.
  std::vector<Frame> frames_;
  Plane plane_;
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
