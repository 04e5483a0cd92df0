// Real people, tracked by sensors: agents keep clear of them, robots brake before them, and a contact is an
// event. They have no body in the physics: nothing pushes them.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "server/simulation/agents.hpp"
#include "server/simulation/contact_tracker.hpp"
#include "server/simulation/planar.hpp"
#include "server/simulation/simulation.hpp"

namespace parhelion::simulation {

/// A real person at the newest step.
struct PlacedPerson {
  std::uint32_t id = 0;
  std::size_t robot = 0;
  Footprint disc;            ///< m, map
  Eigen::Vector2d velocity;  ///< m/s, map
};

class RealPeople {
 public:
  /// Replaces those that this robot sees.
  void set(const std::vector<RealPerson>& people, std::size_t robot);
  /// To the places of this step, along their velocities for at most half a second.
  void place(SimulationTime now);
  std::span<const PlacedPerson> placed() const { return std::span(placed_).first(people_.size()); }

  /// Reports contacts of agents; subject: the agent, object: as of set_real_people()
  /// (PairKind::real_virtual). Undetectable, so never scored: the agent stands and the person comes.
  void report_contacts(const Agents& agents, SimulationTime now, std::vector<Event>& events);

 private:
  std::vector<RealPerson> people_;
  std::vector<PlacedPerson> placed_;  ///< at least one for each: memory is kept
  std::vector<TouchingPair> touching_;
  ContactTracker contacts_;
};

/// The part of `wanted` at which the agent can still stop before every person: its speed towards a person is
/// at most sqrt(2 a d), a its deceleration and d its distance less a margin. Direction and curvature stay.
Twist2 slowed_for_people(const Agent& agent, const Twist2& wanted, const RealPeople& people);

}  // namespace parhelion::simulation
