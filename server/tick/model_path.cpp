// MR_MODEL: a new version of the building takes the old one's place between two physics steps.
#include "server/tick/door_sight.hpp"
#include "server/tick/tick.hpp"

namespace parhelion::tick {

Result<PreparedModel> prepare_model(const ModelVersion& message, const Configuration& configuration) {
  auto model = parse_model(message.yaml, "MR_MODEL version " + std::to_string(message.version));
  if (!model) return model.error();
  const std::string& map_id = configuration.model.map_id;
  if (!map_id.empty() && model->map_id != map_id) {
    return Error{"MR_MODEL version " + std::to_string(message.version) + ": is of map '" + model->map_id +
                 "', the session's is '" + map_id + "'"};
  }
  auto building = simulation::Simulation::prepare_building(*model);
  if (!building)
    return Error{"MR_MODEL version " + std::to_string(message.version) + ": " + building.error().message};
  scan::BuildingTree tree(*model, scan::BuildingTree::Doors::left_out);
  return PreparedModel{message.version, std::make_shared<const SemanticModel>(std::move(*model)),
                       std::move(tree), std::move(*building)};
}

void change_model(const Configuration& configuration, const Message& input, State& state, Outputs& outputs) {
  ModelVersion message;
  if (const Status read = decode(input.channel, input.payload, message); !read)
    return refuse(read.error(), state);
  std::optional<PreparedModel> prepared = std::exchange(state.prepared_model, std::nullopt);
  if (!configuration.scenario.mapping) {
    return refuse({input.channel + ": a new model, though the scenario does not say 'mapping: true'"}, state);
  }
  if (message.version <= state.model_version) {
    return refuse({input.channel + ": version " + std::to_string(message.version) + " after version " +
                   std::to_string(state.model_version)},
                  state);
  }
  if (!prepared || prepared->version != message.version) {
    auto made = prepare_model(message, configuration);
    if (!made) return refuse(made.error(), state);
    prepared = std::move(*made);
  }
  if (const Status set = state.simulation.set_building(*prepared->model, std::move(prepared->building)); !set)
    return refuse({input.channel + ": " + set.error().message}, state);
  state.caster.set_building(std::move(prepared->tree));
  state.model = std::move(prepared->model);
  state.model_version = message.version;
  find_real_doors(configuration, *state.model, state);
  Event event;
  event.stamp = simulation_time(input.arrival);
  event.kind = EventKind::model_changed;
  event.text = "version " + std::to_string(message.version) + ": " +
               std::to_string(state.model->entities.size()) + " entities";
  publish_simulation_events(configuration, state, outputs);
  publish_event(configuration, event, state, outputs);
}

}  // namespace parhelion::tick
