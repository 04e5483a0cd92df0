// Learners with known abilities, to evaluate the choice of tasks. They deliberately differ from the
// estimator's model: abilities are continuous and correlated within a person, success follows a normal curve
// (the estimator: independent discrete states, and a logistic curve), form varies from day to day, learning
// is stronger near the ability and for quick learners, skills without practice are forgotten, and tasks are
// harder or easier than their position in the order.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "server/training/next_task.hpp"

namespace parhelion::test {

/// Six skills at three levels, in rising order; true difficulties vary around those of the order.
struct Curriculum {
  std::vector<training::TaskOffer> offers;
  std::vector<double> true_difficulty;

  explicit Curriculum(unsigned seed, double spread = 0.3) {
    const std::vector<std::string> names{"driving", "doors", "stairs", "handling", "looking", "avoiding"};
    for (int level = 1; level <= 3; ++level) {
      for (std::size_t k = 0; k < names.size(); ++k) {
        offers.push_back({"programme " + std::to_string(level),
                          names[k] + " " + std::to_string(level),
                          {names[k]},
                          level,
                          0});
        if (k % 2 == 1)
          offers.push_back({"programme " + std::to_string(level),
                            names[k - 1] + " and " + names[k],
                            {names[k - 1], names[k]},
                            level,
                            0});
      }
    }
    training::rank_difficulties(offers);
    std::mt19937_64 random(seed);
    std::normal_distribution<double> off;  // times spread, which may be 0
    for (const training::TaskOffer& offer : offers)
      true_difficulty.push_back(offer.difficulty + spread * off(random));
  }
};

/// Parameters of a group of learners.
struct Population {
  double ability = -1, ability_spread = 1, own_spread = 1;  ///< at the beginning; spread over people, and
                                                            ///< over one person's skills
  double rate = 0.35, rate_spread = 0.4;                    ///< median gain per task; spread of its logarithm
  double forgets = 0.004;                                   ///< per task that does not practise it
  double form = 0.3;                                        ///< sigma of the day's form
};

class SimulatedLearner {
 public:
  SimulatedLearner(const Curriculum& curriculum, const Population& population, std::uint64_t seed)
      : curriculum_(curriculum), population_(population), random_(seed) {
    const double person = population.ability + population.ability_spread * normal_(random_);
    rate_ = population.rate * std::exp(population.rate_spread * normal_(random_));
    for (const training::TaskOffer& offer : curriculum.offers)
      for (const std::string& skill : offer.skills)
        if (ability_.emplace(skill, 0).second)
          ability_[skill] = person + population.own_spread * normal_(random_);
  }

  /// Attempts the task (and learns); returns whether it was a success.
  bool attempt(std::size_t task) {
    const training::TaskOffer& offer = curriculum_.offers[task];
    form_ = 0.8 * form_ + population_.form * 0.6 * normal_(random_);
    const bool done = uniform_(random_) < chance(task, form_);
    for (auto& [skill, ability] : ability_) {
      if (std::count(offer.skills.begin(), offer.skills.end(), skill) == 0) {
        ability -= population_.forgets;
        continue;
      }
      const double challenge = (curriculum_.true_difficulty[task] - ability) / 1.5;
      ability += rate_ * std::max(0.3, std::exp(-challenge * challenge)) * (done ? 1 : 0.7);
    }
    return done;
  }
  /// The hardest task of each skill would succeed with the probability `fraction`.
  bool mastered(double fraction) const {
    for (const auto& [skill, ability] : ability_) {
      double hardest = -10;
      for (std::size_t i = 0; i < curriculum_.offers.size(); ++i)
        if (curriculum_.offers[i].skills == std::vector<std::string>{skill})
          hardest = std::max(hardest, curriculum_.true_difficulty[i]);
      if (curve(ability - hardest) < fraction) return false;
    }
    return true;
  }

 private:
  static double curve(double over) { return 0.02 + 0.94 * 0.5 * std::erfc(-over / 1.6 / std::sqrt(2.0)); }
  double chance(std::size_t task, double form) const {
    double weakest = 10;
    for (const std::string& skill : curriculum_.offers[task].skills)
      weakest = std::min(weakest, ability_.at(skill));
    return curve(weakest + form - curriculum_.true_difficulty[task]);
  }

  const Curriculum& curriculum_;
  Population population_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  std::uniform_real_distribution<double> uniform_;
  std::map<std::string, double> ability_;
  double rate_ = 0, form_ = 0;
};

/// One learner's course, by choice or in the fixed order.
struct Course {
  int until_mastered = 0;  ///< tasks until truly mastered, or `max_tasks`
  int until_complete = 0;  ///< tasks until reported as complete, or `max_tasks`
  double confidence = 0;   ///< reported then
  bool truly = false;      ///< mastered at that time
};

struct Calibration {
  std::array<double, 10> claimed{}, came{};
  std::array<int, 10> count{};
  void add(double chance, bool done) {
    const auto bin = std::min<std::size_t>(9, static_cast<std::size_t>(chance * 10));
    claimed[bin] += chance;
    came[bin] += done ? 1 : 0;
    ++count[bin];
  }
  /// Expected calibration error: mean over all predictions of |predicted - observed| in their tenth.
  double error() const {
    double sum = 0;
    int all = 0;
    for (std::size_t i = 0; i < 10; ++i) {
      sum += std::abs(claimed[i] - came[i]);
      all += count[i];
    }
    return all == 0 ? 0 : sum / all;
  }
};

enum class Order {
  chosen,   ///< by next_task()
  repeated  ///< the fixed order: each task until it is completed, then the next, starting again after the
            ///< last last
};

/// Attempts of `learners` in the fixed order, at most `max_tasks` tasks each: used to learn difficulties.
inline std::vector<std::vector<training::Attempt>> history(const Curriculum& curriculum,
                                                           const Population& population, std::uint64_t seed,
                                                           int learners, int max_tasks = 150) {
  std::vector<std::vector<training::Attempt>> all;
  for (int i = 0; i < learners; ++i) {
    SimulatedLearner learner(curriculum, population, seed + static_cast<std::uint64_t>(i));
    auto& attempts = all.emplace_back();
    for (std::size_t place = 0; static_cast<int>(attempts.size()) < max_tasks;) {
      attempts.push_back({place, learner.attempt(place)});
      if (attempts.back().done) place = (place + 1) % curriculum.offers.size();
    }
  }
  return all;
}

inline Course run_course(const Curriculum& curriculum, const Population& population, std::uint64_t seed,
                         Order order, const training::SkillParameters& parameters = {},
                         Calibration* calibration = nullptr, int max_tasks = 600) {
  const training::ChoiceParameters choice;
  SimulatedLearner learner(curriculum, population, seed);
  training::Skills skills(parameters);
  Course course{max_tasks, max_tasks, 0, false};
  std::size_t place = 0;
  int level = 1;
  bool claimed = false, mastered = false;
  for (int tasks = 0; tasks < max_tasks && !(claimed && mastered); ++tasks) {
    const training::NextTask next = training::next_task(skills, curriculum.offers, level, parameters);
    if (!mastered && learner.mastered(choice.able)) {
      mastered = true;
      course.until_mastered = tasks;
    }
    if (!claimed && next.kind == training::NextTask::Kind::complete) {
      claimed = true;
      course.until_complete = tasks;
      course.confidence = next.confidence;
      course.truly = learner.mastered(choice.able);
    }
    // Learners wrongly reported as complete continue in the fixed order.
    const bool by_choice = order == Order::chosen && next.kind != training::NextTask::Kind::complete;
    const std::size_t task = by_choice ? next.offer : place;
    const training::TaskOffer& offer = curriculum.offers[task];
    const double chance = skills.success(offer.skills, offer.difficulty);
    const bool done = learner.attempt(task);
    if (calibration != nullptr && !claimed) calibration->add(chance, done);
    skills.observe(offer.skills, offer.difficulty, done);
    level = offer.level;
    if (!by_choice && done) place = (place + 1) % curriculum.offers.size();
  }
  return course;
}

}  // namespace parhelion::test
