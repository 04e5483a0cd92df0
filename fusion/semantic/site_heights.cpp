#include "fusion/semantic/site_heights.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>

#include "protocols/model.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kBand = 0.25;               // m, around a level's height
constexpr double kNear = 1.5;                // m, around a scanner
constexpr std::size_t kFewest = 50;          // minimum number of points for a height
constexpr std::size_t kMaxPoints = 500'000;  // maximum number of points used: more change nothing
constexpr std::size_t kMaxScanners = 8;      // maximum number in one line of text

std::vector<Eigen::Vector3d> points_of(const cloud::PointCloud<Map>& cloud, EntityLabel label, double z) {
  std::vector<Eigen::Vector3d> points;
  if (cloud.labels.size() != cloud.size()) return points;
  const std::size_t stride = std::max<std::size_t>(1, cloud.size() / kMaxPoints);
  for (std::size_t i = 0; i < cloud.size(); i += stride) {
    const Eigen::Vector3d p = cloud.points[i].cast<double>();
    if (cloud.labels[i] == static_cast<std::uint8_t>(label) && std::abs(p.z() - z) < kBand)
      points.push_back(p);
  }
  return points;
}

std::optional<LevelHeights> level_heights(const std::vector<Eigen::Vector3d>& points) {
  if (points.size() < kFewest) return std::nullopt;
  std::vector<double> z;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) {
    z.push_back(p.z());
    mean += p;
  }
  mean /= static_cast<double>(points.size());
  LevelHeights heights{quantile(z, 0.05), quantile(z, 0.5), quantile(z, 0.95), 0};
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  for (const Eigen::Vector3d& p : points) {
    const Eigen::Vector2d d = (p - mean).head<2>();
    normal += d * d.transpose();
    right += d * (p.z() - mean.z());
  }
  // Minimum norm: along a single line of points only its own slope is determined.
  heights.lean = std::atan(normal.completeOrthogonalDecomposition().solve(right).norm());
  return heights;
}

std::optional<double> near_height(const std::vector<Eigen::Vector3d>& points,
                                  const Eigen::Vector3d& scanner) {
  std::vector<double> z;
  for (const Eigen::Vector3d& p : points) {
    const Eigen::Vector2d d = (p - scanner).head<2>();
    // Most points are far away in one direction already.
    if (std::abs(d.x()) < kNear && std::abs(d.y()) < kNear && d.norm() < kNear) z.push_back(p.z());
  }
  if (z.size() < kFewest) return std::nullopt;
  return median(z);
}

__attribute__((format(printf, 1, 2))) std::string format_text(const char* format, ...) {
  char text[200];
  va_list values;
  va_start(values, format);
  std::vsnprintf(text, sizeof text, format, values);
  va_end(values);
  return text;
}

std::string heights_text(const char* name, const LevelHeights& level) {
  return format_text("%s %.3f m (nine tenths of its points from %.3f to %.3f)", name, level.median, level.low,
                     level.high);
}

}  // namespace

SiteHeights site_heights(const cloud::PointCloud<Map>& cloud, std::optional<double> floor,
                         std::optional<double> ceiling) {
  std::vector<Eigen::Vector3d> of_floor, of_ceiling;
  if (floor) of_floor = points_of(cloud, EntityLabel::floor, *floor);
  if (ceiling) of_ceiling = points_of(cloud, EntityLabel::ceiling, *ceiling);
  SiteHeights heights;
  heights.floor = level_heights(of_floor);
  heights.ceiling = level_heights(of_ceiling);
  for (const Eigen::Vector3d& viewpoint : cloud.viewpoints)
    heights.scanners.push_back(
        {viewpoint.z(), near_height(of_floor, viewpoint), near_height(of_ceiling, viewpoint)});
  return heights;
}

std::string heights_text(const SiteHeights& heights) {
  std::string words;
  if (heights.floor) words += heights_text("floor", *heights.floor);
  if (heights.ceiling) words += (words.empty() ? "" : ", ") + heights_text("ceiling", *heights.ceiling);
  if (heights.floor && heights.ceiling)
    words += format_text(", %.3f m between them", heights.ceiling->median - heights.floor->median);
  for (std::size_t i = 0; i < std::min(heights.scanners.size(), kMaxScanners); ++i) {
    const ScannerHeights& scanner = heights.scanners[i];
    if (!scanner.floor && !scanner.ceiling) continue;
    words += format_text("; scanner %zu:", i + 1);
    if (scanner.floor) words += format_text(" %.3f m over its floor", scanner.z - *scanner.floor);
    if (scanner.floor && scanner.ceiling) words += ",";
    if (scanner.ceiling) words += format_text(" %.3f m under its ceiling", *scanner.ceiling - scanner.z);
  }
  return words;
}

}  // namespace parhelion::semantic
