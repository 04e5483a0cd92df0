#include "tests/mean_sites/mean_scan.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
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

  /// A line of beams that nods: dense along the line, sparse across; beams at edges fall between.
  void from_sweeps() {
    for (std::size_t s = 0; s < site_.scanners.size(); ++s) {
      const Eigen::Vector3d& from = site_.scanners[s];
      const Transform<Map, Map> error(
          Eigen::Quaterniond(Eigen::AngleAxisd(0.004 * gaussian(), Eigen::Vector3d::UnitZ())),
          0.015 * Eigen::Vector3d(gaussian(), gaussian(), 0.5 * gaussian()));
      const auto view = static_cast<std::uint16_t>(s);
      scan_.cloud.viewpoints.push_back(scan_.T_cloud_site * from);
      const Eigen::Matrix3d heading =
          Eigen::AngleAxisd(range(-3, 3), Eigen::Vector3d::UnitZ()).toRotationMatrix();
      for (double tilt = -1.35; tilt < 1.35; tilt += 0.03) {
        const Eigen::Matrix3d line =
            heading * Eigen::AngleAxisd(tilt, Eigen::Vector3d::UnitY()).toRotationMatrix();
        for (double a = -2.2; a < 2.2; a += 0.009) {
          const Eigen::Vector3d ray = line * Eigen::Vector3d(std::cos(a), std::sin(a), 0);
          const Eigen::Vector3d beside = line * Eigen::Vector3d(std::cos(a + 0.004), std::sin(a + 0.004), 0);
          const auto here = tree_.cast(from, ray, 20), there = tree_.cast(from, beside, 20);
          const bool edge = std::isfinite(here.range) && std::isfinite(there.range) &&
                            std::abs(here.range - there.range) > 0.05;
          const double mixed = edge && range(0, 1) < 0.5 ? range(0, 1) * (there.range - here.range) : 0;
          measure(from, ray, 0.2, 20, 0.015, view, &error, mixed);
        }
      }
    }
  }

  void from_camera(bool warped = false) {
    Eigen::Vector3d off(0, 0, 0);
    double turn = 0;
    const double stretch = warped ? range(-0.02, 0.02) : 0;
    for (std::size_t k = 0; k < site_.path.size(); ++k) {
      if (warped && k % 4 == 0) {
        off = 0.02 * Eigen::Vector3d(gaussian(), gaussian(), 0.5 * gaussian());
        turn = 0.006 * gaussian();
      }
      const Transform<Map, Map> error(Eigen::Quaterniond(Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ())),
                                      off);
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
          if (!std::isfinite(hit.range)) continue;
          const double bend = stretch * hit.range * (1 + 0.5 * (u * u + v * v) / 6400.0);
          measure(site_.path[k], ray, 0.4, 4.5, 0.0015 * hit.range * hit.range, view,
                  warped ? &error : nullptr, bend);
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
  struct Met {
    double range = std::numeric_limits<double>::infinity();
    std::uint16_t box = 0;
  };
  static bool contains(const std::vector<std::size_t>& boxes, std::uint16_t box) {
    return std::find(boxes.begin(), boxes.end(), box) != boxes.end();
  }
  Met first_met(const Eigen::Vector3d& from, const Eigen::Vector3d& ray, double far) const {
    const auto hit = tree_.cast(from, ray, far);
    if (!std::isfinite(hit.range)) return {};
    return {hit.range,
            static_cast<std::uint16_t>(std::lround(static_cast<double>(hit.reflectivity) * kMarks) - 1)};
  }
  /// What a ray meets: through glass mostly what is behind it, in a mirror what it reflects, farther away.
  Met meet(const Eigen::Vector3d& from, const Eigen::Vector3d& ray, double far) {
    Met met = first_met(from, ray, far);
    if (!std::isfinite(met.range)) return met;
    if (contains(site_.glass, met.box) && range(0, 1) > 0.125) {
      const double beyond = met.range + 0.04;
      met = first_met(from + beyond * ray, ray, far - beyond);
      met.range += beyond;
    } else if (contains(site_.mirrors, met.box)) {
      const ModelEntity& mirror = site_.model.entities[met.box];
      int flat = 0;
      mirror.size.minCoeff(&flat);
      Eigen::Vector3d back = ray;
      back[flat] = -back[flat];
      const Met image = first_met(from + (met.range - 1e-3) * ray, back, far - met.range);
      if (std::isfinite(image.range)) met.range += image.range;
    }
    return met;
  }
  /// m to somebody who walks while the scanner turns; infinity: nobody.
  double to_walker(const Eigen::Vector3d& from, const Eigen::Vector3d& ray) const {
    double nearest = std::numeric_limits<double>::infinity();
    for (const auto& [a, b] : site_.walkers) {
      const double around = std::atan2(ray.y(), ray.x()), phase = std::abs(std::remainder(7 * around, 2.0));
      const Eigen::Vector2d at = (a + phase * (b - a)).head<2>() - from.head<2>();
      const Eigen::Vector2d along = ray.head<2>();
      const double level = along.norm(), t = at.dot(along) / std::max(1e-9, level * level);
      const double off = (at - t * along).norm(), z = from.z() + t * ray.z();
      if (t > 0 && off < 0.2 && z > a.z() && z < a.z() + 1.75) nearest = std::min(nearest, t);
    }
    return nearest;
  }
  void measure(const Eigen::Vector3d& from, const Eigen::Vector3d& ray, double near, double far, double noise,
               std::uint16_t view, const Transform<Map, Map>* error, double more = 0) {
    Met met = meet(from, ray, far);
    if (const double walker = to_walker(from, ray); walker < met.range) met = {walker, kNobody};
    if (!std::isfinite(met.range) || met.range < near || met.range > far) return;
    Eigen::Vector3d p = (met.range + more + noise * gaussian()) * ray;
    p = from + (error != nullptr ? *error * p : p);
    scan_.cloud.points.push_back((scan_.T_cloud_site * p).cast<float>());
    scan_.cloud.scans.push_back(view);
    scan_.box.push_back(met.box);
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
    case Device::sweeps:
      measuring.from_sweeps();
      break;
    case Device::warped_camera:
      measuring.from_camera(true);
      break;
  }
  return measuring.take();
}

}  // namespace parhelion::test
