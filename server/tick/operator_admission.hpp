// Which operators are accepted when many names claim robots: names come from the bus, where a stranger can
// make up any number of them.
#pragma once

#include <cstdint>
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

/// Console heartbeats: a console repeats its operator's name, a flood of made-up names does not.
class SeenNames {
 public:
  /// Time after which a name that is sent again counts as repeated. Half a heartbeat of a console.
  static constexpr Duration kRepeat = milliseconds(200);

  /// A claim by this name. True: the same name has claimed a robot within the last second, and kRepeat ago or
  /// longer. The newest names are stored by their hash, in groups of four, 64 KiB in all. Of a group the
  /// oldest is forgotten: with 4,000 new names a second, fewer than a tenth of the names that are repeated
  /// after 0.4 s.
  bool repeats(std::string_view name, ArrivalTime now);

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
