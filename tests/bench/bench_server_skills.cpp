// The choice of the next task, judged on simulated learners: tasks until mastery compared with the fixed
// order, and the prediction error. Arguments: seed (1), learners a group (1000).
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "tests/server/training/simulated_learner.hpp"

namespace parhelion {
namespace {

struct Group {
  const char* name;
  test::Population population;
  double spread;  ///< of true difficulties around the fixed order's
};

void judge(const Group& group, unsigned seed, int learners, int before) {
  double chosen = 0, fixed = 0, complete = 0, confidence = 0, truly = 0, fixed_complete = 0;
  int claimed = 0;
  test::Calibration calibration;
  std::vector<test::Curriculum> curricula;  // one for each tenth of the learners
  std::vector<training::SkillParameters> parameters;
  for (unsigned i = 0; i < 10; ++i) {
    test::Curriculum& curriculum = curricula.emplace_back(seed * 1000 + i, group.spread);
    const auto others = history(curriculum, group.population, seed * 7'000'003ULL + i * 1000, before);
    parameters.push_back(training::fit_parameters(curriculum.offers, others));
    training::fit_difficulties(curriculum.offers, others, parameters.back());
  }
  for (int i = 0; i < learners; ++i) {
    const std::size_t tenth = static_cast<std::size_t>(i) % 10;
    const test::Curriculum& curriculum = curricula[tenth];
    const std::uint64_t own = seed * 1'000'003ULL + static_cast<std::uint64_t>(i);
    const auto a =
        run_course(curriculum, group.population, own, test::Order::chosen, parameters[tenth], &calibration);
    const auto b = run_course(curriculum, group.population, own, test::Order::repeated, parameters[tenth]);
    chosen += a.until_mastered;
    fixed += b.until_mastered;
    complete += a.until_complete;
    fixed_complete += b.until_complete;
    if (a.confidence == 0) continue;
    ++claimed;
    confidence += a.confidence;
    truly += a.truly ? 1 : 0;
  }
  const double n = learners;
  std::printf(
      "%-16s mastered after %6.1f tasks, in the fixed order %6.1f: %4.1f %% fewer; calibration error "
      "%.3f\n",
      group.name, chosen / n, fixed / n, 100 * (1 - chosen / fixed), calibration.error());
  std::printf(
      "%-16s said to be complete after %6.1f (of the fixed order %6.1f; %d of %d learners) with %.3f, true "
      "for %.3f\n",
      "", complete / n, fixed_complete / n, claimed, learners, confidence / std::max(1, claimed),
      truly / std::max(1, claimed));
  if (std::getenv("BINS"))
    for (int i = 0; i < 10; ++i)
      std::printf("  %d: %.3f %.3f\n", calibration.count[i], calibration.claimed[i] / calibration.count[i],
                  calibration.came[i] / calibration.count[i]);
}

}  // namespace
}  // namespace parhelion

int main(int argc, char** argv) {
  const unsigned seed = argc > 1 ? static_cast<unsigned>(std::atoi(argv[1])) : 1;
  const int learners = argc > 2 ? std::atoi(argv[2]) : 1000;
  const int before = argc > 3 ? std::atoi(argv[3]) : 30;
  std::printf("seed %u, %d learners a group, difficulties by %d others\n", seed, learners, before);
  using parhelion::test::Population;
  const parhelion::Group groups[] = {{"usual", Population{}, 0.3},
                                     {"quick", Population{.rate = 0.7}, 0.3},
                                     {"slow", Population{.rate = 0.2}, 0.3},
                                     {"forgetful", Population{.forgets = 0.012}, 0.3},
                                     {"skilled", Population{.ability = 0.5}, 0.3},
                                     {"uneven", Population{.ability_spread = 0.5, .own_spread = 1.8}, 0.3},
                                     {"badly ordered", Population{}, 0.6}};
  for (const parhelion::Group& group : groups) parhelion::judge(group, seed, learners, before);
}
