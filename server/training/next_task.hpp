// What a trainee should do next.
#pragma once

#include <string>
#include <vector>

#include "server/training/skills.hpp"

namespace parhelion::training {

/// A task that may be given.
struct TaskOffer {
  std::string scenario, name;
  std::vector<std::string> skills;  ///< none: it is never chosen
  int level = 1;                    ///< 1 to 3
  double difficulty = 0;            ///< on the scale of the abilities
};

/// Difficulties for offers that stand in rising order, as programmes do: evenly from -1.5 to 1.5.
void rank_difficulties(std::vector<TaskOffer>& offers);

/// A task that a trainee of the group has had, in the order in which they had them.
struct Attempt {
  std::size_t offer = 0;
  bool done = false;
};
/// What is believed of who was never seen: the mean ability and the pace of learning under which the group's
/// attempts are likeliest (empirical Bayes over a grid).
SkillParameters fit_parameters(const std::vector<TaskOffer>& offers,
                               const std::vector<std::vector<Attempt>>& trainees);

/// Corrects difficulties by how others fared: Elo's rule d += u(n) (P(success) - done) with the uncertainty
/// u(n) = a / (1 + b n) after n answers (Pelanek 2016, equations 2 and 4; a = 0.3, b = 0.05), of each trainee
/// the first five tries at a task: who needs many would else speak for many.
void fit_difficulties(std::vector<TaskOffer>& offers, const std::vector<std::vector<Attempt>>& trainees,
                      const SkillParameters& parameters = {});

struct ChoiceParameters {
  double able = 0.75;        ///< a skill is mastered that makes this share of its hardest tasks a success
  double confidence = 0.9;   ///< complete: that all skills are mastered has at least this probability
  double best_chance = 0.5;  ///< of success: most is learnt where a task is neither easy nor hopeless
  double too_hard = 0.25;    ///< below this chance on the best of a level one steps back to the one below
};

struct NextTask {
  enum class Kind { task, step_back, complete };
  Kind kind = Kind::task;
  std::size_t offer = 0;  ///< index into the offers; not set where complete
  double chance = 0;      ///< expected share of successes
  double confidence = 0;  ///< probability that all skills are mastered
  std::string reason;     ///< one sentence
};

/// The ability from which on `skill` counts as mastered, given its hardest offer.
double mastery_ability(const std::vector<TaskOffer>& offers, const std::string& skill,
                       const SkillParameters& skills, const ChoiceParameters& choice);

/// Chooses the offer that promises most: sum over its skills of the probability that the skill is not
/// mastered, weighted by how near the chance of success is to best_chance; the first where several promise
/// the same. `level`: that of the trainee's newest task (1 at the beginning). `offers` has at least one with
/// a skill.
NextTask next_task(const Skills& skills, const std::vector<TaskOffer>& offers, int level,
                   const SkillParameters& parameters = {}, const ChoiceParameters& choice = {});

}  // namespace parhelion::training
