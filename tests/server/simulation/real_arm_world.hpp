// The example's robot with its arm in a simulation, moved as if by its encoders.
#pragma once

#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "server/simulation/building/planar.hpp"
#include "server/simulation/robots/robot_model.hpp"
#include "worlds.hpp"

namespace parhelion::test {

inline std::shared_ptr<const simulation::RobotModel> example_model() {
  static const std::shared_ptr<const simulation::RobotModel> model = [] {
    auto read = simulation::load_robot_model(std::string(PARHELION_SOURCE_DIR) + "/examples/robot/body.yaml");
    EXPECT_TRUE(read.ok()) << (read ? "" : read.error().message);
    return std::make_shared<const simulation::RobotModel>(std::move(read).value());
  }();
  return model;
}

inline RobotDescription robot_with_arm() {
  auto read = load_robot_description(std::string(PARHELION_SOURCE_DIR) + "/examples/robot/robot.yaml");
  EXPECT_TRUE(read.ok()) << (read ? "" : read.error().message);
  read->model = example_model()->name;
  return std::move(read).value();
}

/// The hand level, the point between its pads at `reach` m from the turret's axis and z m over the floor; the
/// gap between the fingers in m.
inline std::map<std::string, double> hand_at(double reach, double z, double turret, double gap) {
  constexpr double upper = 0.36, fore = 0.32, hand = 0.14, shoulder = 0.66;
  const double dx = reach - hand, dz = z - shoulder, d2 = dx * dx + dz * dz, d = std::sqrt(d2);
  const double elbow = -std::acos((d2 - upper * upper - fore * fore) / (2 * upper * fore));
  const double lifted = std::atan2(dz, dx) + std::acos((d2 + upper * upper - fore * fore) / (2 * upper * d));
  return {{"turret", turret},
          {"shoulder", lifted},
          {"elbow", elbow},
          {"wrist", -lifted - elbow},
          {"gripper", gap / 2}};
}

/// A real robot whose encoders are what a test says; joints move with constant velocity from call to call.
class RealArmWorld : public testing::Test {
 protected:
  using Posture = std::map<std::string, double>;

  void start(const RobotDescription& description = robot_with_arm(), const SemanticModel& model = room(8)) {
    simulation::SimulationOptions options;
    options.robot_models.push_back(example_model());
    auto made = simulation::Simulation::create(options, model, description, kStart);
    ASSERT_TRUE(made.ok()) << made.error().message;
    simulation_.emplace(std::move(*made));
    posture_ = hand_at(0.45, 0.75, 0, 0.1);
  }
  void spawn(AgentDefinition thing, const Eigen::Vector3d& size, double mass = 0) {
    thing.size = size;
    thing.mass = mass;
    const Status spawned = simulation_->spawn(thing, real_);
    ASSERT_TRUE(spawned.ok()) << spawned.error().message;
  }
  /// To this posture within `duration` s, with the base moving with `twist`.
  void move(const Posture& to, double duration, const Twist2& twist = {}) {
    const int steps = std::max(1, static_cast<int>(std::lround(duration / kStep)));
    const Posture from = posture_;
    for (int i = 1; i <= steps; ++i) {
      for (const auto& [joint, position] : to)
        posture_[joint] = from.at(joint) + (position - from.at(joint)) * i / steps;
      Posture speeds;
      for (const auto& [joint, position] : to) speeds[joint] = (position - from.at(joint)) / (steps * kStep);
      step(speeds, twist);
    }
  }
  void wait(double duration) {
    for (int i = 0; i < std::lround(duration / kStep); ++i) step({}, {});
  }
  void step(const Posture& speeds, const Twist2& twist) {
    const auto& joints = example_model()->joints;
    simulation::JointPosture encoders{std::vector<double>(joints.size(), 0),
                                      std::vector<double>(joints.size(), 0)};
    for (std::size_t i = 0; i < joints.size(); ++i) {
      if (const auto at = posture_.find(joints[i].name); at != posture_.end())
        encoders.positions[i] = at->second;
      if (const auto at = speeds.find(joints[i].name); at != speeds.end())
        encoders.velocities[i] = at->second;
    }
    simulation_->set_encoders(encoders, fresh_);
    const Pose2 moved = simulation::advance(planar(real_.T_map_base), twist, kStep);
    real_.T_map_base = Transform<Map, Base>::planar(moved.x, moved.y, moved.yaw);
    real_.twist = twist;
    std::vector<simulation::LaserRequest> requests;
    simulation_->step(there_ ? std::optional(real_) : std::nullopt, requests);
    for (Event& event : simulation_->take_events()) events_.push_back(std::move(event));
  }
  std::vector<std::string> gripper_events() const {
    std::vector<std::string> names;
    for (const Event& event : events_) {
      switch (event.kind) {
        case EventKind::gripped:
        case EventKind::lifted:
        case EventKind::dropped:
        case EventKind::placed:
        case EventKind::payload_exceeded:
        case EventKind::joint_overload:
          names.push_back(std::string(to_string(event.kind)) + " " + event.object);
          break;
        default:
          break;
      }
    }
    return names;
  }
  Eigen::Vector3d place_of(const std::string& name) const {
    return simulation_->pose_of(name)->translation();
  }
  /// A post of `width` in front of the robot, gripped.
  void grip(double width = 0.06, double mass = 0.5) {
    spawn(agent("post", AgentKind::box, 0.6, 0), {width, width, 0.45}, mass);
    move(hand_at(0.44, 0.38, 0, 0.1), 1);
    move(hand_at(0.60, 0.38, 0, 0.1), 1);
    move(hand_at(0.60, 0.38, 0, width), 0.5);
    wait(0.1);
  }

  std::optional<simulation::Simulation> simulation_;
  simulation::RealRobotState real_;
  Posture posture_;
  bool fresh_ = true, there_ = true;
  std::vector<Event> events_;
};

}  // namespace parhelion::test
