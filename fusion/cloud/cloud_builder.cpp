#include "fusion/cloud/cloud_builder.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <utility>

#include "protocols/available_memory.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::cloud {
namespace {

/// Error where `bytes` exceeds `available` (0: use available_memory()); it names both numbers and `what`.
Status require_memory(std::uint64_t bytes, std::uint64_t available, const std::string& what) {
  if (available == 0) available = available_memory();
  if (bytes <= available) return {};
  char figures[96];
  std::snprintf(figures, sizeof figures, " needs %.2f GB of memory, %.2f GB are available",
                static_cast<double>(bytes) / 1e9, static_cast<double>(available) / 1e9);
  return Error{what + figures + ": thin the points out, or use a machine with more"};
}

template <class Number>
double load_as(const char* at, bool swap) {
  std::array<char, sizeof(Number)> bytes;
  std::memcpy(bytes.data(), at, sizeof(Number));
  if (swap) std::reverse(bytes.begin(), bytes.end());
  return static_cast<double>(std::bit_cast<Number>(bytes));
}

double metres(LengthUnit unit) {
  switch (unit) {
    case LengthUnit::centimetre:
      return 0.01;
    case LengthUnit::millimetre:
      return 0.001;
    case LengthUnit::foot:
      return 0.3048;
    case LengthUnit::inch:
      return 0.0254;
    case LengthUnit::metre:
      break;
  }
  return 1;
}

Eigen::Matrix3d axes_to_scanner(FileAxes axes) {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  switch (axes) {
    case FileAxes::x_forward_z_up:
      break;
    case FileAxes::x_right_y_up:
      R << 0, 0, -1, -1, 0, 0, 0, 1, 0;
      break;
    case FileAxes::x_right_y_down:
      R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
      break;
    case FileAxes::x_right_y_up_mirrored:
      R << 0, 0, 1, -1, 0, 0, 0, 1, 0;
      break;
  }
  return R;
}

std::uint8_t to_byte(double value) {
  return std::isfinite(value) ? static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0, 255.0))) : 0;
}

/// A vector of unit length is kept unchanged, so that written values are read back bit for bit.
Eigen::Vector3f unit_or_zero(const Eigen::Vector3d& normal) {
  const double length = normal.norm();
  if (!std::isfinite(length) || length <= 0) return Eigen::Vector3f::Zero();
  if (std::abs(length - 1) < 1e-3) return normal.cast<float>();
  return (normal / length).cast<float>();
}

bool is_whole(double value, double max) { return value >= 0 && value <= max && value == std::floor(value); }

/// The 1st and 99th percentile of z over every k-th point, so that at most 100,000 are used.
double height_of(const std::vector<Eigen::Vector3f>& points) {
  std::vector<float> z;
  const std::size_t step = points.size() / 100'000 + 1;
  for (std::size_t i = 0; i < points.size(); i += step) z.push_back(points[i].z());
  const double high = static_cast<double>(quantile(z, 0.99)), low = static_cast<double>(quantile(z, 0.01));
  return high - low;
}

}  // namespace

std::size_t size_of(Scalar scalar) {
  static constexpr std::array<std::size_t, 10> sizes{1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
  return sizes[static_cast<std::size_t>(scalar)];
}

double load(const char* at, Scalar scalar, bool swap) {
  switch (scalar) {
    case Scalar::i8:
      return load_as<std::int8_t>(at, swap);
    case Scalar::u8:
      return load_as<std::uint8_t>(at, swap);
    case Scalar::i16:
      return load_as<std::int16_t>(at, swap);
    case Scalar::u16:
      return load_as<std::uint16_t>(at, swap);
    case Scalar::i32:
      return load_as<std::int32_t>(at, swap);
    case Scalar::u32:
      return load_as<std::uint32_t>(at, swap);
    case Scalar::i64:
      return load_as<std::int64_t>(at, swap);
    case Scalar::u64:
      return load_as<std::uint64_t>(at, swap);
    case Scalar::f32:
      return load_as<float>(at, swap);
    case Scalar::f64:
      break;
  }
  return load_as<double>(at, swap);
}

Column column_named(std::string_view name) {
  static constexpr std::pair<std::string_view, Column> names[] = {
      {"x", Column::x},
      {"y", Column::y},
      {"z", Column::z},
      {"nx", Column::nx},
      {"ny", Column::ny},
      {"nz", Column::nz},
      {"normal_x", Column::nx},
      {"normal_y", Column::ny},
      {"normal_z", Column::nz},
      {"red", Column::red},
      {"green", Column::green},
      {"blue", Column::blue},
      {"r", Column::red},
      {"g", Column::green},
      {"b", Column::blue},
      {"diffuse_red", Column::red},
      {"diffuse_green", Column::green},
      {"diffuse_blue", Column::blue},
      {"label", Column::label},
      {"scan", Column::scan},
      {"rgb", Column::packed_colour},
      {"rgba", Column::packed_colour},
  };
  for (const auto& [known, column] : names) {
    if (known == name) return column;
  }
  return Column::ignored;
}

Eigen::Matrix3d file_to_scanner(ScanFormat format, const ReadOptions& options) {
  const bool uos = format == ScanFormat::uos_3d;
  return metres(options.unit.value_or(uos ? LengthUnit::centimetre : LengthUnit::metre)) *
         axes_to_scanner(
             options.axes.value_or(uos ? FileAxes::x_right_y_up_mirrored : FileAxes::x_forward_z_up));
}

CloudBuilder::CloudBuilder(std::string name, ScanFormat format, const ReadOptions& options)
    : file_to_scanner_(cloud::file_to_scanner(format, options)),
      memory_(options.memory),
      work_per_point_(options.work_per_point) {
  scan_.name = std::move(name);
  axes_ = file_to_scanner_ / file_to_scanner_.col(2).norm();
}

void CloudBuilder::declare(Column column, Scalar scalar) {
  has_[static_cast<std::size_t>(column)] = true;
  if (column == Column::red) {
    const bool floating = scalar == Scalar::f32 || scalar == Scalar::f64;
    colour_scale_ = floating ? 255 : scalar == Scalar::u16 ? 1.0 / 257 : 1;
  }
  normals_ = has(Column::nx) && has(Column::ny) && has(Column::nz);
  colours_ = (has(Column::red) && has(Column::green) && has(Column::blue)) || has(Column::packed_colour);
}

Status CloudBuilder::reserve(std::uint64_t points, std::uint64_t extra_bytes) {
  PointCloud<Scanner>& cloud = scan_.cloud;
  const bool labels = has(Column::label), scans = has(Column::scan);
  const std::uint64_t each = sizeof(cloud.points[0]) + (normals_ ? sizeof(cloud.normals[0]) : 0) +
                             (colours_ ? sizeof(cloud.colours[0]) : 0) + (labels ? 1 : 0) + (scans ? 2 : 0) +
                             work_per_point_;
  const std::string what = scan_.name + ": a scan of " + std::to_string(points) + " points";
  if (Status status = require_memory(points * each + extra_bytes, memory_, what); !status) return status;
  cloud.points.reserve(points);
  if (normals_) cloud.normals.reserve(points);
  if (colours_) cloud.colours.reserve(points);
  if (labels) cloud.labels.reserve(points);
  if (scans) cloud.scans.reserve(points);
  return {};
}

void CloudBuilder::add(const Record& record) {
  const Eigen::Vector3f point =
      (file_to_scanner_ * Eigen::Vector3d(record[0], record[1], record[2])).cast<float>();
  if (!point.allFinite()) {
    ++scan_.not_finite;
    return;
  }
  scan_.cloud.points.push_back(point);
  add_attributes(record);
}

void CloudBuilder::add_attributes(const Record& record) {
  const auto value = [&record](Column column) { return record[static_cast<std::size_t>(column)]; };
  PointCloud<Scanner>& cloud = scan_.cloud;
  if (normals_) {
    const Eigen::Vector3d normal = axes_ * Eigen::Vector3d(record[3], record[4], record[5]);
    cloud.normals.push_back(unit_or_zero(normal));
  }
  if (has(Column::packed_colour)) {
    const auto packed = static_cast<std::uint32_t>(value(Column::packed_colour));
    cloud.colours.push_back({static_cast<std::uint8_t>(packed >> 16U),
                             static_cast<std::uint8_t>(packed >> 8U), static_cast<std::uint8_t>(packed)});
  } else if (colours_) {
    cloud.colours.push_back({to_byte(value(Column::red) * colour_scale_),
                             to_byte(value(Column::green) * colour_scale_),
                             to_byte(value(Column::blue) * colour_scale_)});
  }
  if (has(Column::label)) {
    labels_fit_ = labels_fit_ && is_whole(value(Column::label), 0xFF);
    cloud.labels.push_back(labels_fit_ ? static_cast<std::uint8_t>(value(Column::label)) : 0);
  }
  if (has(Column::scan)) {
    scans_fit_ = scans_fit_ && is_whole(value(Column::scan), 0xFFFF);
    cloud.scans.push_back(scans_fit_ ? static_cast<std::uint16_t>(value(Column::scan)) : 0);
  }
}

void CloudBuilder::add_viewpoint(const Eigen::Vector3d& file_point) {
  scan_.cloud.viewpoints.push_back(file_to_scanner_ * file_point);
}

void CloudBuilder::drop_unfit_columns() {
  PointCloud<Scanner>& cloud = scan_.cloud;
  if (!labels_fit_) {
    cloud.labels.clear();
    note("labels left out: they are not all whole numbers from 0 to 255");
  }
  if (!cloud.scans.empty() && !cloud.viewpoints.empty()) {
    scans_fit_ =
        scans_fit_ && *std::max_element(cloud.scans.begin(), cloud.scans.end()) < cloud.viewpoints.size();
  }
  if (!scans_fit_) {
    cloud.scans.clear();
    cloud.viewpoints.clear();
    note("scan numbers and viewpoints left out: the numbers are not all those of a viewpoint");
  }
}

void CloudBuilder::drop_missing_returns() {
  constexpr std::ptrdiff_t kFewest = 10;  // a single point may lie there
  PointCloud<Scanner>& cloud = scan_.cloud;
  const auto is_origin = [](const Eigen::Vector3f& p) { return p.isZero(0); };
  if (std::count_if(cloud.points.begin(), cloud.points.end(), is_origin) < kFewest) return;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (is_origin(cloud.points[i])) continue;
    cloud.points[kept] = cloud.points[i];
    if (!cloud.normals.empty()) cloud.normals[kept] = cloud.normals[i];
    if (!cloud.colours.empty()) cloud.colours[kept] = cloud.colours[i];
    if (!cloud.labels.empty()) cloud.labels[kept] = cloud.labels[i];
    if (!cloud.scans.empty()) cloud.scans[kept] = cloud.scans[i];
    ++kept;
  }
  scan_.no_return = cloud.size() - kept;
  cloud.points.resize(kept);
  if (!cloud.normals.empty()) cloud.normals.resize(kept);
  if (!cloud.colours.empty()) cloud.colours.resize(kept);
  if (!cloud.labels.empty()) cloud.labels.resize(kept);
  if (!cloud.scans.empty()) cloud.scans.resize(kept);
}

void CloudBuilder::note_suspected_unit() {
  const double height = height_of(scan_.cloud.points);
  char text[128];
  if (height > 100) {
    const char* unit = height > 1000 ? "mm" : "cm";
    std::snprintf(text, sizeof text, "the room is %.0f m high: is the file in %s? Give --unit %s", height,
                  height > 1000 ? "millimetres" : "centimetres", unit);
    note(text);
  } else if (height > 0 && height < 0.1 && file_to_scanner_.col(2).norm() < 0.5) {
    std::snprintf(text, sizeof text, "the room is %.4f m high: is the file in metres? Give --unit m", height);
    note(text);
  }
}

Result<ScanFile> CloudBuilder::finish() {
  drop_missing_returns();
  if (scan_.cloud.empty() && scan_.no_return > 0)
    return Error{scan_.name + ": no point: all " + std::to_string(scan_.no_return) +
                 " are at the origin, where sensors put what returned nothing"};
  if (scan_.cloud.empty()) {
    const std::string lost = scan_.not_finite == 0
                                 ? ": it has no points"
                                 : ": all " + std::to_string(scan_.not_finite) + " are NaN or infinite";
    return Error{scan_.name + ": no finite point" + lost};
  }
  drop_unfit_columns();
  note_suspected_unit();
  if (scan_.not_finite > 0) note(std::to_string(scan_.not_finite) + " points left out: NaN or infinite");
  if (scan_.no_return > 0)
    note(std::to_string(scan_.no_return) +
         " points left out: all at the origin, where sensors put what returned nothing");
  return std::move(scan_);
}

}  // namespace parhelion::cloud
