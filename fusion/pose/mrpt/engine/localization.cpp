// Monte Carlo localization.
#include <mrpt/bayes/CParticleFilter.h>
#include <mrpt/maps/CMultiMetricMap.h>
#include <mrpt/maps/COccupancyGridMap2D.h>
#include <mrpt/slam/CMonteCarloLocalization2D.h>

#include "fusion/pose/maps/frozen_map.hpp"
#include "fusion/pose/mrpt/engine/configuration.hpp"
#include "fusion/pose/mrpt/engine/engine.hpp"
#include "fusion/pose/mrpt/engine/module.hpp"

namespace parhelion::pose {
namespace {

constexpr const char* kDefaults = R"(
[PF_options]
PF_algorithm = 0
resamplingMethod = 0
adaptiveSampleSize = 1
BETA = 0.5
sampleSize = 1
[KLD_options]
KLD_binSize_PHI_deg = 5
KLD_binSize_XY = 0.1
KLD_delta = 0.01
KLD_epsilon = 0.02
KLD_maxSampleSize = 40000
KLD_minSampleSize = 250
KLD_minSamplesPerBin = 0
[LocalizationExperiment]
particles_count = 20000
[MetricMap]
occupancyGrid_count = 1
[MetricMap_occupancyGrid_00_creationOpts]
resolution = 0.05
[MetricMap_occupancyGrid_00_likelihoodOpts]
likelihoodMethod = 4
LF_decimation = 5
LF_stdHit = 0.1
LF_maxCorrsDistance = 0.3
LF_zHit = 0.95
LF_zRandom = 0.05
LF_maxRange = 80
LF_alternateAverageMethod = 0
)";

/// Around `start`, uniform.
constexpr double kStartReach = 0.5, kStartYawReach = 0.26;  ///< m, rad

struct Options {
  mrpt::bayes::CParticleFilter::TParticleFilterOptions filter;
  mrpt::slam::TKLDParams kld;
  mrpt::maps::TSetOfMetricMapInitializers maps;
  int particles = 0;
};

Result<Options> read_options(const std::string& file) {
  constexpr const char* kSections[] = {"PF_options", "KLD_options", "MetricMap"};
  const auto configuration = read_configuration(file, kDefaults, kSections);
  if (!configuration) return configuration.error();
  Options options;
  const Status loaded = load_options(file, [&] {
    options.filter.loadFromConfigFile(*configuration, "PF_options");
    options.kld.loadFromConfigFile(*configuration, "KLD_options");
    options.maps.loadFromConfigFile(*configuration, "MetricMap");
    options.particles = configuration->read_int("LocalizationExperiment", "particles_count", 20000);
  });
  if (!loaded) return loaded.error();
  if (options.particles < 1 || options.particles > 10'000'000) {
    return Error{file + ": [LocalizationExperiment] particles_count = " + std::to_string(options.particles) +
                 "; expected 1 to 10000000"};
  }
  return options;
}

void fill(const GridMap& from, mrpt::maps::COccupancyGridMap2D& grid) {
  const double x_max = from.x_min + from.width * from.resolution,
               y_max = from.y_min + from.height * from.resolution;
  grid.setSize(static_cast<float>(from.x_min), static_cast<float>(x_max), static_cast<float>(from.y_min),
               static_cast<float>(y_max), static_cast<float>(from.resolution), 0.5F);
  for (int y = 0; y < from.height; ++y) {
    for (int x = 0; x < from.width; ++x) {
      const auto cell =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(from.width) + static_cast<std::size_t>(x);
      grid.setCell(x, y, 1 - from.occupied[cell]);
    }
  }
}

class MrptLocalizer final : public MrptEngine {
 public:
  MrptLocalizer(const RobotDescription& robot, GridMap map, const Options& options)
      : MrptEngine(robot), map_(std::move(map)) {
    filter_.m_options = options.filter;
    silence(filter_);
    silence(particles_);
    metric_map_ = mrpt::maps::CMultiMetricMap::Create(options.maps);
    if (!grid()) throw std::runtime_error("[MetricMap] makes no grid: set occupancyGrid_count to 1");
    fill(map_, *grid());
    particles_.options.metricMap = metric_map_;
    particles_.options.KLD_params = options.kld;
  }

  void begin(const std::optional<Eigen::Vector3d>& start, int particles) {
    if (start) {
      particles_.resetUniform(start->x() - kStartReach, start->x() + kStartReach, start->y() - kStartReach,
                              start->y() + kStartReach, start->z() - kStartYawReach,
                              start->z() + kStartYawReach, std::min(particles, 2000));
    } else {
      particles_.resetUniformFreeSpace(grid().get(), 0.7, particles);
    }
  }

  std::vector<PoseEstimate> finish() override { return {}; }
  GridMap grid_map() const override { return map_; }
  Status save_simplemap(const std::string& path) const override {
    return Error{path + ": localization does not build a map; omit --map to build one"};
  }

 protected:
  PlanarPosterior process(mrpt::obs::CActionCollection& action, mrpt::obs::CSensoryFrame& frame) override {
    filter_.executeOn(particles_, &action, &frame);
    return planar_posterior(particles_);
  }
  void made(PoseEstimate& estimate) override { estimate.map_id = map_.id; }

 private:
  mrpt::maps::COccupancyGridMap2D::Ptr grid() const {
    return metric_map_->mapByClass<mrpt::maps::COccupancyGridMap2D>();
  }

  GridMap map_;
  mrpt::maps::CMultiMetricMap::Ptr metric_map_;
  mrpt::bayes::CParticleFilter filter_;
  mrpt::slam::CMonteCarloLocalization2D particles_;
};

}  // namespace

Result<std::unique_ptr<Slam>> mrpt_localizer(const RobotDescription& robot, const std::string& map_path,
                                             const SlamOptions& options) {
  const auto read = read_options(options.engine_config);
  if (!read) return read.error();
  auto map = load_frozen_map(map_path, options.resolution);
  if (!map) return map.error();
  seed_mrpt(options.seed);
  std::unique_ptr<MrptLocalizer> localizer;
  const Status made = load_options(options.engine_config, [&] {
    localizer = std::make_unique<MrptLocalizer>(robot, std::move(map->grid), *read);
    localizer->begin(options.start, read->particles);
  });
  if (!made) return made.error();
  return std::unique_ptr<Slam>(std::move(localizer));
}

}  // namespace parhelion::pose
