// Cost of tracking people in one scan.
#include <benchmark/benchmark.h>

#include "fusion/people/people_tracker.hpp"
#include "tests/fusion/people/crowd_score.hpp"
#include "tests/fusion/people/depth_room.hpp"

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

/// One slice of an image of 640x480 pixels, whatever is found in it afterwards.
void slice_depth(benchmark::State& state) {
  test::DepthRoomOptions options;
  options.duration = 0.2;
  const test::DepthRoom room = make_depth_room(options);
  const people::DepthView small = room.view(room.images.front());
  constexpr int kWidth = 640, kHeight = 480;
  std::vector<std::uint16_t> millimetres;
  std::vector<Eigen::Vector3f> directions;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const int from = y * small.height / kHeight * small.width + x * small.width / kWidth;
      millimetres.push_back(small.millimetres[static_cast<std::size_t>(from)]);
      directions.push_back(small.directions[static_cast<std::size_t>(from)]);
    }
  }
  people::DepthView view = small;
  view.width = kWidth, view.height = kHeight, view.millimetres = millimetres, view.directions = directions;
  people::DepthSlice slice;
  for (auto _ : state) benchmark::DoNotOptimize(slice.set(view));
}
BENCHMARK(slice_depth)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace parhelion
BENCHMARK_MAIN();
