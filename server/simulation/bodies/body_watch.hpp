// Converts the motion of supervised bodies to events (paper 4.1): a BodyWatch for each body, updated at every
// physics step.
#pragma once

#include <vector>

#include "server/simulation/bodies/watches.hpp"

namespace parhelion {
struct AgentDefinition;
}
namespace parhelion {
struct RobotDescription;
}
namespace parhelion::simulation {

/// All watches of one body.
class BodyWatch {
 public:
  BodyWatch() = default;
  explicit BodyWatch(Supervised body) : body_(std::move(body)) {}

  /// Processes the step that ended at `motion`; appends its events, all stamped motion.stamp.
  void update(const ObservedMotion& motion, const std::vector<Zone>& zones, const Building& building,
              double dt, std::vector<Event>& events);
  /// The body is removed at `now`: ends its movements and leaves its zones.
  void close(SimulationTime now, const std::vector<Zone>& zones, std::vector<Event>& events);
  const Supervised& body() const { return body_; }

 private:
  Supervised body_;
  ObservedMotion last_;
  MovementWatch movement_;
  AttitudeWatch attitude_;
  FallWatch fall_;
  StepWatch steps_;
  ZoneWatch zones_;
};

struct AgentForm;
struct RobotModel;
/// The real robot: its height is an estimate by SLAM, so falls are not reported.
Supervised supervised(const RobotDescription& robot);
Supervised supervised(const AgentDefinition& agent, const AgentForm& form);
/// An articulated robot, with all events.
Supervised supervised(const std::string& name, const RobotModel& model);

}  // namespace parhelion::simulation
