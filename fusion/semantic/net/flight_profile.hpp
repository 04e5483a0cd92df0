// The stepped profile of a flight, looked at from its side: what continues it needs few points, because where
// its risers and treads must be is known. Internal to the semantic net.
#pragma once

#include <optional>
#include <vector>

#include "fusion/semantic/net/find_stairs.hpp"
#include "fusion/semantic/net/flight_strip.hpp"

namespace parhelion::semantic {

/// A point on the way of a flight.
struct FlightPoint {
  double s, t, z;  ///< m: along the flight, across it from its left side, height
  /// Seen from above, and from the flight's foot; true where it is not known from where. Undersides of treads
  /// and backs of risers make a flight of their own otherwise.
  bool from_above, from_front;
};
using FlightPoints = std::vector<FlightPoint>;

/// The points that flights are looked for in.
struct StepPoints {
  const StripPoints& strips;
  const cloud::PointCloud<Map>& cloud;
  const Segmentation& segmentation;
};

/// Higher than a riser is.
bool is_tall(const Segmentation& segmentation, std::uint32_t surface);

/// m: where a flight's steps are seen, and what is usual among them.
struct ProfileFrame {
  double left, width, rise, depth;
};

/// A riser between two heights and the tread that is new: behind its head, or before its foot.
struct ProfileCorner {
  double edge, low, high;  ///< m
  bool below;              ///< the tread before the foot
};

/// The points around a corner: on its riser or tread, beside them, and where its riser would go on: over its
/// head, and under the foot of one that leads down.
struct ProfileMatch {
  std::size_t on = 0, off = 0, over = 0;
  double across = 0;                 ///< fraction of the width where points are on it
  double filled = 0;                 ///< of these, where they cover much of the tread or of the riser
  std::vector<double> riser, tread;  ///< m: places along the flight of the one's, heights of the other's
  std::vector<double> tread_at;      ///< m: places along the flight of the tread's

  double worth() const { return static_cast<double>(on) - 2 * static_cast<double>(off + over); }
  bool continues() const;  ///< whether they are those of a step
};

ProfileMatch match(const FlightPoints& points, const ProfileCorner& corner, double depth, double width);

/// `flight` has at least three steps.
ProfileFrame frame_of(const Flight& flight);

/// The points between two places along the flight and two heights, over its width; not those of walls and
/// cheeks beside it.
FlightPoints points_along(const StepPoints& points, const Eigen::Vector2d& direction,
                          const ProfileFrame& frame, double from, double to, double low, double high);

/// The new tread; its place and height are measured where enough of it is.
Step step_at(const ProfileCorner& corner, const ProfileMatch& match, const ProfileFrame& frame);

/// The flight's direction, turned until its risers are square to it; unchanged where too little of them is
/// seen.
Eigen::Vector2d square_to_risers(const StepPoints& points, const Flight& flight);

/// Whether its rises are even and most of its steps are seen.
bool is_on_profile(const StepPoints& points, const Flight& flight);

/// Whether a landing between the flight's upper end and a place along it is seen, over half of its length, or
/// lies too high to be seen.
bool may_have_landing(const StepPoints& points, const Flight& flight, double to);

/// The step that continues the flight's profile beyond one end, there or behind a landing; the end's own step
/// is changed where it is that landing.
std::optional<Step> next_on_profile(const StepPoints& points, Flight& flight, bool below);

}  // namespace parhelion::semantic
