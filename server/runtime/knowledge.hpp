// What the robots of trainees have sensed: a function of the session's messages, so that the station, the
// review and a replay agree on what a trainee could know.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "protocols/event.hpp"
#include "protocols/telemetry.hpp"
#include "server/runtime/sight.hpp"
#include "server/tick/configuration.hpp"

namespace parhelion::runtime {

enum class SensedBy : std::uint8_t { laser, camera, touch };
const char* to_string(SensedBy by);

/// An agent or a door, as it was when the robot sensed it last.
struct Sensed {
  SimulationTime first, last;
  SensedBy by = SensedBy::laser;            ///< the last time
  std::vector<WorldMessage::Entry> bodies;  ///< by then; velocities are those of that instant
};

/// A robot that a trainee drives: one of the session's, or an agent that is driven by commands.
bool is_driven_by_trainees(const tick::Configuration& configuration, const AgentDefinition& agent);

/// What a trainee reads before the start.
std::string trainee_briefing(const tick::Configuration& configuration);

/// Call in the order of the session. Not thread-safe.
class Knowledge {
 public:
  using ByEntity = std::map<std::string, Sensed, std::less<>>;

  /// The references must outlive this. `shapes`: kept up to date by the caller.
  Knowledge(const tick::Configuration& configuration, const simulation::EntityShapes& shapes);

  /// Another session begins.
  void restart();
  void set_building(const SemanticModel& model) { visibility_.set_building(model); }

  /// MR_SCAN_INFO of a robot of the session: the agents that its beams met.
  void handle_scan(const ScanInfo& info, std::size_t robot, const WorldMessage& world);
  /// MR_CAMERA of a robot of the session, with virtual things in it.
  void handle_picture(std::size_t robot, const WorldMessage& world);
  /// A scan or a picture of an agent that a trainee drives.
  void handle_scan_of(const AgentDefinition& agent, const WorldMessage& world);
  void handle_picture_of(const AgentDefinition& agent, const WorldMessage& world);
  /// A contact is felt; a report gives an object its name.
  void take(const Event& event, const WorldMessage& world);

  /// Names of the agents of the session, of those that its scripts may add, and of the last 4096 that were
  /// removed. What robots sensed of an agent is kept for as long as its name.
  const std::set<std::string, std::less<>>& agents() const { return agents_; }
  /// Whether an agent had this name and was removed before those. Of a filter with bounded memory (Bloom,
  /// "Space/time trade-offs in hash coding with allowable errors", CACM 13, 1970): true for each such name,
  /// and after 100,000 of them for one in 200,000 other names.
  bool has_forgotten(std::string_view name) const;
  /// What trainees are told before the start: the briefing, without values that were drawn, which may be
  /// places.
  const std::string& briefing() const { return briefing_; }
  /// By entity; empty for a robot that has sensed nothing.
  const ByEntity& sensed_by(const std::string& robot) const;
  /// True for a robot of the session, and for an agent that trainees drive.
  bool is_trainees(const std::string& robot) const;
  /// True if a trainee of this robot has reported the entity.
  bool reported(const std::string& robot, const std::string& entity) const;
  /// Counts from 1, in the order in which the session's robots sensed them; 0: none has.
  std::size_t number_of(const std::string& entity) const;

 private:
  void note(const std::string& robot, const std::string& entity, SensedBy by, const WorldMessage& world);
  void look_for_doors(const std::string& robot, const std::optional<LaserDescription>& laser,
                      const WorldMessage& world);
  void look(const std::string& robot, const RobotDescription& description, const WorldMessage& world);
  const RobotDescription* model_of(const AgentDefinition& agent) const;
  void note_removal(const std::string& agent);
  void forget(const std::string& agent);

  const tick::Configuration& configuration_;
  const simulation::EntityShapes& shapes_;
  const std::string briefing_;
  Sight visibility_;
  const std::set<std::string, std::less<>> agents_of_scenario_;
  std::set<std::string, std::less<>> agents_;
  std::map<std::string, ByEntity, std::less<>> sensed_;                              // by robot
  std::map<std::string, std::set<std::string, std::less<>>, std::less<>> reported_;  // by robot
  std::map<std::string, std::size_t, std::less<>> numbers_;                          // by entity
  std::size_t last_number_ = 0;
  std::deque<std::pair<std::string, std::uint64_t>> removals_;  // with their numbers, oldest first
  std::map<std::string, std::uint64_t, std::less<>> removed_;   // by agent: its last removal
  std::uint64_t last_removal_ = 0;
  std::vector<bool> forgotten_;  // Bloom filter of names; empty until the first
};

}  // namespace parhelion::runtime
