// A trainee's skills, estimated from completed tasks: Bayesian knowledge tracing (Corbett and Anderson 1995,
// "Knowledge tracing: modeling the acquisition of procedural knowledge") with many ordered states per skill
// instead of two, and with the logistic curve of Elo and Rasch (Pelanek 2016, "Applications of the Elo rating
// system in adaptive educational systems") for the success probability given difficulty and ability.
#pragma once

#include <array>
#include <map>
#include <string>
#include <vector>

namespace parhelion::training {

/// Ability and difficulty share one unitless scale: where they are equal, half of all tries succeed.
struct SkillParameters {
  double prior_mean = -1, prior_sigma = 1.5;  ///< ability of a new trainee
  double slope = 1.2;                         ///< steepness of the logistic curve
  double guess = 0.05, slip = 0.05;           ///< success without the ability; failure despite it
  double learns_done = 0.4;     ///< probability that a completed task raises the ability by one state,
  double learns_failed = 0.28;  ///< and that a failed one does; at most learns_done
};

/// Estimate of one skill: a probability for each ability.
class SkillBelief {
 public:
  static constexpr std::size_t kStates = 19;
  static constexpr double kLowest = -4.5, kStep = 0.5;  ///< up to 4.5
  using Distribution = std::array<double, kStates>;     ///< over abilities

  explicit SkillBelief(const SkillParameters& parameters);

  const Distribution& ability() const { return probability_; }
  double mean() const;
  /// Probability that the ability is at least `ability`.
  double at_least(double ability) const;
  /// Bayes: P(L | outcome), where `others` is the weakest ability among the task's other skills. Then P(L)
  /// shifts upwards for learning.
  void observe(const SkillParameters& parameters, double difficulty, const Distribution& others, bool done);

 private:
  Distribution probability_;
};

/// A trainee's skills, by name. Replacing a failure by a success never lowers an estimate from single-skill
/// tasks. The order of observations of different skills does not matter unless a task needs both.
class Skills {
 public:
  explicit Skills(const SkillParameters& parameters = {}) : parameters_(parameters) {}

  /// A task needs each of `skills` (each once), and the weakest determines P(success) = guess + (1 - guess -
  /// slip) / (1 + exp(-slope (min ability - difficulty))). Their estimates are treated as independent.
  void observe(const std::vector<std::string>& skills, double difficulty, bool done);
  double success(const std::vector<std::string>& skills, double difficulty) const;
  /// For a skill without observations: the prior.
  const SkillBelief& belief(const std::string& skill) const;

 private:
  SkillBelief::Distribution weakest(const std::vector<std::string>& skills, std::size_t without) const;

  SkillParameters parameters_;
  SkillBelief unseen_{parameters_};
  std::map<std::string, SkillBelief> beliefs_;
};

}  // namespace parhelion::training
