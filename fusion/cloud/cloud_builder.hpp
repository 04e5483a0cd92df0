// Collects the points of a file: converts unit and axes and drops non-finite points, for all formats.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "fusion/cloud/read_cloud.hpp"

namespace parhelion::cloud {

/// Number types of PLY and PCD.
enum class Scalar : std::uint8_t { i8, u8, i16, u16, i32, u32, i64, u64, f32, f64 };
std::size_t size_of(Scalar scalar);
/// The number at `at`; `swap`: its byte order is reversed.
double load(const char* at, Scalar scalar, bool swap);

/// Meaning of a column of a file.
enum class Column : std::uint8_t {
  x,
  y,
  z,
  nx,
  ny,
  nz,
  red,
  green,
  blue,
  label,
  scan,
  packed_colour,
  ignored
};
constexpr std::size_t kColumnCount = 12;  ///< without `ignored`
using Record = std::array<double, kColumnCount>;

/// Looks up the column names used in PLY and PCD files.
Column column_named(std::string_view name);

/// The map from file axes to REP-103, unit included.
Eigen::Matrix3d file_to_scanner(ScanFormat format, const ReadOptions& options);

class CloudBuilder {
 public:
  CloudBuilder(std::string name, ScanFormat format, const ReadOptions& options);

  /// The file has this column. Colours of another type than u8 are scaled: u16 / 257, floats * 255.
  void declare(Column column, Scalar scalar = Scalar::f64);
  bool has(Column column) const { return has_[static_cast<std::size_t>(column)]; }

  /// Reserves memory for `points` after checking the available memory; the reader has checked that the file
  /// can hold them. `extra_bytes` are needed in addition. Error: not enough memory.
  Status reserve(std::uint64_t points, std::uint64_t extra_bytes = 0);

  void add(const Record& record);
  void add_viewpoint(const Eigen::Vector3d& file_point);
  void note(std::string text) { scan_.notes.push_back(std::move(text)); }

  /// Checks the whole cloud. Error: no finite point.
  Result<ScanFile> finish();

  std::size_t viewpoints() const { return scan_.cloud.viewpoints.size(); }
  const std::string& name() const { return scan_.name; }

 private:
  void add_attributes(const Record& record);
  void drop_unfit_columns();
  /// Many sensors write a beam that returned nothing as a point in the sensor itself.
  void drop_missing_returns();
  void note_suspected_unit();

  ScanFile scan_;
  Eigen::Matrix3d file_to_scanner_, axes_;
  std::array<bool, kColumnCount + 1> has_{};
  double colour_scale_ = 1;
  bool normals_ = false, colours_ = false;
  bool labels_fit_ = true, scans_fit_ = true;
  std::uint64_t memory_, work_per_point_;
};

// One parser per format, for the whole content of a file.
Result<ScanFile> parse_ply(std::string_view bytes, CloudBuilder builder);
Result<ScanFile> parse_pcd(std::string_view bytes, CloudBuilder builder);
Result<ScanFile> parse_las(std::string_view bytes, CloudBuilder builder);
Result<ScanFile> parse_octree(std::string_view bytes, CloudBuilder builder);
Result<ScanFile> parse_xyz(std::string_view bytes, CloudBuilder builder, bool uos);

}  // namespace parhelion::cloud
