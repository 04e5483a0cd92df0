#include "server/simulation/agent_lasers.hpp"

#include <cmath>
#include <numbers>
#include <utility>

#include "server/simulation/robots/base_body.hpp"

namespace parhelion::simulation {

Status fit_laser(Agent& agent, SimulationTime now) {
  if (agent.definition.laser.empty()) return {};
  const std::string who = "agent '" + agent.definition.name + "': ";
  if (agent.definition.kind != AgentKind::robot) return Error{who + "only a robot carries a laser"};
  auto preset = load_laser_preset(agent.definition.laser);
  if (!preset) return Error{who + preset.error().message};
  AgentLaser laser;
  laser.description = std::move(preset).value();
  laser.description.T_base_laser = agent_laser_mount();
  if (agent.robot && agent.robot->model().description.laser)
    laser.description.T_base_laser = agent.robot->model().description.laser->T_base_laser;
  if (laser.description.scan_period <= 0) laser.description.scan_period = 0.1;
  laser.next = now;
  agent.laser = std::move(laser);
  return {};
}

void request_scans(Agents& agents, SimulationTime now, std::vector<LaserRequest>& requests) {
  for (Agent& agent : agents) {
    if (!agent.laser || now < agent.laser->next) continue;
    AgentLaser& laser = *agent.laser;
    while (laser.next <= now) laser.next = laser.next + seconds(laser.description.scan_period);
    laser.requested = now;
    laser.T_map_laser = base_of(agent.rigid.T_map_body) * laser.description.T_base_laser;
    LaserRequest request{agent.definition.name, now, laser.T_map_laser, laser.description, {}};
    for (std::size_t i = 0; i < agent.body_count; ++i) {
      request.own_bodies.push_back(agent.first_body + static_cast<BodyId>(i));
    }
    requests.push_back(std::move(request));
  }
}

void handle_scan(AgentLaser& laser, const Scan& scan) {
  constexpr double sector_width = 4 * std::numbers::pi / 180;
  laser.points.clear();
  double sector_end = -1;
  float nearest = 0;
  double nearest_angle = 0;
  const auto close_sector = [&] {
    if (nearest <= 0) return;
    const Eigen::Vector3d p = laser.T_map_laser * Eigen::Vector3d(nearest * std::cos(nearest_angle),
                                                                  nearest * std::sin(nearest_angle), 0);
    laser.points.push_back(make_disc({p.x(), p.y()}, 0.02));
    nearest = 0;
  };
  for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
    const double swept = static_cast<double>(i) * std::abs(static_cast<double>(scan.angle_increment));
    if (swept > sector_end) {
      close_sector();
      sector_end = swept + sector_width;
    }
    const float range = scan.ranges[i];
    if (laser.description.convention.classify(range) != BeamKind::hit || range > kSight) continue;
    if (nearest <= 0 || range < nearest) {
      nearest = range;
      nearest_angle = scan.angle_min + static_cast<double>(i) * scan.angle_increment;
    }
  }
  close_sector();
  laser.measured = laser.requested;
}

}  // namespace parhelion::simulation
