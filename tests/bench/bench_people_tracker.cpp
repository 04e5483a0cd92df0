// Cost of tracking people in one scan.
#include <benchmark/benchmark.h>

#include "fusion/people/people_tracker.hpp"
#include "tests/fusion/people/crowd_score.hpp"

namespace parhelion {
namespace {

/// Walkers and chairs; beams.
void track_people(benchmark::State& state) {
  test::CrowdOptions options;
  options.walkers = static_cast<int>(state.range(0));
  options.chairs = static_cast<int>(state.range(1));
  options.room = options.walkers > 50 ? 40 : 15;
  options.laser.range_max = 40;
  options.duration = 10;
  options.laser.beams = static_cast<int>(state.range(2));
  const test::Crowd crowd = make_crowd(options);
  people::PeopleTracker tracker;
  std::size_t k = 0;
  std::int64_t turns = 0, tracks = 0;
  for (auto _ : state) {
    people::LaserSweep sweep = test::sweep_of(crowd, crowd.scans[k]);
    sweep.stamp = sweep.stamp + seconds(static_cast<double>(10 * turns));
    benchmark::DoNotOptimize(tracker.update(sweep));
    tracks += static_cast<std::int64_t>(tracker.tracks().size());
    if (++k == crowd.scans.size()) k = 0, ++turns;
  }
  state.counters["tracks"] = static_cast<double>(tracks) / static_cast<double>(state.iterations());
}
BENCHMARK(track_people)
    ->Args({5, 6, 361})
    ->Args({5, 6, 720})
    ->Args({10, 15, 1081})
    ->Args({200, 0, 1081})
    ->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace parhelion
BENCHMARK_MAIN();
