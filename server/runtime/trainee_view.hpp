// Decides what a trainee may know of a session, for the station and the review.
//
// These are: the trainees' robots, real people, what the scenario shows on purpose, the zones that the
// briefing names, and what the trainee's robot has sensed, at the place where it was sensed last. A thing has
// its own name if the briefing gives it, or once the trainee has reported it; otherwise a number: "object 3".
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
  std::map<std::string, Thing, std::less<>>
      things;  ///< by the trainee's name for it; without what the scenario shows
};

/// Of the trainees that drive one set of robots. Holds references; make one when it is needed.
class TraineeView {
 public:
  /// `robots`: those that the trainee drives or follows.
  TraineeView(const tick::Configuration& configuration, const Knowledge& knowledge,
              std::vector<std::string> robots);

  const std::vector<std::string>& robots() const { return robots_; }
  /// Bodies have the names that the trainee knows. A body that none of the trainee's robots senses at present
  /// stands where it was sensed last.
  KnownWorld world(const WorldMessage& world) const;
  /// The last time that one of the trainee's robots sensed the entity; nullptr: none has.
  const Sensed* sensed(const std::string& entity) const;
  /// The event as the trainee may read it; none: it is not for trainees.
  std::optional<Event> event(const Event& event) const;
  /// The trainee's name for an agent, a robot, a door or a part of the building; empty: an agent that the
  /// trainee does not know.
  std::string name_of(const std::string& entity) const;
  /// The entity that has this name for the trainee; other names are returned unchanged.
  std::string entity_of(const std::string& name) const;
  /// The text with the trainee's names for agents.
  std::string text(const std::string& text) const;
  std::vector<Zone> zones() const;
  /// True for a robot that the trainee may drive, watch and follow.
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
