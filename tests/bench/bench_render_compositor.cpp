// Frame in to frame out at 640x480 JPEG with ten visible robots (about 20,000 triangles at full detail), per
// stage; the same with a depth image; and the stand-in camera. Prints p50 and p99 in milliseconds.
#include <benchmark/benchmark.h>

#include <chrono>
#include <map>

#include "protocols/quantile.hpp"
#include "tests/render/scenes.hpp"

namespace parhelion {
namespace {

using namespace test;

SemanticModel corridor() {
  SemanticModel model;
  model.entities = {wall("left", 5, 2.2, 0, 16), wall("right", 5, -2.2, 0, 16),
                    wall("end", 13, 0, M_PI / 2, 5),
                    wall("pillar", 6.2, 0.2, 0.4, 0.4, 2.5, EntityLabel::pillar)};
  return model;
}

/// Ten robots with about 2,000 triangles each at close range.
render::RenderJob ten_robots() {
  World world;
  for (int i = 0; i < 10; ++i)
    world.add("robot " + std::to_string(i), robot_shapes(),
              Transform<Map, Body>::planar(1.6 + 0.5 * i, (i % 3 - 1) * 0.75, i));
  render::RenderJob job;
  job.camera = pinhole();
  job.T_map_optical = look({-0.6, 0, 1.1}, 0.02, 0.2);
  job.world = world.snapshot;
  auto camera = render::VirtualCamera::create(corridor());
  if (camera.ok()) job.image = (*camera)->render(job.camera, job.T_map_optical, {}, SensorTime{}, "");
  return job;
}

class Percentiles {
 public:
  void add(const std::string& stage, double milliseconds) { samples_[stage].push_back(milliseconds); }
  void report(benchmark::State& state) {
    for (auto& [stage, values] : samples_) {
      state.counters[stage + "_p50_ms"] = quantile(values, 0.5);
      state.counters[stage + "_p99_ms"] = quantile(values, 0.99);
    }
  }

 private:
  std::map<std::string, std::vector<double>> samples_;
};

void run(benchmark::State& state, const render::RenderJob& job) {
  auto compositor = render::Compositor::create(corridor());
  if (!compositor.ok()) return state.SkipWithError(compositor.error().message.c_str());
  (*compositor)->compose(job);  // shaders are compiled on first use
  Percentiles percentiles;
  for (auto _ : state) {
    const auto start = std::chrono::steady_clock::now();
    const render::RenderAnswer answer = (*compositor)->compose(job);
    const double all =
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    if (!answer.drawn) return state.SkipWithError(("nothing was drawn: " + answer.reason).c_str());
    percentiles.add("frame", all);
    percentiles.add("decode", 1e-3 * answer.timings.decode.microseconds());
    percentiles.add("draw", 1e-3 * answer.timings.draw.microseconds());
    percentiles.add("composite", 1e-3 * answer.timings.composite.microseconds());
    percentiles.add("encode", 1e-3 * answer.timings.encode.microseconds());
  }
  percentiles.report(state);
}

void ten_robots_jpeg(benchmark::State& state) { run(state, ten_robots()); }
BENCHMARK(ten_robots_jpeg)->Unit(benchmark::kMillisecond)->Iterations(300)->MeasureProcessCPUTime();

void ten_robots_with_distortion(benchmark::State& state) {
  render::RenderJob job = ten_robots();
  job.camera.intrinsics.distortion = {-0.3, 0.1, 0.001, -0.001, 0};
  run(state, job);
}
BENCHMARK(ten_robots_with_distortion)
    ->Unit(benchmark::kMillisecond)
    ->Iterations(200)
    ->MeasureProcessCPUTime();

void one_robot_with_depth(benchmark::State& state) {
  render::RenderJob job = robot_job(jpeg_image(), 2);
  job.depth = Image{};
  job.depth->width = 640, job.depth->height = 480;
  job.depth->format = PixelFormat::depth_mm;
  job.depth->row_stride = 1280;
  job.depth->metadata = {{"encoding", {'r', 'a', 'w'}}};
  for (int y = 0; y < 480; ++y)
    for (int x = 0; x < 640; ++x) {
      const int mm = x % 40 < 8 ? 0 : x % 40 < 20 ? 1500 : 3500;  // slats with gaps between them
      job.depth->bytes.push_back(static_cast<std::uint8_t>(mm & 255));
      job.depth->bytes.push_back(static_cast<std::uint8_t>(mm >> 8));
    }
  job.depth_camera.intrinsics = job.camera.intrinsics;
  job.depth_camera.range_min = 0.4, job.depth_camera.range_max = 8;
  job.T_map_depth = job.T_map_optical.as<Map, DepthOptical>();
  run(state, job);
}
BENCHMARK(one_robot_with_depth)->Unit(benchmark::kMillisecond)->Iterations(100)->MeasureProcessCPUTime();

void stand_in_camera(benchmark::State& state) {
  auto camera = render::VirtualCamera::create(corridor());
  if (!camera.ok()) return state.SkipWithError(camera.error().message.c_str());
  const render::RenderJob job = ten_robots();
  for (auto _ : state)
    benchmark::DoNotOptimize((*camera)->render(job.camera, job.T_map_optical, {}, SensorTime{}, "bench"));
}
BENCHMARK(stand_in_camera)->Unit(benchmark::kMillisecond)->Iterations(100)->MeasureProcessCPUTime();

}  // namespace
}  // namespace parhelion

BENCHMARK_MAIN();
