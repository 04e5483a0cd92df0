// What a person is called where nothing personal goes: on the bus, in logs, in events.
#pragma once

#include <string>

#include "server/station/http/identity.hpp"

namespace parhelion::station {

/// The role and a number: the same for each page of an account for as long as the program runs, another the
/// next time. Letters, digits and '_', as the bus has it.
std::string operator_name(const Identity& who);

}  // namespace parhelion::station
