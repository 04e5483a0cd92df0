// MRPT's own SLAM behind pose::Slam: ICP-SLAM (CMetricMapBuilderICP), grid mapping with a Rao-Blackwellized
// particle filter (CMetricMapBuilderRBPF; Grisetti, Stachniss and Burgard 2007, Blanco, Gonzalez and
// Fernandez-Madrigal 2010), and Monte Carlo localization with KLD sampling (CMonteCarloLocalization2D; Fox
// 2003). No MRPT type is named here.
//
// They are a module that is loaded when one is asked for first; it is in ../lib/parhelion beside the program.
// An error says where it was looked for.
//
// Random numbers are from MRPT's generator, which a process has once: it is seeded when an engine is made, so
// that two engines that run at the same time in one process change each other's results.
#pragma once

#include <memory>
#include <string>

#include "fusion/pose/slam.hpp"

namespace parhelion::pose {

/// options.engine: mrpt_icp or mrpt_rbpf. options.engine_config: a file of MRPT's icp-slam or rbpf-slam, with
/// its section [MappingApplication] and, for ICP, [ICP]; empty: defaults of our own. Errors name file,
/// section and key.
Result<std::unique_ptr<Slam>> make_mrpt_mapper(const RobotDescription& robot, const SlamOptions& options);

/// options.engine: mrpt_localization. options.engine_config: a file of MRPT's pf-localization, with its
/// sections [PF_options], [KLD_options], [MetricMap], and particles_count in [LocalizationExperiment].
Result<std::unique_ptr<Slam>> make_mrpt_localizer(const RobotDescription& robot, const std::string& map_path,
                                                  const SlamOptions& options);

}  // namespace parhelion::pose
