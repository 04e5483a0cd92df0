// Initial guesses of scan poses from the user.
#pragma once

#include <string>
#include <vector>

#include "fusion/cloud/registration.hpp"
#include "protocols/status.hpp"

namespace parhelion::tools {

/// `text` is "X,Y,Z,YAW" (m, degrees) for the second of two scans, or a file with a line for each scan: four
/// such numbers, or the 16 of a 4x4 matrix by rows; '#' starts a comment. Empty: no effect. Guesses are
/// relative to the first scan: the pose on the first line is removed from the others.
Status apply_guess(const std::string& text, std::vector<cloud::ScanToRegister>& scans);

}  // namespace parhelion::tools
