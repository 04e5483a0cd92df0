// What a trainee may be told of a session: the one place that decides it, for the station and the review.
//
// His robot and the other trainees' robots, real people, what the scenario shows on purpose, the zones that
// the briefing names, and what his robot has sensed, at the place where it was sensed last. Things have names
// of their own only where the briefing names them, and what he is to find once he has reported it; else a
// number: "object 3".
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "server/runtime/knowledge.hpp"

namespace parhelion::runtime {

/// What was sensed within it counts as being sensed: some lasers need that long for a scan.
inline constexpr Duration kSensedNow = milliseconds(500);

/// A world as a trainee knows it.
struct KnownWorld {
  struct Thing {
    SimulationTime sensed;  ///< the last time
    SensedBy by = SensedBy::laser;
    bool now = false;  ///< that is so short ago that it counts as being sensed
  };
  WorldMessage message;
  std::map<std::string, Thing, std::less<>> things;  ///< by his name; what the scenario shows is none of them
};

/// Of the trainees that drive one set of robots. Holds references; make one when it is needed.
class TraineeView {
 public:
  /// `robots`: those that he drives or follows.
  TraineeView(const tick::Configuration& configuration, const Knowledge& knowledge,
              std::vector<std::string> robots);

  const std::vector<std::string>& robots() const { return robots_; }
  /// Its bodies are named as he knows them. Those that no robot of his senses at present stand where they
  /// were sensed last.
  KnownWorld world(const WorldMessage& world) const;
  /// The last time that one of his robots sensed the entity; nullptr: none has.
  const Sensed* sensed(const std::string& entity) const;
  /// The event as he may read it; none: it is not for him.
  std::optional<Event> event(const Event& event) const;
  /// The name by which he knows an agent, a robot, a door or a part of the building; empty: he does not know
  /// the agent.
  std::string name_of(const std::string& entity) const;
  /// The entity that he calls so; other names are returned unchanged.
  std::string entity_of(const std::string& name) const;
  /// The text with names of agents as he knows them.
  std::string text(const std::string& text) const;
  std::vector<Zone> zones() const;
  /// True for a robot that he may drive, watch and follow.
  bool may_follow(const std::string& robot) const;

 private:
  bool is_own(const std::string& robot) const;
  bool is_shown(const std::string& name) const;
  bool knows_zone(const std::string& zone) const;
  bool is_in_briefing(const std::string& name) const;
  bool is_for_him(const Event& event) const;
  bool is_known(const std::string& name) const;
  bool is_agent(const std::string& name) const;
  /// Names of agents of which nothing is known any more.
  void replace_forgotten(std::string& text) const;
  void add(const std::string& entity, const WorldMessage& world, KnownWorld& known) const;

  const tick::Configuration& configuration_;
  const Knowledge& knowledge_;
  const std::vector<std::string> robots_;
};

}  // namespace parhelion::runtime
