#include "tests/fusion/people/synthetic_crowd.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "fusion/scan/lidar_model.hpp"
#include "protocols/splitmix64.hpp"
#include "tests/fusion/people/crowd_lasers.hpp"

namespace parhelion::test {
namespace {

constexpr double kPi = std::numbers::pi;

/// Seven of ten crowds: at the height of ankles or knees.
void vary_laser(Random& random, LaserKind& laser) {
  if (random.chance(0.7)) laser.height = random.uniform(0.07, 0.6);
  if (random.chance(0.5)) laser.rate = random.uniform(10, 40);
}

}  // namespace

double Random::uniform(double low, double high) {
  state_ += kSplitMix64Increment;
  return low + (high - low) * unit_interval(splitmix64(state_));
}
double Random::normal(double sigma) {
  const double u = 1 - uniform(), v = uniform();
  return sigma * std::sqrt(-2 * std::log(u)) * std::cos(2 * kPi * v);
}
int Random::integer(int low, int high) {
  return std::min(high, low + static_cast<int>(uniform() * (high - low + 1)));
}

CrowdOptions random_crowd(std::uint64_t seed) {
  Random random(seed ^ 0xC0FFEE);
  CrowdOptions options;
  options.seed = seed;
  options.walkers = random.integer(1, 7);
  options.standing = random.integer(0, 3);
  options.chairs = random.integer(0, 10);
  options.tables = random.integer(0, 4);
  options.poles = random.integer(0, 6);
  options.boxes = random.integer(0, 5);
  options.bins = random.integer(0, 4);
  options.robots = random.integer(0, 2);
  options.room = random.uniform(6, 18);
  options.open = random.chance(0.15);
  options.glass = random.chance(0.4);
  options.moving_laser = random.chance(0.7);
  options.model = random.chance(0.5);
  options.pose_noise = random.uniform(0, 0.012);
  options.pose_drift = random.uniform(0, 0.05);
  LaserKind& laser = options.laser;
  constexpr int kBeams[] = {180, 245, 361, 512, 720, 768, 1081};
  laser.beams = kBeams[random.integer(0, 6)];
  laser.field = laser.beams == 245 ? 1.5 : random.chance(0.4) ? 2 * kPi : random.uniform(3.1, 4.72);
  constexpr double kRates[] = {5.5, 7.5, 10, 10, 15, 25, 40};
  laser.rate = kRates[random.integer(0, 6)];
  laser.range_max = random.uniform(5, 30);
  laser.noise = random.uniform(0.003, 0.03);
  laser.quantization = random.chance(0.3) ? 0.01 : 0;
  laser.dropout = random.chance(0.3) ? random.uniform(0, 0.03) : 0.001;
  laser.mixed = random.uniform(0, 0.7);
  constexpr double kHeights[] = {0.1, 0.18, 0.25, 0.35, 0.5, 0.85, 1.1};
  laser.height = kHeights[random.integer(0, 6)];
  laser.clockwise = random.chance(0.2);
  return options;
}

CrowdOptions varied_crowd(std::uint64_t seed) {
  CrowdOptions options = random_crowd(seed);
  Random random(seed ^ 0x5EA7ED);
  options.varied = true;
  options.walkers = random.integer(0, 4);
  options.aids = random.integer(0, 2);
  options.seated = random.integer(0, 2);
  options.groups = random.integer(0, 2);
  options.leaning = random.integer(0, 2);
  options.seats = random.integer(0, 2);
  options.odometry = !options.moving_laser || random.chance(0.75);
  options.model = options.model && options.odometry;
  vary_laser(random, options.laser);
  return options;
}

Crowd make_crowd(const CrowdOptions& options) {
  World world(options);
  Crowd crowd;
  crowd.laser = describe(options.laser);
  const auto beams = static_cast<std::size_t>(options.laser.beams);
  scan::beam_times(crowd.laser, beams, crowd.beam_time);
  crowd.sigma = std::hypot(options.pose_noise, options.pose_drift);
  for (int k = 0; k < 40; ++k) world.step(0.05);
  const int n = static_cast<int>(options.duration * options.laser.rate);
  const double period = 1 / options.laser.rate;
  for (int k = 0; k < n; ++k) {
    CrowdScan out;
    out.stamp = SimulationTime{seconds(1000 + k * period).ns};
    out.scan.stamp = SensorTime{out.stamp.ns};
    out.scan.angle_min = static_cast<float>(crowd.laser.angle_min);
    out.scan.angle_increment = static_cast<float>(crowd.laser.angle_increment);
    measure(options, crowd.laser, world, out);
    world.step(0.1 / options.laser.rate);
    if (options.model) out.building = modelled_walls(options, crowd.laser, world, out.estimated);
    crowd.scans.push_back(std::move(out));
  }
  return crowd;
}

}  // namespace parhelion::test
