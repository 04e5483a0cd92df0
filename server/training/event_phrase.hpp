// An event in the words of a briefing.
#pragma once

#include <string>

#include "protocols/event.hpp"

namespace parhelion::training {

/// What it is to cause an event, for a trainee: "touching door 1", "tipping over"; of kinds without words of
/// their own the name, as "speed limited with door 1". `object` empty: any. Names no thing but `object`,
/// since a trainee knows what the briefing names.
std::string event_phrase(EventKind kind, const std::string& object);

}  // namespace parhelion::training
