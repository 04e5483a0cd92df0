#include "fusion/semantic/texture/align_views.hpp"

#include <Eigen/Cholesky>
#include <cmath>
#include <optional>

#include "fusion/cloud/parallel.hpp"
#include "fusion/semantic/texture/grey_image.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kBlurs[] = {4, 2, 1};  ///< px, from coarse to fine
constexpr double kSigmaGrey = 12;       ///< of 255; larger differences count less
constexpr double kMargin = 2;           ///< px
constexpr double kPrior = 0.01;  ///< neighbouring samples are not independent: the weight of what is given

/// Focal lengths that are tried first: powers of the step, up to the last.
constexpr double kFocalStep = 1.04;
constexpr int kFocalSteps = 6;
constexpr double kFocalGain = 0.9;  ///< another than the given one must lower the cost to this share

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Matrix62 = Eigen::Matrix<double, 6, 2>;

struct SeenSample {
  std::uint32_t sample;
  float weight;
};

/// Mean over the views of a sample.
struct Mean {
  double grey = 0;
  Eigen::Vector2d by_lens = Eigen::Vector2d::Zero();  ///< derivative
};

/// What a view shows of a point.
struct Look {
  double grey = 0;
  Eigen::Vector3d p, by_point;  ///< in the optical frame, m; grey by p
  Eigen::Vector2d by_lens;      ///< grey by the logarithm of the focal length and by the distortion
};

/// Normal equations of one view: its pose, the lens, and what couples them.
struct Equations {
  Matrix6 H = Matrix6::Zero();
  Vector6 g = Vector6::Zero();
  Matrix62 coupling = Matrix62::Zero();
  Eigen::Matrix2d H_lens = Eigen::Matrix2d::Zero();
  Eigen::Vector2d g_lens = Eigen::Vector2d::Zero();
  double samples = 0, cost = 0;
};

class Alignment {
 public:
  Alignment(std::span<ColourView> views, std::span<const Eigen::Vector3f> gains,
            std::span<const SurfaceSample> samples, const AlignOptions& options)
      : views_(views), gains_(gains), samples_(samples), options_(options), seen_(views.size()) {
    for (std::size_t s = 0; s < samples.size(); ++s)
      for (const Observation& seen : samples[s].seen)
        seen_[seen.view].push_back({static_cast<std::uint32_t>(s), seen.weight});
    for (const ColourView& view : views) given_.push_back(view.T_map_optical.inverse().isometry());
    now_ = given_;
  }

  LensError run() {
    for (const double blur : kBlurs) {
      std::vector<GreyImage> images;
      for (std::size_t v = 0; v < views_.size(); ++v) images.emplace_back(views_[v], gains_[v], blur);
      if (blur == kBlurs[0] && options_.rounds > 0) find_focal(images);
      for (int round = 0; round < options_.rounds; ++round) step(equations(images));
    }
    for (std::size_t v = 0; v < views_.size(); ++v)
      views_[v].T_map_optical = Transform<CameraOptical, Map>(now_[v]).inverse();
    return lens_;
  }

 private:
  std::optional<Look> look(std::size_t v, const Eigen::Vector3f& point, const GreyImage& image) const {
    const Pinhole& camera = views_[v].camera;
    Look look;
    look.p = now_[v] * point.cast<double>();
    if (look.p.z() < 0.05) return std::nullopt;
    const double x = look.p.x() / look.p.z(), y = look.p.y() / look.p.z(), r2 = x * x + y * y;
    const double k = lens_.distortion, fx = lens_.focal * camera.fx, fy = lens_.focal * camera.fy;
    const Eigen::Vector2d off(fx * x * (1 + k * r2), fy * y * (1 + k * r2));
    const Eigen::Vector2d pixel = off + Eigen::Vector2d(camera.cx, camera.cy);
    if (!camera.contains(pixel, kMargin)) return std::nullopt;
    const GreyImage::Value value = image.at(pixel);
    look.grey = static_cast<double>(value.grey);
    const Eigen::Vector2d gradient = value.gradient.cast<double>();
    const double gx = gradient.x() * fx, gy = gradient.y() * fy, radial = gx * x + gy * y;
    const double by_x = (1 + k * r2) * gx + 2 * k * x * radial;
    const double by_y = (1 + k * r2) * gy + 2 * k * y * radial;
    look.by_point = Eigen::Vector3d(by_x, by_y, -(by_x * x + by_y * y)) / look.p.z();
    look.by_lens = {gradient.dot(off), r2 * radial};
    return look;
  }

  std::vector<Equations> equations(const std::vector<GreyImage>& images) const {
    std::vector<Mean> means(samples_.size());
    cloud::for_each_chunk(samples_.size(), 1024, options_.threads,
                          [&](std::size_t, std::size_t begin, std::size_t end) {
                            for (std::size_t s = begin; s < end; ++s) means[s] = mean_of(samples_[s], images);
                          });
    std::vector<Equations> all(views_.size());
    cloud::for_each_chunk(views_.size(), 1, options_.threads, [&](std::size_t v, std::size_t, std::size_t) {
      all[v] = equations_of(v, images[v], means);
    });
    return all;
  }

  Mean mean_of(const SurfaceSample& sample, const std::vector<GreyImage>& images) const {
    Mean mean;
    double total = 0;
    for (const Observation& seen : sample.seen) {
      const auto shown = look(seen.view, sample.point, images[seen.view]);
      if (!shown) continue;
      const auto weight = static_cast<double>(seen.weight);
      mean.grey += weight * shown->grey;
      mean.by_lens += weight * shown->by_lens;
      total += weight;
    }
    if (total > 0) mean.grey /= total, mean.by_lens /= total;
    return mean;
  }

  Equations equations_of(std::size_t v, const GreyImage& image, const std::vector<Mean>& means) const {
    Equations sum;
    for (const SeenSample& seen : seen_[v]) {
      const auto shown = look(v, samples_[seen.sample].point, image);
      if (!shown) continue;
      const double error = shown->grey - means[seen.sample].grey;
      Vector6 J;
      J << shown->by_point, shown->p.cross(shown->by_point);
      // The lens moves what all views show of a sample, and so their mean.
      const Eigen::Vector2d J_lens = shown->by_lens - means[seen.sample].by_lens;
      const double off = error * error / (kSigmaGrey * kSigmaGrey), weight = 1 / (1 + off);
      sum.H += weight * J * J.transpose();
      sum.g += weight * error * J;
      sum.coupling += weight * J * J_lens.transpose();
      sum.H_lens += weight * J_lens * J_lens.transpose();
      sum.g_lens += weight * error * J_lens;
      sum.samples += 1;
      sum.cost += std::log1p(off);
    }
    sum.H += prior(sum.samples);
    sum.g += prior(sum.samples) * moved(v);
    return sum;
  }

  /// One step of Gauss and Newton; the poses are eliminated from the equations of the lens.
  void step(const std::vector<Equations>& equations) {
    Eigen::Matrix2d H = Eigen::Matrix2d::Zero();
    Eigen::Vector2d g = Eigen::Vector2d::Zero();
    double samples = 0;
    for (const Equations& view : equations) {
      if (view.samples < kFewSamples) continue;
      const Matrix62 solved = view.H.ldlt().solve(view.coupling);
      H += view.H_lens - view.coupling.transpose() * solved;
      g += view.g_lens - solved.transpose() * view.g;
      samples += view.samples;
    }
    Eigen::Vector2d step_lens = Eigen::Vector2d::Zero();
    if (samples > 0 && options_.refine_lens) step_lens = lens_step(H, g, samples);
    for (std::size_t v = 0; v < views_.size(); ++v) {
      if (equations[v].samples < kFewSamples) continue;
      const Vector6 step = -equations[v].H.ldlt().solve(equations[v].g + equations[v].coupling * step_lens);
      if (!step.allFinite() || step.norm() > 0.2) continue;
      now_[v] = Eigen::Translation3d(step.head<3>()) * rotation(step.tail<3>()) * now_[v];
    }
    lens_.focal *= std::exp(step_lens.x());
    lens_.distortion += step_lens.y();
  }

  Eigen::Vector2d lens_step(Eigen::Matrix2d H, Eigen::Vector2d g, double samples) const {
    const double weight = kPrior * samples * kSigmaGrey * kSigmaGrey;
    const Eigen::Vector2d sigma(options_.sigma_focal, options_.sigma_distortion);
    const Eigen::Vector2d trust = weight * sigma.array().square().inverse();
    H += Eigen::Matrix2d(trust.asDiagonal());
    g += trust.cwiseProduct(Eigen::Vector2d(std::log(lens_.focal / first_focal_), lens_.distortion));
    const Eigen::Vector2d step = -H.ldlt().solve(g);
    if (!step.allFinite()) return Eigen::Vector2d::Zero();
    return step.cwiseMax(-0.05).cwiseMin(0.05);
  }

  /// Of some focal lengths that are far apart, the one with which the views agree best at their given poses:
  /// steps of Gauss and Newton do not find the way from one stripe of a poster to the next.
  void find_focal(const std::vector<GreyImage>& images) {
    if (!options_.refine_lens) return;
    double min_cost = kFocalGain * cost_at(1, images), best = 1;
    for (int i = -kFocalSteps; i <= kFocalSteps; ++i) {
      const double focal = std::pow(kFocalStep, i), cost = cost_at(focal, images);
      if (i != 0 && cost < min_cost) min_cost = cost, best = focal;
    }
    lens_.focal = first_focal_ = best;
  }

  double cost_at(double focal, const std::vector<GreyImage>& images) {
    lens_.focal = focal;
    double cost = 0, samples = 0;
    for (const Equations& view : equations(images)) cost += view.cost, samples += view.samples;
    return cost / std::max(1.0, samples);
  }

  /// How far the view is from its given pose.
  Vector6 moved(std::size_t v) const {
    const Eigen::Isometry3d delta = now_[v] * given_[v].inverse(Eigen::Isometry);
    const Eigen::AngleAxisd turn(delta.linear());
    Vector6 result;
    result << delta.translation(), turn.angle() * turn.axis();
    return result;
  }

  static Eigen::AngleAxisd rotation(const Eigen::Vector3d& w) {
    const double angle = w.norm();
    return angle < 1e-12 ? Eigen::AngleAxisd::Identity() : Eigen::AngleAxisd(angle, w / angle);
  }

  Matrix6 prior(double samples) const {
    const double weight = kPrior * samples * kSigmaGrey * kSigmaGrey;
    Vector6 sigma;
    sigma << Eigen::Vector3d::Constant(options_.sigma_position),
        Eigen::Vector3d::Constant(options_.sigma_angle);
    return (weight * sigma.array().square().inverse()).matrix().asDiagonal();
  }

  static constexpr double kFewSamples = 100;  ///< of a view: it stays where it is

  std::span<ColourView> views_;
  std::span<const Eigen::Vector3f> gains_;
  std::span<const SurfaceSample> samples_;
  const AlignOptions& options_;
  std::vector<std::vector<SeenSample>> seen_;
  std::vector<Eigen::Isometry3d> given_, now_;  ///< T_optical_map
  LensError lens_;
  double first_focal_ = 1;
};

}  // namespace

LensError align_views(std::span<ColourView> views, std::span<const Eigen::Vector3f> gains,
                      std::span<const SurfaceSample> samples, const AlignOptions& options) {
  return Alignment(views, gains, samples, options).run();
}

}  // namespace parhelion::semantic
