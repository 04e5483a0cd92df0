#include "server/training/next_task.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

namespace parhelion::training {
namespace {

struct Need {
  std::string skill;
  double mastered;  ///< probability
};

std::string percent(double fraction) {
  // 100 % is never shown.
  const int rounded = static_cast<int>(std::floor(100 * fraction + 0.5));
  return std::to_string(std::min(rounded, fraction < 1 ? 99 : 100)) + " %";
}

std::vector<Need> needs_of(const Skills& skills, const std::vector<TaskOffer>& offers,
                           const SkillParameters& parameters, const ChoiceParameters& choice) {
  std::set<std::string> names;
  for (const TaskOffer& offer : offers) names.insert(offer.skills.begin(), offer.skills.end());
  std::vector<Need> needs;
  for (const std::string& name : names)
    needs.push_back({name, skills.belief(name).at_least(mastery_ability(offers, name, parameters, choice))});
  return needs;
}

double mastered(const std::vector<Need>& needs, const std::string& skill) {
  for (const Need& need : needs)
    if (need.skill == skill) return need.mastered;
  return 1;
}

const std::string& neediest(const std::vector<Need>& needs, const TaskOffer& offer) {
  return *std::min_element(offer.skills.begin(), offer.skills.end(), [&](const auto& a, const auto& b) {
    return mastered(needs, a) < mastered(needs, b);
  });
}

double promise(const std::vector<Need>& needs, const TaskOffer& offer, double chance,
               const ChoiceParameters& choice) {
  double wanted = 0;
  for (const std::string& skill : offer.skills) wanted += 1 - mastered(needs, skill);
  const double off = (chance - choice.best_chance) / 0.3;
  return wanted * std::exp(-off * off);
}

NextTask complete(const std::vector<Need>& needs, double confidence) {
  const auto weakest = std::min_element(needs.begin(), needs.end(),
                                        [](const Need& a, const Need& b) { return a.mastered < b.mastered; });
  NextTask next;
  next.kind = NextTask::Kind::complete;
  next.confidence = confidence;
  next.reason = "Training is complete: all " + std::to_string(needs.size()) +
                " skills are mastered with a probability of " + percent(confidence) +
                ", the least certain being " + weakest->skill + " with " + percent(weakest->mastered) + ".";
  return next;
}

/// The highest probability of success among the offers of `level` that train `skill`; negative: none.
double best_chance(const Skills& skills, const std::vector<TaskOffer>& offers, int level,
                   const std::string& skill) {
  double best = -1;
  for (const TaskOffer& offer : offers)
    if (offer.level == level && std::count(offer.skills.begin(), offer.skills.end(), skill) > 0)
      best = std::max(best, skills.success(offer.skills, offer.difficulty));
  return best;
}

void explain(NextTask& next, const TaskOffer& offer, const std::vector<Need>& needs, double at_level,
             int level) {
  const std::string& skill = neediest(needs, offer);
  const std::string task = "'" + offer.name + "'" + (offer.scenario.empty() ? "" : " of " + offer.scenario);
  if (next.kind == NextTask::Kind::step_back) {
    next.reason = "Step back to level " + std::to_string(offer.level) + ": " + skill + " at level " +
                  std::to_string(level) + " would succeed with only " + percent(at_level) + ", " + task +
                  " with " + percent(next.chance) + ".";
  } else {
    next.reason = task + " trains " + skill + ", which is mastered with a probability of " +
                  percent(mastered(needs, skill)) + ", and should succeed with " + percent(next.chance) + ".";
  }
}

double log_likelihood(const std::vector<TaskOffer>& offers, const std::vector<std::vector<Attempt>>& trainees,
                      const SkillParameters& parameters) {
  double sum = 0;
  for (const auto& attempts : trainees) {
    Skills skills(parameters);
    for (const Attempt& attempt : attempts) {
      const TaskOffer& offer = offers[attempt.offer];
      if (offer.skills.empty()) continue;
      const double chance = skills.success(offer.skills, offer.difficulty);
      sum += std::log(attempt.done ? chance : 1 - chance);
      skills.observe(offer.skills, offer.difficulty, attempt.done);
    }
  }
  return sum;
}

}  // namespace

void rank_difficulties(std::vector<TaskOffer>& offers) {
  constexpr double kEasiest = -1.5, kHardest = 1.5;
  const double last = std::max<double>(1, static_cast<double>(offers.size()) - 1);
  for (std::size_t i = 0; i < offers.size(); ++i)
    offers[i].difficulty = kEasiest + (kHardest - kEasiest) * static_cast<double>(i) / last;
}

SkillParameters fit_parameters(const std::vector<TaskOffer>& offers,
                               const std::vector<std::vector<Attempt>>& trainees) {
  SkillParameters best;
  double likeliest = -std::numeric_limits<double>::infinity();
  const SkillParameters usual;
  for (const double mean : {-1.0, -0.5, 0.0, 0.5, 1.0, -1.5, -2.0, -2.5}) {
    for (const double pace : {1.0, 0.5, 2.0}) {
      SkillParameters tried;
      tried.prior_mean = mean;
      tried.learns_done = pace * usual.learns_done;
      tried.learns_failed = pace * usual.learns_failed;
      const double likelihood = log_likelihood(offers, trainees, tried);
      if (likelihood <= likeliest) continue;
      likeliest = likelihood;
      best = tried;
    }
  }
  return best;
}

void fit_difficulties(std::vector<TaskOffer>& offers, const std::vector<std::vector<Attempt>>& trainees,
                      const SkillParameters& parameters) {
  constexpr double kUncertainty = 0.3, kSettling = 0.05;
  constexpr int kTries = 5;
  std::vector<int> answers(offers.size());
  for (const auto& attempts : trainees) {
    Skills skills(parameters);
    std::vector<int> tries(offers.size());
    for (const Attempt& attempt : attempts) {
      TaskOffer& offer = offers[attempt.offer];
      if (offer.skills.empty()) continue;
      const double chance = skills.success(offer.skills, offer.difficulty);
      skills.observe(offer.skills, offer.difficulty, attempt.done);
      if (tries[attempt.offer]++ >= kTries) continue;
      offer.difficulty +=
          kUncertainty / (1 + kSettling * answers[attempt.offer]++) * (chance - (attempt.done ? 1 : 0));
      offer.difficulty = std::clamp(offer.difficulty, SkillBelief::kLowest, -SkillBelief::kLowest);
    }
  }
}

double mastery_ability(const std::vector<TaskOffer>& offers, const std::string& skill,
                       const SkillParameters& skills, const ChoiceParameters& choice) {
  double hardest = -std::numeric_limits<double>::infinity();
  for (const TaskOffer& offer : offers)
    if (std::count(offer.skills.begin(), offer.skills.end(), skill) > 0)
      hardest = std::max(hardest, offer.difficulty);
  const double known = (choice.able - skills.guess) / (1 - skills.guess - skills.slip);
  return hardest + std::log(known / (1 - known)) / skills.slope;
}

NextTask next_task(const Skills& skills, const std::vector<TaskOffer>& offers, int level,
                   const SkillParameters& parameters, const ChoiceParameters& choice) {
  const auto needs = needs_of(skills, offers, parameters, choice);
  double confidence = 1;
  for (const Need& need : needs) confidence *= need.mastered;
  if (confidence >= choice.confidence) return complete(needs, confidence);
  NextTask next;
  next.confidence = confidence;
  double best = -1;
  for (std::size_t i = 0; i < offers.size(); ++i) {
    if (offers[i].skills.empty()) continue;
    const double chance = skills.success(offers[i].skills, offers[i].difficulty);
    const double promised = promise(needs, offers[i], chance, choice);
    if (promised <= best) continue;
    best = promised;
    next.offer = i;
    next.chance = chance;
  }
  const TaskOffer& offer = offers[next.offer];
  const double at_level = best_chance(skills, offers, level, neediest(needs, offer));
  if (offer.level < level && at_level >= 0 && at_level < choice.too_hard)
    next.kind = NextTask::Kind::step_back;
  explain(next, offer, needs, at_level, level);
  return next;
}

}  // namespace parhelion::training
