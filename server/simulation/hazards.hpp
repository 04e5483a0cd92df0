// Hazards of the scenario: devices that are set off at a step, and what a sensor reads of sources.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "protocols/event.hpp"
#include "protocols/hazard.hpp"
#include "server/simulation/hazard_fields.hpp"
#include "server/simulation/surroundings.hpp"

namespace parhelion::simulation {

class Hazards {
 public:
  /// The fields of gas that stand still are made now: a wide one takes milliseconds.
  Hazards(const std::vector<Hazard>& hazards, const Building& building);

  /// After a step: appends an event for each device that is set off by it.
  void update(const Surroundings& around, std::vector<Event>& events);
  /// As Simulation::hazard_reading().
  bool read(const Surroundings& around, HazardReading& reading);
  /// There is another building: fields of gas are made anew when they are read.
  void forget_fields();

 private:
  /// A hazard and what is kept of it between steps.
  struct Entry {
    Hazard hazard;
    bool set_off = false;
    std::optional<std::uint32_t> epoch = {};  ///< of its agent at the step before
    /// m/s, of its agent at the two steps before, the older one first.
    std::array<Eigen::Vector3d, 2> velocity = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
    GasField gas = {};
  };
  /// What set a device off.
  struct Trigger {
    const char* by = nullptr;  ///< nullptr: nothing did
    double value = 0;
    std::string who = {};
    PairKind pair = PairKind::none;
    bool unsensed = false;
  };
  static Trigger felt(Entry& entry, const Agent& agent);
  static Trigger approached(const Entry& entry, const Agent* own, const Eigen::Vector3d& place,
                            const Surroundings& around);
  bool has(HazardKind kind) const;
  double read_sources(HazardKind kind, const Eigen::Vector3d& p, const Surroundings& around);

  std::vector<Entry> entries_;
};

}  // namespace parhelion::simulation
