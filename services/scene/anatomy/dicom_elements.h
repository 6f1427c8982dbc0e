// Values of DICOM elements, checked, and the refusals that name them. Internal to services/scene/anatomy.
#pragma once

// DCMTK wants this one first.
#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcitem.h>
#include <dcmtk/dcmdata/dctagkey.h>

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <utility>

namespace fulcrum::scene {

/// Throws InputError "file: where: element is value; valid". `where`: of several such elements which one; may be empty.
class DicomElements {
 public:
  explicit DicomElements(std::filesystem::path file) : path_(std::move(file)) {}

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[noreturn]] void Refuse(const std::string& reason) const;
  [[noreturn]] void Refuse(const DcmTagKey& key, const std::string& where, const std::string& value,
                           const std::string& valid) const;

  /// One line of printable UTF-8, at most 64 bytes.
  static std::string Printable(const OFString& value);
  /// "Rows (0028,0010)"
  static std::string NameOf(const DcmTagKey& key);
  /// As %.6g.
  static std::string Number(double value);
  /// The value in quotes, or "missing".
  static std::string Text(DcmItem* item, const DcmTagKey& key);
  /// One of `low` to `high`.
  int Integer(DcmItem* item, const DcmTagKey& key, int low, int high, const std::string& where) const;
  /// Just so many, up to 1e6.
  template <int kCount>
  Eigen::Matrix<double, kCount, 1> Numbers(DcmItem* item, const DcmTagKey& key, const std::string& where) const {
    Eigen::Matrix<double, kCount, 1> numbers;
    ReadNumbers(item, key, where, kCount, numbers.data());
    return numbers;
  }

 private:
  void ReadNumbers(DcmItem* item, const DcmTagKey& key, const std::string& where, unsigned count,
                   double* numbers) const;

  const std::filesystem::path path_;
};

}  // namespace fulcrum::scene
