// The faults that the program injects.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tests/fault/server_under_test.hpp"
#include "tests/fault/stand_in_robot.hpp"

namespace parhelion::test {

struct FaultBed {
  ServerUnderTest& server;
  StandInRobot& robot;
};

struct Fault {
  std::string name;
  /// Injects it; may take time. Undoes what outlives it.
  std::function<void(FaultBed&)> inject;
  bool ends_server = false;   ///< for good: no scan is answered afterwards
  bool is_noise = false;      ///< the server works on: the robot need not stop
  std::string expected = {};  ///< in the server's output; empty: nothing
};

std::vector<Fault> all_faults();
/// Those that set this machine's clock for two seconds, for which the program needs the right.
std::vector<Fault> clock_faults();

}  // namespace parhelion::test
