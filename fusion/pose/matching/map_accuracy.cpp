#include "fusion/pose/matching/map_accuracy.hpp"

#include <algorithm>
#include <cmath>

namespace parhelion::pose {
namespace {

constexpr int kMemory = 200;            ///< scans
constexpr std::size_t kMinPoints = 30;  ///< on surfaces
constexpr double kOnSurface = 0.1;      ///< m
constexpr double kSameWall = 0.95;      ///< cosine between the normals of neighbours
/// What a match is off, to the distance between the map's scans; and where that turns it. Chosen on generated
/// offices and a ring whose mapped scans were placed with errors of 3 and 8 mm, which last for some ten
/// scans.
constexpr double kPart = 0.3, kLever = 3;  ///< -, m
constexpr double kFirst = 0.005 / kPart;   ///< m, before the first scan; it counts for `kFirstScans`
constexpr int kFirstScans = 2;
/// Of a thickness, without what surfaces that are not quite flat add to it: 4 to 6 % on maps without errors.
constexpr double kOwn = 0.94;
constexpr double kMinExcess = 0.001;  ///< m: rounding of the map's surfaces

constexpr double squared(double x) { return x * x; }

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

MapAccuracy::MapAccuracy(std::size_t max_points) : excess_(squared(kFirst)), scans_(kFirstScans) {
  distances_.reserve(max_points);
  thicknesses_.reserve(max_points);
}

void MapAccuracy::add(const SurfelMap& map, std::span<const Eigen::Vector2d> points_base,
                      const Pose2& T_map_base) {
  distances_.clear();
  thicknesses_.clear();
  const Surfel* before = nullptr;
  double distance_before = 0;
  for (const Eigen::Vector2d& p : points_base) {
    const Eigen::Vector2d q = T_map_base * p;
    const Surfel* surfel = map.nearest(q);
    if (surfel != nullptr && !surfel->flat) surfel = nullptr;
    const double distance = surfel != nullptr ? surfel->normal.dot(q - surfel->mean) : 0;
    if (surfel != nullptr && std::abs(distance) > kOnSurface) surfel = nullptr;
    if (surfel != nullptr && before != nullptr) {
      const double cosine = surfel->normal.dot(before->normal);
      if (std::abs(cosine) > kSameWall) {
        distances_.push_back(std::abs(distance - std::copysign(1.0, cosine) * distance_before));
        thicknesses_.push_back(squared(surfel->thickness));
      }
    }
    before = surfel;
    distance_before = distance;
  }
  if (distances_.size() < kMinPoints) return;
  // The median of the difference of two normal errors is 0.954 of their sigma.
  const double noise = squared(median(distances_) / 0.954);
  excess_ += (kOwn * median(thicknesses_) - noise - excess_) / static_cast<double>(scans_);
  scans_ = std::min(scans_ + 1, kMemory);
}

double MapAccuracy::position_sigma() const {
  return kPart * std::sqrt(std::max(excess_, squared(kMinExcess)));
}

double MapAccuracy::yaw_sigma() const { return position_sigma() / kLever; }

}  // namespace parhelion::pose
