#include "fusion/pose/slam_by_scans.hpp"

#include <algorithm>
#include <utility>

#include "fusion/pose/mapping/odometry_by_scans.hpp"

namespace parhelion::pose {
namespace {

bool is_of_odometry(const OdometryFinding& finding) {
  return finding.fault != OdometryFault::carried && finding.fault != OdometryFault::laser_frozen &&
         finding.fault != OdometryFault::beam_order;
}

class SlamByScans final : public Slam {
 public:
  SlamByScans(const RobotDescription& robot, std::unique_ptr<Slam> engine)
      : by_scans_(robot), engine_(std::move(engine)) {}

  void add(const Odometry&) override {}
  void add_inertial(const ImuSample& sample) override {
    by_scans_.add_inertial(sample);
    engine_->add_inertial(sample);
  }
  std::optional<PoseEstimate> add(const Scan& scan) override {
    odometry_ = by_scans_.add(scan);
    if (odometry_) engine_->add(*odometry_);
    return engine_->add(scan);
  }
  std::vector<PoseEstimate> finish() override { return engine_->finish(); }
  std::optional<Odometry> odometry_by_scans() const override { return odometry_; }
  std::vector<OdometryFinding> odometry_findings() const override {
    std::vector<OdometryFinding> findings = engine_->odometry_findings();
    std::erase_if(findings, is_of_odometry);
    return findings;
  }
  GridMap grid_map() const override { return engine_->grid_map(); }
  Status save_simplemap(const std::string& path) const override { return engine_->save_simplemap(path); }

 private:
  OdometryByScans by_scans_;
  std::unique_ptr<Slam> engine_;
  std::optional<Odometry> odometry_;  ///< of the last scan
};

}  // namespace

std::unique_ptr<Slam> with_odometry_by_scans(const RobotDescription& robot, std::unique_ptr<Slam> engine) {
  return std::make_unique<SlamByScans>(robot, std::move(engine));
}

}  // namespace parhelion::pose
