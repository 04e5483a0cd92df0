#include "fusion/pose/mapping/live_loops.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>

namespace parhelion::pose {
namespace {

constexpr double kNodeDistance = 1;          ///< m of path between two poses of the graph
constexpr std::size_t kNearest = 4;          ///< submaps that one scan is matched to,
constexpr std::size_t kNearestInWindow = 2;  ///< and that the last metres are compared with
constexpr double kPartTime = 0.2;            ///< s between two scans for a part of a comparison
constexpr double kMaxParts = 8;              ///< after a scan
constexpr double kCompared = 4;              ///< m of path whose scans are compared
constexpr double kRecent = 6;                ///< m of path over which matches must agree
constexpr std::size_t kEnoughScans = 3;      ///< that agree
constexpr double kSmallWindow = 0.5;         ///< m, within which a match needs no search
constexpr std::size_t kGraphEdges = 500;     ///< of a part of the optimization: half a millisecond
constexpr std::size_t kBuilt = 16;           ///< submaps that are kept: each takes up to 20 MB outdoors

/// T_from_to of two keyframes, as the front end tracked it.
Pose2 tracked_motion(const std::vector<Keyframe>& keyframes, std::size_t from, std::size_t to) {
  Pose2 motion;
  for (std::size_t k = from + 1; k <= to; ++k) motion = motion * keyframes[k].step;
  return motion;
}

}  // namespace

std::optional<LoopCorrection> LiveLoops::update(const std::vector<Keyframe>& keyframes, SensorTime stamp) {
  const double parts = (stamp - last_scan_).seconds() / kPartTime;
  last_scan_ = stamp;
  if (keyframes.size() > poses_.size()) add_keyframe(keyframes);
  for (int part = static_cast<int>(std::clamp(parts, 1.0, kMaxParts)); part > 0; --part) {
    if (closing_) {
      if (auto found = optimize(keyframes)) return found;
    } else if (work(keyframes)) {
      close(keyframes);
    } else {
      break;
    }
  }
  return std::nullopt;
}

/// A comparison that is running goes on: bends of a fraction of a degree are small against the places it
/// compares.
void LiveLoops::poses_changed(const std::vector<Keyframe>& keyframes, std::size_t first) {
  if (poses_.empty()) return;
  for (std::size_t k = first; k < poses_.size(); ++k) poses_[k] = keyframes[k].T_map_base;
  for (std::size_t n = chain_.size(); n-- > 0 && nodes_[n + 1] >= first;)
    chain_[n].T_from_to = tracked_motion(keyframes, nodes_[n], nodes_[n + 1]);
  since_node_ = tracked_motion(keyframes, nodes_.back(), poses_.size() - 1);
}

void LiveLoops::add_keyframe(const std::vector<Keyframe>& keyframes) {
  const Keyframe& added = keyframes.back();
  poses_.push_back(added.T_map_base);
  if (nodes_.empty()) {
    nodes_.push_back(0);
    return;
  }
  Eigen::Matrix3d R_node_from = Eigen::Matrix3d::Identity();
  R_node_from.topLeftCorner<2, 2>() = Eigen::Rotation2Dd(since_node_.yaw).toRotationMatrix();
  since_node_covariance_ += R_node_from * added.step_information.inverse() * R_node_from.transpose();
  since_node_ = since_node_ * added.step;
  if (added.driven - keyframes[nodes_.back()].driven >= kNodeDistance) {
    chain_.push_back(
        {nodes_.size() - 1, nodes_.size(), since_node_, since_node_covariance_.inverse(), false});
    nodes_.push_back(keyframes.size() - 1);
    since_node_ = {};
    since_node_covariance_.setZero();
  }
  // A submap needs half its length of path after it.
  const LoopSearch search(keyframes, poses_, options_);
  const std::size_t end = end_of_stretch(keyframes, next_stretch_, options_);
  if (end < keyframes.size() && added.driven - keyframes[end].driven > options_.submap_length / 2) {
    submaps_.push_back(search.submap(next_stretch_, end));
    next_stretch_ = end;
  }
  const bool busy = closing_ || comparison_ || (!queries_.empty() && window(added) >= kSmallWindow);
  if (!busy && added.driven - last_query_driven_ >= options_.query_distance) ask(keyframes);
}

/// m, of the search.
double LiveLoops::window(const Keyframe& keyframe) const {
  return options_.window(keyframe.driven - last_loop_driven_);
}

/// Plans the comparison of the newest scan with the nearest old submaps.
void LiveLoops::ask(const std::vector<Keyframe>& keyframes) {
  const std::size_t keyframe = keyframes.size() - 1;
  last_query_driven_ = keyframes[keyframe].driven;
  const LoopSearch search(keyframes, poses_, options_);
  std::vector<std::pair<double, std::size_t>> near;
  for (std::size_t s = 0; s < submaps_.size(); ++s) {
    if (search.may_close(keyframe, submaps_[s], window(keyframes[keyframe])))
      near.emplace_back((poses_[submaps_[s].anchor].position() - poses_[keyframe].position()).norm(), s);
  }
  std::sort(near.begin(), near.end());
  queries_.clear();
  const std::size_t wanted = window(keyframes[keyframe]) < kSmallWindow ? kNearest : kNearestInWindow;
  for (std::size_t i = 0; i < std::min(wanted, near.size()); ++i)
    queries_.push_back({near[i].second, keyframe});
}

/// A part of the comparison with old submaps. False: there is nothing to do.
bool LiveLoops::work(const std::vector<Keyframe>& keyframes) {
  const LoopSearch search(keyframes, poses_, options_);
  if (comparison_) {
    Submap& submap = submaps_[comparison_->submap()];
    if (!comparison_->step(search, submap)) return true;
    if (!comparison_->closures().empty()) recent_ = std::move(comparison_->closures());
    remember_built(comparison_->submap());
    comparison_.reset();
    return true;
  }
  if (queries_.empty()) return false;
  const Query query = queries_.front();
  const bool small = window(keyframes[query.keyframe]) < kSmallWindow;
  if (small) {
    remember_built(query.submap);
    if (!submaps_[query.submap].complete) {
      search.add_surfels(submaps_[query.submap]);
      return true;
    }
  }
  queries_.pop_front();
  if (small)
    match_one(search, query);
  else
    comparison_ = begin_comparison(keyframes, query.submap);
  return true;
}

void LiveLoops::match_one(const LoopSearch& search, const Query& query) {
  auto closure = search.matched(submaps_[query.submap], query.submap, query.keyframe);
  if (closure) recent_.push_back(std::move(*closure));
  const double newest = search.keyframes().back().driven;
  std::erase_if(recent_,
                [&](const Closure& c) { return newest - search.keyframes()[c.keyframe].driven > kRecent; });
}

/// Between a submap and the scans of the last metres, as far as these are not in its surroundings.
LoopComparison LiveLoops::begin_comparison(const std::vector<Keyframe>& keyframes, std::size_t submap) const {
  std::vector<std::size_t> scans;
  const double newest = keyframes.back().driven;
  const LoopSearch search(keyframes, poses_, options_);
  for (std::size_t k = keyframes.size(); k-- > 0 && newest - keyframes[k].driven < kCompared;) {
    if (!search.may_close(k, submaps_[submap], window(keyframes[k]))) break;
    if (scans.empty() || keyframes[scans.back()].driven - keyframes[k].driven >= options_.query_distance)
      scans.push_back(k);
  }
  std::reverse(scans.begin(), scans.end());
  return {submap, std::move(scans), window(keyframes.back())};
}

void LiveLoops::remember_built(std::size_t submap) {
  std::erase(built_, submap);
  built_.push_back(submap);
  if (built_.size() <= kBuilt) return;
  submaps_[built_.front()].release();
  built_.pop_front();
}

/// The last node at or before a keyframe.
std::size_t LiveLoops::node_at(std::size_t keyframe) const {
  const auto after = std::upper_bound(nodes_.begin(), nodes_.end(), keyframe);
  return static_cast<std::size_t>(after - nodes_.begin()) - 1;
}

/// Begins to close a loop, where enough scans agree on it.
void LiveLoops::close(const std::vector<Keyframe>& keyframes) {
  const std::vector<std::size_t> agreed = consistent(recent_);
  std::vector<std::size_t> scans;
  scans.reserve(agreed.size());
  for (std::size_t i : agreed) scans.push_back(recent_[i].keyframe);
  std::sort(scans.begin(), scans.end());
  scans.erase(std::unique(scans.begin(), scans.end()), scans.end());
  if (scans.size() < kEnoughScans) return;

  for (std::size_t i : agreed) {
    PoseGraphEdge edge = recent_[i].edge;
    const std::size_t from = node_at(edge.from), to = node_at(edge.to);
    edge.T_from_to = (poses_[nodes_[from]].inverse() * poses_[edge.from]) * edge.T_from_to *
                     (poses_[edge.to].inverse() * poses_[nodes_[to]]);
    edge.from = from, edge.to = to;
    loops_.push_back(edge);
  }
  last_loop_driven_ = keyframes[scans.back()].driven;
  const std::size_t revisited = recent_[agreed.front()].edge.from;
  recent_.clear();
  queries_.clear();

  std::vector<Pose2> before;
  for (std::size_t node : nodes_) before.push_back(poses_[node]);
  std::vector<PoseGraphEdge> edges = chain_;
  edges.insert(edges.end(), loops_.begin(), loops_.end());
  closing_.emplace(
      Closing{PoseGraphOptimization(before, std::move(edges), 2), before, revisited, keyframes.size()});
}

std::optional<LoopCorrection> LiveLoops::optimize(const std::vector<Keyframe>& keyframes) {
  const std::size_t steps = std::max<std::size_t>(kGraphEdges / closing_->graph.edges(), 1);
  for (std::size_t i = 0; i < steps; ++i) {
    if (closing_->graph.step()) return correction(keyframes);
  }
  return std::nullopt;
}

/// Keyframes that have been added since then move with the last pose of the graph.
LoopCorrection LiveLoops::correction(const std::vector<Keyframe>& keyframes) {
  const std::vector<Pose2>&before = closing_->before, &after = closing_->graph.poses();
  for (std::size_t k = 0; k < poses_.size(); ++k) {
    const std::size_t node = std::min(node_at(k), before.size() - 1);
    const auto by = [&](std::size_t n) { return after[n] * (before[n].inverse() * poses_[k]); };
    if (node + 1 >= before.size()) {
      poses_[k] = by(node);
      continue;
    }
    const double begin = keyframes[nodes_[node]].driven, end = keyframes[nodes_[node + 1]].driven;
    poses_[k] = interpolate(by(node), by(node + 1), (keyframes[k].driven - begin) / (end - begin));
  }
  for (Submap& submap : submaps_) {
    if (!submap.complete) submap.surfels.reset();  // the rest is somewhere else now
  }
  const LoopCorrection result{poses_, closing_->revisited, closing_->keyframes};
  closing_.reset();
  return result;
}

}  // namespace parhelion::pose
