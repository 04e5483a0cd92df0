// ICP-SLAM and RBPF grid mapping.
#include <mrpt/poses/CPosePDFGaussian.h>
#include <mrpt/slam/CMetricMapBuilderICP.h>
#include <mrpt/slam/CMetricMapBuilderRBPF.h>

#include "fusion/pose/mrpt/conversion.hpp"
#include "fusion/pose/mrpt/engine/configuration.hpp"
#include "fusion/pose/mrpt/engine/engine.hpp"
#include "fusion/pose/mrpt/engine/module.hpp"

namespace parhelion::pose {
namespace {

using mrpt::slam::CMetricMapBuilder, mrpt::slam::CMetricMapBuilderICP, mrpt::slam::CMetricMapBuilderRBPF;

// MRPT's example configurations, but each scan is matched: a pose is wanted for each.
constexpr const char* kIcpDefaults = R"(
[MappingApplication]
localizationLinDistance = 0
localizationAngDistance = 0
insertionLinDistance = 0.3
insertionAngDistance = 15
minICPgoodnessToAccept = 0.4
matchAgainstTheGrid = 0
pointsMap_count = 1
[MappingApplication_pointsMap_00_insertOpts]
minDistBetweenLaserPoints = 0.05
fuseWithExisting = false
isPlanarMap = 1
[ICP]
maxIterations = 80
minAbsStep_trans = 1e-6
minAbsStep_rot = 1e-6
thresholdDist = 0.3
thresholdAng_DEG = 5
ALFA = 0.8
smallestThresholdDist = 0.05
onlyClosestCorrespondences = true
onlyUniqueRobust = true
ICP_algorithm = icpClassic
corresponding_points_decimation = 5
)";

constexpr const char* kRbpfDefaults = R"(
[MappingApplication]
insertionLinDistance = 1.0
insertionAngDistance_deg = 30
localizeLinDistance = 0.1
localizeAngDistance_deg = 5
PF_algorithm = 2
adaptiveSampleSize = 0
resamplingMethod = 0
sampleSize = 10
BETA = 0.5
pointsMap_count = 1
pfAuxFilterOptimal_MaximumSearchSamples = 250
pfOptimalProposal_mapSelection = 3
ICPGlobalAlign_MinQuality = 0.7
KLD_maxSampleSize = 150
KLD_minSampleSize = 15
KLD_binSize_XY = 0.03
KLD_binSize_PHI_deg = 1
KLD_delta = 0.001
KLD_epsilon = 0.5
ICP_algorithm = 1
maxIterations = 60
thresholdDist = 0.4
thresholdAng_DEG = 5
ALFA = 0.8
smallestThresholdDist = 0.05
onlyClosestCorrespondences = 1
[MappingApplication_pointsMap_00_insertOpts]
minDistBetweenLaserPoints = 0.05
fuseWithExisting = 0
isPlanarMap = 1
[MappingApplication_pointsMap_00_likelihoodOpts]
max_corr_distance = 5.0
sigma_dist = 0.05
)";

class MrptMapper final : public MrptEngine {
 public:
  MrptMapper(const RobotDescription& robot, const SlamOptions& options,
             std::unique_ptr<CMetricMapBuilder> builder)
      : MrptEngine(robot), resolution_(options.resolution), builder_(std::move(builder)) {}

  /// The trajectory that its maps have now: a particle filter changes its past.
  std::vector<PoseEstimate> finish() override {
    const std::vector<MappedScan> keyframes = mapped_scans();
    std::vector<PoseEstimate> trajectory = estimates_;
    const std::string id = grid_map().id;
    const std::size_t count = std::min(keyframes.size(), inserted_at_.size());
    std::size_t k = 0;
    for (std::size_t i = 0; i < trajectory.size(); ++i) {
      while (k + 1 < count && inserted_at_[k + 1] <= i) ++k;
      trajectory[i].causal = false;
      trajectory[i].map_id = id;
      if (count == 0) continue;
      const auto by = [&](std::size_t at) {
        const Pose2 T_key_scan = causal(inserted_at_[at]).inverse() * causal(i);
        return keyframes[at].T_map_base * T_key_scan;
      };
      Pose2 pose = by(k);
      if (k + 1 < count && inserted_at_[k] <= i) {
        const double s = static_cast<double>(i - inserted_at_[k]) /
                         static_cast<double>(inserted_at_[k + 1] - inserted_at_[k]);
        pose = interpolate(pose, by(k + 1), s);
      }
      trajectory[i].T_map_base = transform<Map, Base>(pose);
    }
    return trajectory;
  }

  GridMap grid_map() const override { return grid_of(mapped_scans(), resolution_); }
  Status save_simplemap(const std::string& path) const override {
    return write_simplemap(mapped_scans(), path);
  }

 protected:
  PlanarPosterior process(mrpt::obs::CActionCollection& action, mrpt::obs::CSensoryFrame& frame) override {
    builder_->processActionObservation(action, frame);
    return planar_posterior(*builder_->getCurrentPoseEstimation());
  }

  void made(PoseEstimate& estimate) override {
    const std::size_t size = builder_->getCurrentlyBuiltMapSize();
    for (std::size_t k = inserted_at_.size(); k < size; ++k) inserted_at_.push_back(estimates_.size());
    estimates_.push_back(estimate);
  }

 private:
  Pose2 causal(std::size_t i) const { return planar(estimates_[i].T_map_base); }

  std::vector<MappedScan> mapped_scans() const {
    mrpt::maps::CSimpleMap map;
    builder_->getCurrentlyBuiltMap(map);
    return scans_of(map);
  }

  double resolution_;
  std::unique_ptr<CMetricMapBuilder> builder_;
  std::vector<PoseEstimate> estimates_;
  std::vector<std::size_t> inserted_at_;  ///< estimates whose scans are in the map
};

Status check_maps(const mrpt::maps::TSetOfMetricMapInitializers& maps, const std::string& file) {
  if (maps.size() > 0) return {};
  return Error{file + ": [MappingApplication] makes no map: set pointsMap_count or occupancyGrid_count to 1"};
}

Result<std::unique_ptr<CMetricMapBuilder>> icp_builder(const std::string& file) {
  constexpr const char* kSections[] = {"MappingApplication", "ICP"};
  const auto configuration = read_configuration(file, kIcpDefaults, kSections);
  if (!configuration) return configuration.error();
  auto builder = std::make_unique<CMetricMapBuilderICP>();
  silence(*builder);
  const Status loaded = load_options(file, [&] {
    builder->ICP_options.loadFromConfigFile(*configuration, "MappingApplication");
    builder->ICP_params.loadFromConfigFile(*configuration, "ICP");
  });
  if (!loaded) return loaded.error();
  silence(*builder);  // the file may have set it
  if (const Status some = check_maps(builder->ICP_options.mapInitializers, file); !some) return some.error();
  return std::unique_ptr<CMetricMapBuilder>(std::move(builder));
}

Result<std::unique_ptr<CMetricMapBuilder>> rbpf_builder(const std::string& file) {
  constexpr const char* kSections[] = {"MappingApplication"};
  const auto configuration = read_configuration(file, kRbpfDefaults, kSections);
  if (!configuration) return configuration.error();
  std::unique_ptr<CMetricMapBuilderRBPF> builder;
  CMetricMapBuilderRBPF::TConstructionOptions options;
  const Status loaded = load_options(file, [&] {
    options.loadFromConfigFile(*configuration, "MappingApplication");
    options.verbosity_level = mrpt::system::LVL_ERROR;
    builder = std::make_unique<CMetricMapBuilderRBPF>(options);
  });
  if (!loaded) return loaded.error();
  if (const Status some = check_maps(options.mapsInitializers, file); !some) return some.error();
  silence(*builder);
  silence(builder->mapPDF);
  return std::unique_ptr<CMetricMapBuilder>(std::move(builder));
}

}  // namespace

Result<std::unique_ptr<Slam>> mrpt_mapper(const RobotDescription& robot, const SlamOptions& options) {
  seed_mrpt(options.seed);
  auto builder = options.engine == SlamEngine::mrpt_rbpf ? rbpf_builder(options.engine_config)
                                                         : icp_builder(options.engine_config);
  if (!builder) return builder.error();
  const Eigen::Vector3d at = options.start.value_or(Eigen::Vector3d::Zero());
  const Status started = load_options(options.engine_config, [&] {
    const mrpt::poses::CPosePDFGaussian start({at.x(), at.y(), at.z()});
    (*builder)->initialize({}, &start);
  });
  if (!started) return started.error();
  return std::unique_ptr<Slam>(std::make_unique<MrptMapper>(robot, options, std::move(*builder)));
}

}  // namespace parhelion::pose
