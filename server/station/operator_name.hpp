// Pseudonym of a person on the bus, in logs and in events.
#pragma once

#include <string>

#include "server/station/http/identity.hpp"

namespace parhelion::station {

/// Role and number: the same for all pages of an account during one run of the program, different in the next
/// run. Letters, digits and '_', as the bus requires.
std::string operator_name(const Identity& who);

}  // namespace parhelion::station
