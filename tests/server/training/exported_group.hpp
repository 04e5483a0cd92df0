// Three trainees as exported: with a name, with only a mail's hash, without a session.
#pragma once

#include <string>
#include <vector>

#include "server/training/exchange.hpp"
#include "tests/server/training/recorded_session.hpp"

namespace parhelion::test {

inline const std::string kMbox(40, 'c');

inline std::vector<training::TraineeHistory> group() {
  return {{{"t-0123456789ab", "Anna \"Nan\" Schmidt, B", ""}, {recorded_session(1), recorded_session(2)}},
          {{"t-ba9876543210", "", kMbox}, {recorded_session(3)}},
          {{"t-000000000000", "Nobody yet", ""}, {}}};
}

}  // namespace parhelion::test
