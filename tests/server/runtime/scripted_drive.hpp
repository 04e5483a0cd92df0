// A session of a shipped level 1 scenario, driven by a script like an operator: TELEOP and JOINT_CMD in,
// events out. As fast as possible.
#pragma once

#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>

#include "server/runtime/session_files.hpp"
#include "tests/server/tick/crawler_arm.hpp"
#include "tests/server/tick/tick_fixture.hpp"

namespace parhelion::test {

class ScriptedDrive : public TickTest {
 protected:
  static constexpr double kDegree = std::numbers::pi / 180;

  /// `change`: the test's changes to the scenario.
  void load(const std::string& scenario, const std::function<void(Scenario&)>& change = {}) {
    auto files = runtime::load_session_files(scenario, "");
    ASSERT_TRUE(files.ok()) << files.error().message;
    if (change) change(files->scenario);
    auto robot = tick::trainee_description(files->scenario, files->robot_models);
    ASSERT_TRUE(robot.ok()) << robot.error().message;
    auto made = tick::configure(files->scenario, *robot, files->model, files->robot_models);
    ASSERT_TRUE(made.ok()) << made.error().message;
    start(std::move(*made));
    now_ = ArrivalTime{state_->simulation.now().ns};
  }

  /// Commands `ask()` twenty times a second, until `done` or for `limit` s.
  bool drive(const std::function<Twist2()>& ask, const std::function<bool()>& done, double limit) {
    for (const ArrivalTime end = now_ + seconds(limit); now_ < end && !done();) {
      now_ = now_ + milliseconds(50);
      send(message(channel::kTeleop, now_.utime(), TwistCommand{SensorTime{now_.ns}, ask()}));
    }
    return done();
  }
  bool drive(const Twist2& twist, const std::function<bool()>& done, double limit) {
    return drive([twist] { return twist; }, done, limit);
  }
  void wait(double duration) {
    drive(
        Twist2{}, [] { return false; }, duration);
  }
  /// Towards a position: turns on the spot first, then drives.
  Twist2 towards(const Eigen::Vector2d& place, double speed) {
    const Eigen::Vector2d to_place = place - motion().T_map_base.translation().head<2>();
    const Eigen::Matrix3d R = motion().T_map_base.rotation();
    const double off = std::remainder(std::atan2(to_place.y(), to_place.x()) - std::atan2(R(1, 0), R(0, 0)),
                                      2 * std::numbers::pi);
    return {std::abs(off) > 0.2 ? 0 : speed, 0, std::clamp(2.0 * off, -0.8, 0.8)};
  }
  bool drive_to(const Eigen::Vector2d& place, double speed, double limit,
                const std::function<bool()>& done = {}) {
    const auto ask = [&] { return towards(place, speed); };
    const auto there = [&] {
      return (motion().T_map_base.translation().head<2>() - place).norm() < 0.12 || (done && done());
    };
    return drive(ask, there, limit);
  }
  /// Drives the tracked robot up a flight of stairs: flippers on the first step, then pressed down on its
  /// tread, then in line with the tracks.
  bool climb_to(const Eigen::Vector2d& place, double limit) {
    std::size_t phase = 0;
    ArrivalTime pressed;
    const auto ask = [&] {
      const double pitch = std::asin(motion().T_map_base.rotation()(2, 0));
      if (phase == 0 && pitch > 6 * kDegree) phase = 1;
      if (phase == 1 && pitch > 22 * kDegree) phase = 2;
      // A single step, or the end of a flight: ready for the next one.
      if (phase != 1) pressed = now_;
      if ((phase == 1 && now_ - pressed > seconds(4)) || (phase == 2 && pitch < 4 * kDegree)) phase = 0;
      const double angle = std::array{35, -20, -6}[phase] * kDegree;
      send_flippers(angle);
      return towards(place, 0.3);
    };
    const auto there = [&] { return (motion().T_map_base.translation().head<2>() - place).norm() < 0.12; };
    return drive(ask, there, limit);
  }

  void send_flippers(double angle) {
    send_joints({{"left_flipper_joint", angle}, {"right_flipper_joint", angle}});
  }
  /// Moves joints to positions, for `duration` s.
  void move_joints(const std::map<std::string, double>& positions, double duration) {
    for (const ArrivalTime end = now_ + seconds(duration); now_ < end;) {
      now_ = now_ + milliseconds(50);
      send_joints(positions);
    }
  }
  /// Moves the crawler's gripper there (crawler_reach).
  void reach(double ahead, double z, double turned, double duration) {
    move_joints(crawler_reach(ahead, z, turned), duration);
  }
  /// Moves the part from the robot's right into the container on its left, as placed by the shipped
  /// scenarios.
  void lift_part_into_container() {
    const double part = -90 * kDegree, tub = 90 * kDegree;  // beside the robot at its start
    reach(0.68, 0.40, part, 5);
    reach(0.68, 0.11, part, 3);
    move_joints({{"left_finger_joint", 0.079}}, 1.5);
    reach(0.66, 0.50, part, 4);
    reach(0.68, 0.50, tub, 7);
    reach(0.68, 0.30, tub, 2);
    move_joints({{"left_finger_joint", 0.04}}, 0.5);
    move_joints({{"left_finger_joint", 0}}, 2);
  }
  /// The trainee's report of an object, with its position.
  void report(const std::string& what, const Eigen::Vector2d& place) {
    now_ = now_ + microseconds(1);
    const ObjectReport report{.stamp = SensorTime{now_.ns}, .object = what, .position = place};
    send(message(channel::kMrObjectReport, now_.utime(), report));
  }
  /// Receives the server's outputs, in order.
  virtual void handle_output(const tick::Outputs::Entry& /*entry*/) {}

  const simulation::RobotMotion& motion() {
    return *state_->simulation.robot_motion(configuration_.scenario.trainee->name);
  }
  /// Since the start; with `object`, if given.
  bool happened(EventKind kind, const std::string& object = "") const {
    return std::any_of(events_.begin(), events_.end(), [&](const Event& event) {
      return event.kind == kind && (object.empty() || event.object == object || event.subject == object);
    });
  }
  std::string event_log() const {
    std::string text;
    for (const Event& event : events_)
      text += std::to_string(event.stamp.ns / 1'000'000 - kStartUs / 1000) + " " + to_string(event.kind) +
              " " + event.subject + " " + event.object + " " + std::to_string(event.value) + "\n";
    return text;
  }

  /// Keeps the newest outputs' events.
  void take_events() {
    for (const tick::Outputs::Entry& entry : outputs_.entries()) {
      handle_output(entry);
      if (entry.channel != channel::kMrEvents) continue;
      Event event;
      ASSERT_TRUE(decode(entry.channel, entry.payload, event).ok());
      events_.push_back(std::move(event));
    }
  }

  ArrivalTime now_;
  std::vector<Event> events_;

 private:
  void send_joints(const std::map<std::string, double>& positions) {
    Joints joints;
    joints.stamp = SensorTime{now_.ns};
    for (const auto& [name, position] : positions) {
      joints.names.push_back(name);
      joints.positions.push_back(position);
    }
    now_ = now_ + microseconds(1);
    send(message(channel::kJointCmd, now_.utime(), joints));
  }
  void send(const Message& input) {
    outputs_.clear();
    tick::tick(configuration_, input, *state_, outputs_, observer_);
    take_events();
  }
};

}  // namespace parhelion::test
