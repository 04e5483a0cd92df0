#include "server/simulation/robots/urdf.hpp"

#include <tinyxml2.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <string_view>

#include "protocols/yaml/utf8.hpp"
#include "server/simulation/robots/urdf_elements.hpp"
#include "server/simulation/robots/urdf_meshes.hpp"
#include "server/simulation/robots/xml_fault.hpp"

namespace parhelion::simulation {
namespace {

using urdf::color_of;
using urdf::description_of;
using urdf::number;
using urdf::number_or;
using urdf::origin_of;
using urdf::refuse;
using urdf::Refused;
using urdf::required_child;
using urdf::required_text;
using urdf::required_vector;
using urdf::text_of;
using urdf::vector_or_zero;
using urdf::XMLElement;

constexpr std::size_t kMaxBytes = std::size_t{16} << 20;  // embedded meshes included
constexpr std::size_t kMaxLinks = 1000;
constexpr double kWholeTurn = 6.3;  // rad

/// Colours of materials by name, linear; a material without a colour, such as one with a texture, has none.
using Colors = std::map<std::string, std::optional<Eigen::Vector3f>>;

/// The first element of xacro, a macro language for URDF; null: none.
const XMLElement* find_xacro(const tinyxml2::XMLNode& node) {
  for (auto* each = node.FirstChildElement(); each; each = each->NextSiblingElement()) {
    if (std::string_view(each->Name()).starts_with("xacro:")) return each;
    if (const XMLElement* inside = find_xacro(*each)) return inside;
  }
  return nullptr;
}

class Reader {
 public:
  explicit Reader(const MaterialTable& materials) : materials_(materials) {}

  UrdfRobot read(const XMLElement& robot) {
    for (auto* each = robot.FirstChildElement("material"); each; each = each->NextSiblingElement("material"))
      colors_[required_text(*each, "name")] = color_of(*each);
    collect(robot, "link", links_);
    collect(robot, "joint", joints_);
    if (links_.size() > kMaxLinks)
      refuse(robot, std::to_string(links_.size()) + " links; at most " + std::to_string(kMaxLinks) +
                        " are simulated");
    for (const auto& [name, joint] : joints_) connect(*joint);
    const XMLElement& root = root_link(robot);
    add_link(root);
    add_children(root, 0);
    for (const auto& [name, link] : links_) {
      const bool reached = std::ranges::find(robot_.links, name, &RobotLink::name) != robot_.links.end();
      if (!reached) {
        refuse(*link, "is not connected to '" + robot_.links[0].name +
                          "': its joints make a loop; a robot is a tree of links");
      }
    }
    for (RobotJoint& joint : robot_.joints) gear(joint);
    for (const auto& [name, color] : colors_) robot_.materials.push_back(name);
    return std::move(robot_);
  }

 private:
  using Elements = std::map<std::string, const XMLElement*>;

  static void collect(const XMLElement& robot, const char* tag, Elements& elements) {
    for (auto* each = robot.FirstChildElement(tag); each; each = each->NextSiblingElement(tag)) {
      if (!elements.emplace(required_text(*each, "name"), each).second)
        refuse(*each, "the name occurs twice");
    }
  }

  std::string end_of(const XMLElement& joint, const char* tag) const {
    const std::string link = required_text(required_child(joint, tag), "link");
    if (!links_.contains(link))
      refuse(joint, std::string("its ") + tag + " link '" + yaml::printable(link) + "' does not exist");
    return link;
  }

  void connect(const XMLElement& joint) {
    const std::string child = end_of(joint, "child");
    const auto [other, is_new] = carrier_.emplace(child, &joint);
    if (!is_new) {
      refuse(joint, "closes a loop: link '" + yaml::printable(child) + "' hangs from " +
                        description_of(*other->second) + " already; a robot is a tree of links");
    }
    children_[end_of(joint, "parent")].push_back(&joint);
  }

  /// The link that no joint carries.
  const XMLElement& root_link(const XMLElement& robot) const {
    const XMLElement* root = nullptr;
    for (const auto& [name, link] : links_) {
      if (carrier_.contains(name)) continue;
      if (root != nullptr)
        refuse(*link, "no joint connects it to " + description_of(*root) + "; a robot is a tree of links");
      root = link;
    }
    if (root == nullptr)
      refuse(robot, "no root link: a joint closes a loop, or there is no link; one must be no joint's child");
    return *root;
  }

  void add_link(const XMLElement& link) {
    robot_.links.emplace_back();
    robot_.links.back().name = text_of(link, "name");
  }

  void add_children(const XMLElement& link, std::size_t index) {
    fill(link, robot_.links[index]);
    const auto joints = children_.find(robot_.links[index].name);
    if (joints == children_.end()) return;
    for (const XMLElement* element : joints->second) {
      const XMLElement& child = *links_.at(end_of(*element, "child"));
      RobotJoint joint;
      joint.parent = index;
      joint.child = robot_.links.size();
      fill(*element, joint);
      warn_of_degrees(*element);
      if (joint.kind != JointKind::fixed && child.FirstChildElement("inertial") == nullptr)
        refuse(child, "has no <inertial>, but joint '" + yaml::printable(joint.name) + "' moves it");
      robot_.joints.push_back(joint);
      add_link(child);
      add_children(child, joint.child);
    }
  }

  Material material(const XMLElement& visual) {
    Material result;
    const XMLElement* element = visual.FirstChildElement("material");
    if (element == nullptr) return result;
    const std::string name = text_of(*element, "name");
    if (const auto known = materials_.find(name); known != materials_.end()) result = known->second;
    std::optional<Eigen::Vector3f> color = color_of(*element);
    if (!name.empty()) {
      const bool defines = color || element->FirstChildElement("texture") != nullptr;
      const auto known = defines ? colors_.emplace(name, color).first : colors_.find(name);
      if (known == colors_.end())
        refuse(*element, "is defined nowhere; expected <color rgba=...> in it, or a <material> of that name");
      color = known->second;
    }
    if (color) result.albedo = {color->x(), color->y(), color->z()};
    return result;
  }

  void warn(const XMLElement& link, const std::string& words) {
    robot_.warnings.push_back(std::to_string(link.GetLineNum()) + ": " + description_of(link) + words);
  }

  void warn_of_degrees(const XMLElement& joint) {
    const XMLElement* origin = joint.FirstChildElement("origin");
    if (origin == nullptr || !(vector_or_zero(*origin, "rpy").cwiseAbs().maxCoeff() > kWholeTurn)) return;
    warn(joint, ": rpy='" + yaml::printable(text_of(*origin, "rpy")) +
                    "' is more than a whole turn; URDF angles are radians: are these degrees?");
    robot_.angle_warnings.push_back(robot_.warnings.back());
  }

  /// Of a <mesh>: one for each colour; none, and a warning, where its file was not found.
  std::vector<Shape> mesh(const XMLElement& link, const XMLElement& element, const XMLElement& form,
                          const Material& look, bool solid) {
    const std::string filename = required_text(form, "filename");
    if (!is_embedded(filename)) {
      warn(link, std::string(": its ") + element.Name() + " is left out: mesh '" + yaml::printable(filename) +
                     "' was not found");
      (solid ? robot_.solid_left_out : robot_.visible_left_out).push_back(text_of(link, "name"));
      return {};
    }
    Eigen::Vector3d scale = Eigen::Vector3d::Ones();
    if (form.Attribute("scale") != nullptr) scale = vector_or_zero(form, "scale");
    if (!(scale.cwiseAbs().minCoeff() > 0)) refuse(form, "a scale of zero");
    if (solid) {
      const auto shape = solid_mesh_shape(filename, origin_of(element), scale);
      if (!shape) refuse(form, shape.error().message);
      return {*shape};
    }
    const bool has_material = element.FirstChildElement("material") != nullptr;
    auto shapes = mesh_shapes(filename, origin_of(element), scale, look, !has_material);
    if (!shapes) refuse(form, shapes.error().message);
    return std::move(*shapes);
  }

  std::vector<Shape> shapes(const XMLElement& link, const XMLElement& element, const Material& look,
                            bool solid) {
    const XMLElement& geometry = required_child(element, "geometry");
    if (const XMLElement* form = geometry.FirstChildElement("mesh"))
      return mesh(link, element, *form, look, solid);
    return {shape(element, geometry, look)};
  }

  static Shape shape(const XMLElement& element, const XMLElement& geometry, const Material& look) {
    const XMLElement* form = geometry.FirstChildElement();
    const std::string tag = form == nullptr ? "" : form->Name();
    Shape shape;
    shape.T_body_shape = Transform<Body, ShapeFrame>(origin_of(element));
    shape.material = look;
    if (tag == "box") {
      const auto size = required_vector(*form, "size");
      shape.kind = ShapeKind::box;
      shape.size = {size[0], size[1], size[2]};
    } else if (tag == "cylinder") {
      shape.kind = ShapeKind::cylinder;
      shape.size = {number(*form, "radius"), number(*form, "radius"), number(*form, "length")};
    } else if (tag == "sphere") {
      shape.kind = ShapeKind::sphere;
      shape.size = Eigen::Vector3d::Constant(number(*form, "radius"));
    } else {
      refuse(geometry, "expected <box>, <cylinder>, <sphere> or <mesh> in it");
    }
    if (shape.size.minCoeff() <= 0) refuse(*form, "a shape whose size is not positive");
    return shape;
  }

  void fill(const XMLElement& link, RobotLink& out) {
    // What is wrong in a shape is said with the link's name.
    const auto with_link = [&](auto&& read) {
      try {
        return read();
      } catch (const Refused& refused) {
        throw Refused{refused.line, description_of(link) + ": " + refused.words};
      }
    };
    const auto append = [&](const char* tag, bool solid, std::vector<Shape>& to) {
      for (auto* part = link.FirstChildElement(tag); part; part = part->NextSiblingElement(tag)) {
        const Material look = solid ? Material{} : with_link([&] { return material(*part); });
        const auto added = with_link([&] { return shapes(link, *part, look, solid); });
        to.insert(to.end(), added.begin(), added.end());
      }
    };
    append("visual", false, out.visible);
    append("collision", true, out.solid);
    const bool mesh_only = std::ranges::any_of(out.visible, [](const Shape& s) { return s.mesh != nullptr; });
    if (mesh_only && link.FirstChildElement("collision") == nullptr) {
      append("visual", true, out.solid);
      warn(link, " has no <collision>: the convex hull of its visual mesh collides");
    }
    if (const XMLElement* inertial = link.FirstChildElement("inertial")) fill_inertia(link, *inertial, out);
  }

  static void fill_inertia(const XMLElement& link, const XMLElement& inertial, RobotLink& out) {
    const double mass = number(required_child(inertial, "mass"), "value");
    if (!(mass > 0)) {
      refuse(link,
             "a mass of " + std::to_string(mass) +
                 " kg; expected more than 0 (leave <inertial> out of a fixed link that is only a frame)");
    }
    const Eigen::Isometry3d frame = origin_of(inertial);
    const XMLElement& moments = required_child(inertial, "inertia");
    const auto of = [&](const char* name) { return number(moments, name); };
    Eigen::Matrix3d I;
    I << of("ixx"), of("ixy"), of("ixz"), of("ixy"), of("iyy"), of("iyz"), of("ixz"), of("iyz"), of("izz");
    out.mass = mass;
    out.center = frame.translation();
    out.inertia = frame.linear() * I * frame.linear().transpose();
    const Eigen::Vector3d principal = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(I).eigenvalues();
    // The largest moment of inertia is at most the sum of the others.
    if (!(principal.x() > 0) || principal.z() > 1.001 * (principal.x() + principal.y()))
      refuse(link, "an impossible inertia: its principal moments are " + std::to_string(principal.x()) +
                       ", " + std::to_string(principal.y()) + " and " + std::to_string(principal.z()) +
                       " kg m^2");
  }

  static JointKind kind_of(const XMLElement& joint) {
    static const std::map<std::string, JointKind> kinds{{"fixed", JointKind::fixed},
                                                        {"revolute", JointKind::revolute},
                                                        {"continuous", JointKind::continuous},
                                                        {"prismatic", JointKind::prismatic}};
    const auto kind = kinds.find(required_text(joint, "type"));
    if (kind == kinds.end())
      refuse(joint, "only fixed, revolute, continuous and prismatic joints are simulated");
    return kind->second;
  }

  static void fill(const XMLElement& joint, RobotJoint& out) {
    out.name = text_of(joint, "name");
    out.T_parent_child = Transform<Body, Body>(origin_of(joint));
    out.kind = kind_of(joint);
    if (out.kind == JointKind::fixed) return;
    if (const XMLElement* axis = joint.FirstChildElement("axis")) out.axis = vector_or_zero(*axis, "xyz");
    if (!(out.axis.norm() > 1e-6)) refuse(joint, "its axis is zero");
    out.axis.normalize();
    if (const XMLElement* dynamics = joint.FirstChildElement("dynamics")) {
      out.friction = number_or(*dynamics, "friction", 0);
      out.damping = number_or(*dynamics, "damping", 0);
    }
    const bool limited = out.kind != JointKind::continuous;
    if (const XMLElement* limit = joint.FirstChildElement("limit")) {
      out.lower = number_or(*limit, "lower", 0);
      out.upper = number_or(*limit, "upper", 0);
      out.effort = number(*limit, "effort");
      out.velocity = number(*limit, "velocity");
    } else if (limited) {
      refuse(joint, "expected <limit lower=... upper=... effort=... velocity=...> in it");
    }
    if (limited && !(out.lower < out.upper)) {
      refuse(joint, "limits from " + std::to_string(out.lower) + " to " + std::to_string(out.upper) +
                        "; expected lower < upper");
    }
    if (!(out.effort >= 0) || !(out.velocity >= 0) || !(out.friction >= 0) || !(out.damping >= 0))
      refuse(joint, "effort, velocity, friction and damping: expected none below 0");
  }

  void gear(RobotJoint& joint) {
    const XMLElement& element = *joints_.at(joint.name);
    const XMLElement* mimic = element.FirstChildElement("mimic");
    if (mimic == nullptr) return;
    const std::string name = required_text(*mimic, "joint");
    joint.gear_ratio = number_or(*mimic, "multiplier", 1);
    joint.gear_offset = number_or(*mimic, "offset", 0);
    const auto leader =
        std::find_if(robot_.joints.begin(), robot_.joints.end(), [&](const RobotJoint& other) {
          return other.name == name && other.kind != JointKind::fixed && &other != &joint;
        });
    const bool leads =
        leader != robot_.joints.end() && joints_.at(leader->name)->FirstChildElement("mimic") == nullptr;
    if (!leads || joint.kind == JointKind::fixed || joint.gear_ratio == 0)
      refuse(element,
             "mimics '" + yaml::printable(name) +
                 "'; expected another joint that moves and mimics none, and a multiplier other than 0");
    joint.start = joint.gear_offset;
    joint.geared = static_cast<std::size_t>(leader - robot_.joints.begin());
  }

  const MaterialTable& materials_;
  Colors colors_;
  Elements links_, joints_;                                         // by name
  std::map<std::string, const XMLElement*> carrier_;                // joint of a child link
  std::map<std::string, std::vector<const XMLElement*>> children_;  // joints of a parent link, by their names
  UrdfRobot robot_;
};

Error no_xml(const std::string& text, const std::string& origin, const tinyxml2::XMLDocument& document) {
  const bool deep = document.ErrorID() == tinyxml2::XML_ELEMENT_DEPTH_EXCEEDED;
  const auto fault = deep ? std::nullopt : find_xml_fault(text);
  const int line = fault ? fault->line : std::max(1, document.ErrorLineNum());
  return Error{origin + ":" + std::to_string(line) + ": not XML: " +
               (fault  ? fault->words
                : deep ? "elements are nested too deeply"
                       : "in the element that begins here, look for an attribute without a value or quotes")};
}

}  // namespace

Result<UrdfRobot> read_urdf(const std::string& urdf, const std::string& origin,
                            const MaterialTable& materials) {
  if (urdf.size() > kMaxBytes)
    return Error{origin + ": " + std::to_string(urdf.size()) + " bytes; expected a URDF of at most 16 MiB"};
  tinyxml2::XMLDocument document;
  if (document.Parse(urdf.data(), urdf.size()) != tinyxml2::XML_SUCCESS) {
    return no_xml(urdf, origin, document);
  }
  if (const XMLElement* macro = find_xacro(document)) {
    return Error{origin + ":" + std::to_string(macro->GetLineNum()) + ": <" + macro->Name() +
                 ">: this is xacro, not URDF; expand it with: xacro FILE.xacro > FILE.urdf"};
  }
  const XMLElement* robot = document.FirstChildElement("robot");
  if (robot == nullptr) return Error{origin + ":1: expected <robot>, found no such element"};
  try {
    UrdfRobot read = Reader(materials).read(*robot);
    for (auto* warnings : {&read.warnings, &read.angle_warnings})
      for (std::string& warning : *warnings) warning.insert(0, origin + ":");
    return read;
  } catch (const Refused& refused) {
    return Error{origin + ":" + std::to_string(refused.line) + ": " + refused.words};
  }
}

}  // namespace parhelion::simulation
