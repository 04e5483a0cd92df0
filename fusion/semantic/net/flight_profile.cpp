#include "fusion/semantic/net/flight_profile.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "protocols/quantile.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kOn = 0.035;  ///< m, from a riser or a tread to a point of it
constexpr double kSide =
    0.08;  ///< m, of the flight's width at either side: a wall or a cheek may stand there
constexpr double kColumn = 0.10;      ///< m, across the flight
constexpr double kAcross = 0.2;       ///< minimum fraction of these in which it is seen
constexpr std::size_t kFew = 8;       ///< points of a step
constexpr double kAgree = 0.7;        ///< minimum fraction of the points there that are on the profile
constexpr double kOver = 0.5;         ///< points over a step, of those on it: more is a wall
constexpr double kHead = 0.6;         ///< m, over a step, that is free
constexpr double kLanding = 2.6;      ///< m, of a landing
constexpr std::size_t kSurface = 15;  ///< points that tell a tread's height

/// The points of a column of a step: sparse lines of points that cross a slope make a stepped profile, too,
/// but are nowhere spread over a tread or a riser.
struct Column {
  double near = 0, far = 0, low = 0, high = 0;  ///< m: of its points on the tread; on the riser
  bool any = false, any_tread = false, any_riser = false;

  void add_tread(double s) {
    near = any_tread ? std::min(near, s) : s, far = any_tread ? std::max(far, s) : s;
    any = any_tread = true;
  }
  void add_riser(double z) {
    low = any_riser ? std::min(low, z) : z, high = any_riser ? std::max(high, z) : z;
    any = any_riser = true;
  }
  bool is_filled(double depth, double rise) const {
    constexpr double kMuch = 0.4;
    return far - near >= kMuch * depth || high - low >= kMuch * rise;
  }
};

}  // namespace

bool ProfileMatch::continues() const {
  return on >= kFew && across >= kAcross &&
         static_cast<double>(on) >= kAgree * static_cast<double>(on + off) &&
         static_cast<double>(over) <= kOver * static_cast<double>(on);
}

ProfileMatch match(const FlightPoints& points, const ProfileCorner& corner, double depth, double width) {
  ProfileMatch result;
  std::vector<Column> columns(static_cast<std::size_t>(width / kColumn) + 1);
  const double tread = corner.below ? corner.low : corner.high;
  const double from = corner.below ? -0.8 * depth : -0.5 * depth,
               to = corner.below ? 0.5 * depth : 0.8 * depth;
  for (const FlightPoint& p : points) {
    const double s = p.s - corner.edge, z = p.z;
    if (s < from || s > to || z < corner.low - kHead || z > corner.high + kHead) continue;
    // What is at the height of the level that the flight already has is no evidence for another one.
    const bool known = corner.below ? z > corner.high - kOn : z < corner.low + kOn;
    if (known && !(corner.below && s < -kOn)) continue;
    // Under an open flight, seen from behind it.
    if (!p.from_front && s > kOn && z < corner.high - kOn) continue;
    const bool on_tread = p.from_above && std::abs(z - tread) < kOn && (corner.below ? s < kOn : s > -kOn);
    const bool on_riser = p.from_front && std::abs(s) < kOn && z > corner.low - kOn && z < corner.high + kOn;
    if (on_tread || on_riser) {
      ++result.on;
      Column& column = columns[static_cast<std::size_t>(p.t / kColumn)];
      if (on_tread) {
        result.tread.push_back(z);
        result.tread_at.push_back(p.s);
        column.add_tread(s);
      } else {
        result.riser.push_back(p.s);
        column.add_riser(z);
      }
    } else if (z > corner.high + kOn) {
      result.over += s > -kOn && s < 0.5 * depth;
    } else if (z < corner.low - kOn) {
      result.over += corner.below && p.from_front && std::abs(s) < kOn;
    } else {
      ++result.off;
    }
  }
  const auto any = std::count_if(columns.begin(), columns.end(), [](const Column& c) { return c.any; });
  const auto filled = std::count_if(columns.begin(), columns.end(), [&](const Column& c) {
    return c.is_filled(depth, corner.high - corner.low);
  });
  result.across = static_cast<double>(any) / static_cast<double>(columns.size());
  result.filled = any > 0 ? static_cast<double>(filled) / static_cast<double>(any) : 0;
  return result;
}

namespace {

/// m, where its steps' front edges are: the outer edge of a tread is seen from everywhere.
double depth_between(const Flight& flight) {
  std::vector<double> depths;
  for (std::size_t i = 2; i < flight.steps.size(); ++i)
    depths.push_back(flight.steps[i].near - flight.steps[i - 1].near);
  return depths.empty() ? 0 : median(depths);
}

}  // namespace

ProfileFrame frame_of(const Flight& flight) {
  std::vector<double> left, right;
  for (const Step& step : flight.steps) left.push_back(step.left), right.push_back(step.right);
  const double l = median(left) + kSide, r = median(right) - kSide;
  return {l, r - l, median(flight.rises()), depth_between(flight)};
}

bool is_tall(const Segmentation& segmentation, std::uint32_t surface) {
  constexpr double kHighRiser = 0.6;  // m
  if (surface >= segmentation.verticals.size()) return false;
  const VerticalSurface& upright = segmentation.verticals[surface];
  return upright.z_high - upright.z_low > kHighRiser;
}

FlightPoints points_along(const StepPoints& points, const Eigen::Vector2d& direction,
                          const ProfileFrame& frame, double from, double to, double low, double high) {
  FlightPoints result;
  const Eigen::Vector2d across(-direction.y(), direction.x());
  const auto is_beside = [&](std::uint32_t surface) {
    if (!is_tall(points.segmentation, surface)) return false;
    const VerticalSurface& upright = points.segmentation.verticals[surface];
    return std::abs(direction.dot((upright.end - upright.start).normalized())) > 0.7;
  };
  const cloud::PointCloud<Map>& cloud = points.cloud;
  const auto add = [&](std::uint32_t k) {
    const Eigen::Vector3d p = points.strips.sorted()[k].cast<double>();
    if (p.z() < low || p.z() > high) return;
    const double s = direction.dot(p.head<2>()), t = across.dot(p.head<2>()) - frame.left;
    const std::uint32_t i = points.strips.order()[k];
    if (s < from || s > to || t < 0 || t > frame.width || is_beside(points.segmentation.surface_of[i]))
      return;
    bool above = true, front = true;
    if (!cloud.viewpoints.empty()) {
      const Eigen::Vector3d& eye = cloud.viewpoints[cloud.scans.empty() ? 0 : cloud.scans[i]];
      above = eye.z() > p.z(), front = direction.dot(eye.head<2>()) < s;
    }
    result.push_back({s, t, p.z(), above, front});
  };
  points.strips.for_each_on(direction, {from, to, frame.left, frame.left + frame.width}, add);
  return result;
}

namespace {

/// The best place for the corner within a few centimetres.
ProfileMatch best_near(const FlightPoints& points, ProfileCorner& corner, const ProfileFrame& frame) {
  ProfileMatch best;
  const double edge = corner.edge;
  for (const double off : {0.0, 0.02, -0.02, 0.04, -0.04}) {
    ProfileCorner moved = corner;
    moved.edge = edge + off;
    ProfileMatch candidate = match(points, moved, frame.depth, frame.width);
    if (off != 0 && candidate.worth() <= best.worth()) continue;
    best = std::move(candidate);
    corner.edge = moved.edge;
  }
  return best;
}

}  // namespace

Step step_at(const ProfileCorner& corner, const ProfileMatch& match, const ProfileFrame& frame) {
  constexpr double kOuter = 0.03;  // quantile: the outer edge of a tread is seen from everywhere above it
  double edge = corner.edge;
  if (match.riser.size() >= kFew)
    edge = median(std::vector<double>(match.riser));
  else if (!corner.below && match.tread_at.size() >= kSurface)
    edge = quantile(std::vector<double>(match.tread_at), kOuter);
  const double predicted = corner.below ? corner.low : corner.high;
  const double z = match.tread.size() >= kSurface ? median(std::vector<double>(match.tread)) : predicted;
  const double left = frame.left - kSide, right = frame.left + frame.width + kSide;
  return corner.below ? Step{kNoSurface, z, edge - frame.depth, edge, left, right}
                      : Step{kNoSurface, z, edge, edge + frame.depth, left, right};
}

namespace {

/// The corner that follows one, outwards.
ProfileCorner after(const ProfileCorner& corner, const ProfileFrame& frame) {
  const double sign = corner.below ? -1 : 1;
  return {corner.edge + sign * frame.depth, corner.low + sign * frame.rise, corner.high + sign * frame.rise,
          corner.below};
}

bool is_seen_from_above(const cloud::PointCloud<Map>& cloud, double z) {
  constexpr double kLower = 0.05;  // m
  return cloud.viewpoints.empty() ||
         std::any_of(cloud.viewpoints.begin(), cloud.viewpoints.end(),
                     [&](const Eigen::Vector3d& eye) { return eye.z() > z + kLower; });
}

/// Whether points of a level surface lie between two places along the flight, over half of the way.
bool is_level_between(const FlightPoints& points, double z, double from, double to) {
  constexpr double kBin = 0.1;  // m
  const double low = std::min(from, to), length = std::abs(to - from);
  std::vector<bool> seen(static_cast<std::size_t>(length / kBin) + 1);
  for (const FlightPoint& p : points) {
    if (p.from_above && std::abs(p.z - z) < kOn && p.s >= low && p.s < low + length)
      seen[static_cast<std::size_t>((p.s - low) / kBin)] = true;
  }
  return 2 * static_cast<std::size_t>(std::count(seen.begin(), seen.end(), true)) >= seen.size();
}

}  // namespace

Eigen::Vector2d square_to_risers(const StepPoints& points, const Flight& flight) {
  constexpr double kReach = 0.12, kMaxTurn = 0.08, kWide = 0.2;  // m, rad, m
  constexpr std::size_t kEnough = 30;
  const ProfileFrame frame = frame_of(flight);
  if (frame.width < 2 * kWide) return flight.direction;
  struct Seen {
    double s, t;
    std::size_t riser;
  };
  std::vector<Seen> seen;
  const Step &first = flight.steps.front(), &last = flight.steps.back();
  for (const FlightPoint& p :
       points_along(points, flight.direction, frame, first.near, last.far, first.z, last.z)) {
    for (std::size_t i = 1; i < flight.steps.size(); ++i) {
      const double over = (p.z - flight.steps[i - 1].z) / (flight.steps[i].z - flight.steps[i - 1].z);
      const double s = p.s - flight.steps[i].near;
      if (over > 0.25 && over < 0.75 && std::abs(s) < kReach) seen.push_back({s, p.t, i});
    }
  }
  double slope = 0;
  for (int round = 0; round < 5; ++round) {
    if (seen.size() < kEnough) return flight.direction;
    struct Sums {
      double n = 0, s = 0, t = 0, st = 0, tt = 0;
    };
    std::vector<Sums> sums(flight.steps.size());
    for (const Seen& p : seen) {
      Sums& sum = sums[p.riser];
      sum.n += 1, sum.s += p.s, sum.t += p.t, sum.st += p.s * p.t, sum.tt += p.t * p.t;
    }
    double covariance = 0, variance = 0, n = 0;
    for (const Sums& sum : sums) {
      if (sum.n < 3) continue;
      covariance += sum.st - sum.s * sum.t / sum.n, variance += sum.tt - sum.t * sum.t / sum.n, n += sum.n;
    }
    if (n < static_cast<double>(kEnough) || variance < n * kWide * kWide) return flight.direction;
    slope = covariance / variance;
    std::vector<double> off;
    for (const Seen& p : seen) {
      const Sums& sum = sums[p.riser];
      off.push_back(std::abs(p.s - sum.s / sum.n - slope * (p.t - sum.t / sum.n)));
    }
    const double max_off = std::max(0.01, 2.5 * median(std::vector<double>(off)));
    std::size_t k = 0;
    std::erase_if(seen, [&](const Seen&) { return off[k++] > max_off; });
  }
  if (std::abs(slope) > kMaxTurn) return flight.direction;
  const Eigen::Vector2d across(-flight.direction.y(), flight.direction.x());
  return (flight.direction - slope * across).normalized();
}

bool is_on_profile(const StepPoints& points, const Flight& flight) {
  constexpr double kUneven = 0.03, kSeen = 0.6, kAgreeing = 0.8;  // m, of its steps, of their points
  constexpr double kFilled = 0.3;                                 // of the columns of a step, median
  constexpr std::size_t kFewest = 3, kTreads = 2;
  // A stride, twice the rise and the depth, is 0.59 to 0.65 m (DIN 18065); long flights prove themselves.
  constexpr double kShortest = 0.54, kLongest = 0.67;  // m
  constexpr std::size_t kLong = 5;
  const ProfileFrame frame = frame_of(flight);
  const double stride = 2 * frame.rise + frame.depth;
  if (flight.steps.size() <= kLong && (stride < kShortest || stride > kLongest)) return false;
  std::size_t seen = 0, treads = 0, on = 0, off = 0;
  std::vector<double> filled;
  for (std::size_t i = 1; i < flight.steps.size(); ++i) {
    const ProfileCorner corner{flight.steps[i].near, flight.steps[i - 1].z, flight.steps[i].z, false};
    if (std::abs(corner.high - corner.low - frame.rise) > kUneven) return false;
    const FlightPoints around =
        points_along(points, flight.direction, frame, corner.edge - frame.depth, corner.edge + frame.depth,
                     corner.low - frame.rise, corner.high + kHead);
    const ProfileMatch there = match(around, corner, frame.depth, frame.width);
    if (!there.continues()) continue;
    ++seen, treads += there.tread.size() >= kSurface, on += there.on, off += there.off;
    filled.push_back(there.filled);
  }
  if (filled.empty() || median(std::move(filled)) < kFilled) return false;
  if (treads < kTreads || static_cast<double>(on) < kAgreeing * static_cast<double>(on + off)) return false;
  return seen >= kFewest && static_cast<double>(seen) >= kSeen * static_cast<double>(flight.steps.size() - 1);
}

bool may_have_landing(const StepPoints& points, const Flight& flight, double to) {
  const Step& end = flight.steps.back();
  if (!is_seen_from_above(points.cloud, end.z)) return true;
  const ProfileFrame frame = frame_of(flight);
  return is_level_between(
      points_along(points, flight.direction, frame, end.far, to, end.z - kOn, end.z + kOn), end.z, end.far,
      to);
}

std::optional<Step> next_on_profile(const StepPoints& points, Flight& flight, bool below) {
  if (flight.steps.size() < 3) return std::nullopt;
  const ProfileFrame frame = frame_of(flight);
  if (frame.width < 3 * kColumn || frame.depth < 0.15) return std::nullopt;
  const double sign = below ? -1 : 1;
  Step& end = below ? flight.steps.front() : flight.steps.back();
  ProfileCorner corner{below ? flight.steps[1].near - frame.depth : end.near + frame.depth,
                       below ? end.z - frame.rise : end.z, below ? end.z : end.z + frame.rise, below};
  const double far = corner.edge + sign * (kLanding + 2 * frame.depth),
               behind = corner.edge - sign * frame.depth;
  const FlightPoints local =
      points_along(points, flight.direction, frame, std::min(far, behind), std::max(far, behind),
                   corner.low - frame.rise - kHead, corner.high + frame.rise + kHead);
  if (const ProfileMatch there = best_near(local, corner, frame); there.continues())
    return step_at(corner, there, frame);
  // Behind a landing a second step must confirm the first.
  constexpr double kShortest = 0.3, kEach = 0.05;  // m beyond a tread's depth
  const double start = (below ? flight.steps[1].near - frame.depth : end.near + frame.depth);
  const bool may_be_seen = is_seen_from_above(points.cloud, end.z);
  for (double more = kShortest; more < kLanding; more += kEach) {
    if (may_be_seen && !is_level_between(local, end.z, start, start + sign * more)) continue;
    ProfileCorner first = corner;
    first.edge = start + sign * more;
    const ProfileMatch there = best_near(local, first, frame);
    if (!there.continues() || there.riser.size() < kFew) continue;
    ProfileCorner second = after(first, frame);
    if (!best_near(local, second, frame).continues()) continue;
    const Step step = step_at(first, there, frame);
    (below ? end.near : end.far) = below ? step.far : step.near;
    return step;
  }
  return std::nullopt;
}

}  // namespace parhelion::semantic
