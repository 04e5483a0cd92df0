// The other real robots in a robot's scan: never injected, and the reason for returns.
#pragma once

#include "protocols/world.hpp"
#include "server/tick/scan_path.hpp"

namespace parhelion::tick {

/// A body of a real robot other than `own`.
inline bool is_other_robot(const BodyDefinition& body, const std::string& own) {
  return body.owner == BodyOwner::real_robot && body.entity != own;
}

/// Explains returns from where another robot may be: from within its outline, widened by kWiden and kSigmas
/// of both robots' positions. Their building hits become the returns themselves. Call after the building was
/// cast.
void explain_by_other_robots(const TickContext& context, const scan::LaserMotion& laser,
                             const ScanPath& path);

inline constexpr double kWiden = 0.15;  // m: arms, cables and masts reach beyond an outline
inline constexpr double kSigmas = 3;

}  // namespace parhelion::tick
