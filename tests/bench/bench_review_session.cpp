// An hour of session converted to its page: MR_WORLD at 30 Hz, scans at 10 Hz, commands at 15 Hz, with and
// without pictures of 640 x 480 at 15 Hz. The log is in the page cache.
#include <benchmark/benchmark.h>

#include "server/review/page.hpp"
#include "tests/server/review/written_session.hpp"
#include "tests/temporary_folder.hpp"

namespace parhelion {
namespace {

void hour(benchmark::State& state) {
  test::WrittenSession session;
  session.seconds = 3600;
  session.agents = 5;
  session.pictures = state.range(0) != 0;
  session.picture_width = 640;
  session.touches.clear();
  for (int i = 0; i < 120; ++i) session.touches.push_back(10 + 29.0 * i);
  const test::TemporaryFolder folder;
  session.write(folder / "hour.lcm");
  std::size_t bytes = 0;
  for (auto _ : state) {
    auto review = review::review_session(folder / "hour.lcm");
    if (!review) return state.SkipWithError(review.error().message.c_str());
    bytes = review::to_html({{std::move(*review)}, {}, {}}).size();
  }
  state.counters["log_MB"] = static_cast<double>(std::filesystem::file_size(folder / "hour.lcm")) / 1e6;
  state.counters["page_MB"] = static_cast<double>(bytes) / 1e6;
}
BENCHMARK(hour)->ArgName("pictures")->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond)->Iterations(3);

}  // namespace
}  // namespace parhelion

BENCHMARK_MAIN();
