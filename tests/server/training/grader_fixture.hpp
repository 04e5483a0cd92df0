// A grader with events and world states from the test.
#pragma once

#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/training/grader.hpp"
#include "tests/model_box.hpp"

namespace parhelion::test {

inline SimulationTime at(double t) { return SimulationTime{1'000'000'000'000} + seconds(t); }

inline Condition on(EventKind kind, const std::string& object = {}) {
  Condition condition;
  condition.event = kind;
  condition.object = object;
  return condition;
}

inline Condition of(Condition::Kind kind, const std::string& target, double distance = 0,
                    double duration = 0) {
  Condition condition;
  condition.kind = kind;
  condition.target = target;
  condition.distance = distance;
  condition.duration = duration;
  return condition;
}

inline Condition join(Condition::Kind kind, std::vector<Condition> parts) {
  Condition condition;
  condition.kind = kind;
  condition.parts = std::move(parts);
  return condition;
}

inline Condition within(Condition condition, double time) {
  condition.within = time;
  return condition;
}

inline Condition never(Condition condition, Condition what) {
  condition.never = {std::move(what)};
  return condition;
}

inline Task task(const std::string& name, double points, Condition done) {
  Task made;
  made.name = name;
  made.points = points;
  made.done = std::move(done);
  return made;
}

inline Penalty penalty(const std::string& name, double points, Condition when) {
  Penalty made;
  made.name = name;
  made.points = points;
  made.when = std::move(when);
  return made;
}

/// Two rooms, a door between them at x = 0, a flight of three steps at x = 4.
inline SemanticModel site() {
  SemanticModel model;
  model.entities.push_back(model_box("door 1", EntityLabel::door, {0, 0, 1}, {1, 0.05, 2}));
  model.entities.back().T_map_body = Transform<Map, Body>(
      Eigen::Quaterniond(Eigen::AngleAxisd(std::acos(0.0), Eigen::Vector3d::UnitZ())), {0, 0, 1});
  model.entities.push_back(model_box("wall 1", EntityLabel::wall, {0, 3, 1.25}, {0.1, 4, 2.5}));
  for (int i = 1; i <= 3; ++i) {
    model.entities.push_back(model_box("step " + std::to_string(i), EntityLabel::stairs,
                                       {4 + 0.3 * i, 0, 0.085 * i}, {0.3, 1, 0.17 * i}));
    model.entities.back().part_of = "stairs 1";
  }
  return model;
}

inline RobotDescription robot_with_wide_camera() {
  RobotDescription description;
  description.name = "rover";
  CameraDescription& camera = description.camera.emplace();
  camera.intrinsics.width = 640;
  camera.intrinsics.height = 480;
  camera.intrinsics.fx = camera.intrinsics.fy = 320;  // 90 degrees wide
  camera.intrinsics.cx = 320;
  camera.intrinsics.cy = 240;
  Eigen::Matrix3d R;  // optical axes: z ahead, x right, y down
  R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  camera.T_base_optical = Transform<Base, CameraOptical>(Eigen::Quaterniond(R), {0, 0, 0.5});
  return description;
}

class GraderTest : public testing::Test {
 protected:
  void start() {
    training_.on_command = false;
    grader_.emplace(training_, model_, robot_, "rover", at(0));
  }

  void add_event(double t, EventKind kind, const std::string& object = {}, double impulse = 0, double x = 0,
                 const std::string& subject = "rover") {
    Event event;
    event.stamp = at(t);
    event.kind = kind;
    event.subject = subject;
    event.object = object;
    event.impulse = impulse;
    event.position = {x, 0, 0};
    grader_->take(event);
  }
  void stand(double t, double x, double y = 0, double yaw = 0,
             std::vector<std::pair<std::string, Eigen::Vector2d>> others = {}) {
    WorldMessage world;
    world.stamp = {at(t).ns};
    world.bodies.emplace_back();
    world.bodies.back().entity = "rover";
    world.bodies.back().T_map_body = Transform<Map, Body>::planar(x, y, yaw, 0);
    for (const auto& [name, place] : others) {
      world.bodies.emplace_back();
      world.bodies.back().entity = name;
      world.bodies.back().T_map_body = Transform<Map, Body>::planar(place.x(), place.y(), 0, 0);
    }
    grader_->take(world);
  }
  training::TaskOutcome outcome(std::size_t i = 0) { return grader_->grade().tasks[i].outcome; }

  Training training_;
  SemanticModel model_ = site();
  RobotDescription robot_ = robot_with_wide_camera();
  std::optional<training::Grader> grader_;
};

}  // namespace parhelion::test
