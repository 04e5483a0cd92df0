// A small scenario with a training as a user writes it, and the inputs of its grader.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "protocols/scenario.hpp"
#include "server/training/grader.hpp"
#include "tests/model_box.hpp"

namespace parhelion::test {

/// An event's differences from "by the rover, about nothing".
struct EventFields {
  std::string object = {};
  double impulse = 0;  // N s
  double value = 0;
  double x = 0;  // m, position
  std::string subject = "rover";
  bool undetectable = false;
};

/// An agent's pose.
struct Stands {
  std::string who;
  double x = 0, y = 0, yaw = 0;  // m, rad
};

class SyntheticSession {
 public:
  /// `training`: the YAML below `training:`, indented by two.
  explicit SyntheticSession(const std::string& training) {
    auto scenario = parse_scenario("training:\n  start: with session\n" + training, "told.yaml");
    EXPECT_TRUE(scenario.ok()) << scenario.error().message;
    if (!scenario) return;
    scenario_ = std::make_unique<Scenario>(std::move(*scenario));
    grader_ = std::make_unique<training::Grader>(*scenario_->training, model_, robot_, "rover", at(0));
  }

  static SimulationTime at(double t) { return SimulationTime{1'000'000'000'000} + seconds(t); }

  SyntheticSession& add_event(double t, EventKind kind, const EventFields& fields = {}) {
    Event event;
    event.stamp = at(t);
    event.kind = kind;
    event.subject = fields.subject;
    event.object = fields.object;
    event.impulse = fields.impulse;
    event.value = fields.value;
    event.position = {fields.x, 0, 0};
    event.undetectable = fields.undetectable;
    grader_->take(event);
    return *this;
  }
  SyntheticSession& world(double t, const std::vector<Stands>& all = {{"rover"}}) {
    WorldMessage world;
    world.stamp = {at(t).ns};
    for (const Stands& one : all) {
      world.bodies.emplace_back();
      world.bodies.back().entity = one.who;
      world.bodies.back().T_map_body = Transform<Map, Body>::planar(one.x, one.y, one.yaw, 0);
    }
    grader_->take(world);
    return *this;
  }
  SyntheticSession& closes(double t) {
    grader_->close(at(t));
    return *this;
  }
  training::Grade grade() const { return grader_->grade(); }
  double score() const { return grade().score; }
  training::TaskOutcome outcome(std::size_t task = 0) const { return grade().tasks[task].outcome; }

 private:
  /// Two rooms with a door between them at x = 0, a window in the wall beside it, and two flights of stairs.
  static SemanticModel site() {
    SemanticModel model;
    model.entities.push_back(model_box("door 1", EntityLabel::door, {0, 0, 1}, {1, 0.05, 2}));
    model.entities.back().T_map_body = Transform<Map, Body>(
        Eigen::Quaterniond(Eigen::AngleAxisd(std::acos(0.0), Eigen::Vector3d::UnitZ())), {0, 0, 1});
    model.entities.push_back(model_box("wall 1", EntityLabel::wall, {0, 3, 1.25}, {0.1, 4, 2.5}));
    model.entities.push_back(model_box("window 1", EntityLabel::window, {0, -2, 1.25}, {0.1, 2, 2.5}));
    for (const auto& [flight, x] : {std::pair("stairs 1", 4.0), std::pair("stairs 2", 8.0)}) {
      for (int i = 1; i <= 3; ++i) {
        model.entities.push_back(model_box(std::string(flight) + " step " + std::to_string(i),
                                           EntityLabel::stairs, {x + 0.3 * i, 0, 0.085 * i},
                                           {0.3, 1, 0.17 * i}));
        model.entities.back().part_of = flight;
      }
    }
    return model;
  }
  /// With a camera half a metre above the floor and a field of view of 90 degrees ahead.
  static RobotDescription rover() {
    RobotDescription description;
    description.name = "rover";
    CameraDescription& camera = description.camera.emplace();
    camera.intrinsics.width = camera.intrinsics.height = 640;
    camera.intrinsics.fx = camera.intrinsics.fy = camera.intrinsics.cx = camera.intrinsics.cy = 320;
    Eigen::Matrix3d R;  // optical axes: z ahead, x right, y down
    R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    camera.T_base_optical = Transform<Base, CameraOptical>(Eigen::Quaterniond(R), {0, 0, 0.5});
    return description;
  }

  const SemanticModel model_ = site();
  const RobotDescription robot_ = rover();
  std::unique_ptr<Scenario> scenario_;
  std::unique_ptr<training::Grader> grader_;
};

}  // namespace parhelion::test
