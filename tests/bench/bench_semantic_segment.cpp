// Levelling and segmentation of tiled copies of a room: time and peak memory per million points.
// bench_semantic_segment [MILLIONS [THREADS]]
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <string>

#include "fusion/cloud/normals.hpp"
#include "fusion/cloud/read_cloud.hpp"
#include "fusion/semantic/segmentation/segmentation.hpp"
#include "tests/fusion/semantic/clouds.hpp"

namespace parhelion {
namespace {

/// The scan of a real room if available, else a synthetic one with a realistic amount of clutter.
std::vector<Eigen::Vector3f> one_room() {
  const std::filesystem::path real =
      std::filesystem::path(PARHELION_DATA_DIR) / "3d-room-scan/room_scan1.pcd";
  if (auto file = cloud::read_scan(real)) return std::move(file->cloud.points);
  std::printf("no %s: a synthetic room in its place\n", real.c_str());
  test::CloudSampler sampler(800, 0.01, 1);
  sampler.room({-2.6, -1.5}, {8, 3.1}, -1.3, 1.65);
  sampler.clutter({Eigen::Vector3d(-2, -1, -1.3), Eigen::Vector3d(3, 2, -0.3)}, 10'000);
  return sampler.cloud().points;
}

/// MiB, peak since `forget`.
double peak_memory(bool forget) {
  if (forget) std::ofstream("/proc/self/clear_refs") << "5";
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    double value = 0;
    if (word == "VmHWM:" && status >> value) return value / 1024;
  }
  return 0;
}

/// s of CPU time of all threads.
double cpu_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

double seconds(const auto& what) {
  const auto begin = std::chrono::steady_clock::now();
  what();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

void measure(const std::vector<Eigen::Vector3f>& room, std::size_t copies, int threads) {
  constexpr float apart = 25;  // m
  cloud::PointCloud<Map> site;
  site.points.reserve(room.size() * copies);
  const auto columns = static_cast<std::size_t>(std::ceil(std::sqrt(static_cast<double>(copies))));
  for (std::size_t c = 0; c < copies; ++c) {
    const Eigen::Vector3f offset(apart * static_cast<float>(c % columns),
                                 apart * static_cast<float>(c / columns), 0);
    for (const Eigen::Vector3f& p : room) site.points.push_back(p + offset);
  }
  const double millions = static_cast<double>(site.size()) / 1e6;
  const double cloud = static_cast<double>(site.size() * sizeof(Eigen::Vector3f)) / (1 << 20);
  const double before = peak_memory(true);
  semantic::SegmentationOptions options;
  options.threads = threads;
  std::size_t verticals = 0, horizontals = 0;
  const double cpu_before = cpu_seconds();
  const double took = seconds([&] {
    const auto found = semantic::segment(site, options);
    verticals = found->verticals.size();
    horizontals = found->horizontals.size();
  });
  const double cpu = cpu_seconds() - cpu_before;
  const double used = peak_memory(false) - before;
  std::printf(
      "%8.2f M points, %d threads: segment %7.3f s, %6.1f ms per million (%.1f of CPU); %7.0f MiB more than "
      "the cloud's "
      "%6.0f "
      "(%.2f times); %zu vertical, %zu horizontal\n",
      millions, threads, took, 1e3 * took / millions, 1e3 * cpu / millions, used, cloud, used / cloud,
      verticals, horizontals);
}

}  // namespace
}  // namespace parhelion

int main(int count, char** words) {
  using namespace parhelion;
  const double max_millions = count > 1 ? std::atof(words[1]) : 10;
  const int threads = count > 2 ? std::atoi(words[2]) : 2;
  cloud::PointCloud<Cloud> cloud;
  cloud.points = one_room();
  Result<Transform<Map, Cloud>> T_map_cloud = Transform<Map, Cloud>();
  std::printf("level: %.1f ms\n", 1e3 * seconds([&] { T_map_cloud = semantic::level(cloud); }));
  const auto room = cloud::transformed(*T_map_cloud, cloud).points;
  for (const cloud::NormalMethod method :
       {cloud::NormalMethod::principal, cloud::NormalMethod::random_planes}) {
    cloud::NormalOptions options;
    options.method = method;
    options.threads = threads;
    std::printf("normals, %s: %.1f ms for %zu points\n",
                method == cloud::NormalMethod::principal ? "principal components" : "algorithm 2",
                1e3 * seconds([&] { (void)cloud::estimate_normals(room, options); }), room.size());
  }
  for (const double millions : {0.1, 1.0, 10.0, 50.0}) {
    const auto copies = static_cast<std::size_t>(millions * 1e6 / static_cast<double>(room.size()));
    if (millions <= max_millions) measure(room, std::max<std::size_t>(1, copies), threads);
  }
}
