#include "tools/calibration/level_posterior.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace parhelion::tools {
namespace {

constexpr auto kHeights = BeamOutcomes::kHeights;
constexpr double kDegree = std::numbers::pi / 180;
constexpr double kHeightStep = 0.01;  // m
constexpr double kSteepest = 5 * kDegree, kTiltStep = 0.5 * kDegree, kSlopeStep = 0.5 * kDegree;
constexpr double kTiltPrior = 2.5 * kDegree;  // 1 sigma
constexpr std::size_t kSamples = 100;         // of the bootstrap
constexpr double kBeamsOfAPlace = 4;
/// Of beams that contradict the truth: people, mixed pixels, errors of the path.
constexpr double kOutlier = 0.03;
const double kWorst = -std::log(kOutlier) / BeamOutcomes::kCostStep;
constexpr double kSeen = 0.5;  // fraction of the beams whose outcome a level must let the camera see

}  // namespace

void BeamOutcomes::set(std::size_t slope, const OfHeights& outcomes, double edge) {
  const int reach = static_cast<int>(std::ceil(2 * edge / kHeightStep));
  std::vector<double> kernel;
  for (int d = 0; d <= reach; ++d) kernel.push_back(std::exp(-0.5 * std::pow(kHeightStep * d / edge, 2)));
  for (int h = 0; h < static_cast<int>(kHeights); ++h) {
    double known = 0, all = 0, bad = 0;
    std::uint8_t place = kUnknown;
    int nearest = reach + 1;
    for (int d = -reach; d <= reach; ++d) {
      if (h + d < 0 || h + d >= static_cast<int>(kHeights)) continue;
      const double weight = kernel[static_cast<std::size_t>(std::abs(d))];
      const std::uint8_t outcome = outcomes[static_cast<std::size_t>(h + d)];
      all += weight;
      if (outcome == kUnknown) continue;
      known += weight;
      if (outcome == kAgrees) continue;
      bad += weight;
      if (std::abs(d) < nearest) nearest = std::abs(d), place = outcome;
    }
    const auto i = static_cast<std::size_t>(h);
    places_[slope][i] = kUnknown;
    if (known < 0.5 * all) continue;
    costs_[slope][i] =
        static_cast<std::uint8_t>(std::lround(-std::log(1 - bad / known * (1 - kOutlier)) / kCostStep));
    places_[slope][i] = costs_[slope][i] == 0 ? kAgrees : place;
  }
}

double BeamOutcomes::slope(std::size_t i) {
  return kSlopeStep * (static_cast<double>(i) - static_cast<double>(kSlopes / 2));
}

double BeamOutcomes::slope_step() { return kSlopeStep; }

/// How much images show of the beams at each level.
struct LevelPosterior::Known {
  std::vector<bool> enough;  ///< of each level: the camera sees half as many beams as at any
  double rate = 1;           ///< of contradictions at the best level
};

double LevelPosterior::steepest() { return kSteepest; }

LevelPosterior::LevelPosterior() : costs_(kPlaces), unknown_(kPlaces) {
  const int steps = static_cast<int>(std::lround(kSteepest / kTiltStep));
  for (int p = -steps; p <= steps; ++p) {
    for (int r = -steps; r <= steps; ++r)
      if (p * p + r * r <= steps * steps) tilts_.push_back({0, p * kTiltStep, r * kTiltStep});
  }
}

void LevelPosterior::add(const BeamOutcomes& beam) {
  constexpr long kLevelSlope = BeamOutcomes::kSlopes / 2, kLast = BeamOutcomes::kSlopes - 1;
  ++beams_;
  for (std::size_t k = 0; k < tilts_.size(); ++k) {
    const double slope =
        tilts_[k].roll * std::sin(beam.bearing()) - tilts_[k].pitch * std::cos(beam.bearing());
    const auto index =
        static_cast<std::size_t>(std::clamp<long>(std::lround(slope / kSlopeStep) + kLevelSlope, 0, kLast));
    const auto& places = beam.places(index);
    const auto& costs = beam.costs(index);
    for (std::size_t h = 0; h < kHeights; ++h) {
      if (places[h] == BeamOutcomes::kAgrees) continue;
      const bool unknown = places[h] == BeamOutcomes::kUnknown;
      OfLevels& sums = unknown ? unknown_[beam.end()] : costs_[places[h] - 1U];
      if (sums.empty()) sums.assign(size(), 0);
      sums[k * kHeights + h] += unknown ? 1 : costs[h];
    }
  }
}

LevelPosterior::Known LevelPosterior::known() const {
  std::vector<double> bad(size()), unseen(size());
  for (std::size_t place = 0; place < kPlaces; ++place) {
    for (std::size_t i = 0; i < costs_[place].size(); ++i) bad[i] += double{costs_[place][i]} / kWorst;
    for (std::size_t i = 0; i < unknown_[place].size(); ++i) unseen[i] += double{unknown_[place][i]};
  }
  const double all = static_cast<double>(beams_);
  const double max_known = all - *std::min_element(unseen.begin(), unseen.end());
  Known known;
  for (std::size_t i = 0; i < size(); ++i) {
    known.enough.push_back(all - unseen[i] > kSeen * max_known);
    if (known.enough.back()) known.rate = std::min(known.rate, bad[i] / (all - unseen[i]));
  }
  return known;
}

LevelPosterior::OfLevels LevelPosterior::prior(const Known& known) const {
  OfLevels prior;
  for (std::size_t i = 0; i < size(); ++i) {
    const Level& tilt = tilts_[i / kHeights];
    const double squares = tilt.pitch * tilt.pitch + tilt.roll * tilt.roll;
    prior.push_back(static_cast<float>(known.enough[i] ? -0.5 * squares / (kTiltPrior * kTiltPrior) : -1e3));
  }
  return prior;
}

/// Of each place that contradicts a level. A beam without an outcome counts as an average one, or levels at
/// which nothing is seen would seem the best.
std::vector<LevelPosterior::OfLevels> LevelPosterior::log_likelihoods(double rate) const {
  std::vector<OfLevels> all;
  for (std::size_t place = 0; place < kPlaces; ++place) {
    const OfLevels& costs = costs_[place];
    const OfLevels& unknown = unknown_[place];
    if (costs.empty()) continue;
    const double max_beams = double{*std::max_element(costs.begin(), costs.end())} / kWorst;
    const double weight = BeamOutcomes::kCostStep / (1 + max_beams / kBeamsOfAPlace);
    OfLevels& log_likelihood = all.emplace_back();
    log_likelihood.reserve(size());
    for (std::size_t i = 0; i < size(); ++i) {
      const double cost = double{costs[i]} + (unknown.empty() ? 0 : rate * kWorst * double{unknown[i]});
      log_likelihood.push_back(static_cast<float>(-weight * cost));
    }
  }
  return all;
}

void LevelPosterior::add_moments(const OfLevels& log_density, Level& first, Level& second) const {
  constexpr float kNegligible = 20;
  const float top = *std::max_element(log_density.begin(), log_density.end());
  double total = 0;
  Level mean, square;
  for (std::size_t i = 0; i < size(); ++i) {
    if (log_density[i] < top - kNegligible) continue;
    const double p = std::exp(double{log_density[i] - top});
    const Level& tilt = tilts_[i / kHeights];
    const double height = BeamOutcomes::height(i % kHeights);
    total += p;
    mean.height += p * height, square.height += p * height * height;
    mean.pitch += p * tilt.pitch, square.pitch += p * tilt.pitch * tilt.pitch;
    mean.roll += p * tilt.roll, square.roll += p * tilt.roll * tilt.roll;
  }
  const double w = 1 / (total * kSamples);
  first.height += w * mean.height, first.pitch += w * mean.pitch, first.roll += w * mean.roll;
  second.height += w * square.height, second.pitch += w * square.pitch, second.roll += w * square.roll;
}

LevelEstimate LevelPosterior::estimate() const {
  const Known known = this->known();
  const OfLevels prior = this->prior(known);
  const std::vector<OfLevels> places = log_likelihoods(known.rate);
  std::mt19937 random(1);
  Level first, second;
  for (std::size_t b = 0; b < kSamples; ++b) {
    std::vector<float> times(places.size());
    for (std::size_t k = 0; k < places.size(); ++k) ++times[random() % places.size()];
    OfLevels sample = prior;
    for (std::size_t k = 0; k < places.size(); ++k) {
      if (times[k] == 0) continue;
      for (std::size_t i = 0; i < sample.size(); ++i) sample[i] += times[k] * places[k][i];
    }
    add_moments(sample, first, second);
  }
  const auto sigma = [](double mean, double square, double step) {
    return std::sqrt(std::max(0.0, square - mean * mean) + step * step / 12);
  };
  return {first,
          {sigma(first.height, second.height, kHeightStep), sigma(first.pitch, second.pitch, kTiltStep),
           sigma(first.roll, second.roll, kTiltStep)},
          1 - known.rate,
          places.size()};
}

}  // namespace parhelion::tools
