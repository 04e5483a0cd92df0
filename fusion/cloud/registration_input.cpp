#include "fusion/cloud/registration_input.hpp"

#include <algorithm>
#include <cmath>

#include "protocols/length_text.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::cloud {
namespace {

constexpr double kSurfelsARadius = 25;  // resolves furniture, with a dozen points per surfel in a usual scan

template <class Frame>
Status check(const PointCloud<Frame>& cloud, const char* name) {
  const auto error = [&](const std::string& what) {
    return Error{"register: the " + std::string(name) + " " + what};
  };
  if (cloud.empty()) return error("cloud has no points");
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (!cloud.points[i].allFinite())
      return error("cloud's point " + std::to_string(i) +
                   " is not finite; drop such points where the cloud is read");
  }
  if (!cloud.scans.empty() && cloud.scans.size() != cloud.size())
    return error("cloud has " + std::to_string(cloud.scans.size()) + " scan numbers for " +
                 std::to_string(cloud.size()) + " points; give one each, or none");
  for (const std::uint16_t scan : cloud.scans) {
    if (!cloud.viewpoints.empty() && scan >= cloud.viewpoints.size())
      return error("cloud has a point of scan " + std::to_string(scan) + ", but " +
                   std::to_string(cloud.viewpoints.size()) + " viewpoints");
  }
  return {};
}

}  // namespace

double scene_radius(const std::vector<Eigen::Vector3f>& points) {
  constexpr std::size_t max_samples = 2000;
  const std::size_t step = 1 + points.size() / max_samples;
  std::vector<float> values;
  Eigen::Vector3f centre;
  for (int axis = 0; axis < 3; ++axis) {
    values.clear();
    for (std::size_t i = 0; i < points.size(); i += step) values.push_back(points[i][axis]);
    centre[axis] = median(values);
  }
  values.clear();
  for (std::size_t i = 0; i < points.size(); i += step) values.push_back((points[i] - centre).norm());
  return static_cast<double>(quantile(values, 0.8, QuantileRank::upper));
}

double surfel_size_of(double target_radius, double source_radius) {
  return std::clamp(target_radius, source_radius, 2 * source_radius) / kSurfelsARadius;
}

double fitted_surfel_size(const std::vector<Eigen::Vector3f>& points) {
  return points.empty() ? 0 : scene_radius(points) / kSurfelsARadius;
}

Status check_cloud(const PointCloud<Target>& cloud) { return check(cloud, "target"); }
Status check_cloud(const PointCloud<Source>& cloud) { return check(cloud, "source"); }

Status check_options(const RegistrationOptions& options) {
  if (!(options.max_distance > 0) || !std::isfinite(options.max_distance))
    return Error{"register: max_distance is " + std::to_string(options.max_distance) +
                 " m; give one above 0"};
  if (options.max_iterations < 1)
    return Error{"register: max_iterations is " + std::to_string(options.max_iterations) +
                 "; give 1 or more"};
  if (!(options.min_overlap > 0 && options.min_overlap <= 1))
    return Error{"register: min_overlap is " + std::to_string(options.min_overlap) +
                 "; give a fraction in (0, 1]"};
  if (!(options.surfel_size >= 0) || !std::isfinite(options.surfel_size))
    return Error{"register: surfel_size is " + std::to_string(options.surfel_size) +
                 " m; give one above 0, or 0"};
  if (options.threads < 0)
    return Error{"register: threads is " + std::to_string(options.threads) + "; give 0 or more"};
  return {};
}

Status check_scales(double target, double source, double max_distance) {
  constexpr double max_ratio = 30;
  const double smaller = std::min(target, source), larger = std::max(target, source);
  const std::string sizes = "four fifths of the target are within " + length_text(target) +
                            " of its middle, of the source within " + length_text(source);
  if (!(smaller > 0))
    return Error{"register: " + sizes + ": a cloud of one place only; give a scan of surfaces"};
  if (larger > max_ratio * smaller)
    return Error{"register: " + sizes + ": is one of them in millimetres? Give both in metres"};
  if (smaller > 500 * max_distance)
    return Error{"register: " + sizes + ", but partners are searched within " + length_text(max_distance) +
                 ": are they in millimetres? Give metres, or a larger max_distance"};
  return {};
}

}  // namespace parhelion::cloud
