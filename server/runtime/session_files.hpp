// The files that a session starts from. What serve, replay and validate say of them is one and the same.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "server/tick/configuration.hpp"

namespace parhelion::runtime {

struct SessionFiles {
  Scenario scenario;
  SemanticModel model;                    ///< empty where the scenario names none
  std::optional<RobotDescription> robot;  ///< none: the ROBOT channel says it
  tick::RobotModels robot_models;         ///< all shipped ones, and those that the scenario names
};

/// Reads the scenario at `path`, the model that it names, and the robot description at `robot` or, where that
/// is empty, the one that the scenario names; at levels 1 and 2 that of the trainee's robot model. Where the
/// scenario names a robot model by its file, the model's own name takes its place. Errors name file and line;
/// also for what is well written but cannot be run. `seed`: in place of the scenario's.
Result<SessionFiles> load_session_files(const std::string& path, const std::string& robot,
                                        std::optional<std::uint64_t> seed = std::nullopt);

/// A robot description that a session can use.
Result<RobotDescription> load_usable_robot(const std::string& path);

/// Whether the session could begin, and its tasks be passed: builds its world, puts the agents of the
/// scenario at `path` into it, and looks for a way to the zones of the tasks.
Status check_start(const tick::Configuration& configuration, const std::string& path);

}  // namespace parhelion::runtime
