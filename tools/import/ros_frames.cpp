#include "tools/import/ros_frames.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <numbers>
#include <set>
#include <sstream>

namespace parhelion::tools {
namespace {

bool contains(const std::string& text, const char* part) { return text.find(part) != std::string::npos; }

}  // namespace

void RosFrames::add(const ros::StampedTransform& transform, bool is_static) {
  constexpr double still_distance = 0.001, still_angle = 0.1 * std::numbers::pi / 180;
  Edge& edge = edges_[{transform.header.frame, transform.child}];
  if (edge.count++ == 0) {
    edge.first = transform.pose;
    return;
  }
  const Eigen::Isometry3d change = edge.first.inverse() * transform.pose;
  const double angle = Eigen::AngleAxisd(change.linear()).angle();
  if (change.translation().norm() <= still_distance && std::abs(angle) <= still_angle) return;
  if (is_static) {
    edge.first = transform.pose;
    edge.contradicted = true;
  } else {
    edge.moves = true;
  }
}

std::vector<std::string> RosFrames::contradictions(std::string frame) const {
  std::vector<std::string> notes;
  // Not more steps than edges: they may form a ring.
  for (std::size_t step = 0; step < edges_.size(); ++step) {
    const auto up = std::find_if(edges_.begin(), edges_.end(),
                                 [&](const auto& edge) { return edge.first.second == frame; });
    if (up == edges_.end()) break;
    if (up->second.contradicted) {
      std::ostringstream text;
      const Eigen::Vector3d p = up->second.first.translation();
      text << "tf_static has different poses of " << frame << " in " << up->first.first
           << "; the last is used, as tf does: " << p.x() << " " << p.y() << " " << p.z()
           << " m. Check it: the robot's description and a driver may contradict each other";
      notes.push_back(text.str());
    }
    frame = up->first.first;
  }
  return notes;
}

std::optional<Eigen::Isometry3d> RosFrames::find(const std::string& from, const std::string& to,
                                                 bool& moves) const {
  struct Reached {
    std::string frame;
    Eigen::Isometry3d pose;
    bool moves;
  };
  std::deque<Reached> open{{from, Eigen::Isometry3d::Identity(), false}};
  std::set<std::string> seen{from};
  while (!open.empty()) {
    const Reached here = open.front();
    open.pop_front();
    if (here.frame == to) {
      moves = here.moves;
      return here.pose;
    }
    for (const auto& [key, edge] : edges_) {
      const bool down = key.first == here.frame, up = key.second == here.frame;
      if (!down && !up) continue;
      const std::string& next = down ? key.second : key.first;
      if (!seen.insert(next).second) continue;
      open.push_back(
          {next, here.pose * (down ? edge.first : edge.first.inverse()), here.moves || edge.moves});
    }
  }
  return std::nullopt;
}

bool RosFrames::has(const std::string& frame) const {
  for (const auto& [key, edge] : edges_) {
    if (key.first == frame || key.second == frame) return true;
  }
  return false;
}

std::vector<RosFrames::Key> RosFrames::odometry_edges() const {
  std::vector<Key> found;
  for (const auto& [key, edge] : edges_) {
    const std::string name = key.first.substr(key.first.rfind('/') + 1);
    if (name.starts_with("odom") && !contains(key.second, "map") && !contains(key.second, "odom"))
      found.push_back(key);
  }
  return found;
}

std::string RosFrames::static_edges_text() const {
  std::ostringstream text;
  text.precision(9);
  for (const auto& [key, edge] : edges_) {
    text << "; tf " << key.first << " -> " << key.second;
    if (edge.moves) {
      text << " moves";
      continue;
    }
    const Eigen::Vector3d p = edge.first.translation();
    const Eigen::Quaterniond q(edge.first.linear());
    text << " [" << p.x() << " " << p.y() << " " << p.z() << "] m, quaternion wxyz [" << q.w() << " " << q.x()
         << " " << q.y() << " " << q.z() << "]";
  }
  return text.str();
}

}  // namespace parhelion::tools
