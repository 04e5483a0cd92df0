// Simulated robots in scripted runs, moved by the physics: witnesses derive the expected events from the
// motion, by an independent implementation of the rules.
#pragma once

#include <memory>
#include <utility>

#include "robots_world.hpp"
#include "scripted_runs.hpp"

namespace parhelion::test {

/// Moving above 0.05 m/s or 0.1 rad/s, standing after a quarter of a second below 0.02 m/s and 0.04 rad/s.
class MovementWitness {
 public:
  explicit MovementWitness(std::string who = "r") : who_(std::move(who)) {}
  void see(const Eigen::Vector3d& velocity, const Eigen::Vector3d& rotation_rate, double t,
           std::vector<Expected>& expected) {
    const double speed = velocity.norm(), rate = rotation_rate.norm();
    if (!moves_ && (speed > 0.05 || rate > 0.10)) {
      moves_ = true;
      slow_ = 0;
      expected.push_back({EventKind::movement_started, t, "", who_});
    } else if (moves_) {
      slow_ = speed < 0.02 && rate < 0.04 ? slow_ + 1 : 0;
      if (slow_ <= 60) return;
      moves_ = false;
      expected.push_back({EventKind::movement_stopped, t, "", who_});
    }
  }
  void see(const simulation::RobotMotion& motion, double t, std::vector<Expected>& expected) {
    see(motion.velocity, motion.rotation_rate, t, expected);
  }

 private:
  std::string who_;
  bool moves_ = false;
  int slow_ = 0;  // steps
};

/// A contact from its first touch, each second of its duration, and its end after a quarter of a second
/// without touch.
class ContactWitness {
 public:
  ContactWitness(std::string subject, std::string object)
      : subject_(std::move(subject)), object_(std::move(object)) {}
  void see(bool touches, double t, std::vector<Expected>& expected) {
    if (!open_ && !touches) return;
    if (!open_) {
      open_ = true;
      steps_since_report_ = 0;
      expected.push_back({EventKind::contact_started, t, object_, subject_});
    } else {
      ++steps_since_report_;
    }
    apart_ = touches ? 0 : apart_ + 1;
    if (touches && steps_since_report_ >= 240) {
      expected.push_back({EventKind::contact_continues, t, object_, subject_});
      steps_since_report_ = 0;
    }
    if (apart_ <= 60) return;
    open_ = false;
    expected.push_back({EventKind::contact_ended, t, object_, subject_});
  }

 private:
  std::string subject_, object_;
  bool open_ = false;
  int steps_since_report_ = 0, apart_ = 0;  // steps
};

inline Run with_robot(simulation::RobotModel model, SemanticModel site, double duration) {
  Run run{.name = "robot", .duration = duration};
  run.model = std::move(site);
  run.options.robot_models.push_back(std::make_shared<const simulation::RobotModel>(std::move(model)));
  return run;
}

inline void joint(simulation::Simulation& simulation, const std::vector<std::string>& names,
                  double position) {
  Joints command;
  command.names = names;
  command.positions.assign(names.size(), position);
  const Status status = simulation.joint_command("r", command);
  ASSERT_TRUE(status.ok()) << status.error().message;
}

}  // namespace parhelion::test
