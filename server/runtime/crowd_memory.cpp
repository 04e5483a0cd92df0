#include "server/runtime/crowd_memory.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>

#include "protocols/world.hpp"
#include "server/simulation/bodies/bodies.hpp"
#include "server/simulation/world/simulation_options.hpp"

namespace parhelion::runtime {
namespace {

constexpr double kPerBody = 4096;        // bytes besides its states: shapes, solver, watches
constexpr double kUsableFraction = 0.8;  // of available memory
constexpr std::uint64_t kPersonBodies = 9;

std::string gigabytes(std::uint64_t bytes) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f GB", static_cast<double>(bytes) * 1e-9);
  return text;
}

}  // namespace

std::uint64_t memory_of_bodies(std::uint64_t bodies, double physics_rate) {
  const double records = std::ceil(simulation::SimulationOptions{}.history.seconds() * physics_rate) + 1;
  return static_cast<std::uint64_t>(static_cast<double>(bodies) *
                                    (records * static_cast<double>(sizeof(BodyState)) + kPerBody));
}

Status check_crowd(const Scenario& scenario, std::uint64_t available) {
  if (!(scenario.physics_rate > 0 && scenario.physics_rate <= 10'000)) return {};
  std::uint64_t bodies = 0;
  for (const AgentDefinition& agent : scenario.agents) bodies += simulation::agent_bodies(agent, 1).size();
  std::uint64_t agents = scenario.agents.size();
  if (scenario.max_agents > Scenario{}.max_agents && scenario.max_agents > agents) {
    bodies += (scenario.max_agents - agents) * kPersonBodies;
    agents = scenario.max_agents;
  }
  const std::uint64_t needed = memory_of_bodies(bodies, scenario.physics_rate);
  const double fraction = kUsableFraction * static_cast<double>(available);
  if (static_cast<double>(needed) <= fraction) return {};
  const auto fit =
      static_cast<std::uint64_t>(static_cast<double>(agents) * fraction / static_cast<double>(needed));
  return Error{"scenario: " + std::to_string(agents) + " agents (agents and max_agents) need about " +
               gigabytes(needed) + " for two seconds of the states of " + std::to_string(bodies) +
               " bodies, and this machine has " + gigabytes(available) + " free; ask for at most " +
               std::to_string(fit) + ", or use a machine with more memory"};
}

}  // namespace parhelion::runtime
