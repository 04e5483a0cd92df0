// Hazards of the scenario: devices triggered at a step, and readings of sources.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "protocols/event.hpp"
#include "protocols/hazard.hpp"
#include "server/simulation/building/hazard_fields.hpp"
#include "server/simulation/world/surroundings.hpp"

namespace parhelion::simulation {

class Hazards {
 public:
  /// Computes the fields of stationary gas leaks now: a wide one takes milliseconds.
  Hazards(const std::vector<Hazard>& hazards, const Building& building);

  /// After a step: appends an event for each triggered device.
  void update(const Surroundings& around, std::vector<Event>& events);
  /// See Simulation::hazard_reading().
  bool read(const Surroundings& around, std::size_t robot, HazardReading& reading);
  /// After a change of the building: gas fields are recomputed when read.
  void forget_fields();

 private:
  /// A hazard and its state between steps.
  struct Entry {
    Hazard hazard;
    bool triggered = false;
    std::optional<std::uint32_t> epoch = {};  ///< of its agent at the previous step
    /// m/s, of its agent at the two steps before, the older one first.
    std::array<Eigen::Vector3d, 2> velocity = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
    GasField gas = {};
  };
  /// The trigger of a device.
  struct Trigger {
    const char* by = nullptr;  ///< cause; nullptr: not triggered
    double value = 0;
    std::string who = {};
    PairKind pair = PairKind::none;
    bool undetectable = false;
  };
  static Trigger felt(Entry& entry, const Agent& agent);
  static Trigger approached(const Entry& entry, const Agent* own, const Eigen::Vector3d& place,
                            const Surroundings& around);
  bool has(HazardKind kind) const;
  double read_sources(HazardKind kind, const Eigen::Vector3d& p, const Surroundings& around);

  std::vector<Entry> entries_;
};

}  // namespace parhelion::simulation
