#include "server/tick/injection_gate.hpp"

#include <algorithm>

namespace parhelion::tick {
namespace {

constexpr std::size_t kMany = 1000;  // more than a session has agents: names of removed ones are dropped

}  // namespace

bool InjectionGate::admit(const std::string& agent, double error, SimulationTime first,
                          const InjectionLimits& limits, simulation::Simulation& simulation) {
  const auto hidden =
      std::find_if(hidden_.begin(), hidden_.end(), [&](const Hidden& each) { return each.agent == agent; });
  const bool good = error <= limits.max_error;  // false for NaN
  if (hidden == hidden_.end()) {
    if (good) return true;
    if (hidden_.size() >= kMany) {
      std::erase_if(hidden_, [&](const Hidden& each) {
        const bool gone = !simulation.find_agent(each.agent);
        if (gone) changes_.push_back({each.agent, true});
        return gone;
      });
    }
    hidden_.push_back({agent, std::nullopt});
    changes_.push_back({agent, false});
    simulation.show(agent, simulation::AgentShown::withheld, robot_);
    return false;
  }
  if (!hidden->returning) {
    if (error <= limits.restore * limits.max_error) hidden->returning = simulation.now();
  } else if (!good) {
    hidden->returning.reset();
  } else if (first > *hidden->returning && simulation.clear_of_real(agent, robot_)) {
    hidden_.erase(hidden);
    changes_.push_back({agent, true});
    simulation.show(agent, simulation::AgentShown::shown, robot_);
    return true;
  }
  simulation.show(agent,
                  hidden->returning ? simulation::AgentShown::returning : simulation::AgentShown::withheld,
                  robot_);
  return false;
}

bool InjectionGate::shows(const std::string& agent) const {
  return std::none_of(hidden_.begin(), hidden_.end(),
                      [&](const Hidden& each) { return each.agent == agent; });
}

}  // namespace parhelion::tick
