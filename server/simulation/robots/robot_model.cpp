#include "server/simulation/robots/robot_model.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <numbers>

#include "protocols/nearest_name.hpp"
#include "protocols/share.hpp"
#include "protocols/yaml/parts.hpp"
#include "protocols/yaml/robot.hpp"
#include "protocols/yaml/schema.hpp"
#include "protocols/yaml/utf8.hpp"
#include "server/simulation/robots/urdf.hpp"
#include "server/simulation/robots/urdf_meshes.hpp"

namespace parhelion::simulation {
namespace {

using yaml::Node;

constexpr double kOnFloor = 0.02;  // m, maximum distance of a runner from base_link's z = 0
constexpr std::array<const char*, 4> kDriveNames{"differential", "skid", "ackermann", "tracked"};

class Reader {
 public:
  Reader(const std::string& urdf, const std::string& yaml, const std::string& origin)
      : urdf_(urdf), origin_(origin), problems_(origin) {
    model_.urdf = urdf;
    model_.yaml = yaml;
  }

  Result<RobotModel> read() {
    const auto document = yaml::read_checked(model_.yaml, origin_, "robot_model");
    if (!document) return document.error();
    const Node& root = *document;
    const auto folder = std::filesystem::path(origin_).parent_path();
    auto robot = read_urdf(urdf_, (folder / root.find("urdf")->text).string(), materials(root));
    if (!robot) return robot.error();
    model_.links = std::move(robot->links);
    model_.joints = std::move(robot->joints);
    model_.warnings = std::move(robot->warnings);
    check_materials(root, robot->materials);
    read_description(*root.find("robot"));
    read_drive(*root.find("drive"));
    read_links(root);
    read_joints(root);
    if (const Node* attitude = root.find("attitude")) yaml::read_attitude_limits(*attitude, model_.attitude);
    if (problems_.empty()) check_runners(*root.find("drive"));
    if (!problems_.empty()) return problems_.error();
    return std::move(model_);
  }

 private:
  static MaterialTable materials(const Node& root) {
    MaterialTable table;
    const Node* node = root.find("materials");
    for (std::size_t i = 0; node && i < node->items.size(); ++i) {
      Material& material = table[node->keys[i]];
      yaml::read(node->items[i], "roughness", material.roughness);
      yaml::read(node->items[i], "metallic", material.metallic);
      yaml::read(node->items[i], "laser_reflectivity", material.laser_reflectivity);
    }
    return table;
  }

  void check_materials(const Node& root, const std::vector<std::string>& known) {
    const Node* node = root.find("materials");
    for (std::size_t i = 0; node && i < node->keys.size(); ++i) {
      const std::string& name = node->keys[i];
      if (std::find(known.begin(), known.end(), name) == known.end())
        problems_.add(node->key_lines[i], "the URDF has no material '" + yaml::printable(name) + "'" +
                                              suggestion_or_known(name, known));
    }
  }

  template <class Named>
  std::optional<std::size_t> index_of(const std::vector<Named>& all, const std::string& name, int line,
                                      const char* what) {
    const auto found = std::find_if(all.begin(), all.end(), [&](const Named& n) { return n.name == name; });
    if (found != all.end()) return static_cast<std::size_t>(found - all.begin());
    std::vector<std::string> names;
    for (const Named& each : all) names.push_back(each.name);
    problems_.add(line, std::string("the URDF has no ") + what + " '" + yaml::printable(name) + "'" +
                            suggestion(name, names));
    return std::nullopt;
  }

  void read_description(const Node& node) {
    model_.description = yaml::read_robot(node, problems_);
    model_.name = model_.description.name;
    if (model_.description.footprint.empty())
      problems_.add(node.line, "'robot': a footprint is needed: its outline on the floor");
    model_.description.mass = 0;
    for (const RobotLink& link : model_.links) model_.description.mass += link.mass;
    if (!(model_.links.front().mass > 0))
      problems_.add(node.line,
                    "link '" + model_.links.front().name + "', the URDF's first, has no <inertial>");
  }

  void read_drive(const Node& node) {
    RobotDrive& drive = model_.drive;
    yaml::read(node, "kind", kDriveNames, drive.kind);
    yaml::read(node, "acceleration", drive.acceleration);
    yaml::read(node, "force", drive.force);
    yaml::read(node, "friction", drive.friction);
    for (const auto& [key, side] : {std::pair{"left", 1}, std::pair{"right", -1}}) {
      for (const Node& item : node.find(key)->items) {
        const auto link = index_of(model_.links, item.text, item.line, "link");
        if (!link) continue;
        RobotRunner runner;
        runner.link = *link;
        runner.side = side;
        runner.kind = *link > 0 && joint_of(*link).kind == JointKind::continuous ? RobotRunner::Kind::wheel
                                                                                 : RobotRunner::Kind::track;
        if (runner.kind == RobotRunner::Kind::wheel) runner.radius = wheel_radius(*link, item.line);
        drive.runners.push_back(runner);
      }
    }
    if (const Node* passive = node.find("passive")) {
      for (const Node& item : passive->items) set_passive(item);
    }
    if (const Node* steering = node.find("steering")) {
      for (const Node& item : steering->items) set_steering(item);
    }
  }

  const RobotJoint& joint_of(std::size_t link) const { return model_.joints[link - 1]; }

  double wheel_radius(std::size_t link, int line) {
    double radius = 0;
    for (const Shape& shape : model_.links[link].solid) {
      radius = std::max(radius, shape.kind == ShapeKind::mesh ? shape.size.maxCoeff() / 2 : shape.size.x());
    }
    if (radius <= 0)
      problems_.add(line, "wheel '" + model_.links[link].name + "' has no <collision> that could roll");
    return radius;
  }

  void set_passive(const Node& item) {
    const auto link = index_of(model_.links, item.text, item.line, "link");
    if (!link) return;
    bool found = false;
    for (RobotRunner& runner : model_.drive.runners) {
      if (runner.link != *link) continue;
      runner.driven = false;
      found = true;
    }
    if (!found)
      problems_.add(item.line, "'passive': '" + yaml::printable(item.text) + "' is not in left or right");
  }

  void set_steering(const Node& item) {
    const auto joint = index_of(model_.joints, item.text, item.line, "joint");
    if (!joint) return;
    bool found = false;
    for (RobotRunner& runner : model_.drive.runners) {
      for (std::size_t link = runner.link; link > 0; link = joint_of(link).parent) {
        if (link - 1 != *joint) continue;
        runner.steering = *joint;
        found = true;
      }
    }
    if (!found || model_.joints[*joint].kind != JointKind::revolute) {
      problems_.add(item.line, "'steering': joint '" + yaml::printable(item.text) +
                                   "' is not a revolute joint that carries a wheel");
    }
  }

  void read_links(const Node& root) {
    if (const Node* bumpers = root.find("bumpers")) {
      for (const Node& item : bumpers->items) {
        if (index_of(model_.links, item.text, item.line, "link")) model_.bumpers.push_back(item.text);
      }
    }
    if (const Node* gripper = root.find("gripper")) {
      for (const Node& item : gripper->items) {
        if (index_of(model_.links, item.text, item.line, "link")) model_.gripper.push_back(item.text);
      }
    }
    const Node* friction = root.find("friction");
    for (std::size_t i = 0; friction && i < friction->items.size(); ++i) {
      if (const auto link = index_of(model_.links, friction->keys[i], friction->key_lines[i], "link"))
        model_.links[*link].friction = friction->items[i].number;
    }
  }

  void read_joints(const Node& root) {
    struct Table {
      const char* key;
      JointKind kind;
      double RobotJoint::*field;
    };
    for (const Table& table : {Table{"break_torque", JointKind::revolute, &RobotJoint::break_effort},
                               Table{"break_force", JointKind::prismatic, &RobotJoint::break_effort},
                               Table{"posture", JointKind::revolute, &RobotJoint::start},
                               Table{"extension", JointKind::prismatic, &RobotJoint::start}}) {
      const Node* node = root.find(table.key);
      for (std::size_t i = 0; node && i < node->items.size(); ++i)
        read_joint(*node, i, table.key, table.kind, table.field);
    }
    for (RobotJoint& joint : model_.joints) {
      if (joint.geared)
        joint.start = joint.gear_ratio * model_.joints[*joint.geared].start + joint.gear_offset;
      const bool limited = joint.kind == JointKind::revolute || joint.kind == JointKind::prismatic;
      if (!limited || (joint.start >= joint.lower && joint.start <= joint.upper)) continue;
      problems_.add(line_of_start(root, joint.name),
                    "joint '" + joint.name + "' would start at " + text(joint, joint.start) +
                        ", outside its limits " + text(joint, joint.lower) + " to " +
                        text(joint, joint.upper) + "; set it with 'posture' or 'extension'");
    }
  }

  /// Where the file says how a joint starts, else its first line.
  static int line_of_start(const Node& root, const std::string& joint) {
    for (const char* key : {"posture", "extension"}) {
      const Node* node = root.find(key);
      for (std::size_t i = 0; node && i < node->keys.size(); ++i) {
        if (node->keys[i] == joint) return node->key_lines[i];
      }
    }
    return root.line;
  }

  static std::string text(double value, const char* format = "%.3f") {
    char text[32];
    std::snprintf(text, sizeof text, format, value);
    return text;
  }
  static std::string text(const RobotJoint& joint, double value) {
    return joint.kind == JointKind::revolute ? text(value * 180 / std::numbers::pi, "%.1f deg")
                                             : text(value, "%.3f m");
  }

  void read_joint(const Node& node, std::size_t i, const char* key, JointKind kind,
                  double RobotJoint::*field) {
    const auto joint = index_of(model_.joints, node.keys[i], node.key_lines[i], "joint");
    if (!joint) return;
    RobotJoint& its = model_.joints[*joint];
    const JointKind like = its.kind == JointKind::continuous ? JointKind::revolute : its.kind;
    if (like != kind) {
      problems_.add(node.key_lines[i], std::string("'") + key + "': joint '" + its.name + "' does not " +
                                           (kind == JointKind::prismatic ? "slide" : "turn"));
      return;
    }
    its.*field = node.items[i].number;
  }

  /// base_link's frame of each link, joints at 0.
  std::vector<Eigen::Isometry3d> link_poses() const {
    std::vector<Eigen::Isometry3d> poses{Eigen::Isometry3d::Identity()};
    for (const RobotJoint& joint : model_.joints)
      poses.push_back(poses[joint.parent] * joint.T_parent_child.isometry());
    return poses;
  }

  void check_runners(const Node& node) {
    const auto poses = link_poses();
    double left = 0, right = 0, steered = 0, fixed = 0;
    int lefts = 0, rights = 0, steers = 0, fixeds = 0;
    for (const RobotRunner& runner : model_.drive.runners) {
      const RobotLink& link = model_.links[runner.link];
      const Eigen::Vector3d center = poses[runner.link].translation();
      if (runner.kind == RobotRunner::Kind::wheel && std::abs(center.z() - runner.radius) > kOnFloor) {
        problems_.add(node.line, "wheel '" + link.name +
                                     "' reaches down to z = " + text(center.z() - runner.radius) +
                                     " m: the first link's frame must be on the floor, between the wheels");
      }
      const Eigen::Vector3d axis =
          poses[runner.link].linear() * (runner.link > 0 && runner.kind == RobotRunner::Kind::wheel
                                             ? joint_of(runner.link).axis
                                             : Eigen::Vector3d::UnitY());
      if (std::abs(axis.y()) < 0.99)
        problems_.add(node.line, "'" + link.name + "' does not roll forward: its axle must lie along y");
      (runner.side > 0 ? left : right) += center.y();
      ++(runner.side > 0 ? lefts : rights);
      (runner.steering ? steered : fixed) += center.x();
      ++(runner.steering ? steers : fixeds);
    }
    RobotDrive& drive = model_.drive;
    drive.track = left / lefts - right / rights;
    if (!(drive.track > 0))
      problems_.add(node.line, "'left' is not to the left of 'right': y must be larger");
    yaml::read(node, "track", drive.track);
    if (drive.kind == DriveKind::ackermann && (steers == 0 || fixeds == 0)) {
      problems_.add(node.line, "ackermann needs wheels that steer (see 'steering') and wheels that do not");
    } else if (drive.kind == DriveKind::ackermann) {
      drive.wheelbase = steered / steers - fixed / fixeds;
      if (!(drive.wheelbase > 0))
        problems_.add(node.line, "the wheels that steer must be in front of those that do not");
    }
  }

  const std::string& urdf_;
  const std::string& origin_;
  yaml::Problems problems_;
  RobotModel model_;
};

constexpr const char* kShipped = "server/robots";

}  // namespace

Result<RobotModel> parse_robot_model(const std::string& urdf, const std::string& yaml,
                                     const std::string& origin) {
  return Reader(urdf, yaml, origin).read();
}

std::vector<std::string> shipped_robot_models() { return shipped_names(kShipped); }

Result<RobotModel> load_robot_model(const std::string& name_or_path) {
  const std::optional<std::string> path = path_of_shipped(kShipped, name_or_path);
  if (!path) {
    const std::vector<std::string> shipped = shipped_robot_models();
    std::string list;
    for (const std::string& each : shipped) list += (list.empty() ? "" : ", ") + each;
    const std::string near = suggestion(name_or_path, shipped);
    return Error{"no robot model is called '" + yaml::printable(name_or_path) + "'" +
                 (near.empty() ? "." : near) +
                 " Known: " + (list.empty() ? "none found in " + share_path(kShipped).string() : list) +
                 "; or give the path of a .yaml file"};
  }
  const auto text = yaml::read_text(*path);
  if (!text) return text.error();
  // The URDF's name is read first; the whole is checked once both are loaded.
  const auto document = yaml::read_checked(*text, *path, "robot_model");
  if (!document) return document.error();
  const std::string urdf_path =
      (std::filesystem::path(*path).parent_path() / document->find("urdf")->text).string();
  const auto urdf = yaml::read_text(urdf_path);
  if (!urdf) return urdf.error();
  EmbeddedUrdf embedded = embed_meshes(*urdf, urdf_path);
  auto model = parse_robot_model(embedded.urdf, *text, *path);
  if (model)
    model->warnings.insert(model->warnings.begin(), embedded.warnings.begin(), embedded.warnings.end());
  return model;
}

}  // namespace parhelion::simulation
