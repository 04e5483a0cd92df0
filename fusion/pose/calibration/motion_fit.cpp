#include <algorithm>

#include "fusion/pose/calibration/chain_equations.hpp"
#include "fusion/pose/calibration/motion_chain.hpp"
#include "fusion/pose/odometry/odometry_correction.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::pose {
namespace {

using Equations = ChainEquations<static_cast<int>(kMotionParameters)>;
using P = MotionParameter;

/// 1 sigma of what is thought possible around the start: keeps what a drive does not show from running away.
constexpr std::array<double, kMotionParameters> kPrior{0.3, 0.3, 0.3, 0.5, 0.5, 1.0, 0.5, 1e4, 1e4, 1e4, 1.0};
/// Steps of numeric derivatives. Those of times are long: over a short one the derivative is the noise of
/// odometry, which would look like a motion that shows the offset. (As an instrument it need not be exact.)
constexpr std::array<double, kMotionParameters> kStep{1e-5, 1e-5, 1e-5, 1e-5, 1e-5, 1e-5,
                                                      0.1,  1e-5, 1e-5, 1e-5, 0.1};
/// The same of a parameter that the drive does not show, and that stays as it was described: a drawing and a
/// data sheet are about as good. What depends on it is no better.
constexpr std::array<double, kMotionParameters> kKept{0.05, 0.05, 0.05, 0.1, 0.1, 0.1,
                                                      0.1,  1e4,  1e4,  1e4, 0.1};
/// Knee of the robust weight (Geman-McClure) in squared sigmas of a residual with three components.
constexpr double kKnee = 16;

Eigen::Vector3d whitened(const Pose2& error, double x, double y, double yaw) {
  return {error.x / x, error.y / y, wrap_angle(error.yaw) / yaw};
}

double robust_weight(const Eigen::Vector3d& residual) {
  const double w = kKnee / (kKnee + residual.squaredNorm());
  return w * w;
}

class Fitter {
 public:
  Fitter(const MotionChain& chain, const MotionParameters& start,
         const std::array<bool, kMotionParameters>& free)
      : chain_(chain), start_(start), now_(start), free_(free) {
    for (const LaserPose& pose : chain.laser)
      poses_.push_back(pose.T_map_laser * start.T_base_laser.inverse());
  }

  std::optional<MotionFit> run(int rounds) {
    constexpr int kIterations = 3;
    for (int round = 0; round < rounds; ++round) {
      noise_ = reference_noise(estimated_noise(chain_, now_, noise_));
      for (int i = 0; i < kIterations; ++i) {
        if (!iterate()) return std::nullopt;
      }
    }
    return MotionFit{now_, noise_, information_, poses_};
  }

 private:
  Eigen::Vector3d laser_residual(std::size_t i, const Pose2& pose, const MotionParameters& p) const {
    return whitened(chain_.laser[i].T_map_laser.inverse() * pose * p.T_base_laser, noise_.laser_position,
                    noise_.laser_position, noise_.laser_yaw);
  }

  std::optional<Pose2> reference_error(const ReferenceSample& sample, const Pose2& pose,
                                       const MotionParameters& p) const {
    const Duration offset = seconds(p.odometry.time_offset);
    const auto raw = chain_.odometry.step(chain_.laser[sample.node].stamp - offset,
                                          sample.stamp + seconds(p.reference_offset) - offset);
    if (!raw) return std::nullopt;
    return sample.T_reference_base.inverse() * p.T_reference_map * pose * corrected_step(p.odometry, *raw);
  }

  /// Derivatives by central differences; `residual(pose, next, parameters)`.
  template <class Residual>
  std::optional<Equations::Term> term(std::size_t i, bool has_next, std::initializer_list<P> parameters,
                                      const Residual& residual) const {
    const Pose2 next = has_next ? poses_[i + 1] : Pose2{};
    const auto here = residual(poses_[i], next, now_);
    if (!here) return std::nullopt;
    Equations::Term term;
    term.residual = *here;
    constexpr double h = 1e-6;
    for (int c = 0; c < 3; ++c) {
      const Pose2 up{c == 0 ? h : 0, c == 1 ? h : 0, c == 2 ? h : 0}, down = up.inverse();
      const auto column = [&](const Pose2& a, const Pose2& b, const Pose2& a_next, const Pose2& b_next) {
        const auto high = residual(a, a_next, now_), low = residual(b, b_next, now_);
        return high && low ? Eigen::Vector3d((*high - *low) / (2 * h)) : Eigen::Vector3d::Zero().eval();
      };
      term.J_pose.col(c) = column(poses_[i] * up, poses_[i] * down, next, next);
      if (has_next) term.J_next.col(c) = column(poses_[i], poses_[i], next * up, next * down);
    }
    for (const P parameter : parameters) {
      const auto k = static_cast<std::size_t>(parameter);
      MotionParameters up = now_, down = now_;
      up[parameter] += kStep[k];
      down[parameter] -= kStep[k];
      const auto high = residual(poses_[i], next, up), low = residual(poses_[i], next, down);
      if (high && low) term.J_parameters.col(static_cast<Eigen::Index>(k)) = (*high - *low) / (2 * kStep[k]);
    }
    return term;
  }

  void add(Equations& equations, std::size_t i, bool has_next, const std::optional<Equations::Term>& term) {
    if (term) equations.add(i, *term, robust_weight(term->residual), has_next);
  }

  void add_laser(Equations& equations, std::size_t i) {
    add(equations, i, false,
        term(i, false, {P::laser_x, P::laser_y, P::laser_yaw},
             [&](const Pose2& pose, const Pose2&, const MotionParameters& p) {
               return std::optional(laser_residual(i, pose, p));
             }));
  }

  void add_step(Equations& equations, std::size_t i) {
    add(equations, i, true,
        term(i, true, {P::translation_scale, P::rotation_scale, P::curvature, P::time_offset},
             [&](const Pose2& pose, const Pose2& next,
                 const MotionParameters& p) -> std::optional<Eigen::Vector3d> {
               // Compared as odometry measures it: scaled to the true step, its noise would be taken for a
               // motion that shows the scale, which would come out too small.
               const auto raw = chain_.raw_step(i, p);
               if (!raw) return std::nullopt;
               return whitened(raw->inverse() * pose::raw_step(p.odometry, pose.inverse() * next),
                               noise_.along, noise_.across, noise_.turn);
             }));
  }

  void add_reference(Equations& equations, const ReferenceSample& sample) {
    add(equations, sample.node, false,
        term(sample.node, false,
             {P::translation_scale, P::rotation_scale, P::curvature, P::time_offset, P::reference_x,
              P::reference_y, P::reference_yaw, P::reference_offset},
             [&](const Pose2& pose, const Pose2&,
                 const MotionParameters& p) -> std::optional<Eigen::Vector3d> {
               const auto error = reference_error(sample, pose, p);
               if (!error) return std::nullopt;
               return whitened(*error, noise_.reference_position, noise_.reference_position,
                               noise_.reference_yaw);
             }));
  }

  bool iterate() {
    Equations equations(poses_.size());
    for (std::size_t i = 0; i < poses_.size(); ++i) {
      add_laser(equations, i);
      if (i + 1 < poses_.size()) add_step(equations, i);
    }
    for (const ReferenceSample& sample : chain_.reference) add_reference(equations, sample);
    for (std::size_t k = 0; k < kMotionParameters; ++k) {
      const auto parameter = static_cast<P>(k);
      equations.add_prior(static_cast<int>(k), now_[parameter] - start_[parameter],
                          free_[k] ? kPrior[k] : kKept[k]);
      if (!free_[k]) equations.fix(static_cast<int>(k));
    }
    const auto solution = equations.solve();
    if (!solution) return false;
    for (std::size_t k = 0; k < kMotionParameters; ++k) {
      if (free_[k]) now_[static_cast<P>(k)] += solution->parameters[static_cast<Eigen::Index>(k)];
    }
    for (std::size_t i = 0; i < poses_.size(); ++i) {
      const Eigen::Vector3d& step = solution->poses[i];
      poses_[i] = poses_[i] * Pose2{step.x(), step.y(), step.z()};
    }
    information_ = solution->information;
    return true;
  }

  /// Residuals of the reference have its noise and that of poses fitted to many others, which is less.
  MotionNoise reference_noise(MotionNoise noise) const {
    std::vector<double> position, yaw;
    for (const ReferenceSample& sample : chain_.reference) {
      const auto error = reference_error(sample, poses_[sample.node], now_);
      if (!error) continue;
      position.insert(position.end(), {std::abs(error->x), std::abs(error->y)});
      yaw.push_back(std::abs(wrap_angle(error->yaw)));
    }
    if (position.empty()) return noise;
    noise.reference_position = std::max(1.4826 * median(position), 1e-3);
    noise.reference_yaw = std::max(1.4826 * median(yaw), 5e-4);
    return noise;
  }

  const MotionChain& chain_;
  MotionParameters start_, now_;
  std::array<bool, kMotionParameters> free_;
  MotionNoise noise_;
  std::vector<Pose2> poses_;
  Equations::Matrix information_ = Equations::Matrix::Zero();
};

}  // namespace

double kept_sigma(MotionParameter parameter) { return kKept.at(static_cast<std::size_t>(parameter)); }

std::optional<MotionFit> fit_motion(const MotionChain& chain, const MotionParameters& start,
                                    const std::array<bool, kMotionParameters>& free, int rounds) {
  return Fitter(chain, start, free).run(rounds);
}

}  // namespace parhelion::pose
