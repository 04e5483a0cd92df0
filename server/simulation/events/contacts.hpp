// Contacts in a step: between bodies in the solver, and of real robots with the building.
#pragma once

#include <string>
#include <vector>

#include "server/simulation/bodies/agents.hpp"
#include "server/simulation/bodies/contact_tracker.hpp"
#include "server/simulation/bodies/real_robot.hpp"
#include "server/simulation/building/building.hpp"
#include "server/simulation/physics/physics.hpp"

namespace parhelion::simulation {

/// m added around a real robot for its pose uncertainty, in distances to the building.
double contact_margin(const RealRobot& robot);

class Contacts {
 public:
  /// After a step: finds contacts and appends the events of ContactTracker. Marks the touching links of
  /// articulated robots.
  void update(Agents& agents, const RealRobots& real_robots, const Building& building, const Physics& physics,
              SimulationTime now, std::vector<Event>& events);
  /// Of the newest step.
  const std::vector<TouchingPair>& touching() const { return touching_; }
  /// Whether the contact is active.
  bool touched(const std::string& subject, const std::string& object) const {
    return tracker_.touched(subject, object);
  }
  /// The same, whichever of them is the subject.
  bool touch_each_other(const std::string& a, const std::string& b) const {
    return touched(a, b) || touched(b, a);
  }
  /// Ends the contacts of an entity that is removed or moved.
  void forget(const std::string& entity, SimulationTime now, std::vector<Event>& events) {
    tracker_.forget(entity, now, events);
  }
  /// Reserves memory for a building of this many obstacles, so that no step allocates any.
  void reserve(std::size_t obstacles) { near_.reserve(4 * obstacles); }

 private:
  void collect_body_contacts(Agents& agents, const RealRobots& real_robots, const Building& building,
                             const Physics& physics);
  void collect_building_contacts(const RealRobot& robot, const Building& building);
  void collect_held_thing(const RealRobot& robot, const Agents& agents);
  void collect_robot_contact(const RealRobot& one, const RealRobot& other);

  ContactTracker tracker_;
  std::vector<TouchingPair> touching_;
  std::vector<const FixedObstacle*> near_;  // reused memory
  Footprint moved_;                         // reused memory
};

}  // namespace parhelion::simulation
