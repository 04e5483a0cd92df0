// The defaults in the schema of joystick mappings equal those of the program.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "server/station/console/joystick_mapping.hpp"
#include "tests/schema_defaults.hpp"

namespace parhelion::station {
namespace {

using test::SchemaDefaults;

std::string values_of(const JoystickMapping& mapping) {
  std::ostringstream text;
  text << mapping.dead_zone << ' ' << mapping.curve << ' ' << mapping.rate << ' ' << mapping.speed << ' '
       << mapping.yaw_rate << ' ' << mapping.forward.invert << mapping.left.invert << mapping.turn.invert;
  for (const MappedJoint& joint : mapping.joints) text << ' ' << joint.axis.invert;
  return text.str();
}

TEST(JoystickSchema, DefaultsMatchTheProgram) {
  SchemaDefaults defaults("joystick", [](const std::string& yaml) -> std::optional<std::string> {
    const auto mapping = parse_joystick_mapping(yaml, "document");
    if (!mapping) return std::nullopt;
    return values_of(*mapping);
  });
  defaults.compare(SchemaDefaults::Json::parse(R"({"dead_man": "a",
    "axes": {"forward": {"axis": "lefty"}, "left": {"axis": "leftx"}, "turn": {"axis": "rightx"}},
    "joints": [{"joint": "j", "speed": 1, "axis": "righty"}]})"));
  EXPECT_THAT(defaults.differences(), testing::IsEmpty());
  EXPECT_THAT(defaults.missing(), testing::IsEmpty());
}

}  // namespace
}  // namespace parhelion::station
