#include "server/training/skills.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace parhelion::training {
namespace {

using Distribution = SkillBelief::Distribution;
constexpr std::size_t kStates = SkillBelief::kStates;

double ability_of(std::size_t state) {
  return SkillBelief::kLowest + SkillBelief::kStep * static_cast<double>(state);
}

/// P(success) for each ability.
Distribution success_by_ability(const SkillParameters& parameters, double difficulty) {
  Distribution success;
  for (std::size_t i = 0; i < kStates; ++i)
    success[i] = parameters.guess + (1 - parameters.guess - parameters.slip) /
                                        (1 + std::exp(-parameters.slope * (ability_of(i) - difficulty)));
  return success;
}

/// P(success) for each ability in one skill, with `others` as the weakest of the rest.
Distribution success_with(const Distribution& success, const Distribution& others) {
  Distribution with;
  double weaker = 0, as_others = 0;
  for (std::size_t i = 0; i < kStates; ++i) {
    with[i] = as_others + std::max(0.0, 1 - weaker) * success[i];
    weaker += others[i];
    as_others += others[i] * success[i];
  }
  return with;
}

}  // namespace

SkillBelief::SkillBelief(const SkillParameters& parameters) {
  double sum = 0;
  for (std::size_t i = 0; i < kStates; ++i) {
    const double z = (ability_of(i) - parameters.prior_mean) / parameters.prior_sigma;
    sum += probability_[i] = std::exp(-0.5 * z * z);
  }
  for (double& probability : probability_) probability /= sum;
}

double SkillBelief::mean() const {
  double mean = 0;
  for (std::size_t i = 0; i < kStates; ++i) mean += probability_[i] * ability_of(i);
  return std::clamp(mean, ability_of(0), ability_of(kStates - 1));
}

double SkillBelief::at_least(double ability) const {
  double above = 0;
  for (std::size_t i = 0; i < kStates; ++i) {
    // A state covers the range halfway to its neighbours.
    const double fraction = (ability_of(i) - ability) / kStep + 0.5;
    above += probability_[i] * std::clamp(fraction, 0.0, 1.0);
  }
  return std::min(1.0, above);
}

void SkillBelief::observe(const SkillParameters& parameters, double difficulty, const Distribution& others,
                          bool done) {
  const Distribution success = success_with(success_by_ability(parameters, difficulty), others);
  double all = 0;
  for (std::size_t i = 0; i < kStates; ++i) all += probability_[i] *= done ? success[i] : 1 - success[i];
  const double learns = done ? parameters.learns_done : parameters.learns_failed;
  double from_below = 0;
  for (std::size_t i = 0; i < kStates; ++i) {
    const double probability = probability_[i] / all;
    const double leaves = i + 1 < kStates ? learns * probability : 0;
    probability_[i] = probability - leaves + from_below;
    from_below = leaves;
  }
}

const SkillBelief& Skills::belief(const std::string& skill) const {
  const auto found = beliefs_.find(skill);
  return found == beliefs_.end() ? unseen_ : found->second;
}

/// The weakest of all skills except `without` (beyond the last: of all); of none the highest state.
Distribution Skills::weakest(const std::vector<std::string>& skills, std::size_t without) const {
  Distribution at_least;
  at_least.fill(1);
  for (std::size_t s = 0; s < skills.size(); ++s) {
    if (s == without) continue;
    const Distribution& ability = belief(skills[s]).ability();
    double sum = 0;
    for (std::size_t i = kStates; i-- > 0;) at_least[i] *= std::min(1.0, sum += ability[i]);
  }
  for (std::size_t i = 0; i + 1 < kStates; ++i) at_least[i] -= at_least[i + 1];
  return at_least;
}

double Skills::success(const std::vector<std::string>& skills, double difficulty) const {
  const Distribution ability = weakest(skills, skills.size());
  const Distribution success = success_by_ability(parameters_, difficulty);
  return std::inner_product(ability.begin(), ability.end(), success.begin(), 0.0);
}

void Skills::observe(const std::vector<std::string>& skills, double difficulty, bool done) {
  // All updates use the estimates before this task.
  std::vector<Distribution> others;
  for (std::size_t i = 0; i < skills.size(); ++i) others.push_back(weakest(skills, i));
  for (std::size_t i = 0; i < skills.size(); ++i)
    beliefs_.try_emplace(skills[i], unseen_).first->second.observe(parameters_, difficulty, others[i], done);
}

}  // namespace parhelion::training
