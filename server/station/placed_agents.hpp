// What is known of the agents that MR_WORLD only names: how they were defined, and what they were told since.
#pragma once

#include <map>
#include <string>

#include "protocols/event.hpp"
#include "protocols/instructor_command.hpp"
#include "protocols/scenario.hpp"

namespace parhelion::station {

class PlacedAgents {
 public:
  explicit PlacedAgents(const Scenario& scenario);

  /// Whoever sent it; it counts once an event says that it was done.
  void take(const InstructorCommand& command);
  void take(const Event& event);
  /// The session begins anew.
  void restart();

  /// nullptr: nothing but its name is known. Valid until the next take().
  const AgentDefinition* find(const std::string& agent) const;
  const std::map<std::string, AgentDefinition>& all() const { return agents_; }
  bool frozen() const { return frozen_; }  ///< all agents stand still by the instructor's word

 private:
  void done(const InstructorCommand& command);

  const Scenario& scenario_;
  std::map<std::string, AgentDefinition> agents_;
  std::map<std::string, AgentDefinition> scripted_;   ///< what scripts may spawn
  std::map<std::uint64_t, InstructorCommand> asked_;  ///< by request; what was not answered yet
  bool frozen_ = false;
};

}  // namespace parhelion::station
