// The shipped presets against their data sheets.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "fusion/scan/lidar_model.hpp"
#include "protocols/robot.hpp"

namespace parhelion::scan {
namespace {

struct Expected {
  const char* name;
  int beams;
  double field;  // degrees
  double range_max, noise, quantization;
  double scan_period;
};

class LidarPreset : public testing::TestWithParam<Expected> {};

TEST_P(LidarPreset, matches_the_data_sheet) {
  const Expected& expected = GetParam();
  const auto laser = load_laser_preset(expected.name);
  ASSERT_TRUE(laser.ok()) << laser.error().message;
  EXPECT_EQ(laser->beams, expected.beams);
  EXPECT_NEAR((laser->beams - 1) * laser->angle_increment * 180 / std::numbers::pi, expected.field, 1e-6);
  EXPECT_NEAR(laser->angle_min, -(laser->beams - 1) * laser->angle_increment / 2, laser->angle_increment)
      << "looks ahead";
  EXPECT_FLOAT_EQ(laser->convention.range_max, static_cast<float>(expected.range_max));
  EXPECT_DOUBLE_EQ(laser->noise_sigma, expected.noise);
  EXPECT_DOUBLE_EQ(laser->quantization, expected.quantization);
  EXPECT_NEAR(laser->scan_period, expected.scan_period, 1e-9);
}

TEST_P(LidarPreset, sweeps_within_its_scan_period) {
  const auto laser = load_laser_preset(GetParam().name);
  ASSERT_TRUE(laser.ok());
  std::vector<float> time;
  const Sweep sweep = beam_times(*laser, static_cast<std::size_t>(laser->beams), time);
  EXPECT_GT((sweep.end - sweep.start).seconds(), 0);
  EXPECT_LE((sweep.end - sweep.start).seconds(), laser->scan_period);
}

TEST_P(LidarPreset, reads_back_what_it_writes) {
  const auto laser = load_laser_preset(GetParam().name);
  ASSERT_TRUE(laser.ok());
  const RangeConvention& convention = laser->convention;
  EXPECT_EQ(convention.classify(convention.no_return_sentinel()), BeamKind::no_return);
  EXPECT_EQ(convention.classify(convention.too_close_sentinel()), BeamKind::too_close);
  for (std::size_t beam = 0; beam < 1000; ++beam) {
    const auto range = static_cast<float>(static_cast<double>(beam) * 1.1e-3 * double{convention.range_max});
    const Measurement measured = measure(*laser, {1, 1}, beam, range);
    EXPECT_EQ(convention.classify(measured.range), measured.kind) << range;
  }
}

INSTANTIATE_TEST_SUITE_P(All, LidarPreset,
                         testing::Values(Expected{"lms-200", 361, 180, 80, 0.005, 0.01, 2.0 / 75},
                                         Expected{"s3000", 761, 190, 49, 0.01, 0.01, 0.12},
                                         Expected{"utm-30lx", 1081, 270, 30, 0.01, 0.001, 0.025},
                                         Expected{"urg-04lx", 682, 681 * 360.0 / 1024, 5.6, 0.01, 0.001,
                                                  0.1}),
                         [](const auto& tested) {
                           std::string name = tested.param.name;
                           std::erase(name, '-');
                           return name;
                         });

}  // namespace
}  // namespace parhelion::scan
