#include "server/simulation/robots/robot_layout.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace parhelion::simulation {
namespace {

class Builder {
 public:
  explicit Builder(const RobotModel& model) : model_(model) {}

  RobotLayout build() {
    const std::size_t links = model_.links.size();
    layout_.node_of_link.resize(links);
    layout_.T_node_link.assign(links, Eigen::Isometry3d::Identity());
    T_part_node_.clear();
    for (std::size_t link = 0; link < links; ++link) place(link);
    for (std::size_t link = 0; link < links; ++link) fill(link);
    for (std::size_t i = 0; i < layout_.parts.size(); ++i) finish(i);
    bound_curvature();
    return std::move(layout_);
  }

 private:
  /// A wheel at y steers by delta where tan(delta) = k L / (1 - k y), so k = tan(delta) / (L + y tan(delta)).
  void bound_curvature() {
    const double length = model_.drive.wheelbase;
    bool first = true;
    for (std::size_t i = 0; i < layout_.runners.size(); ++i) {
      const auto& steering = model_.drive.runners[i].steering;
      if (!steering) continue;
      const double y = layout_.runners[i].center.y();
      const double low = std::tan(model_.joints[*steering].lower),
                   high = std::tan(model_.joints[*steering].upper);
      const double smallest = low / (length + y * low), largest = high / (length + y * high);
      layout_.min_curvature = first ? smallest : std::max(layout_.min_curvature, smallest);
      layout_.max_curvature = first ? largest : std::min(layout_.max_curvature, largest);
      first = false;
    }
  }
  /// Vertices of a shape for a hull around it; false: the shape has none.
  static bool append_corners(const Shape& shape, const Eigen::Isometry3d& T_part_link,
                             std::vector<Eigen::Vector3d>& hull) {
    constexpr int kSides = 24;  // for a circle: an error of at most 0.9 % of its radius
    const Eigen::Isometry3d T = T_part_link * shape.T_body_shape.isometry();
    if (shape.kind == ShapeKind::mesh) {
      for (const Eigen::Vector3d& corner : hull_corners(shape.mesh->vertices))
        hull.push_back(T * Eigen::Vector3d(corner - kHullMargin * corner.normalized()));
      return true;
    }
    if (shape.kind == ShapeKind::box) {
      const Eigen::Vector3d half = shape.size / 2 - Eigen::Vector3d::Constant(kHullMargin);
      for (int i = 0; i < 8; ++i) {
        const Eigen::Vector3d corner(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
        hull.push_back(T * corner.cwiseProduct(half));
      }
      return true;
    }
    if (shape.kind != ShapeKind::cylinder) return false;
    const double radius = shape.size.x() - kHullMargin, half = shape.size.z() / 2 - kHullMargin;
    for (int i = 0; i < 2 * kSides; ++i) {
      const double angle = 2 * std::numbers::pi * (i / 2) / kSides;
      hull.push_back(
          T * Eigen::Vector3d(radius * std::cos(angle), radius * std::sin(angle), i % 2 ? half : -half));
    }
    return true;
  }

  std::optional<std::size_t> runner_of(std::size_t link) const {
    for (std::size_t i = 0; i < model_.drive.runners.size(); ++i) {
      if (model_.drive.runners[i].link == link) return i;
    }
    return std::nullopt;
  }
  bool steers(std::size_t joint) const {
    return std::any_of(model_.drive.runners.begin(), model_.drive.runners.end(),
                       [&](const RobotRunner& r) { return r.steering == joint; });
  }

  std::size_t add_part() {
    layout_.parts.emplace_back();
    layout_.parts.back().mass = 0;
    layout_.parts.back().inertia.setZero();
    layout_.solids.emplace_back();
    return layout_.parts.size() - 1;
  }

  void add_node(std::size_t link, RobotNode node, const Eigen::Isometry3d& T_part_node) {
    node.link = link;
    layout_.node_of_link[link] = layout_.nodes.size();
    layout_.nodes.push_back(std::move(node));
    T_part_node_.push_back(T_part_node);
  }

  /// Assigns the link's node and part.
  void place(std::size_t link) {
    RobotNode node;
    if (link == 0) {
      node.part = add_part();
      T_base_link_.push_back(Eigen::Isometry3d::Identity());
      add_node(link, node, Eigen::Isometry3d::Identity());
      return;
    }
    const RobotJoint& joint = model_.joints[link - 1];
    const std::size_t parent = layout_.node_of_link[joint.parent];
    const Eigen::Isometry3d T_node_link = layout_.T_node_link[joint.parent] * joint.T_parent_child.isometry();
    T_base_link_.push_back(T_base_link_[joint.parent] * joint.T_parent_child.isometry());
    if (joint.kind == JointKind::fixed) {
      layout_.node_of_link[link] = parent;
      layout_.T_node_link[link] = T_node_link;
      return;
    }
    const auto runner = runner_of(link);
    const bool wheel = runner && model_.drive.runners[*runner].kind == RobotRunner::Kind::wheel;
    if (wheel || steers(link - 1)) {
      node.part = layout_.nodes[parent].part;
      node.parent = parent;
      node.T_parent_node = T_node_link;
      node.axis = joint.axis;
      if (wheel) node.runner = runner;
      if (!wheel) {
        node.steering = link - 1;
        layout_.steering.push_back(link - 1);
      }
      add_node(link, node, T_part_node_[parent] * T_node_link);
      return;
    }
    add_joint(link, joint, parent, T_node_link);
  }

  void add_joint(std::size_t link, const RobotJoint& joint, std::size_t parent,
                 const Eigen::Isometry3d& T_node_link) {
    RobotNode node;
    node.part = add_part();
    RobotLayout::Joint its;
    its.joint = link - 1;
    its.a = layout_.nodes[parent].part;
    its.b = node.part;
    const Eigen::Isometry3d along_axis(
        Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitX(), joint.axis));
    its.definition.kind =
        joint.kind == JointKind::prismatic ? PartJointKind::prismatic : PartJointKind::revolute;
    its.definition.limited = joint.kind != JointKind::continuous;
    its.definition.lower = joint.lower;
    its.definition.upper = joint.upper;
    its.definition.T_a_joint = T_part_node_[parent] * T_node_link * along_axis;
    its.definition.T_b_joint = along_axis;
    layout_.joints.push_back(its);
    add_node(link, node, Eigen::Isometry3d::Identity());
  }

  /// Collision shapes of a link. A track is a tight belt: one hull around all shapes of its link, so that no
  /// edge inside catches on steps.
  void add_solids(std::size_t link, const Eigen::Isometry3d& T_part_link, int runner) {
    const RobotLink& its = model_.links[link];
    const std::size_t node = layout_.node_of_link[link], part = layout_.nodes[node].part;
    const auto surface = runner_of(link);
    const bool is_track = surface && model_.drive.runners[*surface].kind == RobotRunner::Kind::track;
    const auto add = [&](PartShape& solid, const Eigen::Isometry3d& T_link_shape) {
      solid.friction = its.friction;
      solid.runner = runner;
      layout_.parts[part].shapes.push_back(solid);
      layout_.solids[part].push_back({link, node, layout_.T_node_link[link] * T_link_shape});
    };
    PartShape belt;
    for (const Shape& shape : its.solid) {
      if (is_track && append_corners(shape, T_part_link, belt.hull)) continue;
      PartShape solid;
      solid.shape = shape;
      solid.shape.T_body_shape = Transform<Body, ShapeFrame>(T_part_link * shape.T_body_shape.isometry());
      if (shape.mesh) append_corners(shape, T_part_link, solid.hull);
      add(solid, shape.T_body_shape.isometry());
    }
    if (!belt.hull.empty()) add(belt, Eigen::Isometry3d::Identity());
  }

  /// Adds the link's shapes and mass to its node and part.
  void fill(std::size_t link) {
    const RobotLink& its = model_.links[link];
    const std::size_t node = layout_.node_of_link[link];
    const std::size_t part = layout_.nodes[node].part;
    const Eigen::Isometry3d T_part_link = T_part_node_[node] * layout_.T_node_link[link];
    for (Shape shape : its.visible) {
      shape.T_body_shape =
          Transform<Body, ShapeFrame>(layout_.T_node_link[link] * shape.T_body_shape.isometry());
      layout_.nodes[node].visible.push_back(shape);
    }
    PartDefinition& to = layout_.parts[part];
    int runner_index = -1;
    if (const auto runner = runner_of(link)) {
      runner_index = static_cast<int>(to.runners.size());
      const bool wheel = model_.drive.runners[*runner].kind == RobotRunner::Kind::wheel;
      Eigen::Vector3d axis =
          wheel ? model_.joints[link - 1].axis : T_base_link_[link].linear().transpose().col(1);
      // A wheel may be modelled with its axle to the right: then its rotation is reversed.
      if ((T_base_link_[link].linear() * axis).y() < 0) axis = -axis;
      const Eigen::Vector3d in_node = layout_.T_node_link[link].linear() * axis;
      to.runners.push_back({T_part_node_[node].linear() * in_node, model_.drive.friction});
      if (layout_.runners.size() < model_.drive.runners.size())
        layout_.runners.resize(model_.drive.runners.size());
      layout_.runners[*runner] = {part, static_cast<std::size_t>(runner_index), node, in_node,
                                  T_base_link_[link].translation()};
    }
    add_solids(link, T_part_link, runner_index);
    if (its.mass > 0)
      masses_.push_back({part, its.mass, T_part_link * its.center,
                         T_part_link.linear() * its.inertia * T_part_link.linear().transpose()});
  }

  /// Combined mass, centre and inertia of the links (parallel axes).
  void finish(std::size_t part) {
    PartDefinition& to = layout_.parts[part];
    Eigen::Vector3d moment = Eigen::Vector3d::Zero();
    for (const Mass& mass : masses_) {
      if (mass.part != part) continue;
      to.mass += mass.mass;
      moment += mass.mass * mass.center;
    }
    to.center = moment / to.mass;
    for (const Mass& mass : masses_) {
      if (mass.part != part) continue;
      const Eigen::Vector3d arm = mass.center - to.center;
      to.inertia += mass.inertia +
                    mass.mass * (arm.squaredNorm() * Eigen::Matrix3d::Identity() - arm * arm.transpose());
    }
    to.inertia = ((to.inertia + to.inertia.transpose()) / 2).eval();
  }

  struct Mass {
    std::size_t part;
    double mass;
    Eigen::Vector3d center;
    Eigen::Matrix3d inertia;
  };
  const RobotModel& model_;
  RobotLayout layout_;
  std::vector<Eigen::Isometry3d> T_part_node_;  // joints at 0
  std::vector<Eigen::Isometry3d> T_base_link_;  // joints at 0
  std::vector<Mass> masses_;
};

}  // namespace

RobotLayout make_layout(const RobotModel& model) { return Builder(model).build(); }

}  // namespace parhelion::simulation
