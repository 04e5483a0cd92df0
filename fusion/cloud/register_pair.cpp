#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <span>

#include "fusion/cloud/parallel.hpp"
#include "fusion/cloud/registration.hpp"
#include "fusion/cloud/registration_verdict.hpp"
#include "fusion/cloud/surfel_match.hpp"

namespace parhelion {
namespace {

constexpr int resolutions = 4;  // each twice as fine as the one before
constexpr double surfels_a_radius =
    25;  // fine enough for furniture, with a dozen points in each of a usual scan's

/// m, four of five points are within it of the middle point: the size of a scene, whatever few points do.
double scene_radius(const std::vector<Eigen::Vector3f>& points) {
  constexpr std::size_t most_looked_at = 2000;
  const std::size_t step = 1 + points.size() / most_looked_at;
  std::vector<float> values;
  const auto quantile = [&](std::size_t tenths) {
    const auto at = values.begin() + static_cast<std::ptrdiff_t>(values.size() * tenths / 10);
    std::nth_element(values.begin(), at, values.end());
    return *at;
  };
  Eigen::Vector3f centre;
  for (int axis = 0; axis < 3; ++axis) {
    values.clear();
    for (std::size_t i = 0; i < points.size(); i += step) values.push_back(points[i][axis]);
    centre[axis] = quantile(5);
  }
  values.clear();
  for (std::size_t i = 0; i < points.size(); i += step) values.push_back((points[i] - centre).norm());
  return quantile(8);
}

template <class Frame>
Status check_cloud(const PointCloud<Frame>& cloud, const char* name) {
  const auto error = [&](const std::string& what) {
    return Error{"register: the " + std::string(name) + " " + what};
  };
  if (cloud.empty()) return error("cloud has no points; give one that has");
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (!cloud.points[i].allFinite())
      return error("cloud's point " + std::to_string(i) +
                   " is not finite; drop such points where the cloud is read");
  }
  if (!cloud.scans.empty() && cloud.scans.size() != cloud.size())
    return error("cloud has " + std::to_string(cloud.scans.size()) + " scan numbers for " +
                 std::to_string(cloud.size()) + " points; give one each, or none");
  for (const std::uint16_t scan : cloud.scans) {
    if (!cloud.viewpoints.empty() && scan >= cloud.viewpoints.size())
      return error("cloud has a point of scan " + std::to_string(scan) + ", but " +
                   std::to_string(cloud.viewpoints.size()) + " viewpoints");
  }
  return {};
}

Status check_options(const RegistrationOptions& options) {
  if (!(options.max_distance > 0) || !std::isfinite(options.max_distance))
    return Error{"register: max_distance is " + std::to_string(options.max_distance) +
                 " m; give one above 0"};
  if (options.max_iterations < 1)
    return Error{"register: max_iterations is " + std::to_string(options.max_iterations) +
                 "; give 1 or more"};
  if (!(options.min_overlap > 0 && options.min_overlap <= 1))
    return Error{"register: min_overlap is " + std::to_string(options.min_overlap) +
                 "; give a share in (0, 1]"};
  if (!(options.surfel_size >= 0) || !std::isfinite(options.surfel_size))
    return Error{"register: surfel_size is " + std::to_string(options.surfel_size) +
                 " m; give one above 0, or 0"};
  if (options.threads < 0)
    return Error{"register: threads is " + std::to_string(options.threads) + "; give 0 or more"};
  return {};
}

std::string metres(double value) {
  std::array<char, 40> text;
  std::snprintf(text.data(), text.size(), "%.3g m", value);
  return text.data();
}

/// Clouds of the same place are of about one size; a factor of a thousand is a unit.
Status check_scales(double target, double source, double max_distance) {
  constexpr double most_apart = 30;
  const double smaller = std::min(target, source), larger = std::max(target, source);
  const std::string sizes = "four fifths of the target are within " + metres(target) +
                            " of its middle, of the source within " + metres(source);
  if (!(smaller > 0))
    return Error{"register: " + sizes + ": a cloud of one place only; give a scan of surfaces"};
  if (larger > most_apart * smaller)
    return Error{"register: " + sizes + ": is one of them in millimetres? Give both in metres"};
  if (smaller > 500 * max_distance)
    return Error{"register: " + sizes + ", but partners are looked for within " + metres(max_distance) +
                 ": are they in millimetres? Give metres, or a greater max_distance"};
  return {};
}

/// Surfels of all sizes, the finest first.
using Pyramid = std::vector<Surfels>;

Pyramid pyramid(VoxelMoments finest) {
  Pyramid result{finest.surfels()};
  VoxelMoments& moments = finest;
  for (int i = 1; i < resolutions; ++i) {
    moments = moments.coarser();
    result.push_back(moments.surfels());
  }
  return result;
}

struct Level {
  const Surfels& source;
  SurfelTarget target;
  MatchOptions options;
};

/// The coarser, the wider partners are looked for: each level's gate holds what the one before leaves.
std::vector<Level> make_levels(const Pyramid& target, const Pyramid& source,
                               const RegistrationOptions& options) {
  constexpr std::array<double, resolutions> gates{2.5, 2, 1.5, 1.25};  // of the surfels' size
  std::vector<Level> levels;
  for (std::size_t i = 0; i < resolutions; ++i) {
    const double size = source[i].size;
    const double gate = std::min(gates[i] * size, std::max(options.max_distance, 3 * source[0].size));
    levels.push_back(
        {source[i], SurfelTarget(target[i], gate), {options.method, gate, size / 2, options.threads}});
  }
  return levels;
}

struct Descent {
  Eigen::Isometry3d T;
  MatchOptions options;  ///< of the last round
  int iterations = 0;
  bool settled = false;  ///< the last step was small
  double last_step = 0;  ///< m
};

/// The kernel's width that fits how well these clouds match at best: 3 sigma of the residuals, by their
/// median; not below half a surfel, where their shape itself ends.
double fitted_kernel(const Level& level, const std::vector<std::int32_t>& found, const Eigen::Isometry3d& T) {
  std::vector<double> residuals;
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (found[i] >= 0) residuals.push_back(residual(level.target, found[i], level.source, i, T));
  }
  if (residuals.empty()) return level.options.kernel;
  const auto middle = residuals.begin() + static_cast<std::ptrdiff_t>(residuals.size() / 2);
  std::nth_element(residuals.begin(), middle, residuals.end());
  return std::clamp(3 * 1.4826 * *middle, level.source.size / 2, level.source.size);
}

/// Gauss and Newton's method from the coarsest level to the finest, there once more with the fitted kernel.
Descent descend(std::span<const Level> levels, const Eigen::Isometry3d& guess, int max_iterations) {
  constexpr int most_a_level = 25;
  const double size = levels[0].source.size;
  Descent result{guess, levels[0].options};
  for (std::size_t l = levels.size(); l-- > 0;) {
    const Level& level = levels[l];
    bool fitted = l > 0;
    result.settled = false;
    result.options = level.options;
    for (int i = 0; i < most_a_level && result.iterations < max_iterations; ++i) {
      const std::vector<std::int32_t> found = partners(level.target, level.source, result.T, result.options);
      if (result.settled || (!fitted && i == most_a_level / 2)) {
        if (fitted) break;
        result.options.kernel = fitted_kernel(level, found, result.T);
        fitted = true;
      }
      const Eigen::Vector3d centre = result.T.translation();
      const NormalEquations equations =
          normal_equations(level.target, level.source, found, result.T, centre, result.options);
      if (equations.pairs < 6) return result;
      Matrix6d H = equations.H;
      H.diagonal().array() += 1e-6 * H.trace() / 6;  // along what is not determined, stay
      // Partners that change to and fro would keep it swinging: shorter steps end that.
      const double shorter = i < 8 ? 1 : i < 16 ? 0.5 : 0.2;
      const Vector6d step = shorter * H.ldlt().solve(equations.b);
      if (!step.allFinite()) return result;
      result.T = stepped(result.T, step, centre);
      ++result.iterations;
      result.last_step = step.head<3>().norm();
      result.settled = step.head<3>().norm() < size / 200 && step.tail<3>().norm() < size / 600;
      if (result.settled && fitted) break;
    }
  }
  return result;
}

/// Where else to begin where the first attempt is not believed: around the guess, as far as the coarsest
/// level does not reach by itself.
std::vector<Eigen::Isometry3d> other_starts(const Eigen::Isometry3d& guess, double reach) {
  std::vector<Eigen::Isometry3d> starts;
  for (const double turn : {0.0, 0.25, -0.25}) {
    for (const Eigen::Vector2d& move : {Eigen::Vector2d(0, 0), Eigen::Vector2d(1, 0), Eigen::Vector2d(-1, 0),
                                        Eigen::Vector2d(0, 1), Eigen::Vector2d(0, -1)}) {
      if (turn == 0 && move.isZero()) continue;
      Eigen::Isometry3d start = guess;
      start.linear() = Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()).toRotationMatrix() * guess.linear();
      start.translation().head<2>() += reach * move;
      starts.push_back(start);
    }
  }
  return starts;
}

/// Everything of one call.
struct Problem {
  const PointCloud<Target>& target;
  const PointCloud<Source>& source;
  const RegistrationOptions& options;
  std::vector<Level> levels;
};

struct Attempt {
  Descent descent;
  AlignmentEvidence seen;
  std::string why;

  Registration registration() const {
    return {Transform<Target, Source>(descent.T),
            seen.covariance,
            why.empty(),
            why,
            seen.overlap,
            seen.rms,
            descent.iterations};
  }
};

Attempt attempt(const Problem& problem, const Eigen::Isometry3d& start) {
  const std::vector<Level>& levels = problem.levels;
  Attempt result{descend(levels, start, problem.options.max_iterations), {}, {}};
  result.seen = evidence({levels[0].target, levels[0].source, problem.target.viewpoints,
                          problem.source.viewpoints, result.descent.T, result.descent.options});
  result.why = objection(result.seen, problem.options.min_overlap);
  if (result.why.empty() && !result.descent.settled && result.descent.last_step > levels[0].source.size / 20)
    result.why = "still moving after " + std::to_string(result.descent.iterations) + " iterations";
  return result;
}

/// Share of a level's source surfels that lie on the target.
double agreement(const Level& level, const Eigen::Isometry3d& T) {
  const std::vector<std::int32_t> found = partners(level.target, level.source, T, level.options);
  double on = 0;
  for (std::size_t i = 0; i < found.size(); ++i)
    on += found[i] >= 0 && residual(level.target, found[i], level.source, i, T) < level.options.kernel;
  return on / static_cast<double>(found.size());
}

/// Rooms look alike when turned by quarters: a result is only right where those turns fit clearly worse.
/// Looked at in the two coarsest levels first, which tells most of them apart.
std::string rival(const Problem& problem, const Attempt& winner, const Eigen::Isometry3d& guess) {
  constexpr double nearly = 0.8;
  // Of two that fit alike, a guess within an eighth of a turn decides; against one that fits better it does
  // not.
  const Eigen::Matrix3d from_guess = (guess.inverse(Eigen::Isometry) * winner.descent.T).linear();
  const bool guess_decides = Eigen::AngleAxisd(from_guess).angle() < std::numbers::pi / 4;
  const std::span<const Level> coarse = std::span(problem.levels).last(2);
  const Eigen::Isometry3d& T = winner.descent.T;
  const double own = agreement(coarse[0], T);
  const auto score = [](const AlignmentEvidence& seen) { return seen.overlap - 2 * seen.contradiction; };
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3f& mean : coarse[1].source.means) middle += T * mean.cast<double>();
  middle /= static_cast<double>(coarse[1].source.count());
  for (int quarters = 1; quarters < 4; ++quarters) {
    const Vector6d turn = (Vector6d() << 0, 0, 0, 0, 0, quarters * std::numbers::pi / 2).finished();
    const Eigen::Isometry3d start = stepped(T, turn, middle);
    const Descent quick = descend(coarse, start, problem.options.max_iterations);
    if (agreement(coarse[0], quick.T) < nearly * own) continue;
    const Attempt other = attempt(problem, quick.T);
    if (!other.why.empty() || (T.inverse(Eigen::Isometry) * other.descent.T).linear().trace() > 2) continue;
    if (score(other.seen) < (guess_decides ? 1.25 : 0.9) * score(winner.seen)) continue;
    return "turned by " + std::to_string(90 * quarters) +
           " degrees the source fits as well or better; guess nearer";
  }
  return {};
}

}  // namespace

double fitted_surfel_size(const std::vector<Eigen::Vector3f>& points) {
  return points.empty() ? 0 : scene_radius(points) / surfels_a_radius;
}

Result<Registration> register_pair(const PointCloud<Target>& target, const PointCloud<Source>& source,
                                   const Transform<Target, Source>& guess,
                                   const RegistrationOptions& options) {
  for (const Status& status :
       {check_options(options), check_cloud(target, "target"), check_cloud(source, "source")}) {
    if (!status.ok()) return status.error();
  }
  if (!guess.finite()) return Error{"register: the guess is not finite; give a rigid transform"};
  const double target_size = scene_radius(target.points), source_size = scene_radius(source.points);
  if (const Status status = check_scales(target_size, source_size, options.max_distance); !status.ok())
    return status.error();

  const double surfel_size = options.surfel_size > 0
                                 ? options.surfel_size
                                 : std::clamp(target_size, source_size, 2 * source_size) / surfels_a_radius;
  Pyramid target_surfels, source_surfels;
  do_both(
      options.threads,
      [&] {
        target_surfels = pyramid({target.points, surfel_size, target.scans, target.viewpoints});
      },
      [&] {
        source_surfels = pyramid({source.points, surfel_size, source.scans, source.viewpoints});
      });
  const Problem problem{target, source, options, make_levels(target_surfels, source_surfels, options)};

  const Attempt first = attempt(problem, guess.isometry());
  Attempt best = first;
  for (const Eigen::Isometry3d& start : other_starts(guess.isometry(), options.max_distance / 2)) {
    if (best.why.empty()) break;
    best = attempt(problem, start);
  }
  if (!best.why.empty()) return first.registration();
  if (options.doubt_turns) best.why = rival(problem, best, guess.isometry());
  return best.registration();
}

}  // namespace parhelion
