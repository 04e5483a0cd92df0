#include <array>
#include <numbers>
#include <optional>
#include <span>

#include "fusion/cloud/parallel.hpp"
#include "fusion/cloud/point_descent.hpp"
#include "fusion/cloud/registration.hpp"
#include "fusion/cloud/registration_input.hpp"
#include "fusion/cloud/registration_verdict.hpp"
#include "fusion/cloud/surfel_descent.hpp"

namespace parhelion::cloud {
namespace {

/// Further starting poses for when the first attempt is rejected: around the guess, beyond the reach of the
/// coarsest level.
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

/// State of one call.
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
  bool undetermined = false;

  Registration registration() const {
    return {Transform<Target, Source>(descent.T),
            seen.covariance,
            why.empty(),
            why,
            undetermined,
            seen.overlap,
            seen.rms,
            descent.iterations};
  }
};

Attempt attempt(const Problem& problem, std::span<const Level> levels, const Eigen::Isometry3d& start) {
  const bool of_points = problem.options.method == IcpMethod::paper;
  Attempt result{of_points ? descend_points(problem.target, problem.source, levels[0], start, problem.options)
                           : descend(levels, start, problem.options.max_iterations),
                 {},
                 {},
                 false};
  const Descent& descent = result.descent;
  result.seen = evidence({levels[0].target, levels[0].source, problem.target.viewpoints,
                          problem.source.viewpoints, descent.T, descent.partners, descent.options});
  result.why = objection(result.seen, problem.options.min_overlap);
  AlignmentEvidence rest = result.seen;
  rest.undetermined.clear();
  result.undetermined = !result.why.empty() && objection(rest, problem.options.min_overlap).empty();
  const bool cut_off = descent.iterations >= problem.options.max_iterations;
  if (result.why.empty() && !descent.settled && (cut_off || descent.last_step > levels[0].source.size / 20))
    result.why = "still moving after " + std::to_string(descent.iterations) + " iterations";
  return result;
}

double agreement(const Level& level, const Eigen::Isometry3d& T) {
  PartnerSearch search(level.target, level.source, level.options.gate);
  find_partners(search, level.source, T, level.options.threads);
  return agreement(level, search, T);
}

/// The best result turned by quarters about the upward axis and refined by the two coarsest levels, nearly to
/// convergence, which suffices to compare them.
std::array<Descent, 3> turned(const Problem& problem, const Eigen::Isometry3d& T) {
  constexpr int max_per_level = 6;
  const std::span<const Level> coarse = std::span(problem.levels).last(2);
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3f& mean : coarse[1].source.means) middle += T * mean.cast<double>();
  middle /= static_cast<double>(coarse[1].source.count());
  std::array<std::optional<Descent>, 3> found;
  for_each_chunk(found.size(), 1, problem.options.threads, [&](std::size_t i, std::size_t, std::size_t) {
    const double angle = static_cast<double>(i + 1) * std::numbers::pi / 2;
    const Vector6d turn = (Vector6d() << 0, 0, 0, 0, 0, angle).finished();
    found[i] = descend(coarse, stepped(T, turn, middle), problem.options.max_iterations, max_per_level);
  });
  return {std::move(*found[0]), std::move(*found[1]), std::move(*found[2])};
}

/// Rooms look similar when turned by quarters: a result is accepted only where those turns fit clearly worse.
/// Compared from coarse to fine, as most differ already at coarse levels.
std::string rival(const Problem& problem, const Attempt& winner, const Eigen::Isometry3d& guess) {
  constexpr double nearly = 0.8;
  const std::span<const Level> levels = problem.levels;
  const Eigen::Isometry3d& T = winner.descent.T;
  // Between two that fit equally well, a guess within an eighth of a turn decides; it does not decide against
  // a better fit.
  const Eigen::Matrix3d from_guess = (guess.inverse(Eigen::Isometry) * T).linear();
  const bool guess_decides = Eigen::AngleAxisd(from_guess).angle() < std::numbers::pi / 4;
  const auto score = [](const AlignmentEvidence& seen) { return seen.overlap - 2 * seen.contradiction; };
  const double own = agreement(levels[2], T);
  std::array<Descent, 3> others = turned(problem, T);
  for (std::size_t i = 0; i < others.size(); ++i) {
    if (agreement(levels[2], others[i].partners, others[i].T) < nearly * own) continue;
    const Descent finer = descend(levels.subspan(1, 1), others[i].T, problem.options.max_iterations);
    if (agreement(levels[1], finer.partners, finer.T) < nearly * agreement(levels[1], T)) continue;
    const Attempt other = attempt(problem, levels.first(1), finer.T);
    if (!other.why.empty() || (T.inverse(Eigen::Isometry) * other.descent.T).linear().trace() > 2) continue;
    if (score(other.seen) < (guess_decides ? 1.25 : 0.9) * score(winner.seen)) continue;
    return "turned by " + std::to_string(90 * (i + 1)) +
           " degrees the source fits as well or better; guess nearer";
  }
  return {};
}

/// Starts from the guess, then from other poses, until a result is accepted; else returns the first.
Registration best_registration(const Problem& problem, const Eigen::Isometry3d& guess) {
  Attempt best = attempt(problem, problem.levels, guess);
  if (!best.why.empty()) {
    if (!problem.options.other_starts || problem.options.method == IcpMethod::paper)
      return best.registration();
    Registration first = best.registration();
    for (const Eigen::Isometry3d& start : other_starts(guess, problem.options.max_distance / 2)) {
      best = attempt(problem, problem.levels, start);
      if (best.why.empty()) break;
    }
    if (!best.why.empty()) return first;
  }
  if (problem.options.doubt_turns) best.why = rival(problem, best, guess);
  return best.registration();
}

}  // namespace

Result<Registration> register_pair(const PointCloud<Target>& target, const PointCloud<Source>& source,
                                   const Transform<Target, Source>& guess,
                                   const RegistrationOptions& options) {
  for (const Status& status : {check_options(options), check_cloud(target), check_cloud(source)}) {
    if (!status.ok()) return status.error();
  }
  if (!guess.finite()) return Error{"register: the guess is not finite; give a rigid transform"};
  const double target_radius = scene_radius(target.points), source_radius = scene_radius(source.points);
  if (const Status status = check_scales(target_radius, source_radius, options.max_distance); !status.ok())
    return status.error();

  const double size =
      options.surfel_size > 0 ? options.surfel_size : surfel_size_of(target_radius, source_radius);
  Registration result;
  with_threads(options.threads, [&] {
    std::vector<SurfelTarget> of_target;
    Pyramid of_source;
    const auto surfels = [&](const auto& cloud) {
      return pyramid({cloud.points, size, cloud.scans, cloud.viewpoints}, options.threads);
    };
    run_both(
        options.threads, [&] { of_target = targets(surfels(target)); }, [&] { of_source = surfels(source); });
    result = best_registration({target, source, options, make_levels(of_target, of_source, options)},
                               guess.isometry());
  });
  return result;
}

}  // namespace parhelion::cloud
