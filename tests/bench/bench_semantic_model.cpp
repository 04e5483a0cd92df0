// The whole of `parhelion map model` on tiled copies of one site: reads a binary PLY, levels, segments,
// labels, meshes and writes. Prints time per million points and peak memory beyond the cloud's own 12 bytes
// per point; the memory of the program without a cloud is measured first and subtracted.
//   bench_semantic_model PARHELION FOLDER [MILLIONS [THREADS [CLOUD.ply]]]
// FOLDER receives the clouds (14 bytes per point) and models. Without CLOUD.ply the synthetic site is tiled,
// seen from four places.
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "fusion/cloud/read_cloud.hpp"
#include "tests/synthetic_site.hpp"

namespace {

using namespace parhelion;
namespace fs = std::filesystem;

Result<cloud::PointCloud<Cloud>> one_site(const char* path) {
  if (path == nullptr) return test::scan_of_site();
  auto scan = cloud::read_scan(path);
  if (!scan) return scan.error();
  return cloud::renamed<Cloud>(std::move(scan->cloud));
}

/// Copies side by side until there are `points`, written record by record, so that the memory of this process
/// does not count as the program's.
std::size_t write_tiled(const cloud::PointCloud<Cloud>& site, std::size_t points, const fs::path& path) {
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& p : site.points) box.extend(p);
  const Eigen::Vector2f pitch = box.sizes().head<2>().array().ceil() + 5;  // m: walls do not join
  const std::size_t copies = (points + site.size() - 1) / site.size();
  const auto columns = static_cast<std::size_t>(std::ceil(std::sqrt(static_cast<double>(copies))));
  // Fewer points than one copy has: every n-th point.
  const std::size_t step = points < site.size() ? site.size() / points : 1;
  const std::size_t written = copies * ((site.size() + step - 1) / step);
  const auto offset = [&](std::size_t c) {
    return Eigen::Vector3f(pitch.x() * static_cast<float>(c % columns),
                           pitch.y() * static_cast<float>(c / columns), 0);
  };
  std::ofstream file(path, std::ios::binary);
  file << "ply\nformat binary_little_endian 1.0\n";
  const std::size_t eyes = site.viewpoints.size();
  for (std::size_t i = 0; i < copies * eyes; ++i) {
    const Eigen::Vector3d p = site.viewpoints[i % eyes] + offset(i / eyes).cast<double>();
    file << "comment viewpoint " << i << ' ' << p.x() << ' ' << p.y() << ' ' << p.z() << '\n';
  }
  file << "element vertex " << written << "\nproperty float x\nproperty float y\nproperty float z\n"
       << (eyes > 0 ? "property ushort scan\n" : "") << "end_header\n";
  for (std::size_t c = 0; c < copies; ++c) {
    for (std::size_t i = 0; i < site.size(); i += step) {
      const Eigen::Vector3f p = site.points[i] + offset(c);
      file.write(reinterpret_cast<const char*>(p.data()), 12);
      const auto scan = static_cast<std::uint16_t>(c * eyes + (site.scans.empty() ? 0 : site.scans[i]));
      if (eyes > 0) file.write(reinterpret_cast<const char*>(&scan), 2);
    }
  }
  return written;
}

struct Cost {
  int exit = -1;
  double wall = 0, cpu = 0;  ///< s
  double memory = 0;         ///< bytes, peak
};

Cost run(std::vector<std::string> words) {
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  const auto begin = std::chrono::steady_clock::now();
  const pid_t pid = fork();
  if (pid == 0) {
    execv(argv[0], argv.data());
    _exit(127);
  }
  int status = 0;
  rusage use{};
  wait4(pid, &status, 0, &use);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status),
          std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(),
          seconds(use.ru_utime) + seconds(use.ru_stime), 1024.0 * static_cast<double>(use.ru_maxrss)};
}

}  // namespace

int main(int count, char** words) {
  if (count < 3) {
    std::fprintf(stderr, "usage: %s PARHELION FOLDER [MILLIONS [THREADS [CLOUD.ply]]]\n", words[0]);
    return 2;
  }
  const std::string program = words[1], threads = count > 4 ? words[4] : "2";
  const fs::path folder = words[2];
  const double max_millions = count > 3 ? std::atof(words[3]) : 10;
  const auto site = one_site(count > 5 ? words[5] : nullptr);
  if (!site) return std::fprintf(stderr, "%s\n", site.error().message.c_str()), 1;
  const fs::path cloud = folder / "bench-cloud.ply", model = folder / "bench-model.yaml";
  const auto measure = [&](std::size_t points) {
    const std::size_t written = write_tiled(*site, points, cloud);
    Cost cost = run({program, "map", "model", cloud, "-o", model, "--force", "--threads", threads});
    fs::remove(cloud);
    fs::remove(model);
    return std::pair(written, cost);
  };
  // The smallest cloud that gives a model includes the cost of libraries, pictures of tiles and buffers.
  const auto [few, fixed] = measure(5000);
  std::printf("%zu points (what is fixed): %.3f s wall, %.3f s processor, %.1f MB\n", few, fixed.wall,
              fixed.cpu, fixed.memory / 1e6);
  int failed = fixed.exit;
  for (const double millions : {0.1, 1.0, 10.0, 50.0}) {
    if (millions > max_millions) break;
    const auto [points, cost] = measure(static_cast<std::size_t>(millions * 1e6));
    const double per = static_cast<double>(points) / 1e6, own = 12.0 * static_cast<double>(points);
    std::printf(
        "%6.2f M points, %s threads: per million %.3f s wall, %.3f s processor (%.3f and %.3f without what "
        "is "
        "fixed); peak %.0f MB, %.2f times the cloud, %.2f times without what is fixed%s\n",
        per, threads.c_str(), cost.wall / per, cost.cpu / per, (cost.wall - fixed.wall) / per,
        (cost.cpu - fixed.cpu) / per, cost.memory / 1e6, cost.memory / own,
        (cost.memory - fixed.memory) / own, cost.exit == 0 ? "" : " FAILED");
    std::fflush(stdout);
    failed |= cost.exit;
  }
  return failed;
}
