// MR_MODEL: replaces the building by a new version between two physics steps.
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

/// The expensive results of a MR_MODEL message: prepared outside the tick in a live server, inside it in
/// replay.
struct PreparedModel {
  std::uint64_t version = 0;
  std::shared_ptr<const SemanticModel> model;
  scan::BuildingTree tree;
  std::shared_ptr<simulation::Building> building;  ///< for the physics
};

/// Error: YAML that is not a model, or a model of another map than the session's.
Result<PreparedModel> prepare_model(const ModelVersion& message, const Configuration& configuration);

/// The building as currently known.
struct SiteState {
  explicit SiteState(const Configuration& configuration);

  scan::RayCaster caster;                      ///< the building, without its doors
  std::shared_ptr<const SemanticModel> model;  ///< from MR_MODEL; null: the configuration's is current
  std::uint64_t model_version = 0;             ///< from MR_MODEL; 0: the configuration's
  std::optional<PreparedModel> prepared;       ///< for the next MR_MODEL, where prepared ahead
};

inline const SemanticModel& current_model(const Configuration& configuration, const SiteState& site) {
  return site.model ? *site.model : configuration.model;
}

void handle_model(const TickContext& context, const Message& input, SiteState& site, DoorTracker& doors,
                  simulation::Simulation& simulation);

}  // namespace parhelion::tick
