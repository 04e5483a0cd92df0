// Shapes of the bodies named by MR_WORLD: for drawing a session without simulating it.
#pragma once

#include <deque>
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
#include "protocols/model_objects.hpp"
#include "protocols/robot.hpp"
#include "protocols/scenario.hpp"
#include "protocols/scene.hpp"
#include "server/simulation/robots/robot_model.hpp"

namespace parhelion::simulation {

/// Starts with the scenario's agents; a spawn counts from its agent_spawned on, because a command may be
/// refused. Of removed agents that are not the scenario's the newest kMaxRemoved are kept, for what is drawn
/// from memory.
class EntityShapes {
 public:
  static constexpr std::size_t kMaxRemoved = 1000;
  using Parts = std::map<std::string, std::vector<Shape>, std::less<>>;

  EntityShapes(const Scenario& scenario, const RobotDescription& robot, const SemanticModel& model,
               std::vector<std::shared_ptr<const RobotModel>> robot_models);

  /// Another real robot.
  void add(const RobotDescription& robot);
  /// Movable objects of the site.
  void add(const std::vector<ModelObject>& objects);

  void take(const AgentSpawn& command);
  void take(const Event& event);
  /// A new version of the building, for its doors.
  void take(const SemanticModel& model);

  /// In the body's frame. Null: unknown shape (its spawn was not recorded).
  const std::vector<Shape>* find(std::string_view entity, std::string_view part) const;
  /// Definition of an agent or of the trainee's simulated robot. Null: unknown.
  const AgentDefinition* definition(std::string_view entity) const;
  /// Mount of the agent's laser (MR_AGENT_<name>_SCAN); none: no laser.
  std::optional<Transform<Base, Laser>> laser_mount(std::string_view entity) const;

 private:
  void stand(const AgentDefinition& agent);
  void note_removal(const std::string& agent);
  const RobotModel* model_of(const std::string& name) const;

  Scenario scenario_;
  std::vector<std::shared_ptr<const RobotModel>> robot_models_;
  std::map<std::string, Parts, std::less<>> shapes_, doors_;
  std::map<std::string, AgentDefinition, std::less<>> definitions_;
  std::map<std::uint64_t, AgentDefinition> asked_;  ///< requested spawns by request number, not confirmed yet
  std::deque<std::string> removed_;                 ///< the newest last; none of them was spawned again
};

}  // namespace parhelion::simulation
