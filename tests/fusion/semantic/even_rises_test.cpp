// Rises are equal as built: heights that the cloud gives inaccurately follow from the others, accurate ones
// are kept.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "fusion/semantic/net/find_stairs.hpp"
#include "fusion/semantic/net/flight_strip.hpp"
#include "protocols/quantile.hpp"
#include "tests/fusion/semantic/clouds.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kTread = 0.26, kStepWidth = 1.2, kStrip = 0.5;  // m

struct Stairs {
  cloud::PointCloud<Map> cloud;
  Flight flight;
};

/// Steps along x with the given rises, with the floor before them; every point is raised by bend(x).
Stairs stairs_of(const std::vector<double>& rises, const std::function<double(double)>& bend) {
  test::CloudSampler sampler(3000, 0.004, 11);
  Stairs stairs;
  double z = 0;
  const auto tread = [&](double from, double to) {
    const std::size_t before = sampler.cloud().size();
    sampler.slab({from, 0}, {to, kStepWidth}, z);
    std::vector<double> heights;
    for (std::size_t i = before; i < sampler.cloud().size(); ++i) {
      Eigen::Vector3f p = sampler.cloud().points[i];
      p.z() += static_cast<float>(bend(p.x()));
      stairs.cloud.points.push_back(p);
      heights.push_back(p.z());
    }
    stairs.flight.steps.push_back({kNoSurface, median(heights), from, to, 0, kStepWidth});
  };
  tread(-kStrip, 0);
  for (std::size_t i = 0; i < rises.size(); ++i) {
    z += rises[i];
    tread(static_cast<double>(i) * kTread, static_cast<double>(i + 1) * kTread);
  }
  return stairs;
}

/// m, maximum deviation of the rises from their mean.
double unevenness(const Flight& flight) {
  const std::vector<double> rises = flight.rises();
  double mean = 0, largest = 0;
  for (const double rise : rises) mean += rise / static_cast<double>(rises.size());
  for (const double rise : rises) largest = std::max(largest, std::abs(rise - mean));
  return largest;
}

TEST(EvenRises, AreRecoveredFromABentCloud) {
  // A depth camera at the foot of the flight: distant treads incline by up to 5 degrees.
  Stairs stairs = stairs_of(std::vector<double>(9, 0.16), [](double x) { return 0.02 * x * std::abs(x); });
  const double before = unevenness(stairs.flight);
  EXPECT_GT(before, 0.010) << "the cloud bends enough to see it";
  even_rises(StripPoints(stairs.cloud.points), stairs.flight);
  EXPECT_LT(unevenness(stairs.flight), 0.8 * before);
  EXPECT_LT(unevenness(stairs.flight), 0.010);
}

TEST(EvenRises, LeaveWellMeasuredUnevenStairsAsTheyAre) {
  const std::vector<double> rises = {0.17, 0.17, 0.195, 0.17, 0.15, 0.17};
  Stairs stairs = stairs_of(rises, [](double) { return 0; });
  even_rises(StripPoints(stairs.cloud.points), stairs.flight);
  const std::vector<double> found = stairs.flight.rises();
  for (std::size_t i = 0; i < rises.size(); ++i) EXPECT_NEAR(found[i], rises[i], 0.003) << i;
}

TEST(EvenRises, InferAnUnseenTreadFromTheOthers) {
  Stairs stairs = stairs_of(std::vector<double>(6, 0.17), [](double) { return 0; });
  stairs.flight.steps[3].z += 0.03;
  std::erase_if(stairs.cloud.points,
                [](const Eigen::Vector3f& p) { return p.x() > 2 * kTread && p.x() < 3 * kTread; });
  even_rises(StripPoints(stairs.cloud.points), stairs.flight);
  EXPECT_NEAR(stairs.flight.steps[3].z, 3 * 0.17, 0.005);
}

TEST(EvenRises, DoNotChangeTwoSteps) {
  Stairs stairs = stairs_of({0.15, 0.19}, [](double x) { return 0.05 * x; });
  const std::vector<double> before = stairs.flight.rises();
  even_rises(StripPoints(stairs.cloud.points), stairs.flight);
  EXPECT_EQ(stairs.flight.rises(), before);
}

}  // namespace
}  // namespace parhelion::semantic
