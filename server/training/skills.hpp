// How well a trainee has each skill, from which tasks were done: Bayesian knowledge tracing (Corbett and
// Anderson 1995, "Knowledge tracing: modeling the acquisition of procedural knowledge") with many ordered
// states of a skill in place of two, and with the logistic curve of Elo and Rasch (Pelanek 2016,
// "Applications of the Elo rating system in adaptive educational systems") for how a task's difficulty meets
// an ability.
#pragma once

#include <array>
#include <map>
#include <string>
#include <vector>

namespace parhelion::training {

/// Ability and difficulty are on one scale without unit: where they are equal, half of all tries go well.
struct SkillParameters {
  double prior_mean = -1, prior_sigma = 1.5;  ///< of the ability of who was never seen
  double slope = 1.2;                         ///< of the logistic curve: how sharply ability decides
  double guess = 0.05, slip = 0.05;           ///< done without the ability; not done in spite of it
  double learns_done = 0.4;     ///< probability that a task done lifts the ability by one state,
  double learns_failed = 0.28;  ///< and one that failed; not more than learns_done
};

/// What is believed of one skill: a probability for each ability.
class SkillBelief {
 public:
  static constexpr std::size_t kStates = 19;
  static constexpr double kLowest = -4.5, kStep = 0.5;  ///< up to 4.5
  using Distribution = std::array<double, kStates>;     ///< over abilities

  explicit SkillBelief(const SkillParameters& parameters);

  const Distribution& ability() const { return probability_; }
  double mean() const;
  /// Probability that the ability is at least this.
  double at_least(double ability) const;
  /// Bayes: P(L | outcome), where `others` is the weakest ability of what else the task asks for. Then P(L)
  /// moves up: what was not there may have been learnt.
  void observe(const SkillParameters& parameters, double difficulty, const Distribution& others, bool done);

 private:
  Distribution probability_;
};

/// A trainee's skills, by name. A success in place of a failure never lowers an estimate that tasks of one
/// skill make. Which skill is observed first is all one, as long as no task asks for both.
class Skills {
 public:
  explicit Skills(const SkillParameters& parameters = {}) : parameters_(parameters) {}

  /// A task asks for each of `skills` (each once), and the weakest decides: P(success) = guess + (1 - guess -
  /// slip) / (1 + exp(-slope (min ability - difficulty))). Their beliefs are kept as if they were independent
  /// of each other.
  void observe(const std::vector<std::string>& skills, double difficulty, bool done);
  double success(const std::vector<std::string>& skills, double difficulty) const;
  /// Of a skill never seen: the prior.
  const SkillBelief& belief(const std::string& skill) const;

 private:
  SkillBelief::Distribution weakest(const std::vector<std::string>& skills, std::size_t without) const;

  SkillParameters parameters_;
  SkillBelief unseen_{parameters_};
  std::map<std::string, SkillBelief> beliefs_;
};

}  // namespace parhelion::training
