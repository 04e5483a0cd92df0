// The defaults in a robot model's schema are those of the program.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "protocols/yaml/document.hpp"
#include "server/simulation/robots/robot_model.hpp"
#include "tests/schema_defaults.hpp"

namespace parhelion::simulation {
namespace {

using test::SchemaDefaults;

const std::string kFolder = std::string(PARHELION_SOURCE_DIR) + "/server/robots/";

/// All values of a robot model's file, except its robot description.
std::string values_of(const RobotModel& model) {
  std::ostringstream text;
  text << model.drive.acceleration << ' ' << model.drive.force << ' ' << model.drive.friction << '\n';
  const AttitudeLimits& limits = model.attitude;
  text << limits.pitch_warning << ' ' << limits.pitch_limit << ' ' << limits.roll_warning << ' '
       << limits.roll_limit << ' ' << limits.yaw_rate_warning << ' ' << limits.yaw_rate_limit << '\n';
  for (const RobotLink& link : model.links) {
    for (const Shape& shape : link.visible)
      text << shape.material.roughness << ' ' << shape.material.metallic << ' '
           << shape.material.laser_reflectivity << '\n';
  }
  return text.str();
}

TEST(RobotModelSchema, DefaultsMatchTheProgram) {
  const auto urdf = yaml::read_text(kFolder + "rover.urdf");
  ASSERT_TRUE(urdf) << urdf.error().message;
  SchemaDefaults defaults("robot_model", [&](const std::string& yaml) -> std::optional<std::string> {
    const auto model = parse_robot_model(*urdf, yaml, kFolder + "document.yaml");
    if (!model) return std::nullopt;
    return values_of(*model);
  });
  defaults.compare(SchemaDefaults::Json::parse(R"({
    "urdf": "rover.urdf", "attitude": {}, "materials": {"shell": {}},
    "drive": {"kind": "differential", "left": ["left_wheel"], "right": ["right_wheel"]},
    "robot": {"footprint": [["0 m", "0 m"], ["1 m", "0 m"], ["0 m", "1 m"]]}})"));
  std::set<std::string> missing = defaults.missing();
  // Checked by tests/protocols/schema_defaults_test.cpp.
  std::erase_if(missing, [](const std::string& key) { return key.starts_with(".robot."); });
  EXPECT_THAT(missing, testing::IsEmpty());
  EXPECT_THAT(defaults.differences(), testing::IsEmpty());
}

}  // namespace
}  // namespace parhelion::simulation
