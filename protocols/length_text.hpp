// Formats lengths for messages, plans and reports.
#pragma once

#include <string>

namespace parhelion {

/// "12.35 m", to the centimetre; "0.035 m", to the millimetre, below 0.1 m.
std::string length_text(double metres);

}  // namespace parhelion
