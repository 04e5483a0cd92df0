// The scenario's scripts: what sets them off, and which of them are due.
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

/// Deterministic: a function of the events received, and of the instants and places it is asked about.
class Scripts {
 public:
  /// Where somebody is now, map frame; none: nobody of this name is anywhere. kTrainee is asked for as well.
  using PlaceOf = std::function<std::optional<Eigen::Vector3d>(const std::string& who)>;
  struct Due {
    const Script* script;
    std::string set_off_by;  ///< whose event or nearness it was; empty: time
  };

  Scripts() = default;
  /// Times count from `start`; `trainees`: the names that events have for kTrainee.
  Scripts(std::vector<Script> scripts, std::vector<std::string> trainees, SimulationTime start);

  /// Somebody sets it off, even one that has run and runs once. Error: there is none of this name; the
  /// message says which there are.
  Status set_off(const std::string& name, SimulationTime now);
  /// Every event that is published.
  void handle(const Event& event);
  /// Once a step: what time and nearness (in the plane) set off. Nearness does so when it begins; it has
  /// ended when they are kApart farther.
  void update(SimulationTime now, const PlaceOf& place_of);
  /// Those whose actions are due by `now`, in the order of their instants, then of the scenario. What these
  /// set off is for the next step, and a script that is set off several times for one instant runs once: no
  /// loop of scripts can hold up a step.
  std::vector<Due> take_due(SimulationTime now);

  static constexpr double kApart = 0.2;  // m

 private:
  struct Progress {
    bool spent = false;   // of one that runs once
    bool near = false;    // of one about nearness
    SimulationTime next;  // of one about time
  };
  struct Pending {
    SimulationTime at;
    std::size_t script;
    std::string set_off_by;
  };
  bool is(const std::string& wanted, const std::string& name) const;
  void set_off(std::size_t script, SimulationTime at, const std::string& by);
  void update_near(std::size_t script, SimulationTime now, const PlaceOf& place_of);

  std::vector<Script> scripts_;
  std::vector<std::string> trainees_;
  std::vector<Progress> progress_;  // by script
  std::vector<Pending> pending_;    // ascending instant, then script
};

struct Configuration;

/// Names that no trigger will ever meet. Error: the script, the name, and the nearest that is known.
Status check_scripts(const Configuration& configuration);

}  // namespace parhelion::tick
