// Reading a 3D scan of a million points from each format: bytes of the file per second.
#include <benchmark/benchmark.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <random>

#include "fusion/cloud/read_cloud.hpp"
#include "fusion/cloud/write_cloud.hpp"

namespace parhelion {
namespace {

constexpr std::size_t kCount = 1'000'000;

cloud::PointCloud<Scanner> room() {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> metres(-10, 10);
  cloud::PointCloud<Scanner> cloud;
  for (std::size_t i = 0; i < kCount; ++i) {
    cloud.points.emplace_back(metres(random), metres(random), metres(random) / 7);
  }
  return cloud;
}

/// The cloud in a file with this extension; removed at the end.
class File {
 public:
  explicit File(const std::string& extension)
      : path_(std::filesystem::temp_directory_path() /
              ("parhelion-bench-" + std::to_string(::getpid()) + extension)) {
    const cloud::PointCloud<Scanner> cloud = room();
    if (extension == ".ply") written_ = cloud::write_ply(path_, cloud).ok();
    if (extension == ".pcd") written_ = cloud::write_pcd(path_, cloud).ok();
    if (extension != ".xyz") return;
    std::FILE* file = std::fopen(path_.c_str(), "w");
    if (file == nullptr) return;
    for (const Eigen::Vector3f& p : cloud.points) {
      std::fprintf(file, "%.4f %.4f %.4f\n", static_cast<double>(p.x()), static_cast<double>(p.y()),
                   static_cast<double>(p.z()));
    }
    written_ = std::fclose(file) == 0;
  }
  ~File() { std::filesystem::remove(path_); }
  const std::filesystem::path& path() const { return path_; }
  bool written() const { return written_; }

 private:
  std::filesystem::path path_;
  bool written_ = false;
};

void read(benchmark::State& state, const std::string& path) {
  std::size_t points = 0;
  for (auto _ : state) {
    const auto scan = cloud::read_scan(path);
    if (!scan) return state.SkipWithError(scan.error().message.c_str());
    points = scan->cloud.size();
    benchmark::DoNotOptimize(scan->cloud.points.data());
  }
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(std::filesystem::file_size(path)));
  state.counters["points"] = static_cast<double>(points);
}

void written_file(benchmark::State& state, const std::string& extension) {
  const File file(extension);
  if (!file.written()) return state.SkipWithError("no room for the file");
  read(state, file.path());
}

void recording(benchmark::State& state, const std::string& relative) {
  const std::filesystem::path path = std::filesystem::path(PARHELION_DATA_DIR) / relative;
  if (!std::filesystem::exists(path)) return state.SkipWithError("the recording is not here");
  read(state, path);
}

BENCHMARK_CAPTURE(written_file, ply_binary, ".ply")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(written_file, pcd_binary, ".pcd")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(written_file, xyz_text, ".xyz")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(recording, pcd_compressed, "3d-room-scan/room_scan1.pcd")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(recording, uos_3d, "3d-3dtk-corridor/scan000.3d")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace parhelion

BENCHMARK_MAIN();
