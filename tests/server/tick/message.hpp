// Messages for a tick.
#pragma once

#include <cstdint>
#include <string>

#include "protocols/bus/bus.hpp"
#include "protocols/codec.hpp"

namespace parhelion::test {

inline Message message(const std::string& channel, std::int64_t arrival_us, const auto& item) {
  Message made{channel, ArrivalTime::from_utime(arrival_us), {}};
  encode(item, made.payload);
  return made;
}

}  // namespace parhelion::test
