// `batch` over many copies of one synthetic session of ten minutes: events, the world at 30 Hz, input and
// output scans at 10 Hz. Arguments: sessions (1000), threads (2).
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>

#include "server/runtime/grade_batch.hpp"
#include "tests/server/tick/graded_log.hpp"
#include "tests/temporary_folder.hpp"

namespace parhelion {
namespace {

double peak_megabytes() {
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  return static_cast<double>(used.ru_maxrss) / 1024;
}

/// One file and hard links to it: after the first session the input is in memory.
std::vector<std::string> make_sessions(const test::TemporaryFolder& folder, std::size_t count) {
  constexpr double kDuration = 600;
  auto log = test::lesson(1, 3, true, static_cast<int>(30 * kDuration));
  const Message end = log.back();
  log.pop_back();
  for (int i = 0; i < 10 * static_cast<int>(kDuration); ++i)
    for (const char* channel : {channel::kScan, channel::kMrScan})
      log.push_back(
          test::message(channel, test::kStartUs + 3'000'000 + 100'000LL * i, test::scan_at(0.1 * i)));
  std::stable_sort(log.begin() + 1, log.end(),
                   [](const Message& a, const Message& b) { return a.arrival < b.arrival; });
  log.push_back(end);
  const std::string first = folder / "0000.lcm";
  test::write_log(first, log);
  for (std::size_t i = 1; i < count; ++i) {
    char name[32];
    std::snprintf(name, sizeof name, "%04zu.lcm", i);
    std::filesystem::create_hard_link(first, folder / name);
  }
  std::printf("one session: %zu messages, %.1f MB\n", log.size(),
              static_cast<double>(std::filesystem::file_size(first)) / 1e6);
  return *runtime::session_logs({folder / ""});
}

double run(const std::vector<std::string>& logs, unsigned threads) {
  const auto begin = std::chrono::steady_clock::now();
  const auto rows = runtime::grade_batch(logs, threads);
  const double took = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  for (const runtime::BatchRow& row : rows)
    if (!row.error.empty()) std::printf("%s\n", row.error.c_str());
  std::printf("%zu sessions, %u threads: %.2f s, %.1f ms each; at most %.1f MB\n", logs.size(), threads, took,
              1000 * took / static_cast<double>(logs.size()), peak_megabytes());
  return took;
}

}  // namespace
}  // namespace parhelion

int main(int argc, char** argv) {
  using namespace parhelion;
  const std::size_t count = argc > 1 ? static_cast<std::size_t>(std::atoi(argv[1])) : 1000;
  const unsigned threads = argc > 2 ? static_cast<unsigned>(std::atoi(argv[2])) : 2;
  const test::TemporaryFolder folder;
  const auto logs = make_sessions(folder, count);
  const std::vector<std::string> few(logs.begin(),
                                     logs.begin() + static_cast<long>(std::min<std::size_t>(50, count)));
  const double one = run(few, 1);
  std::printf("%u threads: %.2f times as fast as one\n", threads, one / run(few, threads));
  run(logs, threads);
}
