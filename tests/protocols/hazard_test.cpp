#include "protocols/hazard.hpp"

#include <gtest/gtest.h>

#include "protocols/scenario.hpp"

namespace parhelion {
namespace {

const std::string kHazards =
    "name: hazards\nlevel: 1\ntrainee: {model: rover}\nhazards:\n"
    "  - {name: mine, kind: device, position: [4 m, 2 m, 0 m], nearness: 50 cm, delay: 90 s}\n"
    "  - {name: suitcase, kind: device, agent: case_1, shock: 4 N s, tilt: 30 deg}\n"
    "  - {name: source, kind: radiation, position: [1 m, 2 m, 0.5 m], dose_rate: 2 mSv/h, half_value: 5 cm}\n"
    "  - {name: leak, kind: gas, position: [7 m, 0 m, 1 m], concentration: 2 %, reach: 3 m}\n"
    "hazard_sensor: {radiation_lag: 4 s, radiation_counts: 0.3 kHz, gas_noise: 0.1 %}\n"
    "dose_limits: {radiation: {warning: 20 uSv, limit: 0.05 mSv}, gas: {limit: 2 ppm h}}\n"
    "radio: {position: [0 m, 0 m, 1.5 m], power: 17 dBm, frequency: 5.2 GHz, exponent: 2.4, wall_loss: 6 "
    "dB}\n"
    "battery: {capacity: 120 Wh, idle: 30 W, efficiency: 0.7, low: 0.25}\n";

TEST(Hazard, IsReadWithItsUnits) {
  const auto scenario = parse_scenario(kHazards, "s.yaml");
  ASSERT_TRUE(scenario.ok()) << scenario.error().message;
  ASSERT_EQ(scenario->hazards.size(), 4U);
  EXPECT_DOUBLE_EQ(*scenario->hazards[0].nearness, 0.5);
  EXPECT_DOUBLE_EQ(*scenario->hazards[0].delay, 90);
  EXPECT_FALSE(scenario->hazards[0].shock);
  EXPECT_EQ(scenario->hazards[1].agent, "case_1");
  EXPECT_NEAR(*scenario->hazards[1].tilt, 0.5235987755982988, 1e-12);
  EXPECT_DOUBLE_EQ(scenario->hazards[2].strength, 2000);
  EXPECT_DOUBLE_EQ(scenario->hazards[2].half_value, 0.05);
  EXPECT_DOUBLE_EQ(scenario->hazards[3].strength, 20000);
  EXPECT_DOUBLE_EQ(scenario->hazards[3].reach, 3);
  EXPECT_EQ(scenario->hazard_sensor, (HazardSensor{4, 300, 6.5, 1000})) << "gas_lag is not said";
  EXPECT_EQ(scenario->dose_limits, (DoseLimits{{20, 50}, {std::nullopt, 120}}));
  EXPECT_DOUBLE_EQ(scenario->radio->frequency, 5.2e9);
  EXPECT_DOUBLE_EQ(scenario->radio->sensitivity, -85) << "not said";
  EXPECT_DOUBLE_EQ(scenario->battery->capacity, 432e3);
}

TEST(Hazard, IsWrittenAsItIsRead) {
  const auto scenario = parse_scenario(kHazards, "s.yaml");
  ASSERT_TRUE(scenario.ok());
  const std::string once = to_yaml(*scenario);
  const auto again = parse_scenario(once, "again");
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(to_yaml(*again), once);
  EXPECT_EQ(again->hazards[1].shock, scenario->hazards[1].shock);
  EXPECT_EQ(again->hazards[3].strength, scenario->hazards[3].strength);
  EXPECT_EQ(again->hazard_sensor, scenario->hazard_sensor);
  EXPECT_EQ(again->dose_limits, scenario->dose_limits);
  EXPECT_EQ(again->radio->power, scenario->radio->power);
  EXPECT_EQ(again->battery->low, scenario->battery->low);
}

TEST(Hazard, AWarningAboveItsLimitIsRefused) {
  const auto refused =
      parse_scenario("level: 3\ndose_limits: {gas: {warning: 3 ppm h, limit: 100 ppm min}}\n", "s.yaml");
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("s.yaml:2: dose_limits: a warning is above its limit"),
            std::string::npos)
      << refused.error().message;
}

TEST(Hazard, RadioAndBatteryOfARealRobotAreRefused) {
  const std::string battery = "battery: {capacity: 120 Wh}\n";
  const auto refused = parse_scenario("level: 3\n" + battery, "s.yaml");
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("s.yaml:2: 'battery' is of simulated robots"), std::string::npos)
      << refused.error().message;
  EXPECT_FALSE(parse_scenario("level: 3\nradio: {position: [0 m, 0 m, 1 m]}\n", "s.yaml").ok());
  const std::string agent = "{name: r, kind: robot, model: rover, pose: {x: 1 m, y: 0 m}}";
  EXPECT_TRUE(parse_scenario("level: 3\nagents: [" + agent + "]\n" + battery, "s.yaml").ok());
  EXPECT_TRUE(parse_scenario("level: 3\n" + battery +
                                 "scripts: [{name: s, when: {time: 1 s}, do: [{spawn: " + agent + "}]}]\n",
                             "s.yaml")
                  .ok());
}

TEST(Hazard, AnUnknownKeyIsReportedWithTheNearestKey) {
  const auto refused = parse_scenario("hazards:\n  - {name: h, kind: device, nearnes: 1 m}\n", "s.yaml");
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("s.yaml:2"), std::string::npos) << refused.error().message;
  EXPECT_NE(refused.error().message.find("'nearness'"), std::string::npos) << refused.error().message;
}

TEST(Hazard, InvalidValuesAreRefusedWithTheirLine) {
  const auto fault = [](const std::string& hazard) {
    const auto scenario = parse_scenario("hazards:\n  - {name: h, " + hazard + "}\n", "s.yaml");
    return scenario ? std::string() : scenario.error().message;
  };
  EXPECT_NE(fault("kind: device, position: [0 m, 0 m, 0 m]").find("it has no trigger"), std::string::npos);
  EXPECT_NE(fault("kind: device, position: [0 m, 0 m, 0 m]").find("s.yaml:2"), std::string::npos);
  EXPECT_NE(fault("kind: device, position: [0 m, 0 m, 0 m], shock: 1 N s").find("agent"), std::string::npos);
  EXPECT_NE(fault("kind: device, delay: 1 s").find("a position or an agent"), std::string::npos);
  EXPECT_NE(fault("kind: gas, position: [0 m, 0 m, 0 m]").find("concentration"), std::string::npos);
  EXPECT_NE(fault("kind: device, position: [0 m, 0 m, 0 m], nearness: 1 kg").find("s.yaml:2"),
            std::string::npos);
  EXPECT_NE(fault("kind: radiation, position: [0 m, 0 m, 0 m], dose_rate: -1 uSv/h").find("s.yaml:2"),
            std::string::npos);
}

}  // namespace
}  // namespace parhelion
