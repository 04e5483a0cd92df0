// Chooses a trainee's next task.
#pragma once

#include <string>
#include <vector>

#include "server/training/skills.hpp"

namespace parhelion::training {

/// A task to choose from.
struct TaskOffer {
  std::string scenario, name;
  std::vector<std::string> skills;  ///< none: never chosen
  int level = 1;                    ///< 1 to 3
  double difficulty = 0;            ///< on the same scale as abilities
};

/// Difficulties for offers in rising order, as in programmes: evenly from -1.5 to 1.5.
void rank_difficulties(std::vector<TaskOffer>& offers);

/// A task attempted by a trainee of the group, in the order of attempts.
struct Attempt {
  std::size_t offer = 0;
  bool done = false;
};
/// Prior for a new trainee: the mean ability and learning rates with the maximum likelihood for the group's
/// attempts (empirical Bayes over a grid).
SkillParameters fit_parameters(const std::vector<TaskOffer>& offers,
                               const std::vector<std::vector<Attempt>>& trainees);

/// Corrects difficulties from other trainees' results: Elo's rule d += u(n) (P(success) - done) with the
/// uncertainty u(n) = a / (1 + b n) after n answers (Pelanek 2016, equations 2 and 4; a = 0.3, b = 0.05).
/// Only each trainee's first five tries at a task count, to limit the weight of one trainee.
void fit_difficulties(std::vector<TaskOffer>& offers, const std::vector<std::vector<Attempt>>& trainees,
                      const SkillParameters& parameters = {});

struct ChoiceParameters {
  double able = 0.75;       ///< a skill is mastered if it gives this success rate at its hardest tasks
  double confidence = 0.9;  ///< complete: the probability that all skills are mastered is at least this
  double best_chance =
      0.5;                 ///< success probability with the highest learning gain: neither easy nor hopeless
  double too_hard = 0.25;  ///< below this best probability at a level, go back one level
};

struct NextTask {
  enum class Kind { task, step_back, complete };
  Kind kind = Kind::task;
  std::size_t offer = 0;  ///< index into the offers; not set if complete
  double chance = 0;      ///< expected probability of success
  double confidence = 0;  ///< probability that all skills are mastered
  std::string reason;     ///< one sentence
};

/// The ability at which `skill` counts as mastered, given its hardest offer.
double mastery_ability(const std::vector<TaskOffer>& offers, const std::string& skill,
                       const SkillParameters& skills, const ChoiceParameters& choice);

/// Chooses the offer with the highest gain: sum over its skills of the probability that the skill is not
/// mastered, weighted by how close the probability of success is to best_chance; the first of equals.
/// `level`: that of the trainee's newest task (1 at the beginning). At least one of `offers` must have a
/// skill.
NextTask next_task(const Skills& skills, const std::vector<TaskOffer>& offers, int level,
                   const SkillParameters& parameters = {}, const ChoiceParameters& choice = {});

}  // namespace parhelion::training
