// The pictures of the shipped robots in server/robots/README.md: the four robots, and the crawler on stairs,
// simulated and rendered.
//   parhelion_robot_pictures FOLDER    writes robots.jpg and stairs.jpg there
#include <cmath>
#include <cstdio>
#include <fstream>
#include <memory>

#include "protocols/angle_units.hpp"
#include "render/compositor.hpp"
#include "server/simulation/simulation.hpp"

namespace parhelion::tools {
namespace {

constexpr double kRise = 0.17, kTread = 0.29;  // m
constexpr int kSteps = 7;

void add(SemanticModel& model, const std::string& name, EntityLabel label, const Eigen::Vector3d& center,
         const Eigen::Vector3d& size) {
  ModelEntity entity;
  entity.name = name;
  entity.label = label;
  entity.T_map_body = Transform<Map, Body>(Eigen::Quaterniond::Identity(), center);
  entity.size = size;
  model.entities.push_back(entity);
}

/// A hall with a flight of steps up along x, from x = 1 m on.
SemanticModel hall(bool stairs) {
  SemanticModel model;
  add(model, "floor 1", EntityLabel::floor, {2, 0, -0.05}, {12, 10, 0.1});
  add(model, "wall 1", EntityLabel::wall, {2, 2.2, 1.5}, {12, 0.2, 3});
  for (int i = 0; stairs && i < kSteps; ++i) {
    const double depth = i + 1 < kSteps ? kTread : 3, top = kRise * (i + 1);
    add(model, "step " + std::to_string(i + 1), EntityLabel::stairs,
        {1 + kTread * i + depth / 2, 0.9, top / 2}, {depth, 2.4, top});
  }
  return model;
}

Result<simulation::Simulation> simulate(const SemanticModel& model) {
  simulation::SimulationOptions options;
  for (const std::string& name : simulation::shipped_robot_models()) {
    auto robot = simulation::load_robot_model(name);
    if (!robot) return robot.error();
    options.robot_models.push_back(std::make_shared<const simulation::RobotModel>(std::move(*robot)));
  }
  RobotDescription nobody;
  nobody.name = "nobody";
  nobody.footprint = {{-0.1, -0.1}, {0.1, -0.1}, {0.1, 0.1}, {-0.1, 0.1}};
  nobody.height = 0.2;
  return simulation::Simulation::create(options, model, nobody, SimulationTime{});
}

Status spawn(simulation::Simulation& simulation, const std::string& model, double x, double y, double yaw) {
  AgentDefinition robot;
  robot.name = robot.model = model;
  robot.kind = AgentKind::robot;
  robot.behaviour.kind = BehaviourKind::teleop;
  robot.T_map_base = Transform<Map, Base>::planar(x, y, yaw);
  return simulation.spawn(robot, std::nullopt);
}

void run(simulation::Simulation& simulation, const std::string& robot, double speed, double duration) {
  std::vector<simulation::LaserRequest> requests;
  const SimulationTime end = simulation.now() + seconds(duration);
  while (simulation.now() < end) {
    if (speed > 0) simulation.teleop(robot, {speed, 0, 0});
    requests.clear();
    simulation.step(std::nullopt, requests);
  }
}

/// A picture of 1600 x 640 pixels from one point towards another.
Status shoot(const simulation::Simulation& simulation, const SemanticModel& model,
             const Eigen::Vector3d& from, const Eigen::Vector3d& to, double focal, const std::string& path) {
  auto virtual_camera = render::VirtualCamera::create(model);
  if (!virtual_camera) return virtual_camera.error();
  CameraDescription camera;
  camera.intrinsics.width = 1600;
  camera.intrinsics.height = 640;
  camera.intrinsics.fx = camera.intrinsics.fy = focal;
  camera.intrinsics.cx = 799.5;
  camera.intrinsics.cy = 319.5;
  Eigen::Matrix3d R_map_optical;
  R_map_optical.col(2) = (to - from).normalized();
  R_map_optical.col(0) = R_map_optical.col(2).cross(Eigen::Vector3d::UnitZ()).normalized();
  R_map_optical.col(1) = R_map_optical.col(2).cross(R_map_optical.col(0));
  WorldSnapshot world;
  if (!simulation.at(simulation.now(), world)) return Error{"the newest step is not in the history"};
  const Transform<Map, CameraOptical> T_map_optical(Eigen::Quaterniond(R_map_optical), from);
  const Image image = (*virtual_camera)->render(camera, T_map_optical, world, SensorTime{}, "");
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(image.bytes.data()),
             static_cast<std::streamsize>(image.bytes.size()));
  file.close();
  return file ? Status() : Status(Error{path + ": cannot be written"});
}

Status joints(simulation::Simulation& simulation, const std::vector<std::string>& names,
              const std::vector<double>& positions) {
  Joints command;
  command.names = names;
  command.positions = positions;
  return simulation.joint_command("crawler", command);
}

Status draw_robots(const std::string& folder) {
  const SemanticModel model = hall(false);
  auto simulation = simulate(model);
  if (!simulation) return simulation.error();
  double x = 0;
  for (const char* name : {"rover", "hauler", "buggy", "crawler"}) {
    if (Status status = spawn(*simulation, name, x, 0, -55 * kRadiansPerDegree); !status) return status;
    x += 1.2;
  }
  const Status raised = joints(*simulation, {"shoulder_joint", "elbow_joint", "wrist_joint"},
                               {95 * kRadiansPerDegree, -100 * kRadiansPerDegree, -30 * kRadiansPerDegree});
  if (!raised) return raised;
  run(*simulation, "crawler", 0, 5);
  return shoot(*simulation, model, {1.5, -3.9, 2.3}, {2.08, 0, 0.22}, 1300, folder + "/robots.jpg");
}

Status draw_stairs(const std::string& folder) {
  const SemanticModel model = hall(true);
  auto simulation = simulate(model);
  if (!simulation) return simulation.error();
  if (Status status = spawn(*simulation, "crawler", 0, 0.3, 0); !status) return status;
  double flippers = 35, max_pitch = 0;
  for (int i = 0; i < 200 && simulation->robot_motion("crawler")->T_map_base.translation().x() < 1.9; ++i) {
    const double up = simulation->robot_motion("crawler")->T_map_base.rotation()(2, 0);
    max_pitch = std::max(max_pitch, std::asin(up) / kRadiansPerDegree);
    flippers = max_pitch > 22 ? -6 : max_pitch > 6 ? -20 : 35;
    const double angle = flippers * kRadiansPerDegree;
    if (Status status = joints(*simulation, {"left_flipper_joint", "right_flipper_joint"}, {angle, angle});
        !status)
      return status;
    run(*simulation, "crawler", 0.3, 0.125);
  }
  return shoot(*simulation, model, {0.2, -3.0, 1.75}, {1.88, 0.3, 0.72}, 1550, folder + "/stairs.jpg");
}

}  // namespace
}  // namespace parhelion::tools

int main(int count, char** arguments) {
  if (count != 2) {
    std::fprintf(stderr, "usage: parhelion_robot_pictures FOLDER\n");
    return 2;
  }
  for (const auto draw : {parhelion::tools::draw_robots, parhelion::tools::draw_stairs}) {
    const parhelion::Status status = draw(arguments[1]);
    if (status) continue;
    std::fprintf(stderr, "parhelion_robot_pictures: %s\n", status.error().message.c_str());
    return 1;
  }
  return 0;
}
