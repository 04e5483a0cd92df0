// SDL's own virtual joystick drives the simulated robot of a level 1 session.
// Otherwise SDL renames main.
#define SDL_MAIN_HANDLED
#include "tools/consoles/joystick_console.hpp"

#include <SDL2/SDL.h>
#include <gtest/gtest.h>

#include "tests/server/runtime/scripted_drive.hpp"
#include "tests/server/tick/level_1.hpp"
#include "tests/tools/console_loop.hpp"

namespace parhelion::tools {
namespace {

class JoystickConsoleTest : public test::ConsoleLoop<test::ScriptedDrive> {
 protected:
  void SetUp() override {
    SDL_SetMainReady();
    auto port = station::JoystickPort::open();
    ASSERT_TRUE(port.ok()) << port.error().message;
    port_ = std::move(*port);
    start(test::level_1({test::agent("robot_1", AgentKind::robot, 2, 2, BehaviourKind::teleop)}));
    now_ = ArrivalTime::from_utime(test::kStartUs);
    connect();
    const auto notify = [this](const std::string& line) { printed_ += line + "\n"; };
    console_.emplace(JoystickConsoleOptions{"", "ann", notify}, station::default_joystick_mapping(), *bus_,
                     *port_);
    ASSERT_TRUE(console_->listen().ok());
  }
  void TearDown() override {
    if (joystick_ != nullptr) unplug();
  }

  void plug() {
    index_ = SDL_JoystickAttachVirtual(SDL_JOYSTICK_TYPE_GAMECONTROLLER, 6, 15, 0);
    ASSERT_GE(index_, 0) << SDL_GetError();
    joystick_ = SDL_JoystickOpen(index_);
  }
  void unplug() {
    SDL_JoystickClose(std::exchange(joystick_, nullptr));
    ASSERT_EQ(SDL_JoystickDetachVirtual(index_), 0) << SDL_GetError();
  }
  void hold(SDL_GameControllerButton button, bool down) {
    SDL_JoystickSetVirtualButton(joystick_, button, down ? 1 : 0);
  }
  /// -1..1, positive forwards.
  void push(double fraction) {
    SDL_JoystickSetVirtualAxis(joystick_, SDL_CONTROLLER_AXIS_LEFTY, static_cast<Sint16>(-32767 * fraction));
  }

  /// Runs console and server for `duration` of their common clock.
  void live(double duration) {
    for (const ArrivalTime end = now_ + seconds(duration); now_ < end;) step(milliseconds(5));
  }
  void drive_at_full_speed() {
    plug();
    live(0.3);
    hold(SDL_CONTROLLER_BUTTON_LEFTSHOULDER, true);
    live(0.1);
    push(1);
    live(1);
    ASSERT_GT(speed(), 0.5);
  }
  Status update_console() override { return console_->turn(WallTime{now_.ns}, SensorTime{now_.ns}); }
  void publish() override {
    keep_outputs();
    ConsoleLoop::publish();
  }
  double speed() { return state_->simulation.robot_motion("trainee")->velocity.norm(); }
  float asked() { return static_cast<float>(decoded<TwistCommand>(channel::kMrCmd).back().twist.vx); }
  std::vector<Event> lost() {
    std::vector<Event> all = decoded<Event>(channel::kMrEvents);
    std::erase_if(all, [](const Event& event) { return event.kind != EventKind::console_lost; });
    return all;
  }

  std::unique_ptr<station::JoystickPort> port_;
  std::optional<JoystickConsole> console_;
  std::string printed_;
  SDL_Joystick* joystick_ = nullptr;
  int index_ = -1;
};

TEST_F(JoystickConsoleTest, DrivesTheSimulatedRobotWhileTheDeadManIsHeld) {
  live(0.3);
  EXPECT_NE(printed_.find("waiting for a joystick"), std::string::npos) << printed_;
  plug();
  live(0.3);
  ASSERT_NE(console_->driven(), nullptr);
  EXPECT_EQ(console_->driven()->name, "trainee");
  push(1);
  live(0.5);
  EXPECT_LT(speed(), 0.01) << "a stick without the dead-man";
  push(0);
  hold(SDL_CONTROLLER_BUTTON_LEFTSHOULDER, true);
  live(0.1);
  push(0.6);
  live(1.5);
  const double part = station::shaped(0.6, 0.12, 1.5) * 0.8;
  EXPECT_NEAR(speed(), part, 0.1 * part) << "dead zone and curve";
  hold(SDL_CONTROLLER_BUTTON_LEFTSHOULDER, false);
  live(0.02);
  EXPECT_EQ(asked(), 0) << "at once, and not by silence";
  live(1);
  EXPECT_LT(speed(), 0.01);
  EXPECT_TRUE(lost().empty());
}

TEST_F(JoystickConsoleTest, UnpluggingStopsTheRobotUntilDeadManIsPressedAgain) {
  ASSERT_NO_FATAL_FAILURE(drive_at_full_speed());
  unplug();
  live(0.02);
  EXPECT_EQ(asked(), 0);
  ASSERT_EQ(lost().size(), 1U);
  EXPECT_EQ(lost()[0].object, "trainee");
  EXPECT_EQ(lost()[0].text, "the joystick was unplugged");
  live(1);
  EXPECT_LT(speed(), 0.01);

  plug();
  hold(SDL_CONTROLLER_BUTTON_LEFTSHOULDER, true);
  push(1);
  live(0.5);
  EXPECT_LT(speed(), 0.01) << "held since before it was plugged in";
  ASSERT_NE(console_->driven(), nullptr);
  EXPECT_EQ(console_->driven()->name, "trainee") << "whom it drove before";
  hold(SDL_CONTROLLER_BUTTON_LEFTSHOULDER, false);
  live(0.1);
  hold(SDL_CONTROLLER_BUTTON_LEFTSHOULDER, true);
  live(1);
  EXPECT_GT(speed(), 0.5);
}

TEST_F(JoystickConsoleTest, SwitchesBetweenRobotsAndDrivesOneAtATime) {
  ASSERT_NO_FATAL_FAILURE(drive_at_full_speed());
  hold(SDL_CONTROLLER_BUTTON_START, true);
  live(0.02);
  EXPECT_EQ(asked(), 0) << "the one that is left stops at once";
  hold(SDL_CONTROLLER_BUTTON_START, false);
  live(1);
  EXPECT_EQ(console_->driven()->name, "robot_1");
  const auto place = [this] {
    WorldSnapshot world;
    EXPECT_TRUE(state_->simulation.at(state_->simulation.now(), world));
    for (std::size_t i = 0; i < world.bodies.size(); ++i)
      if (world.scene->bodies[i]->entity == "robot_1") return world.bodies[i].T_map_body.translation().eval();
    ADD_FAILURE() << "no robot_1";
    return Eigen::Vector3d(0, 0, 0);
  };
  const Eigen::Vector3d before = place();
  EXPECT_LT(speed(), 0.01);
  hold(SDL_CONTROLLER_BUTTON_LEFTSHOULDER, false);
  live(0.1);
  hold(SDL_CONTROLLER_BUTTON_LEFTSHOULDER, true);
  live(1);
  EXPECT_GT((place() - before).norm(), 0.2) << "the other one drives";
  EXPECT_LT(speed(), 0.01) << "and the trainee's does not";
  EXPECT_EQ(asked(), 0);
}

}  // namespace
}  // namespace parhelion::tools
