// MR_MODEL: a new version of the building takes the old one's place between two physics steps.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "fusion/scan/building_tree.hpp"
#include "fusion/scan/ray_caster.hpp"
#include "protocols/bus/bus.hpp"
#include "protocols/model.hpp"
#include "protocols/status.hpp"
#include "protocols/telemetry.hpp"
#include "server/tick/door_tracker.hpp"
#include "server/tick/tick_context.hpp"

namespace parhelion::simulation {
class Building;
class Simulation;
}  // namespace parhelion::simulation
namespace parhelion::tick {

/// What takes time to make of a MR_MODEL message: made beside the tick in a live server, in it in replay.
struct PreparedModel {
  std::uint64_t version = 0;
  std::shared_ptr<const SemanticModel> model;
  scan::BuildingTree tree;
  std::shared_ptr<simulation::Building> building;  ///< for the physics
};

/// Error: YAML that is no model, or a model of another map than the session's.
Result<PreparedModel> prepare_model(const ModelVersion& message, const Configuration& configuration);

/// The building as it is known now.
struct SiteState {
  explicit SiteState(const Configuration& configuration);

  scan::RayCaster caster;                      ///< has the building, without its doors
  std::shared_ptr<const SemanticModel> model;  ///< of MR_MODEL; null: the configuration's still holds
  std::uint64_t model_version = 0;             ///< of MR_MODEL; 0: the configuration's
  std::optional<PreparedModel> prepared;       ///< for the MR_MODEL that comes next, where it was made ahead
};

inline const SemanticModel& current_model(const Configuration& configuration, const SiteState& site) {
  return site.model ? *site.model : configuration.model;
}

void handle_model(const TickContext& context, const Message& input, SiteState& site, DoorTracker& doors,
                  simulation::Simulation& simulation);

}  // namespace parhelion::tick
