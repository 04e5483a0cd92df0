// Which operators are accepted when many names claim robots: names come from the bus, where a stranger can
// make up any number of them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/time.hpp"

namespace parhelion::tick {

/// Changes of the robots that operators drive, within a second. Each is an event.
class SwitchBudget {
 public:
  static constexpr int kMaxPerSecond = 20;
  /// False: the budget of this second is used up.
  bool spend(SimulationTime now);

 private:
  SimulationTime since_;
  int count_ = 0;
};

/// Names that are repeated: a console repeats its operator's, a flood of made-up names does not.
class SeenNames {
 public:
  /// Time after which a name that is sent again counts as repeated. Half a heartbeat of a console.
  static constexpr Duration kRepeat = milliseconds(200);

  /// Notes a claim by this name. Returns when the name first claimed a robot if that was at least kRepeat
  /// ago, and less than a second; else none. The newest names are stored by their hash, in groups of four,
  /// 64 KiB in all, and a new name replaces the oldest of its group: with 4,000 new names a second, fewer
  /// than a tenth of the names that are claimed again after 0.4 s are forgotten by then.
  std::optional<ArrivalTime> repeated_since(std::string_view name, ArrivalTime now);

 private:
  struct Place {
    std::uint64_t hash = 0;
    ArrivalTime first;
  };
  std::vector<Place> places_;  // empty until the first claim
};

/// State that decides who is accepted.
struct OperatorAdmission {
  SwitchBudget first_claims;  ///< of any name
  SwitchBudget repeated;  ///< only of names that are repeated, so that a flood of new ones does not use it up
  SeenNames seen;
};

}  // namespace parhelion::tick
