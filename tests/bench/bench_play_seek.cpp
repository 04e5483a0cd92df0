// Opening a recorded session and seeking in it. bench_play_seek SESSION.lcm
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <random>
#include <vector>

#include "server/runtime/play/player.hpp"

int main(int argc, char** argv) {
  using namespace parhelion;
  using Clock = std::chrono::steady_clock;
  const auto milliseconds_since = [](Clock::time_point start) {
    return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
  };
  if (argc != 2) return std::fprintf(stderr, "usage: bench_play_seek SESSION.lcm\n"), 2;
  const auto start = Clock::now();
  auto recording = runtime::Recording::open(argv[1]);
  if (!recording) return std::fprintf(stderr, "%s\n", recording.error().message.c_str()), 1;
  std::printf("open: %zu messages, %.1f s, in %.1f ms\n", recording->size(), recording->duration(),
              milliseconds_since(start));
  std::size_t sent = 0;
  runtime::Player player(std::move(*recording), {.paused = true}, [&sent](const Message&) { ++sent; });
  std::mt19937 random(1);
  std::uniform_real_distribution<double> anywhere(0, player.recording().duration());
  std::vector<double> took;
  for (int i = 0; i < 500; ++i) {
    (void)player.seek(anywhere(random));
    const auto begun = Clock::now();
    if (!player.turn({1})) return 1;
    took.push_back(milliseconds_since(begun));
  }
  std::sort(took.begin(), took.end());
  std::printf("seek: p50 %.2f ms, p95 %.2f, max %.2f; %.0f messages each\n", took[250], took[475],
              took.back(), static_cast<double>(sent) / 500);
  return 0;
}
