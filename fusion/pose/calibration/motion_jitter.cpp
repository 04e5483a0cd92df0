#include <algorithm>

#include "fusion/pose/calibration/motion_chain.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::pose {
namespace {

constexpr std::size_t kMinSamples = 30;

/// Squared speed between two steps of the chain, and the negative product of their errors.
struct JitterSample {
  double speed2 = 0, product = 0;
};

std::vector<JitterSample> jitter_samples(const MotionChain& chain, const MotionParameters& parameters) {
  // A turn shows jitter too; 0.3 m is the arm that weighs a radian against a metre.
  constexpr double kArm2 = 0.09;
  std::vector<JitterSample> samples;
  for (std::size_t i = 1; i + 1 < chain.laser.size(); ++i) {
    const auto before = step_error(chain, i - 1, parameters), after = step_error(chain, i, parameters);
    const auto step_before = chain.step(i - 1, parameters), step_after = chain.step(i, parameters);
    const double dt = (chain.laser[i + 1].stamp - chain.laser[i - 1].stamp).seconds() / 2;
    if (!before || !after || !step_before || !step_after || !(dt > 0)) continue;
    samples.push_back({step_before->x * step_after->x / (dt * dt), -before->x() * after->x()});
    samples.push_back(
        {kArm2 * step_before->yaw * step_after->yaw / (dt * dt), -kArm2 * before->z() * after->z()});
  }
  return samples;
}

struct JitterLine {
  double offset = 0, slope = 0, slope_sigma = 0;
};

/// Least squares, with products held within eight times `last`.
JitterLine fitted_line(const std::vector<JitterSample>& samples, const JitterLine& last) {
  const auto product = [&last](const JitterSample& sample) {
    const double limit = 8 * (std::max(last.offset, 1e-7) + std::max(last.slope * sample.speed2, 0.0));
    return std::clamp(sample.product, -limit, limit);
  };
  double n = 0, x = 0, y = 0, xx = 0, xy = 0;
  for (const JitterSample& sample : samples) {
    n += 1, x += sample.speed2, y += product(sample);
    xx += sample.speed2 * sample.speed2, xy += sample.speed2 * product(sample);
  }
  const double spread = xx - x * x / n;
  if (!(spread > 1e-9)) return {};
  JitterLine line;
  line.slope = (xy - x * y / n) / spread;
  line.offset = (y - line.slope * x) / n;
  double squares = 0;
  for (const JitterSample& sample : samples)
    squares += std::pow(product(sample) - line.offset - line.slope * sample.speed2, 2);
  line.slope_sigma = std::sqrt(squares / n / spread);
  return line;
}

/// Squared speed that a tenth of the samples exceed.
double fast(const std::vector<JitterSample>& samples) {
  std::vector<double> speeds;
  speeds.reserve(samples.size());
  for (const JitterSample& sample : samples) speeds.push_back(std::abs(sample.speed2));
  return quantile(speeds, 0.9);
}

}  // namespace

Measured jitter_of(const MotionChain& chain, const MotionParameters& parameters) {
  std::vector<JitterSample> samples = jitter_samples(chain, parameters);
  if (samples.size() < kMinSamples) return {};
  std::vector<double> sizes;
  sizes.reserve(samples.size());
  for (const JitterSample& sample : samples) sizes.push_back(std::abs(sample.product));
  JitterLine line{30 * median(sizes), 0, 0};
  // Products beyond what the line explains are slip. What counts as such depends on the line.
  for (int i = 0; i < 4; ++i) line = fitted_line(samples, line);
  if (!(line.slope_sigma > 0)) return {};
  const double slope = line.slope, slope_sigma = line.slope_sigma;
  const double jitter = std::sqrt(std::max(slope, 0.0));
  // By the model: odometry's own stamps jitter by more than what interpolation leaves of it.
  constexpr double kModel = 0.15;
  const double sigma =
      std::hypot(slope_sigma / std::max(2 * jitter, std::sqrt(slope_sigma)), kModel * jitter);
  // Slower, or with less of an effect than this beside the scans' own errors, those decide.
  constexpr double kFast2 = 0.1 * 0.1, kFraction = 0.25;
  const double fast2 = fast(samples);
  const bool shows = fast2 > kFast2 && slope * fast2 > kFraction * line.offset;
  return {jitter, sigma, shows && slope > 2 * slope_sigma};
}

}  // namespace parhelion::pose
