#include "tests/mean_sites/mean_scan.hpp"

#include <cmath>
#include <map>
#include <numbers>
#include <tuple>

#include "fusion/scan/building_tree.hpp"

namespace parhelion::test {
namespace {

constexpr double kMarks = 4096;

class Measuring {
 public:
  Measuring(const MeanSite& site, std::uint64_t seed)
      : site_(site), marked_(marked(site)), tree_(marked_), random_(seed) {
    const double yaw = range(-3, 3), lean = range(0, 0.02);
    const Eigen::Quaterniond turn = Eigen::AngleAxisd(lean, Eigen::Vector3d(0.6, 0.8, 0)) *
                                    Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ());
    scan_.T_cloud_site = Transform<Cloud, Map>(turn, -(turn * site.scanners.at(0)));
  }

  void from_tripods(double step, double noise, double off, bool placed) {
    for (const Eigen::Vector3d& from : site_.scanners) {
      const Transform<Map, Map> error(
          Eigen::Quaterniond(Eigen::AngleAxisd(off * 0.17 * gaussian(), Eigen::Vector3d::UnitZ())),
          off * Eigen::Vector3d(gaussian(), gaussian(), 0.5 * gaussian()));
      const auto view = static_cast<std::uint16_t>(scan_.cloud.viewpoints.size());
      if (placed) scan_.cloud.viewpoints.push_back(scan_.T_cloud_site * from);
      for (double up = -1.2; up < 1.5; up += step) {
        const double around = step / std::max(0.1, std::cos(up));
        for (double a = 0; a < 2 * std::numbers::pi; a += around) {
          const Eigen::Vector3d ray(std::cos(up) * std::cos(a), std::cos(up) * std::sin(a), std::sin(up));
          measure(from, ray, 0.3, 25, noise, placed ? view : 0, &error);
        }
      }
    }
    if (!placed) scan_.cloud.scans.clear();
  }

  void from_camera() {
    for (std::size_t k = 0; k < site_.path.size(); ++k) {
      const auto view = static_cast<std::uint16_t>(k);
      scan_.cloud.viewpoints.push_back(scan_.T_cloud_site * site_.path[k]);
      const double heading = 2 * std::numbers::pi * static_cast<double>(k) / 16 + range(-0.3, 0.3);
      const Eigen::Matrix3d look = (Eigen::AngleAxisd(heading, Eigen::Vector3d::UnitZ()) *
                                    Eigen::AngleAxisd(range(0.1, 0.5), Eigen::Vector3d::UnitY()))
                                       .toRotationMatrix();
      for (int v = -48; v < 48; ++v) {
        for (int u = -64; u < 64; ++u) {
          const Eigen::Vector3d ray = (look * Eigen::Vector3d(1, u / 115.0, v / 115.0)).normalized();
          const auto hit = tree_.cast(site_.path[k], ray, 4.5);
          if (std::isfinite(hit.range))
            measure(site_.path[k], ray, 0.4, 4.5, 0.0015 * hit.range * hit.range, view, nullptr);
        }
      }
    }
  }

  /// The centres of the occupied cubes; a cube is of the box that most of its points were measured on.
  void to_voxels(double side) {
    std::map<std::tuple<int, int, int>, std::map<std::uint16_t, int>> cubes;
    for (std::size_t i = 0; i < scan_.cloud.size(); ++i) {
      const Eigen::Vector3i c =
          (scan_.cloud.points[i] / static_cast<float>(side)).array().floor().cast<int>();
      ++cubes[{c.x(), c.y(), c.z()}][scan_.box[i]];
    }
    MeanScan result;
    result.T_cloud_site = scan_.T_cloud_site;
    for (const auto& [cube, boxes] : cubes) {
      const auto [x, y, z] = cube;
      result.cloud.points.push_back((side * (Eigen::Vector3d(x, y, z).array() + 0.5)).matrix().cast<float>());
      result.box.push_back(std::max_element(boxes.begin(), boxes.end(), [](const auto& a, const auto& b) {
                             return a.second < b.second;
                           })->first);
    }
    scan_ = std::move(result);
  }

  MeanScan take() { return std::move(scan_); }
  double range(double low, double high) {
    return low + (high - low) * static_cast<double>(random_() >> 11) * 0x1.0p-53;
  }

 private:
  static SemanticModel marked(const MeanSite& site) {
    SemanticModel model = site.model;
    for (std::size_t i = 0; i < model.entities.size(); ++i)
      model.entities[i].material.laser_reflectivity = static_cast<float>(static_cast<double>(i + 1) / kMarks);
    return model;
  }
  double gaussian() {
    double sum = -6;
    for (int i = 0; i < 12; ++i) sum += range(0, 1);
    return sum;
  }
  void measure(const Eigen::Vector3d& from, const Eigen::Vector3d& ray, double near, double far, double noise,
               std::uint16_t view, const Transform<Map, Map>* error) {
    const auto hit = tree_.cast(from, ray, far);
    if (!std::isfinite(hit.range) || hit.range < near) return;
    Eigen::Vector3d p = (hit.range + noise * gaussian()) * ray;
    p = from + (error != nullptr ? *error * p : p);
    scan_.cloud.points.push_back((scan_.T_cloud_site * p).cast<float>());
    scan_.cloud.scans.push_back(view);
    scan_.box.push_back(
        static_cast<std::uint16_t>(std::lround(static_cast<double>(hit.reflectivity) * kMarks) - 1));
  }

  const MeanSite& site_;
  SemanticModel marked_;
  scan::BuildingTree tree_;
  std::mt19937_64 random_;
  MeanScan scan_;
};

}  // namespace

MeanScan mean_scan(const MeanSite& site, Device device, std::uint64_t seed) {
  Measuring measuring(site, seed * 7919 + static_cast<std::uint64_t>(device));
  constexpr double kStep = 0.013;  // rad
  switch (device) {
    case Device::terrestrial:
      measuring.from_tripods(kStep, measuring.range(0.003, 0.006), 0, true);
      break;
    case Device::drifting:
      measuring.from_tripods(kStep, measuring.range(0.01, 0.02), 0.02, true);
      break;
    case Device::unplaced:
      measuring.from_tripods(kStep, measuring.range(0.003, 0.006), 0, false);
      break;
    case Device::voxels_5cm:
    case Device::voxels_10cm:
      measuring.from_tripods(0.008, 0.005, 0, false);
      measuring.to_voxels(device == Device::voxels_5cm ? 0.05 : 0.10);
      break;
    case Device::depth_camera:
      measuring.from_camera();
      break;
  }
  return measuring.take();
}

}  // namespace parhelion::test
