// A new version of the semantic model on its way into the running server.
#pragma once

#include <cstdint>
#include <memory>

#include "fusion/scan/building_tree.hpp"
#include "protocols/model.hpp"
#include "protocols/status.hpp"
#include "protocols/telemetry.hpp"
#include "server/tick/configuration.hpp"

namespace parhelion::simulation {
class Building;
}
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

}  // namespace parhelion::tick
