// What MRPT's engines have in common: a scan and the odometry since the last one become an observation and an
// action; a distribution becomes an estimate. Internal to this folder.
#pragma once

#include <mrpt/obs/CActionCollection.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/poses/CPose3DPDF.h>
#include <mrpt/poses/CPosePDF.h>
#include <mrpt/system/COutputLogger.h>

#include <optional>

#include "fusion/pose/odometry/scan_odometry.hpp"
#include "fusion/pose/slam.hpp"
#include "fusion/pose/tracks/attitude_track.hpp"

namespace parhelion::pose {

/// Planar mean and covariance (x, y, yaw).
struct PlanarPosterior {
  Pose2 T_map_base;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();
};
PlanarPosterior planar_posterior(const mrpt::poses::CPose3DPDF& pdf);
PlanarPosterior planar_posterior(const mrpt::poses::CPosePDF& pdf);

/// MRPT writes its warnings to the console otherwise: a line for each particle and scan.
void silence(mrpt::system::COutputLogger& logger);

/// MRPT's random generator, which the process has once, starts over.
void seed_mrpt(std::uint64_t seed);

class MrptEngine : public Slam {
 public:
  explicit MrptEngine(const RobotDescription& robot);

  void add(const Odometry& odometry) final { odometry_.add(odometry); }
  void add_inertial(const ImuSample& sample) final { attitude_.add(sample); }
  /// `lost` where the posterior is wide, or where MRPT throws: then odometry alone propagates the last pose.
  std::optional<PoseEstimate> add(const Scan& scan) final;

 protected:
  virtual PlanarPosterior process(mrpt::obs::CActionCollection& action, mrpt::obs::CSensoryFrame& frame) = 0;
  virtual void made(PoseEstimate& estimate) = 0;

  RobotDescription robot_;

 private:
  ScanOdometry odometry_;
  AttitudeTrack attitude_;
  PlanarPosterior last_;
  bool found_ = false;
};

}  // namespace parhelion::pose
