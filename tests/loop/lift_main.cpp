// Scripted lifts by the example robot's arm at level 3: parhelion_lift [COUNT [FIRST SEED]]. One line a lift,
// with what was not as it must be; the last line counts those without.
#include <cstdio>
#include <cstdlib>

#include "tests/loop/lift.hpp"

int main(int argc, char** argv) {
  using namespace parhelion::test;
  const int count = argc > 1 ? std::atoi(argv[1]) : 20, first = argc > 2 ? std::atoi(argv[2]) : 201;
  int right = 0, placed = 0;
  for (int seed = first; seed < first + count; ++seed) {
    const LiftReport report =
        lift_and_place(static_cast<std::uint64_t>(seed), seed % 2 == 0 ? LiftBy::trainee : LiftBy::robot);
    std::printf("%s: %s, score %.0f\n", report.thing.c_str(), report.phase.c_str(), report.live.score);
    for (const std::string& failure : report.failures) std::printf("  %s\n", failure.c_str());
    right += report.failures.empty() ? 1 : 0;
    placed += report.live.score >= 100 ? 1 : 0;
  }
  std::printf("%d of %d as they must be; %d of %d placed\n", right, count, placed, count);
  return right == count ? 0 : 1;
}
