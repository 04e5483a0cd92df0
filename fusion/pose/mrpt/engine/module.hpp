// What the module of MRPT's engines offers to the program that loads it.
#pragma once

#include <memory>
#include <string>

#include "fusion/pose/slam.hpp"

namespace parhelion::pose {

/// As make_mrpt_mapper and make_mrpt_localizer in fusion/pose/mrpt/engines.hpp.
struct MrptEngines {
  Result<std::unique_ptr<Slam>> (*mapper)(const RobotDescription& robot, const SlamOptions& options);
  Result<std::unique_ptr<Slam>> (*localizer)(const RobotDescription& robot, const std::string& map_path,
                                             const SlamOptions& options);
};
inline constexpr const char* kMrptEngines = "parhelion_mrpt_engines";

/// In mapping.cpp and localization.cpp.
Result<std::unique_ptr<Slam>> mrpt_mapper(const RobotDescription& robot, const SlamOptions& options);
Result<std::unique_ptr<Slam>> mrpt_localizer(const RobotDescription& robot, const std::string& map_path,
                                             const SlamOptions& options);

}  // namespace parhelion::pose

// NOLINTNEXTLINE(readability-identifier-naming)
extern "C" const parhelion::pose::MrptEngines parhelion_mrpt_engines;
