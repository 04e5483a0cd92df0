#include "server/tick/model_path.hpp"

#include <utility>

#include "protocols/codec.hpp"
#include "server/simulation/simulation.hpp"
#include "server/tick/world_path.hpp"

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

SiteState::SiteState(const Configuration& configuration) {
  caster.set_building(scan::BuildingTree(configuration.model, scan::BuildingTree::Doors::left_out));
}

void handle_model(const TickContext& context, const Message& input, SiteState& site, DoorTracker& doors,
                  simulation::Simulation& simulation) {
  const Configuration& configuration = context.configuration;
  ModelVersion message;
  if (const Status read = decode(input.channel, input.payload, message); !read)
    return refuse(context, read.error());
  std::optional<PreparedModel> prepared = std::exchange(site.prepared, std::nullopt);
  if (!configuration.scenario.mapping)
    return refuse(context,
                  {input.channel + ": a new model, though the scenario does not say 'mapping: true'"});
  if (message.version <= site.model_version) {
    return refuse(context, {input.channel + ": version " + std::to_string(message.version) +
                            " after version " + std::to_string(site.model_version)});
  }
  if (!prepared || prepared->version != message.version) {
    auto made = prepare_model(message, configuration);
    if (!made) return refuse(context, made.error());
    prepared = std::move(*made);
  }
  if (const Status set = simulation.set_building(*prepared->model, std::move(prepared->building)); !set)
    return refuse(context, {input.channel + ": " + set.error().message});
  site.caster.set_building(std::move(prepared->tree));
  site.model = std::move(prepared->model);
  site.model_version = message.version;
  find_real_doors(configuration, *site.model, simulation, doors);
  Event event;
  event.stamp = context.now;
  event.kind = EventKind::model_changed;
  event.text = "version " + std::to_string(message.version) + ": " +
               std::to_string(site.model->entities.size()) + " entities";
  publish_simulation_events(context, simulation);
  publish_event(context, event);
}

}  // namespace parhelion::tick
