#include "fusion/semantic/texture/align_views.hpp"

#include <Eigen/Cholesky>
#include <cmath>

#include "fusion/cloud/parallel.hpp"
#include "fusion/semantic/texture/grey_image.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kBlurs[] = {4, 2, 1};  ///< px, from coarse to fine
constexpr double kSigmaGrey = 12;       ///< of 255; larger differences count less

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

struct SeenSample {
  std::uint32_t sample;
  float weight;
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

  void run() {
    for (const double blur : kBlurs) {
      std::vector<GreyImage> images;
      for (std::size_t v = 0; v < views_.size(); ++v) images.emplace_back(views_[v], gains_[v], blur);
      for (int round = 0; round < options_.rounds; ++round) step(images);
    }
    for (std::size_t v = 0; v < views_.size(); ++v)
      views_[v].T_map_optical = Transform<CameraOptical, Map>(now_[v]).inverse();
  }

 private:
  static constexpr double kMargin = 2;  ///< px

  void step(const std::vector<GreyImage>& images) {
    std::vector<float> mean(samples_.size());
    cloud::for_each_chunk(samples_.size(), 1024, options_.threads,
                          [&](std::size_t, std::size_t begin, std::size_t end) {
                            for (std::size_t s = begin; s < end; ++s) mean[s] = mean_of(samples_[s], images);
                          });
    cloud::for_each_chunk(views_.size(), 1, options_.threads,
                          [&](std::size_t v, std::size_t, std::size_t) { move(v, images[v], mean); });
  }

  float mean_of(const SurfaceSample& sample, const std::vector<GreyImage>& images) const {
    float sum = 0, total = 0;
    for (const Observation& seen : sample.seen) {
      const Eigen::Vector3d p = now_[seen.view] * sample.point.cast<double>();
      if (p.z() < 0.05) continue;
      const Eigen::Vector2d pixel = views_[seen.view].camera.project(p);
      if (!views_[seen.view].camera.contains(pixel, kMargin)) continue;
      sum += seen.weight * images[seen.view].at(pixel).grey;
      total += seen.weight;
    }
    return total > 0 ? sum / total : 0;
  }

  /// One step of Gauss and Newton for a view's pose.
  void move(std::size_t v, const GreyImage& image, const std::vector<float>& mean) {
    const Pinhole& camera = views_[v].camera;
    Matrix6 H = Matrix6::Zero();
    Vector6 g = Vector6::Zero();
    double samples = 0;
    for (const SeenSample& seen : seen_[v]) {
      const Eigen::Vector3d p = now_[v] * samples_[seen.sample].point.cast<double>();
      if (p.z() < 0.05) continue;
      const Eigen::Vector2d pixel = camera.project(p);
      if (!camera.contains(pixel, kMargin)) continue;
      const GreyImage::Value value = image.at(pixel);
      const double error = static_cast<double>(value.grey) - static_cast<double>(mean[seen.sample]);
      const double gx = static_cast<double>(value.gradient.x()) * camera.fx / p.z();
      const double gy = static_cast<double>(value.gradient.y()) * camera.fy / p.z();
      const Eigen::Vector3d to_point(gx, gy, -(gx * p.x() + gy * p.y()) / p.z());
      Vector6 J;
      J << to_point, p.cross(to_point);
      const double weight = 1 / (1 + error * error / (kSigmaGrey * kSigmaGrey));
      H += weight * J * J.transpose();
      g += weight * error * J;
      samples += 1;
    }
    if (samples < 100) return;
    H += prior(samples);
    g += prior(samples) * moved(v);
    const Vector6 step = -H.ldlt().solve(g);
    if (!step.allFinite() || step.norm() > 0.2) return;
    now_[v] = Eigen::Translation3d(step.head<3>()) * rotation(step.tail<3>()) * now_[v];
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

  /// Neighbouring samples are not independent: the given pose weighs as much as a hundredth of them.
  Matrix6 prior(double samples) const {
    const double weight = 0.01 * samples * kSigmaGrey * kSigmaGrey;
    Vector6 sigma;
    sigma << Eigen::Vector3d::Constant(options_.sigma_position),
        Eigen::Vector3d::Constant(options_.sigma_angle);
    return (weight * sigma.array().square().inverse()).matrix().asDiagonal();
  }

  std::span<ColourView> views_;
  std::span<const Eigen::Vector3f> gains_;
  std::span<const SurfaceSample> samples_;
  const AlignOptions& options_;
  std::vector<std::vector<SeenSample>> seen_;
  std::vector<Eigen::Isometry3d> given_, now_;  ///< T_optical_map
};

}  // namespace

void align_views(std::span<ColourView> views, std::span<const Eigen::Vector3f> gains,
                 std::span<const SurfaceSample> samples, const AlignOptions& options) {
  Alignment(views, gains, samples, options).run();
}

}  // namespace parhelion::semantic
