// Probability of a laser's height and tilt, from beams that each contradict some of them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace parhelion::tools {

/// Height and tilt of a sensor.
struct Level {
  double height = 0;           ///< m, z in base_link
  double pitch = 0, roll = 0;  ///< rad, by which the described sensor is turned about the base's y and x axes
};

/// What a beam says of each height of the laser and slope of the beam.
class BeamOutcomes {
 public:
  static constexpr std::size_t kHeights = 149, kSlopes = 21;
  static constexpr std::uint8_t kAgrees = 0, kUnknown = 255;  ///< else 1 + the place that contradicts
  using OfHeights = std::array<std::uint8_t, kHeights>;

  /// `bearing`: rad, in base_link; `end`: the place of its end.
  BeamOutcomes(double bearing, std::uint8_t end) : bearing_(bearing), end_(end) {}
  /// `edge`: m, 1 sigma of the height at which an outcome changes.
  void set(std::size_t slope, const OfHeights& outcomes, double edge);

  /// m.
  static double height(std::size_t i) { return 0.02 + 0.01 * static_cast<double>(i); }
  /// rad, upward.
  static double slope(std::size_t i);
  static double slope_step();

  double bearing() const { return bearing_; }
  std::uint8_t end() const { return end_; }
  const OfHeights& places(std::size_t slope) const { return places_[slope]; }
  /// Logarithm of how much less probable the beam is, in steps of kCostStep.
  const OfHeights& costs(std::size_t slope) const { return costs_[slope]; }
  static constexpr double kCostStep = 0.025;

 private:
  double bearing_;
  std::uint8_t end_;
  std::array<OfHeights, kSlopes> places_{}, costs_{};
};

struct LevelEstimate {
  Level mean, sigma;
  double agreeing = 0;     ///< fraction of the beams with a known outcome that agree at the best level
  std::size_t things = 0;  ///< places that contradict some level
};

class LevelPosterior {
 public:
  static constexpr std::size_t kPlaces = 128;
  /// rad: pitch and roll are looked for in a circle so large.
  static double steepest();

  LevelPosterior();
  void add(const BeamOutcomes& beam);
  /// The mean of posteriors of bootstrap samples of the places, and its standard deviation: Huggins and
  /// Miller, "Reproducible model selection using bagged posteriors", Bayesian Analysis 18 (2023). What beams
  /// say of one place has one cause, so a place counts as four beams at most. The prior of height is flat
  /// from 0.02 to 1.5 m, that of pitch and roll normal about the description with 2.5 degrees.
  LevelEstimate estimate() const;

 private:
  using OfLevels = std::vector<float>;
  struct Known;

  std::size_t size() const { return tilts_.size() * BeamOutcomes::kHeights; }
  Known known() const;
  OfLevels prior(const Known& known) const;
  std::vector<OfLevels> log_likelihoods(double rate) const;
  void add_moments(const OfLevels& log_density, Level& first, Level& second) const;

  std::vector<Level> tilts_;
  std::vector<OfLevels> costs_;    ///< by place; empty: none
  std::vector<OfLevels> unknown_;  ///< beams, by the place of their ends
  std::size_t beams_ = 0;
};

}  // namespace parhelion::tools
