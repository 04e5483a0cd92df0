#include "fusion/scan/lidar_model.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "fusion/scan/philox.hpp"
#include "protocols/robot.hpp"

namespace parhelion::scan {
namespace {

using Sentinel = RangeConvention::Sentinel;
constexpr float kNoReturn = std::numeric_limits<float>::infinity();

LaserDescription plain_laser() {
  LaserDescription laser;
  laser.convention = {0.1F, 30, Sentinel::infinity, 0, Sentinel::value, 0};
  return laser;
}

// The known answers published with Random123 for philox4x32-10.
TEST(Philox, matches_the_published_test_vectors) {
  EXPECT_EQ(philox4x32({0, 0, 0, 0}, {0, 0}),
            (PhiloxCounter{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}));
  constexpr std::uint32_t ones = 0xffffffff;
  EXPECT_EQ(philox4x32({ones, ones, ones, ones}, {ones, ones}),
            (PhiloxCounter{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}));
  EXPECT_EQ(philox4x32({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, {0xa4093822, 0x299f31d0}),
            (PhiloxCounter{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}));
}

TEST(Noise, is_standard_normal) {
  // Kolmogorov-Smirnov: with 200,000 draws the distance exceeds 0.0044 for one in a thousand correct
  // generators.
  constexpr std::size_t n = 200'000;
  std::vector<double> x(n);
  for (std::size_t i = 0; i < n; ++i) x[i] = standard_normal({42, i / 1000}, i % 1000);
  std::sort(x.begin(), x.end());
  double distance = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const double cdf = 0.5 * std::erfc(-x[i] / std::sqrt(2.0));
    distance =
        std::max({distance, std::abs(cdf - static_cast<double>(i) / n), std::abs(cdf - (i + 1.0) / n)});
  }
  EXPECT_LT(distance, 0.0044);
  EXPECT_LT(x.front(), -4);
  EXPECT_GT(x.back(), 4);
}

// The quantile function inverts the distribution function, far into both tails.
TEST(Noise, is_the_quantile_of_its_uniform_sample) {
  for (std::uint32_t beam = 0; beam < 100'000; ++beam) {
    const PhiloxCounter word = philox4x32({beam, 0, 5, 0}, {6, 0});
    const double p = (static_cast<double>((std::uint64_t{word[0]} << 32 | word[1]) >> 12) + 0.5) * 0x1p-52;
    const double x = standard_normal({6, 5}, beam);
    if (p < 0.5) {
      ASSERT_NEAR(0.5 * std::erfc(-x / std::sqrt(2.0)) / p, 1, 1e-12);
    } else {
      ASSERT_NEAR(0.5 * std::erfc(x / std::sqrt(2.0)) / (1 - p), 1, 1e-12);
    }
  }
}

TEST(Noise, depends_only_on_seed_scan_and_beam) {
  EXPECT_EQ(standard_normal({1, 2}, 3), standard_normal({1, 2}, 3));
  EXPECT_NE(standard_normal({1, 2}, 3), standard_normal({1, 2}, 4));
  EXPECT_NE(standard_normal({1, 2}, 3), standard_normal({1, 3}, 3));
  EXPECT_NE(standard_normal({1, 2}, 3), standard_normal({2, 2}, 3));
  EXPECT_NE(standard_normal({1ULL << 40, 2}, 3), standard_normal({0, 2}, 3))
      << "all 64 bits of the seed count";
  EXPECT_NE(standard_normal({1, 1ULL << 40}, 3), standard_normal({1, 0}, 3));
}

TEST(LidarNoise, quantises_to_the_step_of_the_protocol) {
  LaserDescription laser = plain_laser();
  laser.quantization = 0.01;
  EXPECT_EQ(measure_range(laser, {}, 0, 3.4749F), 3.47F);
  EXPECT_EQ(measure_range(laser, {}, 0, 3.4751F), 3.48F);
  laser.quantization = 0;
  EXPECT_EQ(measure_range(laser, {}, 0, 3.4751F), 3.4751F);
}

TEST(LidarNoise, has_the_specified_sigma) {
  LaserDescription laser = plain_laser();
  laser.noise_sigma = 0.03;
  double sum = 0, squares = 0;
  constexpr int n = 100'000;
  for (int i = 0; i < n; ++i) {
    const double error = double{measure_range(laser, {9, 1}, static_cast<std::size_t>(i), 5)} - 5;
    sum += error;
    squares += error * error;
  }
  EXPECT_NEAR(sum / n, 0, 5e-4);
  EXPECT_NEAR(std::sqrt(squares / n), 0.03, 5e-4);
}

TEST(LidarNoise, writes_limits_in_the_sensors_own_convention) {
  LaserDescription laser = plain_laser();
  EXPECT_EQ(measure(laser, {}, 0, 0.05F).kind, BeamKind::too_close);
  EXPECT_EQ(measure_range(laser, {}, 0, 0.05F), 0.0F);
  EXPECT_EQ(measure_range(laser, {}, 0, 0), 0.0F);
  EXPECT_EQ(measure_range(laser, {}, 0, 30), kNoReturn);
  EXPECT_EQ(measure_range(laser, {}, 0, kNoReturn), kNoReturn);
  laser.convention.no_return = Sentinel::value;
  laser.convention.no_return_value = 81.83F;
  laser.convention.too_close = Sentinel::infinity;
  EXPECT_EQ(measure_range(laser, {}, 0, kNoReturn), 81.83F);
  EXPECT_EQ(measure_range(laser, {}, 0, 0.05F), -kNoReturn);
  laser.convention.too_close = Sentinel::nan;
  EXPECT_TRUE(std::isnan(measure_range(laser, {}, 0, 0.05F)));
  EXPECT_EQ(measure(laser, {}, 0, std::nanf("")).kind, BeamKind::invalid);
}

TEST(LidarNoise, never_writes_a_hit_as_a_sentinel) {
  LaserDescription laser = plain_laser();
  laser.quantization = 0.5;
  laser.convention.no_return = Sentinel::value;
  laser.convention.no_return_value = 5;  // a value that is also a valid range
  EXPECT_EQ(measure_range(laser, {}, 0, 5.1F), 4.5F);
  laser.quantization = 0;
  EXPECT_EQ(measure_range(laser, {}, 0, 5), std::nextafter(5.0F, 0.0F));
}

TEST(BeamTimes, run_from_zero_to_one_over_the_sweep) {
  LaserDescription laser = plain_laser();
  laser.beam_interval = 10e-6;
  std::vector<float> time;
  const Sweep sweep = beam_times(laser, 101, time);
  EXPECT_EQ(sweep.start.ns, 0);
  EXPECT_EQ(sweep.end.ns, 1'000'000);
  EXPECT_EQ(time.front(), 0);
  EXPECT_EQ(time.back(), 1);
  EXPECT_FLOAT_EQ(time[50], 0.5F);
}

TEST(BeamTimes, interlace_two_mirror_passes_for_the_lms_200) {
  const auto laser = load_laser_preset("lms-200");
  ASSERT_TRUE(laser.ok()) << laser.error().message;
  std::vector<float> time;
  const Sweep sweep = beam_times(*laser, 361, time);
  // The last beam of the second pass: one turn of the mirror (13.33 ms) and 179 degrees of it.
  EXPECT_NEAR((sweep.end - sweep.start).seconds(), 1.0 / 75 * (1 + 179.0 / 360), 1e-6);
  EXPECT_GT(time[1], time[360]) << "every beam of the second pass comes after all of the first";
  EXPECT_EQ(time[0], 0);
  EXPECT_EQ(time[359], 1);
}

TEST(BeamTimes, start_before_a_stamp_of_the_middle_or_last_beam) {
  LaserDescription laser = plain_laser();
  laser.beam_interval = 10e-6;
  std::vector<float> time;
  laser.stamp_beam = LaserDescription::StampBeam::last;
  EXPECT_EQ(beam_times(laser, 101, time).end.ns, 0);
  laser.stamp_beam = LaserDescription::StampBeam::middle;
  EXPECT_EQ(beam_times(laser, 101, time).start.ns, -500'000);
}

TEST(BeamTimes, run_backward_where_the_last_beam_of_a_message_is_measured_first) {
  LaserDescription laser = plain_laser();
  laser.beam_interval = -10e-6;
  std::vector<float> time;
  Sweep sweep = beam_times(laser, 101, time);
  EXPECT_EQ(sweep.start.ns, 0);
  EXPECT_EQ(sweep.end.ns, 1'000'000);
  EXPECT_EQ(time.front(), 1);
  EXPECT_EQ(time.back(), 0);
  laser.stamp_beam = LaserDescription::StampBeam::last;
  sweep = beam_times(laser, 101, time);
  EXPECT_EQ(sweep.start.ns, -1'000'000);
  EXPECT_EQ(sweep.end.ns, 0);
}

TEST(BeamTimes, cover_no_beam_one_beam_and_an_instant_sweep) {
  LaserDescription laser = plain_laser();
  std::vector<float> time{1, 2};
  beam_times(laser, 0, time);
  EXPECT_TRUE(time.empty());
  beam_times(laser, 1, time);
  EXPECT_EQ(time, std::vector<float>{0});
  const Sweep sweep = beam_times(laser, 5, time);
  EXPECT_EQ(sweep.start, sweep.end);
  EXPECT_EQ(time, std::vector<float>(5, 0));
}

TEST(BeamTimes, follow_the_scan_where_it_has_times_of_its_own) {
  LaserDescription laser = plain_laser();
  laser.beam_interval = 10e-6;
  Scan scan;
  scan.stamp = SensorTime::from_utime(1'700'000'000'000'000);
  scan.ranges = {1, 1, 1};
  scan.angles = {0, 0.1F, 0.3F};
  scan.times = {scan.stamp.utime() + 50'000, scan.stamp.utime() - 50'000, scan.stamp.utime()};
  std::vector<float> time;
  const Sweep sweep = beam_times(laser, scan, time);
  EXPECT_EQ(sweep.start.ns, -50'000'000);
  EXPECT_EQ(sweep.end.ns, 50'000'000);
  EXPECT_EQ(time, (std::vector<float>{1, 0, 0.5F}));
  scan.times.assign(3, scan.stamp.utime());  // not measured
  EXPECT_EQ(beam_times(laser, scan, time).end.ns, 20'000);
}

}  // namespace
}  // namespace parhelion::scan
