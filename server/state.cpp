#include "server/state.hpp"

namespace parhelion {
namespace {

PoseTrackOptions track_options(const Configuration& configuration) {
  PoseTrackOptions options;
  options.map_id = configuration.model.map_id;
  return options;
}

}  // namespace

State::State(Simulation simulation_, const Configuration& configuration)
    : simulation(std::move(simulation_)), track(configuration.robot, track_options(configuration)) {
  caster.set_building(configuration.model);
}

Result<std::unique_ptr<State>> make_state(const Configuration& configuration, ArrivalTime start) {
  SimulationOptions options;
  options.rate = configuration.scenario.physics_rate;
  options.seed = configuration.scenario.seed;
  auto simulation =
      Simulation::create(options, configuration.model, configuration.robot, simulation_time(start));
  if (!simulation) return simulation.error();
  auto state = std::make_unique<State>(std::move(*simulation), configuration);
  for (const AgentDefinition& agent : configuration.scenario.agents) {
    if (const Status spawned = state->simulation.spawn(agent, std::nullopt); !spawned) {
      return Error{"scenario agent '" + agent.name + "': " + spawned.error().message};
    }
    state->kinds[agent.name] = agent.kind;
  }
  return state;
}

}  // namespace parhelion
