// Contacts become events: when they start, that they go on, and when they stop.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "protocols/event.hpp"

namespace parhelion::simulation {

/// What touches what in a step.
struct TouchingPair {
  std::string subject;
  std::string object;
  PairKind pair = PairKind::none;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m, map
  double impulse = 0;                                  ///< N s in this step
  bool unsensed = false;
  std::string relation = {};  ///< of the object in the model: "in wall 7"
  bool rests = false;         ///< one thing lies still on another
};

/// Bodies that bump lose touch for some steps: a contact has stopped when nothing was felt for `kPause`.
class ContactTracker {
 public:
  static constexpr double kPause = 0.25;   // s
  static constexpr double kPeriod = 1.00;  // s: how often a contact that goes on is reported

  /// `touching`: what touches in the step at `now`. Appends collision_started (impulse: of the first step),
  /// collision_continued (impulse: the largest of one step since it was reported last; value: s since it
  /// started) while it is felt and does not merely rest, and collision_stopped (impulse: the largest of one
  /// step) to `events`, in the order of names.
  void update(const std::vector<TouchingPair>& touching, SimulationTime now, std::vector<Event>& events);
  /// Ends the contacts of an entity that goes away or is moved.
  void forget(const std::string& entity, SimulationTime now, std::vector<Event>& events);

  /// Whether the contact is open.
  bool touched(const std::string& subject, const std::string& object) const;

 private:
  struct Contact {
    TouchingPair newest;
    double peak = 0;           // N s, since it started...
    double peak_reported = 0;  // ...and since it was reported last
    SimulationTime last, started, reported;
  };
  static Event event_of(EventKind kind, const Contact& contact, SimulationTime now, double impulse);
  static void go_on(Contact& contact, SimulationTime now, std::vector<Event>& events);
  static void stop(const Contact& contact, SimulationTime now, std::vector<Event>& events);
  std::map<std::pair<std::string, std::string>, Contact> open_;
};

}  // namespace parhelion::simulation
