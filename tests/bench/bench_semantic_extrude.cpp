// Extruding a scanned building: time, and how well the boxes represent the cells.
#include <benchmark/benchmark.h>

#include "fusion/semantic/grid/extrude.hpp"
#include "tests/fusion/semantic/rooms.hpp"

namespace parhelion {
namespace {

pose::GridMap floor_of_rooms(int rooms, double sigma) {
  std::vector<test::Wall> walls;
  std::vector<Eigen::Vector2d> places;
  const double length = 4.0 * rooms;
  for (const double y : {0.0, 10.0}) walls.push_back({{0, y}, {length, y}});
  for (const double x : {0.0, length}) walls.push_back({{x, 0}, {x, 10}});
  for (int room = 0; room < rooms; ++room) {
    const double x = 4.0 * room;
    walls.push_back({{x, 4}, {x + 1.2, 4}});
    walls.push_back({{x + 2.1, 4}, {x + 4, 4}});
    walls.push_back({{x, 0}, {x, 4}});
    places.insert(places.end(), {{x + 1.5, 2}, {x + 2, 6}, {x + 3.5, 8}});
  }
  return test::scanned_map(walls, places, length + 3, 14, sigma, 1);
}

void extrude_floor(benchmark::State& state) {
  const pose::GridMap map = floor_of_rooms(static_cast<int>(state.range(0)), 0.02);
  Result<SemanticModel> model = SemanticModel();
  for (auto _ : state) model = semantic::extrude(map, {});
  const auto figures = semantic::measure_extrusion(map, *model, {});
  state.counters["cells"] = static_cast<double>(figures.occupied_cells);
  state.counters["covered"] =
      static_cast<double>(figures.covered_cells) / static_cast<double>(figures.occupied_cells);
  state.counters["over_free"] = figures.box_area_over_free / figures.box_area;
  state.counters["walls"] = static_cast<double>(figures.walls);
  state.counters["blocks"] = static_cast<double>(figures.unknown);
}
BENCHMARK(extrude_floor)->Arg(5)->Arg(25)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace parhelion

BENCHMARK_MAIN();
