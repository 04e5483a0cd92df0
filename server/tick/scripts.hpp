// The scenario's scripts: their triggers, and which of them are due.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "protocols/event.hpp"
#include "protocols/script.hpp"
#include "protocols/status.hpp"

namespace parhelion::tick {

/// Deterministic: a function of the received events, and of the instants and positions queried.
class Scripts {
 public:
  /// Current position of a robot or agent, map frame; none: nothing has this name. Queried for kTrainee as
  /// well.
  using PlaceOf = std::function<std::optional<Eigen::Vector3d>(const std::string& who)>;
  struct Due {
    const Script* script;
    std::string triggered_by;  ///< source of the triggering event or approach; empty: time
  };

  Scripts() = default;
  /// Times count from `start`; `trainees`: the names for kTrainee in events.
  Scripts(std::vector<Script> scripts, std::vector<std::string> trainees, SimulationTime start);

  /// Times count from `start` from now on.
  void begin(SimulationTime start);
  /// Triggers a script by command, even one that runs once and has run. Error: no script has this name; the
  /// message lists the known ones.
  Status trigger(const std::string& name, SimulationTime now);
  /// Call with every published event.
  void handle(const Event& event);
  /// Once a step: triggers by time and by proximity (in the plane). Proximity triggers when it begins; it
  /// ends when the distance exceeds the limit by kApart.
  void update(SimulationTime now, const PlaceOf& place_of);
  /// Scripts with actions due by `now`, ordered by instant, then by the scenario. Scripts that these trigger
  /// run at the next step, and a script triggered several times for one instant runs once: no loop of scripts
  /// can block a step.
  std::vector<Due> take_due(SimulationTime now);

  static constexpr double kApart = 0.2;  // m

 private:
  struct Progress {
    bool spent = false;   // of a script that runs once
    bool near = false;    // of a proximity trigger
    SimulationTime next;  // of a time trigger
  };
  struct Pending {
    SimulationTime at;
    std::size_t script;
    std::string triggered_by;
  };
  bool is(const std::string& wanted, const std::string& name) const;
  void trigger(std::size_t script, SimulationTime at, const std::string& by);
  void update_near(std::size_t script, SimulationTime now, const PlaceOf& place_of);

  std::vector<Script> scripts_;
  std::vector<std::string> trainees_;
  std::vector<Progress> progress_;  // by script
  std::vector<Pending> pending_;    // ascending instant, then script
};

struct Configuration;

/// Checks trigger names. Error: the script, the name that can never match, and the nearest known one.
Status check_scripts(const Configuration& configuration);

}  // namespace parhelion::tick
