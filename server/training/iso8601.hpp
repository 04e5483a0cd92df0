// Instants and durations in ISO 8601.
#pragma once

#include <optional>
#include <string>

#include "protocols/time.hpp"

namespace parhelion::training {

/// UTC, nanoseconds: 2023-11-14T22:13:20.000000001Z.
std::string timestamp_text(SimulationTime stamp);
/// With Z or an offset (+01:00, +0100, +01), any number of decimals (rounded down to ns); years 1970 to 2200.
/// nullopt: invalid, or without a time zone.
std::optional<SimulationTime> timestamp_of(const std::string& text);

/// PT600.1S, to the nanosecond.
std::string duration_text(Duration duration);
/// P1DT2H3M4.5S, weeks too, at most 200 years; no years and months, which have no fixed length. nullopt:
/// invalid.
std::optional<Duration> duration_of(const std::string& text);

}  // namespace parhelion::training
