// Real people, tracked by sensors: bodies that agents see, keep clear of and brake before; a contact is an
// event, and driving into a person is the most severe one (person_touched). They are not in the physics:
// nothing pushes them.
#pragma once

#include <cstdint>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/simulation/bodies/agents.hpp"
#include "server/simulation/bodies/contact_tracker.hpp"
#include "server/simulation/bodies/real_robot.hpp"
#include "server/simulation/bodies/real_state.hpp"
#include "server/simulation/building/planar.hpp"

namespace parhelion::simulation {

/// Bodies of real people have the ids from here on: above all others.
inline constexpr BodyId kFirstPersonBody = BodyId{1} << 31;

/// Whether an entity of MR_WORLD is a real person, by its name (name_of()).
bool names_real_person(std::string_view entity);

/// A standing figure, in the body's frame: its origin is on the floor.
const std::vector<Shape>& real_person_shapes();

/// A real person at the newest step.
struct PlacedPerson {
  std::uint32_t id = 0;
  std::shared_ptr<const BodyDefinition> definition;
  Footprint disc;            ///< m, map
  double yaw = 0;            ///< rad, map: where the person walks, or has walked
  Eigen::Vector2d velocity;  ///< m/s, map
  double sigma = 0;          ///< m, 1 sigma of the place
};

class RealPeople {
 public:
  /// Replaces all; `people` in ascending id. True: others than before, so that the scene has changed.
  bool set(const std::vector<RealPerson>& people);
  /// To the places of this step, along their velocities for at most half a second.
  void place(SimulationTime now);
  std::span<const PlacedPerson> placed() const { return placed_; }
  const std::vector<RealPerson>& all() const { return people_; }

  /// Reports contacts of agents (PairKind::real_virtual) and of real robots (PairKind::real_real); object:
  /// the person. If a person walks into a robot that does not drive towards them, the contact is
  /// undetectable, so never scored. Where one drives into a person, person_touched follows, once a contact.
  void report_contacts(const Agents& agents, const RealRobots& robots, SimulationTime now,
                       std::vector<Event>& events);

 private:
  struct Mover;
  void look(const Mover& mover, SimulationTime now, std::vector<Event>& events);

  std::vector<RealPerson> people_;
  std::vector<PlacedPerson> placed_;  ///< one for each of people_
  std::vector<TouchingPair> touching_;
  ContactTracker contacts_;
  std::set<std::pair<std::string, std::string>> blamed_;  ///< contacts that were person_touched
};

/// The part of `wanted` at which the agent can still stop before every person: its speed towards a person is
/// at most sqrt(2 a d), a its deceleration and d its distance less a margin. Direction and curvature stay.
Twist2 slowed_for_people(const Agent& agent, const Twist2& wanted, const RealPeople& people);

}  // namespace parhelion::simulation
