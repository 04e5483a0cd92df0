// Sticks and buttons to commands, and hot plugging of SDL's virtual joystick.
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

// Otherwise SDL renames main.
#define SDL_MAIN_HANDLED
#include <SDL2/SDL.h>

#include <cmath>
#include <limits>

#include "server/station/console/joystick_device.hpp"
#include "server/station/console/joystick_mapping.hpp"

namespace parhelion::station {
namespace {

constexpr const char* kConsole = R"(device: Console
dead_man: button 4
dead_zone: 0.1
curve: 2
speed: 1 m/s
yaw_rate: 90 deg/s
axes:
  forward: {axis: axis 1, invert: true}
  turn: {axis: axis 0, invert: true}
slow: button 5
next_robot: button 7
joints:
  - {joint: arm_1, speed: 0.5, axis: axis 3}
  - {joint: gripper, speed: 0.1, up: button 0, down: button 1}
)";

JoystickMapping mapping() { return *parse_joystick_mapping(kConsole, "console.yaml"); }

JoystickState centred() {
  JoystickState state;
  for (int i = 0; i < 4; ++i) state.axes["axis " + std::to_string(i)] = 0;
  for (int i = 0; i < 8; ++i) state.buttons["button " + std::to_string(i)] = false;
  return state;
}

RC_GTEST_PROP(Joystick, ShapeIsOddMonotonicAndBounded, ()) {
  const double zone = *rc::gen::inRange(0, 90) / 100.0, curve = *rc::gen::inRange(20, 500) / 100.0;
  const double x = *rc::gen::inRange(-1500, 1500) / 1000.0, y = *rc::gen::inRange(-1500, 1500) / 1000.0;
  const double a = shaped(x, zone, curve), b = shaped(y, zone, curve);
  RC_ASSERT(std::abs(a) <= 1 && shaped(-x, zone, curve) == -a);
  RC_ASSERT((!(x <= y) || a <= b));
  RC_ASSERT((std::abs(x) > zone || a == 0));
  RC_ASSERT(shaped(1, zone, curve) == 1);
  RC_ASSERT(shaped(std::numeric_limits<double>::quiet_NaN(), zone, curve) == 0);
}

TEST(Joystick, DrivesOnlyWithDeadManHeldAfterARelease) {
  JoystickDrive drive(mapping());
  JoystickState state = centred();
  state.axes["axis 1"] = -1;
  state.axes["axis 0"] = 0.55;
  state.buttons["button 4"] = true;
  EXPECT_FALSE(drive.command(state).armed) << "held since before it was plugged in";
  state.buttons["button 4"] = false;
  EXPECT_EQ(drive.command(state).twist.vx, 0);
  state.buttons["button 4"] = true;
  const JoystickCommand command = drive.command(state);
  EXPECT_TRUE(command.armed);
  EXPECT_DOUBLE_EQ(command.twist.vx, 1);
  EXPECT_NEAR(command.twist.wz, -0.25 * std::acos(0.0), 1e-12)
      << "half of the way beyond the dead zone, squared";
  drive.restart();
  EXPECT_FALSE(drive.command(state).armed);
}

TEST(Joystick, MovesJointsLimitsSpeedAndSwitchesOncePerPress) {
  JoystickDrive drive(mapping());
  JoystickState state = centred();
  (void)drive.command(state);
  state.buttons["button 4"] = state.buttons["button 0"] = state.buttons["button 5"] = true;
  state.axes["axis 3"] = 1;
  JoystickCommand command = drive.command(state);
  ASSERT_EQ(command.joints.size(), 2U);
  EXPECT_NEAR(command.joints[0], 0.5 / 3, 1e-12);
  EXPECT_NEAR(command.joints[1], 0.1 / 3, 1e-12);
  state.buttons["button 7"] = true;
  EXPECT_TRUE(drive.command(state).next_robot);
  EXPECT_FALSE(drive.command(state).next_robot) << "still down";
}

TEST(Joystick, MappingErrorsReportLineAndValue) {
  const auto unknown = parse_joystick_mapping("dead_man: a\naxes: {}\ndead_zoen: 0.1\n", "j.yaml");
  ASSERT_FALSE(unknown.ok());
  EXPECT_NE(unknown.error().message.find("j.yaml:3"), std::string::npos) << unknown.error().message;
  EXPECT_NE(unknown.error().message.find("dead_zone"), std::string::npos) << unknown.error().message;
  EXPECT_FALSE(parse_joystick_mapping("axes: {}\n", "j.yaml").ok()) << "no dead-man";
  const auto idle =
      parse_joystick_mapping("dead_man: a\naxes: {}\njoints:\n  - {joint: arm, speed: 1}\n", "j.yaml");
  ASSERT_FALSE(idle.ok());
  EXPECT_NE(idle.error().message.find("j.yaml:4"), std::string::npos) << idle.error().message;
  JoystickState small = centred();
  small.buttons.erase("button 7");
  const Status fits = check_mapping(mapping(), small);
  ASSERT_FALSE(fits.ok());
  EXPECT_NE(fits.error().message.find("no button 'button 7'; it has button 0"), std::string::npos)
      << fits.error().message;
  EXPECT_TRUE(check_mapping(mapping(), centred()).ok());
}

TEST(Joystick, ReadsAndHotplugsThroughSdl) {
  SDL_SetMainReady();
  auto port = JoystickPort::open();
  ASSERT_TRUE(port.ok()) << port.error().message;
  ASSERT_FALSE((*port)->poll("").has_value());
  for (int round = 0; round < 2; ++round) {
    const int index = SDL_JoystickAttachVirtual(SDL_JOYSTICK_TYPE_GAMECONTROLLER, 6, 15, 0);
    ASSERT_GE(index, 0) << SDL_GetError();
    ASSERT_EQ((*port)->list().size(), 1U);
    EXPECT_EQ((*port)->list()[0].axes, 6);
    auto state = (*port)->poll("");
    ASSERT_TRUE(state.has_value());
    const JoystickMapping pad = default_joystick_mapping();
    EXPECT_TRUE(check_mapping(pad, *state).ok()) << check_mapping(pad, *state).error().message;
    JoystickDrive drive(pad);
    (void)drive.command(*state);

    SDL_Joystick* joystick = SDL_JoystickOpen(index);
    SDL_JoystickSetVirtualAxis(joystick, SDL_CONTROLLER_AXIS_LEFTY, -32767);
    SDL_JoystickSetVirtualButton(joystick, SDL_CONTROLLER_BUTTON_LEFTSHOULDER, 1);
    state = (*port)->poll("");
    ASSERT_TRUE(state.has_value());
    const JoystickCommand command = drive.command(*state);
    EXPECT_TRUE(command.armed);
    EXPECT_DOUBLE_EQ(command.twist.vx, pad.speed);

    SDL_JoystickClose(joystick);
    ASSERT_EQ(SDL_JoystickDetachVirtual(index), 0) << SDL_GetError();
    EXPECT_FALSE((*port)->poll("").has_value()) << "unplugged";
    EXPECT_EQ((*port)->in_use(), "");
  }
}

}  // namespace
}  // namespace parhelion::station
