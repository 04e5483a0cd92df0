// What the bodies that MR_WORLD names look like: for those who draw a session and do not simulate it.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/event.hpp"
#include "protocols/instructor_command.hpp"
#include "protocols/model.hpp"
#include "protocols/robot.hpp"
#include "protocols/scenario.hpp"
#include "protocols/scene.hpp"
#include "server/simulation/robot_model.hpp"

namespace parhelion::simulation {

/// Begins with what the scenario puts there; a spawn counts from its agent_spawned on, since a command may be
/// refused.
class EntityShapes {
 public:
  using Parts = std::map<std::string, std::vector<Shape>, std::less<>>;

  EntityShapes(const Scenario& scenario, const RobotDescription& robot, const SemanticModel& model,
               std::vector<std::shared_ptr<const RobotModel>> robot_models);

  void take(const AgentSpawn& command);
  void take(const Event& event);
  /// A new version of the building: its doors.
  void take(const SemanticModel& model);

  /// In the frame of the body. Null: its shape is not known (its spawn was not recorded).
  const std::vector<Shape>* find(std::string_view entity, std::string_view part) const;
  /// Of an agent or the trainee's simulated robot, as it was defined. Null: not known.
  const AgentDefinition* definition(std::string_view entity) const;
  /// Where an agent carries the laser of its MR_AGENT_<name>_SCAN; none: it carries none.
  std::optional<Transform<Base, Laser>> laser_mount(std::string_view entity) const;

 private:
  void stand(const AgentDefinition& agent);
  const RobotModel* model_of(const std::string& name) const;

  Scenario scenario_;
  std::vector<std::shared_ptr<const RobotModel>> robot_models_;
  std::map<std::string, Parts, std::less<>> shapes_, doors_;
  std::map<std::string, AgentDefinition, std::less<>> definitions_;
  std::map<std::uint64_t, AgentDefinition> asked_;  ///< spawns by request, not answered yet
};

}  // namespace parhelion::simulation
