#include "server/simulation/bodies/bodies.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "server/simulation/bodies/cable.hpp"
#include "server/simulation/bodies/gait.hpp"
#include "server/simulation/bodies/real_state.hpp"

namespace parhelion::simulation {
namespace {

constexpr double kPersonRadius = 0.30, kPersonHeight = 1.75;                    // m
constexpr double kRobotLength = 0.52, kRobotWidth = 0.48, kRobotHeight = 0.80;  // m

Material paint(float r, float g, float b, float roughness, float metallic = 0, float reflectivity = 0.5F) {
  return {{r, g, b}, roughness, metallic, reflectivity};
}
const Material kShell = paint(0.75F, 0.76F, 0.78F, 0.35F, 0, 0.7F);
const Material kAccent = paint(0.02F, 0.22F, 0.55F, 0.3F, 0, 0.3F);
const Material kRubber = paint(0.02F, 0.02F, 0.02F, 0.9F, 0, 0.1F);
const Material kMetal = paint(0.55F, 0.56F, 0.58F, 0.3F, 1, 0.6F);
const Material kCarton = paint(0.48F, 0.32F, 0.17F, 0.85F, 0, 0.6F);
const Material kTape = paint(0.62F, 0.52F, 0.34F, 0.4F, 0, 0.6F);
const Material kTub = paint(0.10F, 0.28F, 0.12F, 0.5F, 0, 0.5F);
const Material kBarrelBlue = paint(0.02F, 0.10F, 0.42F, 0.4F, 0, 0.4F);
const Material kSkin = paint(0.52F, 0.32F, 0.23F, 0.6F, 0, 0.6F);
const Material kHair = paint(0.05F, 0.03F, 0.02F, 0.8F, 0, 0.2F);
const Material kShirt = paint(0.42F, 0.05F, 0.04F, 0.85F, 0, 0.5F);
const Material kTrousers = paint(0.04F, 0.05F, 0.10F, 0.9F, 0, 0.3F);
const Material kShoe = paint(0.03F, 0.03F, 0.03F, 0.5F, 0, 0.2F);

using ShapePose = Transform<Body, ShapeFrame>;

Shape box(const Eigen::Vector3d& size, const Eigen::Vector3d& center, const Material& material) {
  return {ShapeKind::box, size, ShapePose(Eigen::Quaterniond::Identity(), center), material};
}
Shape cylinder(double radius, double height, const Eigen::Vector3d& center, const Material& material) {
  return {ShapeKind::cylinder,
          {radius, radius, height},
          ShapePose(Eigen::Quaterniond::Identity(), center),
          material};
}
/// Axis along y.
Shape axle(double radius, double width, const Eigen::Vector3d& center, const Material& material) {
  const Eigen::Quaterniond lying(Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitX()));
  return {ShapeKind::cylinder, {radius, radius, width}, ShapePose(lying, center), material};
}
Shape sphere(double radius, const Eigen::Vector3d& center, const Material& material) {
  return {ShapeKind::sphere,
          {radius, radius, radius},
          ShapePose(Eigen::Quaterniond::Identity(), center),
          material};
}
/// Upright, from z = bottom to z = top of its round ends.
Shape capsule(double radius, double bottom, double top, const Eigen::Vector2d& axis,
              const Material& material) {
  return {ShapeKind::capsule,
          {radius, radius, top - bottom - 2 * radius},
          ShapePose(Eigen::Quaterniond::Identity(), {axis.x(), axis.y(), (top + bottom) / 2}),
          material};
}

std::vector<Shape> carton(const Eigen::Vector3d& size) {
  // The tape is thinner than a laser's resolution; it makes a carton recognizable.
  const double tape = 0.002, width = std::min(0.05, size.y() / 3);
  return {box({size.x(), size.y(), size.z() - tape}, {0, 0, (size.z() - tape) / 2}, kCarton),
          box({size.x(), width, tape}, {0, 0, size.z() - tape / 2}, kTape)};
}

/// Bottom, and sides up to the rim.
std::vector<Shape> container(const Eigen::Vector3d& size) {
  constexpr double wall = kContainerWall;
  const double height = size.z() - wall, z = wall + height / 2;
  const Eigen::Vector2d out = (size.head<2>().array() - wall) / 2;
  return {box({size.x(), size.y(), wall}, {0, 0, wall / 2}, kTub),
          box({wall, size.y(), height}, {out.x(), 0, z}, kTub),
          box({wall, size.y(), height}, {-out.x(), 0, z}, kTub),
          box({size.x() - 2 * wall, wall, height}, {0, out.y(), z}, kTub),
          box({size.x() - 2 * wall, wall, height}, {0, -out.y(), z}, kTub)};
}

std::vector<Shape> barrel(double radius, double height) {
  const double rib = std::min(0.02, height / 12), inset = std::min(0.008, radius / 10);
  std::vector<Shape> shapes{cylinder(radius - inset, height, {0, 0, height / 2}, kBarrelBlue)};
  for (const double part : {0.0, 1.0 / 3, 2.0 / 3, 1.0}) {
    shapes.push_back(cylinder(radius, rib, {0, 0, rib / 2 + part * (height - rib)}, kMetal));
  }
  return shapes;
}

std::vector<Shape> robot_chassis() {
  // Every horizontal plane up to the top cuts a solid outline, so that lasers at any height hit the robot.
  return {box({kRobotLength, 0.36, 0.22}, {0, 0, 0.17}, kShell),
          box({0.36, kRobotWidth, 0.08}, {-0.08, 0, 0.28}, kAccent),
          cylinder(0.06, 0.08, {0.20, 0, 0.30}, kRubber),
          box({0.36, 0.40, 0.36}, {-0.08, 0, 0.50}, kShell),
          box({0.02, 0.30, 0.16}, {0.11, 0, 0.56}, kRubber),
          cylinder(0.14, 0.06, {-0.08, 0, 0.71}, kAccent),
          cylinder(0.05, 0.06, {-0.08, 0, 0.77}, kRubber),
          sphere(0.03, {-0.20, 0, 0.03}, kRubber),
          box({0.03, 0.03, 0.06}, {-0.20, 0, 0.06}, kMetal)};
}

std::vector<Shape> robot_wheel(double outward) {
  std::vector<Shape> shapes{axle(kRobotDrive.wheel_radius, 0.05, {0, 0, 0}, kRubber),
                            axle(0.065, 0.052, {0, 0, 0}, kMetal)};
  // Off-centre bolts make the rotation visible.
  for (int i = 0; i < 3; ++i) {
    const double angle = 2 * std::numbers::pi * i / 3;
    const Eigen::Vector3d center(0.045 * std::cos(angle), outward * 0.026, 0.045 * std::sin(angle));
    shapes.push_back(axle(0.010, 0.006, center, kRubber));
  }
  return shapes;
}

std::vector<Shape> torso() {
  return {capsule(0.135, 0.84, 1.47, {0, 0.055}, kShirt),
          capsule(0.135, 0.84, 1.47, {0, -0.055}, kShirt),
          capsule(0.12, 0.80, 1.06, {0, 0.05}, kTrousers),
          capsule(0.12, 0.80, 1.06, {0, -0.05}, kTrousers),
          cylinder(0.05, 0.10, {0.01, 0, 1.50}, kSkin),
          sphere(0.105, {0.02, 0, 1.63}, kSkin),
          sphere(0.108, {0.0, 0, 1.645}, kHair)};
}

std::vector<Shape> arm() {
  return {capsule(0.048, -0.33, 0.04, {0, 0}, kShirt), capsule(0.036, -0.58, -0.27, {0, 0}, kSkin),
          sphere(0.045, {0.01, 0, -0.62}, kSkin)};
}

std::vector<Shape> thigh() { return {capsule(0.078, -kPerson.thigh - 0.05, 0.06, {0, 0}, kTrousers)}; }
std::vector<Shape> shank() { return {capsule(0.056, -kPerson.shank - 0.02, 0.05, {0, 0}, kTrousers)}; }
std::vector<Shape> foot() {
  // The sole is at -ankle: on the floor while standing.
  return {box({0.24, 0.085, 0.05}, {0.06, 0, -kPerson.ankle + 0.025}, kShoe),
          sphere(0.05, {0, 0, -kPerson.ankle + 0.055}, kShoe)};
}

class Assembly {
 public:
  Assembly(const AgentDefinition& agent, BodyId first) : agent_(agent), next_(first) {}
  void add(const char* part, std::vector<Shape> shapes) {
    bodies_.push_back({next_++, agent_.name, part, BodyOwner::agent, true, std::move(shapes)});
  }
  std::vector<BodyDefinition> take() { return std::move(bodies_); }

 private:
  const AgentDefinition& agent_;
  BodyId next_;
  std::vector<BodyDefinition> bodies_;
};

void add_person(Assembly& assembly) {
  assembly.add("torso", torso());
  assembly.add("left_arm", arm());
  assembly.add("right_arm", arm());
  assembly.add("left_thigh", thigh());
  assembly.add("left_shank", shank());
  assembly.add("left_foot", foot());
  assembly.add("right_thigh", thigh());
  assembly.add("right_shank", shank());
  assembly.add("right_foot", foot());
}

}  // namespace

std::vector<BodyDefinition> agent_bodies(const AgentDefinition& agent, BodyId first_id) {
  Assembly assembly(agent, first_id);
  switch (agent.kind) {
    case AgentKind::box:
      assembly.add("box", carton(agent.size));
      break;
    case AgentKind::barrel:
      assembly.add("barrel", barrel(agent.size.x() / 2, agent.size.z()));
      break;
    case AgentKind::person:
      add_person(assembly);
      break;
    case AgentKind::container:
      assembly.add("container", container(agent.size));
      break;
    case AgentKind::cable:
      for (const BodyDefinition& link : cable_bodies(agent.size))
        assembly.add(link.part.c_str(), link.shapes);
      break;
    case AgentKind::robot:
      assembly.add("chassis", robot_chassis());
      assembly.add("left_wheel", robot_wheel(1));
      assembly.add("right_wheel", robot_wheel(-1));
      break;
  }
  return assembly.take();
}

AgentForm agent_form(const AgentDefinition& agent) {
  const Eigen::Vector3d& size = agent.size;
  constexpr double density = 120;  // kg/m^3: a filled carton, a half-empty barrel
  switch (agent.kind) {
    case AgentKind::box:
      return {ShapeKind::box, size, std::max(0.1, density * size.prod()), false,
              make_rectangle(size.x(), size.y())};
    case AgentKind::barrel:
      return {ShapeKind::cylinder, size, std::max(0.1, density * std::numbers::pi / 4 * size.prod()), false,
              make_disc({0, 0}, size.x() / 2)};
    case AgentKind::person:
      return {ShapeKind::cylinder,
              {2 * kPersonRadius, 2 * kPersonRadius, kPersonHeight},
              75,
              true,
              make_disc({0, 0}, kPersonRadius)};
    case AgentKind::container: {
      constexpr double wall_density = 600;  // kg/m^3, ribs and handles counted as wall
      AgentForm form{ShapeKind::box, size, 0, false, make_rectangle(size.x(), size.y()), container(size)};
      for (const Shape& piece : form.pieces) form.mass += wall_density * piece.size.prod();
      return form;
    }
    case AgentKind::cable:
      return {ShapeKind::box, size, cable_form(size).mass, false, make_rectangle(size.x(), size.y())};
    case AgentKind::robot:
      break;
  }
  return {ShapeKind::box,
          {kRobotLength, kRobotWidth, kRobotHeight},
          30,
          true,
          make_rectangle(kRobotLength, kRobotWidth)};
}

AgentForm robot_form(const RobotModel& model) {
  const auto& corners = model.description.footprint;
  Eigen::Vector2d half_sizes = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& corner : corners) half_sizes = half_sizes.cwiseMax(corner.cwiseAbs());
  return {ShapeKind::box,
          {2 * half_sizes.x(), 2 * half_sizes.y(), model.description.height},
          model.description.mass,
          true,
          make_polygon(convex_hull(corners))};
}

Status check_size(const AgentDefinition& agent) {
  if (agent.kind == AgentKind::person || agent.kind == AgentKind::robot) return {};
  const Eigen::Vector3d& size = agent.size;
  const std::string text =
      std::to_string(size.x()) + " x " + std::to_string(size.y()) + " x " + std::to_string(size.z());
  if (agent.kind == AgentKind::cable) return check_cable(agent.name, size);
  if (agent.kind == AgentKind::container && !(size.minCoeff() >= 4 * kContainerWall)) {
    return Error{"agent '" + agent.name + "': size " + text +
                 " m; a container has walls of 1.5 cm: expected each length to be at least 6 cm"};
  }
  if (!size.allFinite() || size.minCoeff() < 0.02 || size.maxCoeff() > 20) {
    return Error{"agent '" + agent.name + "': size " + text + " m; expected each length from 0.02 to 20 m"};
  }
  if (agent.kind == AgentKind::barrel && std::abs(size.x() - size.y()) > 1e-6) {
    return Error{"agent '" + agent.name + "': size " + text +
                 " m; a barrel is round: give the same length for x and y"};
  }
  return {};
}

double stride_length(double speed) { return std::clamp(0.7 + 0.5 * speed, 0.7, 1.5); }

void part_poses(const AgentDefinition& agent, const PartMotion& motion,
                std::vector<Transform<Base, Body>>& poses) {
  const auto wheel = [](double angle, double y) {
    return Transform<Base, Body>(Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY())),
                                 {0, y, kRobotDrive.wheel_radius});
  };
  switch (agent.kind) {
    case AgentKind::box:
    case AgentKind::barrel:
    case AgentKind::container:
      poses.emplace_back();
      break;
    case AgentKind::cable:
      cable_poses(agent.size, poses);
      break;
    case AgentKind::person:
      gait_poses(motion.gait_phase, motion.gait_amplitude, stride_length(agent.behaviour.speed), poses);
      break;
    case AgentKind::robot:
      poses.emplace_back();
      poses.push_back(wheel(motion.wheel_left, kRobotDrive.track / 2));
      poses.push_back(wheel(motion.wheel_right, -kRobotDrive.track / 2));
      break;
  }
}

Transform<Base, Laser> agent_laser_mount() {
  return {Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.20, 0, 0.30)};
}

std::vector<Shape> outline_shapes(const std::vector<Eigen::Vector2d>& footprint, double height) {
  constexpr double thickness = 0.004;  // m
  std::vector<Shape> shapes;
  for (std::size_t i = 0; i < footprint.size(); ++i) {
    const Eigen::Vector2d a = footprint[i], b = footprint[(i + 1) % footprint.size()];
    const Eigen::Vector2d along = (b - a).normalized();
    const Eigen::Vector2d middle = (a + b) / 2 + Eigen::Vector2d(-along.y(), along.x()) * thickness / 2;
    const Eigen::Quaterniond turned(
        Eigen::AngleAxisd(std::atan2(along.y(), along.x()), Eigen::Vector3d::UnitZ()));
    shapes.push_back({ShapeKind::box,
                      {(b - a).norm(), thickness, height},
                      Transform<Body, ShapeFrame>(turned, {middle.x(), middle.y(), height / 2}),
                      {}});
  }
  return shapes;
}

}  // namespace parhelion::simulation
