#include "server/simulation/urdf.hpp"

#include <console_bridge/console.h>
#include <urdf_parser/urdf_parser.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <mutex>
#include <set>

#ifdef PARHELION_ADDRESS_SANITIZER
#include <sanitizer/lsan_interface.h>
#endif

namespace parhelion::simulation {
namespace {

/// Links of liburdfdom reference each other by shared pointers: those of a joint loop, which it rejects, are
/// never freed. Leak checkers ignore allocations during this object's lifetime.
struct LeaksOfUrdfdom {
#ifdef PARHELION_ADDRESS_SANITIZER
  LeaksOfUrdfdom() { __lsan_disable(); }
  ~LeaksOfUrdfdom() { __lsan_enable(); }
#else
  LeaksOfUrdfdom() {}
#endif
};

/// Captures liburdfdom's messages, which it writes to a console.
class Listener : public console_bridge::OutputHandler {
 public:
  Listener() {
    console_bridge::useOutputHandler(this);
    console_bridge::setLogLevel(console_bridge::CONSOLE_BRIDGE_LOG_ERROR);
  }
  ~Listener() override { console_bridge::restorePreviousOutputHandler(); }
  void log(const std::string& text, console_bridge::LogLevel, const char*, int) override {
    if (first_message.empty()) first_message = text;
  }
  std::string first_message;
};

int line_at(const std::string& text, std::size_t place) {
  return 1 +
         static_cast<int>(std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(place), '\n'));
}

class Reader {
 public:
  Reader(const std::string& urdf, const std::string& origin, const MaterialTable& materials)
      : urdf_(urdf), origin_(origin), materials_(materials) {}

  Result<UrdfRobot> read() {
    if (const auto fault = xml_fault()) return *fault;
    const urdf::ModelInterfaceSharedPtr model = parse();
    if (!model) return fault_;
    if (Status status = check_tree(*model); !status) return status.error();
    add_link(*model->getRoot());
    if (Status status = add_children(*model->getRoot(), 0); !status) return status.error();
    if (Status status = add_gears(*model); !status) return status.error();
    return std::move(robot_);
  }

 private:
  Error at(const char* tag, const std::string& name, const std::string& words) const {
    const int line = urdf_line(urdf_, tag, name);
    return Error{origin_ + (line > 0 ? ":" + std::to_string(line) : "") + ": " + tag + " '" + name +
                 "': " + words};
  }

  std::optional<Error> xml_fault() const {
    TiXmlDocument document;
    document.Parse(urdf_.c_str());
    if (!document.Error()) return std::nullopt;
    return Error{origin_ + ":" + std::to_string(document.ErrorRow()) + ": not XML: " + document.ErrorDesc()};
  }

  urdf::ModelInterfaceSharedPtr parse() {
    static std::mutex one_at_a_time;  // the console is global
    const std::lock_guard lock(one_at_a_time);
    Listener listener;
    urdf::ModelInterfaceSharedPtr model;
    try {
      const LeaksOfUrdfdom passed_over;
      model = urdf::parseURDF(urdf_);
    } catch (const std::exception& e) {
      listener.first_message = e.what();
    }
    if (!model || !model->getRoot()) {
      fault_ = Error{origin_ + ": liburdfdom refuses it: " +
                     (listener.first_message.empty() ? "no root link" : listener.first_message)};
      if (fault_.message.find("No root link") != std::string::npos)
        fault_.message += " Either a joint closes a loop, or there is no link: one must be no joint's child";
      return nullptr;
    }
    return model;
  }

  /// liburdfdom accepts a link with two parents, and drops one of them.
  Status check_tree(const urdf::ModelInterface& model) const {
    std::map<std::string, std::string> carrier;
    for (const auto& [name, joint] : model.joints_) {
      const auto [other, is_new] = carrier.emplace(joint->child_link_name, name);
      if (!is_new) {
        return at("joint", name,
                  "closes a loop: link '" + joint->child_link_name + "' hangs from joint '" + other->second +
                      "' already; a robot is a tree of links");
      }
    }
    std::set<std::string> reached;
    std::vector<const urdf::Link*> open{model.getRoot().get()};
    while (!open.empty()) {
      const urdf::Link* link = open.back();
      open.pop_back();
      reached.insert(link->name);
      for (const auto& child : link->child_links) open.push_back(child.get());
    }
    for (const auto& [name, link] : model.links_) {
      if (!reached.contains(name)) {
        return at("link", name,
                  "is not connected to '" + model.getRoot()->name +
                      "': its joints make a loop; a robot is a tree of links");
      }
    }
    return {};
  }

  static Eigen::Isometry3d pose(const urdf::Pose& pose) {
    Eigen::Isometry3d isometry = Eigen::Isometry3d::Identity();
    isometry.linear() = Eigen::Quaterniond(pose.rotation.w, pose.rotation.x, pose.rotation.y, pose.rotation.z)
                            .normalized()
                            .toRotationMatrix();
    isometry.translation() = Eigen::Vector3d(pose.position.x, pose.position.y, pose.position.z);
    return isometry;
  }

  Material material(const urdf::Visual& visual) const {
    Material result;
    const auto known = materials_.find(visual.material_name);
    if (known != materials_.end()) result = known->second;
    if (!visual.material) return result;
    // URDF colours are sRGB.
    const auto linear = [](float c) {
      return c <= 0.04045F ? c / 12.92F : std::pow((c + 0.055F) / 1.055F, 2.4F);
    };
    const urdf::Color& color = visual.material->color;
    result.albedo = {linear(color.r), linear(color.g), linear(color.b)};
    return result;
  }

  Status add_shape(const urdf::Link& link, const urdf::Geometry& geometry, const urdf::Pose& origin,
                   const Material& look, std::vector<Shape>& shapes) const {
    Shape shape;
    shape.T_body_shape = Transform<Body, ShapeFrame>(pose(origin));
    shape.material = look;
    switch (geometry.type) {
      case urdf::Geometry::BOX: {
        const auto& box = static_cast<const urdf::Box&>(geometry);
        shape.kind = ShapeKind::box;
        shape.size = {box.dim.x, box.dim.y, box.dim.z};
        break;
      }
      case urdf::Geometry::CYLINDER: {
        const auto& cylinder = static_cast<const urdf::Cylinder&>(geometry);
        shape.kind = ShapeKind::cylinder;
        shape.size = {cylinder.radius, cylinder.radius, cylinder.length};
        break;
      }
      case urdf::Geometry::SPHERE: {
        const auto& sphere = static_cast<const urdf::Sphere&>(geometry);
        shape.kind = ShapeKind::sphere;
        shape.size = Eigen::Vector3d::Constant(sphere.radius);
        break;
      }
      default:
        return at("link", link.name,
                  "a mesh: only box, cylinder and sphere are simulated; use these instead");
    }
    if (!shape.size.allFinite() || shape.size.minCoeff() <= 0 || !shape.T_body_shape.finite())
      return at("link", link.name, "a shape whose size is not positive, or whose origin is not finite");
    shapes.push_back(shape);
    return {};
  }

  Status fill(const urdf::Link& link, RobotLink& out) const {
    for (const auto& visual : link.visual_array) {
      if (Status status = add_shape(link, *visual->geometry, visual->origin, material(*visual), out.visible);
          !status)
        return status;
    }
    for (const auto& collision : link.collision_array) {
      if (Status status = add_shape(link, *collision->geometry, collision->origin, {}, out.solid); !status)
        return status;
    }
    if (!link.inertial) return {};
    const urdf::Inertial& inertial = *link.inertial;
    if (!(inertial.mass > 0) || !std::isfinite(inertial.mass)) {
      return at("link", link.name,
                "a mass of " + std::to_string(inertial.mass) +
                    " kg; expected more than 0 (leave <inertial> "
                    "out of a fixed link that is only a frame)");
    }
    const Eigen::Isometry3d frame = pose(inertial.origin);
    Eigen::Matrix3d I;
    I << inertial.ixx, inertial.ixy, inertial.ixz, inertial.ixy, inertial.iyy, inertial.iyz, inertial.ixz,
        inertial.iyz, inertial.izz;
    out.mass = inertial.mass;
    out.center = frame.translation();
    out.inertia = frame.linear() * I * frame.linear().transpose();
    const Eigen::Vector3d moments = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(I).eigenvalues();
    // The largest moment of inertia is at most the sum of the others.
    if (!(moments.x() > 0) || moments.z() > 1.001 * (moments.x() + moments.y()))
      return at("link", link.name,
                "an impossible inertia: its principal moments are " + std::to_string(moments.x()) + ", " +
                    std::to_string(moments.y()) + " and " + std::to_string(moments.z()) + " kg m^2");
    return {};
  }

  void add_link(const urdf::Link& link) {
    robot_.links.emplace_back();
    robot_.links.back().name = link.name;
  }

  Status add_children(const urdf::Link& link, std::size_t index) {
    if (Status status = fill(link, robot_.links[index]); !status) return status;
    for (const auto& joint : link.child_joints) {
      const auto child = std::find_if(link.child_links.begin(), link.child_links.end(),
                                      [&](const auto& l) { return l->name == joint->child_link_name; });
      RobotJoint out;
      out.parent = index;
      out.child = robot_.links.size();
      if (Status status = fill(*joint, out); !status) return status;
      if (out.kind != JointKind::fixed && !(*child)->inertial)
        return at("link", (*child)->name, "has no <inertial>, but joint '" + out.name + "' moves it");
      robot_.joints.push_back(out);
      add_link(**child);
      if (Status status = add_children(**child, out.child); !status) return status;
    }
    return {};
  }

  Status fill(const urdf::Joint& joint, RobotJoint& out) const {
    out.name = joint.name;
    out.T_parent_child = Transform<Body, Body>(pose(joint.parent_to_joint_origin_transform));
    switch (joint.type) {
      case urdf::Joint::FIXED:
        out.kind = JointKind::fixed;
        return {};
      case urdf::Joint::REVOLUTE:
        out.kind = JointKind::revolute;
        break;
      case urdf::Joint::CONTINUOUS:
        out.kind = JointKind::continuous;
        break;
      case urdf::Joint::PRISMATIC:
        out.kind = JointKind::prismatic;
        break;
      default:
        return at("joint", joint.name, "only fixed, revolute, continuous and prismatic joints are simulated");
    }
    out.axis = {joint.axis.x, joint.axis.y, joint.axis.z};
    if (!(out.axis.norm() > 1e-6) || !out.axis.allFinite() || !out.T_parent_child.finite())
      return at("joint", joint.name, "its axis or origin is zero or not finite");
    out.axis.normalize();
    if (joint.dynamics) {
      out.friction = joint.dynamics->friction;
      out.damping = joint.dynamics->damping;
    }
    if (joint.limits) {
      out.lower = joint.limits->lower;
      out.upper = joint.limits->upper;
      out.effort = joint.limits->effort;
      out.velocity = joint.limits->velocity;
    }
    const bool limited = out.kind != JointKind::continuous;
    if (limited && !(out.lower < out.upper)) {
      return at("joint", joint.name,
                "limits from " + std::to_string(out.lower) + " to " + std::to_string(out.upper) +
                    "; expected lower < upper");
    }
    if (!(out.effort >= 0) || !(out.velocity >= 0) || !(out.friction >= 0) || !(out.damping >= 0))
      return at("joint", joint.name, "effort, velocity, friction and damping: expected none below 0");
    return {};
  }

  Status add_gears(const urdf::ModelInterface& model) {
    for (RobotJoint& joint : robot_.joints) {
      const auto mimic = model.joints_.at(joint.name)->mimic;
      if (!mimic) continue;
      const auto leader =
          std::find_if(robot_.joints.begin(), robot_.joints.end(), [&](const RobotJoint& other) {
            return other.name == mimic->joint_name && other.kind == joint.kind && &other != &joint;
          });
      const bool leads = leader != robot_.joints.end() && !model.joints_.at(leader->name)->mimic;
      if (!leads || joint.kind == JointKind::fixed || mimic->multiplier != 1 || mimic->offset != 0)
        return at("joint", joint.name,
                  "mimics '" + mimic->joint_name +
                      "'; expected another joint of its kind that mimics none, multiplier 1, offset 0");
      joint.geared = static_cast<std::size_t>(leader - robot_.joints.begin());
    }
    return {};
  }

  const std::string& urdf_;
  const std::string& origin_;
  const MaterialTable& materials_;
  Error fault_;
  UrdfRobot robot_;
};

}  // namespace

int urdf_line(const std::string& urdf, const std::string& tag, const std::string& name) {
  for (std::size_t place = urdf.find('<' + tag); place != std::string::npos;
       place = urdf.find('<' + tag, place + 1)) {
    const std::string_view element(urdf.data() + place, std::min(urdf.find('>', place), urdf.size()) - place);
    if (element.find("name=\"" + name + '"') != std::string_view::npos ||
        element.find("name='" + name + '\'') != std::string_view::npos)
      return line_at(urdf, place);
  }
  return 0;
}

Result<UrdfRobot> read_urdf(const std::string& urdf, const std::string& origin,
                            const MaterialTable& materials) {
  return Reader(urdf, origin, materials).read();
}

}  // namespace parhelion::simulation
