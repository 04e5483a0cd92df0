// Definitions and commands of the agents that MR_WORLD contains by name only.
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

  /// A command from any sender; takes effect when an event confirms it.
  void take(const InstructorCommand& command);
  void take(const Event& event);
  /// For a new session.
  void restart();

  /// nullptr: only its name is known. Valid until the next take().
  const AgentDefinition* find(const std::string& agent) const;
  const std::map<std::string, AgentDefinition>& all() const { return agents_; }
  bool frozen() const { return frozen_; }  ///< the instructor has frozen all agents

 private:
  void done(const InstructorCommand& command);

  const Scenario& scenario_;
  std::map<std::string, AgentDefinition> agents_;
  std::map<std::string, AgentDefinition> scripted_;   ///< agents that scripts may spawn
  std::map<std::uint64_t, InstructorCommand> asked_;  ///< by request; commands without a reply so far
  bool frozen_ = false;
};

}  // namespace parhelion::station
