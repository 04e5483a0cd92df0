#include "server/simulation/bodies/body_watch.hpp"

#include "protocols/agent.hpp"
#include "protocols/robot.hpp"
#include "server/simulation/bodies/bodies.hpp"
#include "server/simulation/bodies/cable.hpp"
#include "server/simulation/robots/robot_model.hpp"

namespace parhelion::simulation {

void BodyWatch::update(const ObservedMotion& motion, const std::vector<Zone>& zones, const Building& building,
                       double dt, std::vector<Event>& events) {
  movement_.update(body_, motion, events);
  if (body_.tilts) attitude_.update(body_, motion, events);
  if (body_.falls) fall_.update(body_, motion, dt, events);
  if (body_.climbs) steps_.update(body_, motion, building, events);
  if (!zones.empty()) zones_.update(body_, motion, zones, events);
  last_ = motion;
}

void BodyWatch::close(SimulationTime now, const std::vector<Zone>& zones, std::vector<Event>& events) {
  last_.stamp = now;
  movement_.close(body_, last_, events);
  zones_.close(body_, last_, zones, events);
}

Supervised supervised(const RobotDescription& robot) {
  Supervised body;
  body.name = robot.name;
  for (const Eigen::Vector2d& corner : robot.footprint) {
    body.low.head<2>() = body.low.head<2>().cwiseMin(corner);
    body.high.head<2>() = body.high.head<2>().cwiseMax(corner);
  }
  body.high.z() = robot.height;
  body.limits = robot.attitude;
  body.tilts = body.climbs = true;
  return body;
}

Supervised supervised(const AgentDefinition& agent, const AgentForm& form) {
  Supervised body;
  body.name = agent.name;
  body.low = {-form.size.x() / 2, -form.size.y() / 2, 0};
  body.high = {form.size.x() / 2, form.size.y() / 2, form.size.z()};
  body.tilts = body.falls = !form.upright;
  if (agent.kind == AgentKind::cable) {
    // The middle link represents the cable.
    const CableForm cable = cable_form(agent.size);
    body.high = {cable.pitch / 2, cable.radius, cable.radius};
    body.low = -body.high;
    body.tilts = false;
  }
  return body;
}

Supervised supervised(const std::string& name, const RobotModel& model) {
  Supervised body = supervised(model.description);
  body.name = name;
  body.limits = model.attitude;
  body.falls = true;
  return body;
}

}  // namespace parhelion::simulation
