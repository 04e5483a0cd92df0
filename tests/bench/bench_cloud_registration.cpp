// Registration of the room pair and full-resolution point-to-point iterations: points, threads, milliseconds,
// and against PCL's ICP where it is installed.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <numbers>
#include <string>

#ifdef PARHELION_WITH_PCL
#include <pcl/point_types.h>
#include <pcl/registration/icp.h>
#endif

#include "fusion/cloud/point_icp.hpp"
#include "fusion/cloud/read_cloud.hpp"
#include "fusion/cloud/registration.hpp"
#include "tests/fusion/cloud/slow_registration.hpp"

namespace {

using namespace parhelion;

template <class Work>
double milliseconds(const Work& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

/// Copies of the cloud side by side, at least `count` points in total.
std::vector<Eigen::Vector3f> tiled(const std::vector<Eigen::Vector3f>& points, std::size_t count) {
  std::vector<Eigen::Vector3f> result;
  for (int tile = 0; result.size() < count; ++tile) {
    for (const Eigen::Vector3f& p : points) {
      if (result.size() < count)
        result.push_back(p + Eigen::Vector3f(30.0f * static_cast<float>(tile), 0, 0));
    }
  }
  return result;
}

double register_default(const cloud::PointCloud<cloud::Target>& target,
                        const cloud::PointCloud<cloud::Source>& source,
                        const Transform<cloud::Target, cloud::Source>& guess) {
  cloud::RegistrationOptions options;
  options.threads = 2;
  std::vector<double> times;
  cloud::Registration found;
  const std::clock_t begin = std::clock();
  for (int i = 0; i < 21; ++i)
    times.push_back(milliseconds([&] { found = *cloud::register_pair(target, source, guess, options); }));
  const double processor = 1000.0 * static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  std::printf("register_pair: %.1f ms of processor time, both threads together\n",
              processor / static_cast<double>(times.size()));
  std::sort(times.begin(), times.end());
  const Eigen::Vector3d t = found.T_target_source.translation();
  std::printf(
      "register_pair: %zu + %zu points, 2 threads: p50 %.1f ms, best %.1f ms; t %.4f %.4f %.4f, yaw %.4f, "
      "%s\n",
      target.size(), source.size(), times[times.size() / 2], times.front(), t.x(), t.y(), t.z(),
      found.T_target_source.yaw(), found.converged ? "converged" : found.why.c_str());
  const test::SlowRegistrar registrar(target.points, source.points, cloud::fitted_surfel_size(target.points));
  const test::SlowRegistration slow = registrar.run(guess.isometry(), options.max_distance);
  const Eigen::Isometry3d apart = slow.T.inverse() * found.T_target_source.isometry();
  std::printf("  %.1f mm and %.3f degrees from the slow twin (all points, %d iterations)\n",
              1000 * (t - slow.T.translation()).norm(),
              Eigen::AngleAxisd(apart.linear()).angle() * 180 / std::numbers::pi, slow.iterations);
  return times[times.size() / 2];
}

void iterate_points(const cloud::PointCloud<cloud::Target>& target,
                    const cloud::PointCloud<cloud::Source>& source,
                    const Transform<cloud::Target, cloud::Source>& guess, bool paper_grid) {
  constexpr std::size_t points = 300000;
  const int iterations = paper_grid ? 3 : 30;
  cloud::PointIcpOptions options;
  options.threads = 2;
  options.paper_grid = paper_grid;
  const auto many_target = tiled(target.points, points);
  std::vector<Eigen::Vector3f> moved;
  for (const Eigen::Vector3f& p : source.points) moved.push_back((guess * p.cast<double>()).cast<float>());
  const auto many_source = tiled(moved, points);
  cloud::PointIcp icp(many_target, many_source, options);
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  double first = 0, sum = 0, last = 0;
  const std::clock_t begin = std::clock();
  for (int i = 0; i < iterations; ++i) {
    last = milliseconds([&] { T = icp.step(T); });
    if (i == 0) first = last;
    sum += last;
  }
  const double processor = 1000.0 * static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  std::printf("exact point-to-point: %.1f ms of processor time an iteration, both threads together\n",
              processor / iterations);
  std::printf(
      "exact point-to-point, %s: %zu points, 2 threads, %d iterations: mean %.1f ms, first %.1f, last "
      "%.1f\n",
      paper_grid ? "paper's grid" : "tree", points, iterations, sum / iterations, first, last);
}

#ifdef PARHELION_WITH_PCL
double register_with_pcl(const cloud::PointCloud<cloud::Target>& target,
                         const cloud::PointCloud<cloud::Source>& source,
                         const Transform<cloud::Target, cloud::Source>& guess) {
  const auto converted = [](const std::vector<Eigen::Vector3f>& points) {
    auto cloud = std::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
    for (const Eigen::Vector3f& p : points) cloud->push_back({p.x(), p.y(), p.z()});
    return cloud;
  };
  pcl::IterativeClosestPoint<pcl::PointXYZ, pcl::PointXYZ> icp;
  icp.setInputTarget(converted(target.points));
  icp.setInputSource(converted(source.points));
  icp.setMaxCorrespondenceDistance(1);
  icp.setMaximumIterations(60);
  icp.setTransformationEpsilon(1e-8);
  pcl::PointCloud<pcl::PointXYZ> aligned;
  const double time = milliseconds([&] { icp.align(aligned, guess.isometry().matrix().cast<float>()); });
  const Eigen::Vector3f t = icp.getFinalTransformation().topRightCorner<3, 1>();
  std::printf("PCL's ICP: %.0f ms; t %.4f %.4f %.4f\n", time, t.x(), t.y(), t.z());
  return time;
}
#endif

}  // namespace

int main() {
  const std::filesystem::path folder = std::filesystem::path(PARHELION_DATA_DIR) / "3d-room-scan";
  const auto first = parhelion::cloud::read_scan(folder / "room_scan1.pcd"),
             second = parhelion::cloud::read_scan(folder / "room_scan2.pcd");
  if (!first || !second) {
    std::printf("%s\n", (first ? second : first).error().message.c_str());
    return 1;
  }
  parhelion::cloud::PointCloud<parhelion::cloud::Target> target;
  parhelion::cloud::PointCloud<parhelion::cloud::Source> source;
  target.points = first->cloud.points;
  source.points = second->cloud.points;
  // A scan is in its scanner's frame.
  target.viewpoints = source.viewpoints = {Eigen::Vector3d::Zero()};
  const auto guess = parhelion::Transform<parhelion::cloud::Target, parhelion::cloud::Source>::planar(
      1.79387, 0.720047, 0.6931);
  [[maybe_unused]] const double own = register_default(target, source, guess);
  iterate_points(target, source, guess, false);
  iterate_points(target, source, guess, true);
#ifdef PARHELION_WITH_PCL
  std::printf("PCL / register_pair: %.0f times\n", register_with_pcl(target, source, guess) / own);
#else
  std::printf("PCL (libpcl-dev) was not there when this was built\n");
#endif
}
