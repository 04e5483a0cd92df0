// Loads the files of a session, with the same checks and messages for serve, replay and validate.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "protocols/site_texture.hpp"
#include "server/tick/configuration.hpp"

namespace parhelion::runtime {

struct SessionFiles {
  Scenario scenario;
  SemanticModel model;                         ///< empty if the scenario names none
  std::vector<ModelObject> objects;            ///< levels 1 and 2: free bodies, no longer in `model`
  std::shared_ptr<const SiteTexture> texture;  ///< beside the model; null: there is none
  std::optional<RobotDescription> robot;       ///< the first; none: to come from the ROBOT channel
  /// All robots in the scenario's order, at least one; none: to come from its ROBOT channel.
  std::vector<std::optional<RobotDescription>> robots;
  std::shared_ptr<const pose::MatchingMap> map;  ///< null: scans are not matched
  tick::RobotModels robot_models;                ///< all shipped ones, and those named by the scenario
};

/// Reads the scenario at `path`, its model, and the robot description at `robot` or, if empty, the
/// scenario's; at levels 1 and 2 that of the trainee's robot model. A robot model given by file is replaced
/// by its own name in the scenario. Errors name file and line, also for valid files that cannot be run.
/// `seed`: replaces the scenario's.
Result<SessionFiles> load_session_files(const std::string& path, const std::string& robot,
                                        std::optional<std::uint64_t> seed = std::nullopt);

enum class DescribedBy { file, bus };
/// Loads the robot models of descriptions that were not loaded with the scenario at that path, and replaces a
/// file by the model's name. A description from the bus cannot name a file outside the scenario's folder.
Status add_models_of(std::vector<RobotDescription>& robots, const std::string& scenario, DescribedBy by,
                     tick::RobotModels& models);

/// Loads a robot description that a session can use.
Result<RobotDescription> load_usable_robot(const std::string& path);

/// Checks that the session can start and its tasks can be completed: builds its world, spawns the agents of
/// the scenario at `path`, and searches a route to the zones of the tasks.
Status check_start(const tick::Configuration& configuration, const std::string& path);

/// What a session with a real robot cannot do because its scenario has no model; nullopt: it has one or makes
/// one (`mapping`), or no robot is real.
std::optional<std::string> note_without_model(const tick::Configuration& configuration);

}  // namespace parhelion::runtime
