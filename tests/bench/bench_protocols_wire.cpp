// Time for a message and for an event of a log.
#include <benchmark/benchmark.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>

#include "protocols/bus/log_file.hpp"
#include "protocols/codec.hpp"

namespace parhelion {
namespace {

Scan scan_of(std::size_t beams) {
  Scan scan;
  scan.stamp = SensorTime::from_utime(1);
  scan.ranges.assign(beams, 3.25F);
  scan.angle_increment = 0.005F;
  return scan;
}

void encode_scan(benchmark::State& state) {
  const Scan scan = scan_of(static_cast<std::size_t>(state.range(0)));
  std::vector<std::uint8_t> bytes;
  for (auto _ : state) {
    encode(scan, bytes);
    benchmark::DoNotOptimize(bytes.data());
  }
}
BENCHMARK(encode_scan)->Arg(361)->Arg(1081);

void decode_scan(benchmark::State& state) {
  std::vector<std::uint8_t> bytes;
  encode(scan_of(static_cast<std::size_t>(state.range(0))), bytes);
  Scan scan;
  for (auto _ : state) {
    if (!decode("SCAN", bytes, scan)) state.SkipWithError("refused");
    benchmark::DoNotOptimize(scan.ranges.data());
  }
}
BENCHMARK(decode_scan)->Arg(361)->Arg(1081);

/// A log of 256 MB in memory, of scans or of images.
void read_log(benchmark::State& state) {
  const auto size = static_cast<std::size_t>(state.range(0));
  const std::string path = "/dev/shm/parhelion-bench-" + std::to_string(getpid());
  const std::vector<std::uint8_t> payload(size, 7);
  {
    auto writer = LogWriter::create(path, true);
    if (!writer) return state.SkipWithError(writer.error().message.c_str());
    for (std::size_t written = 0; written < 256'000'000; written += size) {
      if (!writer->write("SCAN", {}, payload)) return state.SkipWithError("cannot write the log");
    }
  }
  std::int64_t bytes = 0;
  for (auto _ : state) {
    auto reader = LogReader::open(path);
    while (true) {
      const auto event = reader->next();
      if (!event || !event->has_value()) break;
      bytes += static_cast<std::int64_t>((*event)->payload.size());
    }
  }
  state.SetBytesProcessed(bytes);
  std::filesystem::remove(path);
}
BENCHMARK(read_log)->Arg(1'476)->Arg(300'000)->Unit(benchmark::kMillisecond);

void write_log(benchmark::State& state) {
  const std::string path = "/dev/shm/parhelion-bench-" + std::to_string(getpid());
  const std::vector<std::uint8_t> payload(static_cast<std::size_t>(state.range(0)), 7);
  auto writer = LogWriter::create(path, true);
  if (!writer) return state.SkipWithError(writer.error().message.c_str());
  for (auto _ : state) {
    if (!writer->write("SCAN", {}, payload)) return state.SkipWithError("cannot write the log");
  }
  state.SetBytesProcessed(state.iterations() * state.range(0));
  std::filesystem::remove(path);
}
BENCHMARK(write_log)->Arg(1'476)->Iterations(100'000);
BENCHMARK(write_log)->Arg(300'000)->Iterations(1'000);

}  // namespace
}  // namespace parhelion

BENCHMARK_MAIN();
