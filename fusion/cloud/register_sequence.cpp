#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <limits>
#include <numbers>
#include <numeric>

#include "fusion/cloud/registration.hpp"
#include "fusion/cloud/surfels.hpp"
#include "fusion/pose/mapping/pose_graph3.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::cloud {
namespace {

constexpr std::size_t kMaxMapScans = 3;  // nearest ones matched with a new scan
constexpr std::size_t kMinLoopSteps = 5;

/// One scan, thinned to the points needed for matching; the paper's method uses all points.
struct Node {
  PointCloud<Scanner> cloud;
  std::size_t scan = 0;  ///< index in the input
  double reach = 0;      ///< m, radius that contains 80 % of the points
};

Node make_node(const ScanToRegister& scan, std::size_t index, const RegistrationOptions& options) {
  Node node;
  node.scan = index;
  std::vector<float> ranges;
  for (std::size_t i = 0; i < scan.cloud.size(); i += 1 + scan.cloud.size() / 2000)
    ranges.push_back(scan.cloud.points[i].norm());
  node.reach = quantile(ranges, 0.8, QuantileRank::upper);
  // A third of a surfel, so that enough points remain for their normals.
  node.cloud.points = options.method == IcpMethod::paper
                          ? scan.cloud.points
                          : VoxelMoments(scan.cloud.points, options.surfel_size / 3).surfels().means;
  node.cloud.viewpoints = {Eigen::Vector3d::Zero()};
  return node;
}

/// The same for all scans, so that they are comparable.
double middle_surfel_size(const std::vector<ScanToRegister>& scans) {
  std::vector<double> sizes;
  sizes.reserve(scans.size());
  for (const ScanToRegister& scan : scans) sizes.push_back(fitted_surfel_size(scan.cloud.points));
  return median(sizes);
}

class Sequence {
 public:
  Sequence(const std::vector<ScanToRegister>& scans, const RegistrationOptions& options)
      : scans_(scans), options_(options), results_(scans.size()) {}

  Status add(std::size_t index);
  /// Retries the scans that were not placed: later scans may overlap with them.
  Status place_left_out();
  RegisteredSequence result() &&;

 private:
  Eigen::Isometry3d predicted(std::size_t index) const;
  std::vector<std::size_t> nearest(const Eigen::Vector3d& p, double reach, std::size_t end) const;
  Result<Registration> match(const Node& node, const std::vector<std::size_t>& among,
                             const Eigen::Isometry3d& T_cloud_scan) const;
  void connect(std::size_t from, const Registration& found, bool loop);
  Status close_loop();
  std::string leap(const Eigen::Isometry3d& guess, const Eigen::Isometry3d& found) const;

  const std::vector<ScanToRegister>& scans_;
  const RegistrationOptions options_;  ///< with a surfel size
  std::vector<RegisteredScan> results_;
  std::vector<Node> nodes_;  ///< of the scans that converged
  std::vector<Eigen::Isometry3d> poses_;
  std::vector<pose::PoseGraph3Edge> edges_;
};

/// From the last placed scan before it, by the difference of both guesses.
Eigen::Isometry3d Sequence::predicted(std::size_t index) const {
  std::size_t before = 0;
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    if (nodes_[i].scan < index && nodes_[i].scan >= nodes_[before].scan) before = i;
  }
  const ScanToRegister& scan = scans_[index];
  const ScanToRegister& last = scans_[nodes_[before].scan];
  if (!scan.has_guess) return poses_[before];
  if (!last.has_guess) return scan.guess.isometry();
  return poses_[before] * last.guess.isometry().inverse(Eigen::Isometry) * scan.guess.isometry();
}

/// Nodes before `end` within reach, the nearest first.
std::vector<std::size_t> Sequence::nearest(const Eigen::Vector3d& p, double reach, std::size_t end) const {
  std::vector<std::size_t> found;
  const auto distance = [&](std::size_t i) { return (poses_[i].translation() - p).norm(); };
  for (std::size_t i = 0; i < end; ++i) {
    if (distance(i) < reach) found.push_back(i);
  }
  std::stable_sort(found.begin(), found.end(), [&](auto a, auto b) { return distance(a) < distance(b); });
  return found;
}

/// T of the first of `among` to the node.
Result<Registration> Sequence::match(const Node& node, const std::vector<std::size_t>& among,
                                     const Eigen::Isometry3d& T_cloud_scan) const {
  const Eigen::Isometry3d T_anchor_cloud = poses_[among.front()].inverse(Eigen::Isometry);
  PointCloud<Target> target;
  for (const std::size_t i : among) {
    const PointCloud<Target> part =
        transformed(Transform<Target, Scanner>(T_anchor_cloud * poses_[i]), nodes_[i].cloud);
    target.points.insert(target.points.end(), part.points.begin(), part.points.end());
    target.scans.insert(target.scans.end(), part.size(),
                        static_cast<std::uint16_t>(target.viewpoints.size()));
    target.viewpoints.push_back(part.viewpoints.front());
  }
  PointCloud<Source> source;
  source.points = node.cloud.points;
  source.viewpoints = node.cloud.viewpoints;
  return register_pair(target, source, Transform<Target, Source>(T_anchor_cloud * T_cloud_scan), options_);
}

/// An edge from a node to the newest, with the covariance rotated into the newest's frame.
void Sequence::connect(std::size_t from, const Registration& found, bool loop) {
  const Eigen::Matrix3d R = found.T_target_source.rotation();
  Eigen::Matrix<double, 6, 6> turn = Eigen::Matrix<double, 6, 6>::Zero();
  turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = R.transpose();
  const Eigen::Matrix<double, 6, 6> covariance = turn * found.covariance * turn.transpose();
  edges_.push_back({from, nodes_.size() - 1, found.T_target_source.isometry(), covariance.inverse(), loop});
}

/// Matches the newest node with the nearest of those passed long before.
Status Sequence::close_loop() {
  if (nodes_.size() <= kMinLoopSteps) return {};
  const Node& newest = nodes_.back();
  const std::vector<std::size_t> old =
      nearest(poses_.back().translation(), newest.reach / 2, nodes_.size() - kMinLoopSteps);
  if (old.empty()) return {};
  const Result<Registration> found = match(newest, {old.front()}, poses_.back());
  if (!found) return found.error();
  if (!found->converged) return {};
  connect(old.front(), *found, true);
  poses_ = pose::optimize_pose_graph(poses_, edges_);
  return {};
}

/// Why a result that far from its guess is implausible: corridors look similar a few metres and a quarter
/// turn on, and ICP converges there where the scans do not overlap. Empty: plausible.
std::string Sequence::leap(const Eigen::Isometry3d& guess, const Eigen::Isometry3d& found) const {
  const Eigen::Isometry3d moved = guess.inverse(Eigen::Isometry) * found;
  const double distance = moved.translation().norm(), angle = Eigen::AngleAxisd(moved.linear()).angle();
  if (distance < 2 * options_.max_distance && angle < std::numbers::pi / 4) return {};
  std::array<char, 160> words;
  std::snprintf(words.data(), words.size(),
                "it fits %.1f m and %.0f degrees from where its guess puts it, but a guess is taken to be "
                "surer than that",
                distance, angle * 180 / std::numbers::pi);
  return words.data();
}

Status Sequence::add(std::size_t index) {
  RegisteredScan& result = results_[index];
  Node node = make_node(scans_[index], index, options_);
  if (nodes_.empty()) {
    result.converged = true;
    result.overlap = 1;
    nodes_.push_back(std::move(node));
    poses_.push_back(Eigen::Isometry3d::Identity());
    return {};
  }
  const Eigen::Isometry3d start = predicted(index);
  std::vector<std::size_t> among = nearest(start.translation(), node.reach, nodes_.size());
  if (among.empty()) among = {nodes_.size() - 1};
  among.resize(std::min(among.size(), kMaxMapScans));
  const Result<Registration> found = match(node, among, start);
  if (!found) return Error{scans_[index].name + ": " + found.error().message};
  result.why = found->why;
  result.overlap = found->overlap;
  result.rms = found->rms;
  result.T_cloud_scan = Transform<Cloud, Scanner>(start);
  const Eigen::Isometry3d T_cloud_scan = poses_[among.front()] * found->T_target_source.isometry();
  if (found->converged && scans_[index].has_guess) result.why = leap(start, T_cloud_scan);
  result.converged = found->converged && result.why.empty();
  if (!result.converged) return {};
  nodes_.push_back(std::move(node));
  poses_.push_back(T_cloud_scan);
  connect(among.front(), *found, false);
  return close_loop();
}

Status Sequence::place_left_out() {
  for (bool placed = true; placed;) {
    placed = false;
    for (std::size_t i = 0; i < results_.size(); ++i) {
      if (results_[i].converged) continue;
      if (Status status = add(i); !status.ok()) return status;
      placed = placed || results_[i].converged;
    }
  }
  return {};
}

RegisteredSequence Sequence::result() && {
  RegisteredSequence result;
  std::vector<std::size_t> order(nodes_.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](auto a, auto b) { return nodes_[a].scan < nodes_[b].scan; });
  for (const std::size_t i : order) {
    RegisteredScan& scan = results_[nodes_[i].scan];
    scan.T_cloud_scan = Transform<Cloud, Scanner>(poses_[i]);
    const PointCloud<Cloud> part = transformed(scan.T_cloud_scan, scans_[nodes_[i].scan].cloud);
    auto& all = result.cloud;
    all.points.insert(all.points.end(), part.points.begin(), part.points.end());
    all.normals.insert(all.normals.end(), part.normals.begin(), part.normals.end());
    all.colours.insert(all.colours.end(), part.colours.begin(), part.colours.end());
    all.labels.insert(all.labels.end(), part.labels.begin(), part.labels.end());
    all.scans.insert(all.scans.end(), part.size(), static_cast<std::uint16_t>(nodes_[i].scan));
  }
  for (const RegisteredScan& scan : results_)
    result.cloud.viewpoints.push_back(scan.T_cloud_scan.translation());
  // A column that some scans lack is dropped.
  const auto keep_whole = [&](auto& column) {
    if (column.size() != result.cloud.size()) column.clear();
  };
  keep_whole(result.cloud.normals);
  keep_whole(result.cloud.colours);
  keep_whole(result.cloud.labels);
  result.scans = std::move(results_);
  return result;
}

}  // namespace

Result<RegisteredSequence> register_sequence(const std::vector<ScanToRegister>& scans,
                                             const RegistrationOptions& options,
                                             const std::function<void(std::size_t, std::size_t)>& progress) {
  if (scans.empty()) return Error{"register: no scans; give one or more"};
  if (scans.size() > std::numeric_limits<std::uint16_t>::max())
    return Error{"register: " + std::to_string(scans.size()) + " scans; give at most 65535 at once"};
  for (const ScanToRegister& scan : scans) {
    if (scan.cloud.empty()) return Error{scan.name + ": register: the scan has no points"};
    for (std::size_t i = 0; i < scan.cloud.size(); ++i) {
      if (!scan.cloud.points[i].allFinite())
        return Error{scan.name + ": register: point " + std::to_string(i) +
                     " is not finite; drop such points where the cloud is read"};
    }
    if (scan.has_guess && !scan.guess.finite())
      return Error{scan.name + ": register: the guess is not finite; give a rigid transform"};
  }
  RegistrationOptions fitted = options;
  fitted.doubt_turns = false;  // from scan to scan the guess is more reliable
  if (options.surfel_size == 0) fitted.surfel_size = middle_surfel_size(scans);
  Sequence sequence(scans, fitted);
  std::vector<double> seconds;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    const auto start = std::chrono::steady_clock::now();
    if (const Status status = sequence.add(i); !status.ok()) return status.error();
    seconds.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    if (progress) progress(i + 1, scans.size());
  }
  if (const Status status = sequence.place_left_out(); !status.ok()) return status.error();
  RegisteredSequence result = std::move(sequence).result();
  for (std::size_t i = 0; i < scans.size(); ++i) result.scans[i].seconds = seconds[i];
  return result;
}

}  // namespace parhelion::cloud
