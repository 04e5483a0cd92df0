#include "fusion/pose/slam.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "fusion/pose/mrpt/engines.hpp"
#include "fusion/pose/own_slam.hpp"
#include "fusion/pose/slam_by_scans.hpp"

namespace parhelion::pose {
namespace {

constexpr std::array<std::pair<SlamEngine, const char*>, 4> kEngines{
    {{SlamEngine::parhelion, "parhelion"},
     {SlamEngine::mrpt_icp, "mrpt-icp"},
     {SlamEngine::mrpt_rbpf, "mrpt-rbpf"},
     {SlamEngine::mrpt_localization, "mrpt-localization"}}};

Status check(const RobotDescription& robot, const SlamOptions& options) {
  if (!robot.laser)
    return Error{"robot '" + robot.name + "' has no laser; give a description with --robot FILE"};
  if (!(options.resolution > 0 && options.resolution <= 1))
    return Error{"resolution must be above 0 and at most 1 m"};
  if (options.start && !options.start->allFinite())
    return Error{"start must be finite: x, y in m, yaw in rad"};
  if (options.engine == SlamEngine::parhelion && !options.engine_config.empty())
    return Error{options.engine_config + ": is for an engine of MRPT; choose one with --engine"};
  return {};
}

Result<std::unique_ptr<Slam>> with_odometry(const RobotDescription& robot, const SlamOptions& options,
                                            Result<std::unique_ptr<Slam>> engine) {
  if (!engine || options.has_odometry) return engine;
  return with_odometry_by_scans(robot, std::move(*engine));
}

}  // namespace

const char* to_string(SlamEngine engine) {
  return std::find_if(kEngines.begin(), kEngines.end(), [engine](const auto& e) { return e.first == engine; })
      ->second;
}

std::vector<std::string> slam_engines() {
  std::vector<std::string> names;
  for (const auto& engine : kEngines) names.emplace_back(engine.second);
  return names;
}

std::optional<SlamEngine> slam_engine(const std::string& name) {
  for (const auto& engine : kEngines) {
    if (name == engine.second) return engine.first;
  }
  return std::nullopt;
}

Result<std::unique_ptr<Slam>> make_mapper(const RobotDescription& robot, const SlamOptions& options) {
  if (const Status checked = check(robot, options); !checked) return checked.error();
  if (options.engine == SlamEngine::parhelion) return make_own_mapper(robot, options);
  if (options.engine == SlamEngine::mrpt_localization)
    return Error{"mrpt-localization localizes in a map that exists; name it with --map"};
  return with_odometry(robot, options, make_mrpt_mapper(robot, options));
}

Result<std::unique_ptr<Slam>> make_localizer(const RobotDescription& robot, const std::string& map_path,
                                             const SlamOptions& options) {
  if (const Status checked = check(robot, options); !checked) return checked.error();
  if (options.engine == SlamEngine::parhelion)
    return with_odometry(robot, options, make_own_localizer(robot, map_path, options));
  if (options.engine != SlamEngine::mrpt_localization)
    return Error{std::string(to_string(options.engine)) +
                 " builds a map; omit --map, or choose mrpt-localization"};
  return with_odometry(robot, options, make_mrpt_localizer(robot, map_path, options));
}

}  // namespace parhelion::pose
