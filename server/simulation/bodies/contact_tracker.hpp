// Converts contacts to events: start, continuation and end.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "protocols/event.hpp"

namespace parhelion::simulation {

/// Two bodies in contact in a step.
struct TouchingPair {
  std::string subject;
  std::string object;
  PairKind pair = PairKind::none;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m, map
  double impulse = 0;                                  ///< N s in this step
  bool undetectable = false;
  std::string relation = {};  ///< of the object in the model: "in wall 7"
  bool rests = false;         ///< one body rests on the other without motion
};

/// Bouncing bodies lose contact for some steps: a contact has stopped after `kPause` without one.
class ContactTracker {
 public:
  static constexpr double kPause = 0.25;   // s
  static constexpr double kPeriod = 1.00;  // s: report interval of a continuing contact

  /// `touching`: the contacts in the step at `now`. Appends to `events`, in the order of names:
  /// contact_started (impulse: of the first step), contact_continues while the contact exists and is not
  /// mere resting (impulse: the largest of one step since the last report; value: s since the start), and
  /// contact_ended (impulse: the largest of one step).
  void update(const std::vector<TouchingPair>& touching, SimulationTime now, std::vector<Event>& events);
  /// Ends the contacts of an entity that is removed or moved.
  void forget(const std::string& entity, SimulationTime now, std::vector<Event>& events);

  /// Whether the contact is active.
  bool touched(const std::string& subject, const std::string& object) const;

 private:
  struct Contact {
    TouchingPair newest;
    double peak = 0;               // N s, since its start...
    double peak_since_report = 0;  // ...and since the last report
    SimulationTime last, started, reported;
  };
  static Event event_of(EventKind kind, const Contact& contact, SimulationTime now, double impulse);
  static void report_continuing(Contact& contact, SimulationTime now, std::vector<Event>& events);
  static void report_end(const Contact& contact, SimulationTime now, std::vector<Event>& events);
  std::map<std::pair<std::string, std::string>, Contact> open_;
};

}  // namespace parhelion::simulation
