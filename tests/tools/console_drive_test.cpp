// The whole entrance scenario, driven by a simulated operator with a console only: keys typed into a
// terminal, or the sticks and buttons of a game pad. The operator reads the world; the console publishes the
// commands. SDL_MAIN_HANDLED: otherwise SDL renames main.
#define SDL_MAIN_HANDLED
#include <SDL2/SDL.h>

#include "tests/recordings.hpp"
#include "tests/tools/console_loop.hpp"
#include "tests/tools/site_drive.hpp"
#include "tools/consoles/joystick_console.hpp"
#include "tools/consoles/keyboard_console.hpp"

namespace parhelion::tools {
namespace {

constexpr double kLook = 0.03;     // s: repeat interval of a key and reaction interval of an operator
constexpr double kNear = 0.06;     // rad from the target below which an operator slows down
constexpr double kEnough = 0.012;  // rad
constexpr double kPassed = 0.4;    // m, after which the step pressed down on is behind

class ConsoleDrive : public test::ConsoleLoop<test::SiteDrive> {
 protected:
  /// m/s forward; rad to the target, positive to the left.
  virtual void steer(double speed, double left) = 0;
  /// Remaining rad or m.
  virtual void turn_joint(const std::string& joint, double missing) = 0;
  virtual void release_all() = 0;

  /// An operator's action at each look, until `done` or after `limit` s.
  bool operate(const std::function<void()>& act, const std::function<bool()>& done, double limit) {
    for (const ArrivalTime end = now_ + seconds(limit); now_ < end && !done();) {
      step(seconds(kLook), act);
    }
    return done();
  }
  void rest(double duration) {
    operate([this] { release_all(); }, [] { return false; }, duration);
  }
  double missing(const std::string& joint, double goal) {
    const Joints& joints = motion().joints;
    const auto at = std::find(joints.names.begin(), joints.names.end(), joint);
    return goal - joints.positions[static_cast<std::size_t>(at - joints.names.begin())];
  }
  void joint_to(const std::string& joint, double goal) {
    EXPECT_TRUE(operate([&] { turn_joint(joint, missing(joint, goal)); },
                        [&] { return std::abs(missing(joint, goal)) < kEnough; }, 12))
        << joint << " is " << missing(joint, goal) << " off";
    rest(0.1);
  }
  /// Closes the fingers (1) or opens them (-1).
  void fingers(double offset, double duration) {
    operate([&] { turn_joint("left_finger_joint", offset); }, [] { return false; }, duration);
    rest(0.6);
  }
  double off(const Eigen::Vector2d& place) {
    const Eigen::Vector2d offset = place - motion().T_map_base.translation().head<2>();
    const Eigen::Matrix3d R = motion().T_map_base.rotation();
    return std::remainder(std::atan2(offset.y(), offset.x()) - std::atan2(R(1, 0), R(0, 0)),
                          2 * std::numbers::pi);
  }
  bool is_at(const Eigen::Vector2d& place) {
    return (motion().T_map_base.translation().head<2>() - place).norm() < 0.15;
  }
  bool go(const Eigen::Vector2d& place, double speed, double limit, std::optional<EventKind> until = {}) {
    return operate([&] { steer(speed, off(place)); },
                   [&] { return until ? happened(*until, "trainee") : is_at(place); }, limit);
  }
  /// Up the stairs: the flippers up against the first step, pressed down on its tread, then in line with the
  /// tracks; the robot waits each time until they are in position.
  bool climb(const Eigen::Vector2d& place, double limit) {
    std::size_t phase = 0;
    bool level = false;  // since the flippers are up: not tipping over the edge of the previous step any more
    ArrivalTime pressed = now_;
    Eigen::Vector3d pressed_at = Eigen::Vector3d::Zero();
    const auto act = [&] {
      const double pitch = std::asin(motion().T_map_base.rotation()(2, 0));
      level = phase == 0 &&
              (level || (pitch < 4 * kDegree && missing("left_flipper_joint", 35 * kDegree) < kNear));
      const Eigen::Vector3d at = motion().T_map_base.translation();
      if (level && pitch > 6 * kDegree) phase = 1, pressed = now_, pressed_at = at;
      if (phase == 1 && pitch > 22 * kDegree) phase = 2;
      const bool passed = (at - pressed_at).norm() > kPassed;
      if ((phase == 1 && (passed || now_ - pressed > seconds(10))) || (phase == 2 && pitch < 4 * kDegree))
        phase = 0;
      const double angle = std::array{35, -20, -6}[phase] * kDegree;
      for (const char* flipper : {"left_flipper_joint", "right_flipper_joint"}) {
        if (std::abs(missing(flipper, angle)) > 2 * kDegree)
          return turn_joint(flipper, missing(flipper, angle));
      }
      steer(0.32, off(place));
    };
    return operate(
        act, [&] { return is_at(place); }, limit);
  }

  void do_all() {
    const auto low = test::crawler_reach(0.68, 0.11);
    const double shoulder = low.at("shoulder_joint"), beside = 90 * kDegree;
    rest(0.5);
    joint_to("shoulder_joint", shoulder + 0.6);
    joint_to("elbow_joint", low.at("elbow_joint"));
    joint_to("wrist_joint", low.at("wrist_joint"));
    joint_to("turret_joint", -beside);
    joint_to("shoulder_joint", shoulder);
    fingers(1, 1.5);
    joint_to("shoulder_joint", shoulder + 0.6);
    EXPECT_TRUE(happened(EventKind::lifted, "part_1"));
    joint_to("turret_joint", beside);
    joint_to("shoulder_joint", shoulder + 0.27);
    fingers(-1, 1);
    rest(1.5);
    EXPECT_TRUE(happened(EventKind::placed, "container_1"));
    joint_to("shoulder_joint", shoulder + 0.9);
    joint_to("turret_joint", 0);
    joint_to("elbow_joint", -115 * kDegree);
    EXPECT_TRUE(go({0, 0.75}, 0.48, 30)) << motion().T_map_base.translation().transpose();
    EXPECT_TRUE(happened(EventKind::door_opened, "gate 1"));
    EXPECT_TRUE(climb({4.5, 0.85}, 90)) << motion().T_map_base.translation().transpose();
    for (const char* step : {"stairs 1 step 1", "stairs 1 step 2", "stairs 1 step 3", "stairs 1 step 4"})
      EXPECT_TRUE(happened(EventKind::step_climbed, step)) << step;
    EXPECT_TRUE(happened(EventKind::zone_entered, "landing"));
    EXPECT_FALSE(happened(EventKind::tipped_over, "trainee"));
    // Down again in the wrong way: flippers folded, the arm stretched out ahead, and fast.
    joint_to("left_flipper_joint", 140 * kDegree);
    joint_to("right_flipper_joint", 140 * kDegree);
    joint_to("shoulder_joint", 80 * kDegree);
    joint_to("elbow_joint", 0);
    joint_to("wrist_joint", 0);
    EXPECT_TRUE(go({3.95, 0.8}, 0.4, 30)) << motion().T_map_base.translation().transpose();
    joint_to("shoulder_joint", 35 * kDegree);
    EXPECT_TRUE(go({0.5, 0.8}, 0.8, 12, EventKind::tipped_over))
        << motion().T_map_base.translation().transpose() << " pitch "
        << std::asin(motion().T_map_base.rotation()(2, 0)) / kDegree;
  }
  void publish() override {
    take_events();
    ConsoleLoop::publish();
  }
};

class KeyboardDriveTest : public ConsoleDrive {
 protected:
  void sit_down() {
    connect();
    console_.emplace(KeyboardConsoleOptions{}, *bus_);
    ASSERT_TRUE(console_->listen().ok());
  }
  void steer(double speed, double left) override {
    faster(speed / 0.08);
    if (std::abs(left) > 0.25) return hold(left > 0 ? 'a' : 'd');
    if (std::abs(left) > 0.06) return hold(left > 0 ? 'q' : 'e');
    hold('w');
  }
  void turn_joint(const std::string& joint, double missing) override {
    if (console_->joint() != joint) {
      release_all();
      typed_ += ']';
      return;
    }
    faster(std::abs(missing) > kNear ? 10 : 1);
    hold(missing > 0 ? 'r' : 'f');
  }
  void release_all() override {
    if (std::exchange(held_, ' ') != ' ') typed_ += ' ';
  }
  Status update_console() override {
    const std::string typed = std::exchange(typed_, {});
    return console_->turn(typed, WallTime{now_.ns}, SensorTime{now_.ns});
  }

 private:
  /// A terminal sends no key releases, so the previous key is ended with the space bar before another key is
  /// pressed.
  void hold(char key) {
    if (held_ != key) release_all();
    held_ = key;
    typed_ += key;
  }
  void faster(double step) {
    for (; step_ < std::lround(step); ++step_) typed_ += '+';
    for (; step_ > std::lround(step); --step_) typed_ += '-';
  }
  std::optional<KeyboardConsole> console_;
  std::string typed_;
  char held_ = ' ';
  long step_ = station::KeyboardDrive::kSteps / 2;
};

TEST_F(KeyboardDriveTest, CompletesTheEntranceCourseFromTheConsole) {
  const auto cloud = test::recording("3d-ori-stairs/06.pcd");
  PARHELION_NEEDS_RECORDING(cloud);
  make_site("entrance", cloud);
  sit_down();
  do_all();
}

class JoystickDriveTest : public ConsoleDrive {
 protected:
  void sit_down() {
    connect();
    SDL_SetMainReady();
    auto port = station::JoystickPort::open();
    ASSERT_TRUE(port.ok()) << port.error().message;
    port_ = std::move(*port);
    index_ = SDL_JoystickAttachVirtual(SDL_JOYSTICK_TYPE_GAMECONTROLLER, 6, 15, 0);
    ASSERT_GE(index_, 0) << SDL_GetError();
    joystick_ = SDL_JoystickOpen(index_);
    auto mapping = station::load_joystick_mapping("crawler");
    ASSERT_TRUE(mapping.ok()) << mapping.error().message;
    console_.emplace(JoystickConsoleOptions{"", "ann", {}}, std::move(*mapping), *bus_, *port_);
    ASSERT_TRUE(console_->listen().ok());
    rest(0.3);
    hold(SDL_CONTROLLER_BUTTON_LEFTSHOULDER, true);
  }
  void TearDown() override {
    if (joystick_ != nullptr) {
      SDL_JoystickClose(joystick_);
      SDL_JoystickDetachVirtual(index_);
    }
    ConsoleDrive::TearDown();
  }
  void steer(double speed, double left) override {
    release_all();
    push(SDL_CONTROLLER_AXIS_LEFTY, std::abs(left) > 0.25 ? 0 : -speed / 0.8);
    push(SDL_CONTROLLER_AXIS_LEFTX, -std::clamp(2 * left, -0.8, 0.8) / 1.2);
  }
  void turn_joint(const std::string& joint, double missing) override {
    release_all();
    const double fraction = std::clamp(4 * missing, -1.0, 1.0);
    if (joint == "turret_joint") return push(SDL_CONTROLLER_AXIS_RIGHTX, -fraction);
    if (joint == "shoulder_joint") return push(SDL_CONTROLLER_AXIS_RIGHTY, -fraction);
    static const std::map<std::string, std::array<SDL_GameControllerButton, 2>> buttons{
        {"elbow_joint", {SDL_CONTROLLER_BUTTON_DPAD_DOWN, SDL_CONTROLLER_BUTTON_DPAD_UP}},
        {"wrist_joint", {SDL_CONTROLLER_BUTTON_DPAD_LEFT, SDL_CONTROLLER_BUTTON_DPAD_RIGHT}},
        {"left_finger_joint", {SDL_CONTROLLER_BUTTON_B, SDL_CONTROLLER_BUTTON_A}},
        {"left_flipper_joint", {SDL_CONTROLLER_BUTTON_X, SDL_CONTROLLER_BUTTON_Y}},
        {"right_flipper_joint", {SDL_CONTROLLER_BUTTON_X, SDL_CONTROLLER_BUTTON_Y}}};
    hold(buttons.at(joint)[missing > 0 ? 1 : 0], true);
    hold(SDL_CONTROLLER_BUTTON_RIGHTSHOULDER, std::abs(missing) < kNear);
  }
  void release_all() override {
    for (const auto axis : {SDL_CONTROLLER_AXIS_LEFTX, SDL_CONTROLLER_AXIS_LEFTY, SDL_CONTROLLER_AXIS_RIGHTX,
                            SDL_CONTROLLER_AXIS_RIGHTY})
      push(axis, 0);
    for (int button = 0; button < SDL_CONTROLLER_BUTTON_MAX; ++button) {
      if (button != SDL_CONTROLLER_BUTTON_LEFTSHOULDER)
        hold(static_cast<SDL_GameControllerButton>(button), false);
    }
  }
  Status update_console() override { return console_->turn(WallTime{now_.ns}, SensorTime{now_.ns}); }

 private:
  void hold(SDL_GameControllerButton button, bool down) {
    SDL_JoystickSetVirtualButton(joystick_, button, down ? 1 : 0);
  }
  /// Moves the stick to this `fraction` of the speed, through the dead zone and along the curve.
  void push(SDL_GameControllerAxis axis, double fraction) {
    const station::JoystickMapping usual;
    const double offset =
        usual.dead_zone + (1 - usual.dead_zone) * std::pow(std::abs(fraction), 1 / usual.curve);
    SDL_JoystickSetVirtualAxis(
        joystick_, axis, static_cast<Sint16>(fraction == 0 ? 0 : 32767 * std::copysign(offset, fraction)));
  }
  std::unique_ptr<station::JoystickPort> port_;
  std::optional<JoystickConsole> console_;
  SDL_Joystick* joystick_ = nullptr;
  int index_ = -1;
};

TEST_F(JoystickDriveTest, CompletesTheEntranceCourseFromTheConsole) {
  const auto cloud = test::recording("3d-ori-stairs/06.pcd");
  PARHELION_NEEDS_RECORDING(cloud);
  make_site("entrance", cloud);
  sit_down();
  do_all();
}

}  // namespace
}  // namespace parhelion::tools
