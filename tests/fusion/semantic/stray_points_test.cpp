// Strays are left out; thin things, sparse surfaces and clean clouds are not.
#include "fusion/semantic/stray_points.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "tests/mean_sites/mean_score.hpp"

namespace parhelion::semantic {
namespace {

using test::Device;
using test::MeanScan;
using test::MeanSite;
using test::SiteKind;

/// A scanner 1.5 m over a floor of 60 by 60 m, an upright pole of 4 cm 3 m away, a rail of 5 cm 4 m away.
class Yard {
 public:
  /// rad, between lines of the scanner and along them.
  explicit Yard(double lines = 0.008, double step = 0.008) {
    cloud_.viewpoints = {{0, 0, 1.5}};
    for (double up = -1.2; up < 0.2; up += lines) {
      for (double turn = 0; turn < 2 * std::numbers::pi; turn += step / std::cos(up)) {
        const Eigen::Vector3d ray(std::cos(up) * std::cos(turn), std::cos(up) * std::sin(turn), std::sin(up));
        const double floor = -1.5 / ray.z(), pole = to_pole(ray), rail = to_rail(ray);
        const double range = std::min({ray.z() < 0 ? floor : kFar, pole, rail});
        if (!(range * ray.head<2>().cwiseAbs().maxCoeff() < 30)) continue;
        thin_.push_back(range < floor || ray.z() > 0);
        add(ray, range);
      }
    }
    surface_ = cloud_.size();
  }
  /// One of `every` rays again, to somewhere on the way.
  void dust(std::size_t every) {
    for (std::size_t i = 0; i < surface_; i += every) {
      const Eigen::Vector3d ray = cloud_.points[i].cast<double>() - cloud_.viewpoints[0];
      const double part = std::fmod(0.618034 * static_cast<double>(i / every), 1);
      add(ray.normalized(), 0.5 + part * std::min(ray.norm() - 0.6, 12.0));
    }
  }
  void forget_viewpoint() { cloud_.viewpoints.clear(), cloud_.scans.clear(); }

  struct Fractions {
    double strays = 0, thin = 0, surface = 0;
  };
  /// What is left out of each.
  Fractions left_out() const {
    const std::vector<bool> out = stray_points(cloud_);
    Fractions sum, all;
    for (std::size_t i = 0; i < cloud_.size(); ++i) {
      const bool is_out = !out.empty() && out[i];
      const auto part = i >= surface_ ? &Fractions::strays
                        : thin_[i]    ? &Fractions::thin
                                      : &Fractions::surface;
      sum.*part += is_out, all.*part += 1;
    }
    return {sum.strays / std::max(1.0, all.strays), sum.thin / all.thin, sum.surface / all.surface};
  }

 private:
  static constexpr double kFar = std::numeric_limits<double>::infinity();
  static double to_pole(const Eigen::Vector3d& ray) {
    const double across = ray.head<2>().norm(), off = 3 * std::abs(ray.y()) / across;
    const bool met = ray.x() > 0 && off < 0.02 && 1.5 + 3 * ray.z() / across < 2;
    return met ? 3 / across : kFar;
  }
  static double to_rail(const Eigen::Vector3d& ray) {
    if (!(ray.x() < -0.1)) return kFar;
    const double range = -4 / ray.x();
    return std::abs(range * ray.z() + 0.5) < 0.025 && std::abs(range * ray.y()) < 3 ? range : kFar;
  }
  void add(const Eigen::Vector3d& ray, double range) {
    cloud_.points.push_back((cloud_.viewpoints[0] + range * ray).cast<float>());
    cloud_.scans.push_back(0);
  }
  cloud::PointCloud<Cloud> cloud_;
  std::vector<bool> thin_;
  std::size_t surface_ = 0;
};

TEST(StrayPoints, AreLeftOutAndThinThingsAreNot) {
  for (const bool placed : {true, false}) {
    Yard yard;
    yard.dust(60);
    if (!placed) yard.forget_viewpoint();
    const Yard::Fractions out = yard.left_out();
    EXPECT_GT(out.strays, placed ? 0.85 : 0.6);
    EXPECT_LT(out.thin, 0.01);
    EXPECT_LT(out.surface, 0.002) << "far points lie metres apart along the rays";
  }
}

/// Lines 2 degrees apart: a pole has some points on each.
TEST(StrayPoints, AreNoThinThingsOfALaserWithFewLines) {
  Yard yard(0.035, 0.0035);
  yard.dust(60);
  const Yard::Fractions out = yard.left_out();
  EXPECT_GT(out.strays, 0.5);
  EXPECT_LT(out.thin, 0.02);
  EXPECT_LT(out.surface, 0.002);
}

TEST(StrayPoints, AreNotInCleanClouds) {
  for (const bool placed : {true, false}) {
    Yard yard;
    if (!placed) yard.forget_viewpoint();
    EXPECT_EQ(yard.left_out().surface, 0);
    EXPECT_EQ(yard.left_out().thin, 0);
  }
}

TEST(StrayPoints, OfAFewPointsAreNone) {
  cloud::PointCloud<Cloud> cloud;
  EXPECT_TRUE(stray_points(cloud).empty());
  cloud.points = {{0, 0, 0}, {9, 0, 0}, {0, 7, 1}};
  EXPECT_TRUE(stray_points(cloud).empty());
}

test::MeanScore score_of(const MeanSite& site, const MeanScan& scan) {
  const auto built = build_model(scan.cloud);
  EXPECT_TRUE(built);
  return built ? score_model(site, scan, *built) : test::MeanScore{};
}

// One return in 50 is somewhere on its ray.
TEST(StrayPoints, BecomeNoWallsAndNoThings) {
  for (const Device device : {Device::terrestrial, Device::unplaced}) {
    const MeanSite site = mean_site(SiteKind::apartment, 111);
    const MeanScan clean = mean_scan(site, device, 111);
    MeanScan scan = mean_scan(site, Device::terrestrial, 111);
    for (std::size_t i = 0; i < scan.cloud.size(); i += 50) {
      const Eigen::Vector3f eye = scan.cloud.viewpoints[scan.cloud.scans[i]].cast<float>();
      const Eigen::Vector3f ray = scan.cloud.points[i] - eye;
      const auto part = static_cast<float>(std::fmod(0.618034 * static_cast<double>(i / 50), 1));
      scan.cloud.points[i] = eye + (0.5F + part * std::max(0.0F, ray.norm() - 0.5F)) * ray.normalized();
      scan.box[i] = test::kNobody;
    }
    if (device == Device::unplaced) scan.cloud.viewpoints.clear(), scan.cloud.scans.clear();
    const test::MeanScore score = score_of(site, scan), expected = score_of(site, clean);
    EXPECT_GT(score.f1(), expected.f1() - 0.02);
    EXPECT_LT(score.crossing, expected.crossing + 0.5) << "m";
    EXPECT_LE(score.false_objects, expected.false_objects + 2);
  }
}

}  // namespace
}  // namespace parhelion::semantic
