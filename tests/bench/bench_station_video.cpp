// Video latency from the server to a page: drawn here, read back out of the page's canvas in headless
// Chromium.
//   bench_station_video [LOG [KIND...]]
// LOG: its CAMERA pictures are shown (with-camera.lcm of the demo); "-": synthetic ones. KIND: h264, jpeg,
// mjpeg. Prints ms and the cost of a picture. A lossy link is made in a network namespace (`unshare -n`, lo
// up, multicast route) with nftables: on output `meta l4proto tcp ip length > 60 numgen random mod 100 < 2
// drop`.
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>

#include "protocols/bus/log_file.hpp"
#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "render/jpeg.hpp"
#include "server/runtime/wall_clock.hpp"
#include "server/station/http/http_server.hpp"
#include "server/station/video/video_feed.hpp"

namespace {

using namespace parhelion;
using Pixels = std::vector<std::uint8_t>;

constexpr int kWidth = 640, kHeight = 480, kBlock = 16, kBits = 24;

std::vector<Pixels> pictures(const std::string& path) {
  std::vector<Pixels> all;
  render::JpegCodec codec;
  auto reader = LogReader::open(path);
  while (path != "-" && reader.ok() && all.size() < 60) {
    auto next = reader->next();
    if (!next.ok() || !*next) break;
    Image image;
    if ((*next)->channel != channel::kCamera || !decode(channel::kCamera, (*next)->payload, image).ok())
      continue;
    Pixels bgr;
    const auto format = codec.decode(image.bytes, bgr);
    if (format && format->width == kWidth && format->height == kHeight) all.push_back(std::move(bgr));
  }
  for (int k = 0; all.empty() || (path == "-" && k < 60); ++k) {
    Pixels bgr;
    for (int i = 0; i < kWidth * kHeight; ++i) {
      const int x = i % kWidth + 4 * k, y = i / kWidth;
      for (const int c : {x / 3, y / 2, ((x / 40 + y / 40) % 2) * 90 + (x * 7 + y * 13) % 23})
        bgr.push_back(static_cast<std::uint8_t>(c));
    }
    all.push_back(std::move(bgr));
  }
  return all;
}

/// Tenths of a millisecond since the epoch, the lowest 24 bits; below them inverted.
void paint(Pixels& bgr, std::int64_t us) {
  const auto value = static_cast<std::uint32_t>(us / 100);
  for (int row = 0; row < 2 * kBlock; ++row) {
    for (int x = 0; x < kBits * kBlock; ++x) {
      const bool one = ((value >> (kBits - 1 - x / kBlock)) & 1U) != (row < kBlock ? 0U : 1U);
      const std::size_t at = 3 * static_cast<std::size_t>(row * kWidth + x);
      for (std::size_t c = 0; c < 3; ++c) bgr[at + c] = one ? 255 : 0;
    }
  }
}

/// A camera at 30 Hz, until the end of the scope.
class Camera {
 public:
  Camera(Bus& bus, std::vector<Pixels> all)
      : thread_([this, &bus, all = std::move(all)] { run(bus, all); }) {}
  ~Camera() {
    stop_ = true;
    thread_.join();
  }
  Camera(const Camera&) = delete;
  Camera& operator=(const Camera&) = delete;

 private:
  void run(Bus& bus, const std::vector<Pixels>& all) {
    render::JpegCodec codec;
    auto due = std::chrono::steady_clock::now();
    for (std::size_t i = 0; !stop_; ++i) {
      due += std::chrono::microseconds(33'333);
      std::this_thread::sleep_until(due);
      // Forwards and backwards, so that there are no jumps.
      const std::size_t turn = i % std::max<std::size_t>(2 * all.size() - 1, 1);
      Pixels bgr = all[turn < all.size() ? turn : 2 * all.size() - 2 - turn];
      Image image;
      image.stamp = {runtime::wall_now().ns};
      paint(bgr, image.stamp.utime());
      image.width = kWidth;
      image.height = kHeight;
      image.bytes = codec.encode(bgr, {kWidth, kHeight, 85, render::JpegFormat::Subsampling::yuv420}).value();
      std::vector<std::uint8_t> payload;
      encode(image, payload);
      static_cast<void>(bus.publish(channel::kMrCamera, payload));
    }
  }
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

std::string text_of(const char* path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

class Page {
 public:
  void serve(station::HttpServer& server) {
    server.on("GET", "/", station::Access::everyone(), [](const station::HttpRequest&) {
      return station::HttpResponse{
          200, "text/html", "<canvas width=640 height=480></canvas><img><script src=/bench.js></script>"};
    });
    server.on("GET", "/bench.js", station::Access::everyone(), [](const station::HttpRequest&) {
      return station::HttpResponse{200, "text/javascript",
                                   text_of(PARHELION_SOURCE_DIR "/tests/bench/station_video.js")};
    });
    server.on("POST", "/done", station::Access::everyone(), [this](const station::HttpRequest& request) {
      const std::lock_guard lock(mutex_);
      result_ = nlohmann::json::parse(request.body, nullptr, false);
      came_.notify_all();
      return station::HttpResponse{204, "text/plain", ""};
    });
  }
  /// ms, in display order; empty: nothing arrived in time.
  std::vector<double> ages(const std::string& url) {
    const auto folder =
        std::filesystem::temp_directory_path() / ("bench_station_video-" + std::to_string(getpid()));
    const std::string data = "--user-data-dir=" + folder.string();
    std::vector<std::string> words{"chromium", "--headless=new", "--no-sandbox",   "--disable-gpu",
                                   data,       "--mute-audio",   "--no-first-run", url};
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    posix_spawn_file_actions_t quiet;
    posix_spawn_file_actions_init(&quiet);
    posix_spawn_file_actions_addopen(&quiet, 2, "/dev/null", 1, 0);
    pid_t pid = 0;
    std::unique_lock lock(mutex_);
    result_ = nullptr;
    if (posix_spawnp(&pid, "chromium", &quiet, nullptr, argv.data(), environ) != 0) return {};
    came_.wait_for(lock, std::chrono::seconds(90), [this] { return !result_.is_null(); });
    kill(pid, SIGTERM);
    waitpid(pid, nullptr, 0);
    std::filesystem::remove_all(folder);
    std::vector<double> ages;
    for (const auto& age : result_) {
      if (age.is_string()) std::printf("the page: %s\n", age.get<std::string>().c_str());
      if (age.is_number()) ages.push_back(age.get<double>());
    }
    return ages;
  }

 private:
  std::mutex mutex_;
  std::condition_variable came_;
  nlohmann::json result_;
};

void print(const std::string& kind, std::vector<double> ages, const station::VideoCounts& before,
           const station::VideoCounts& after) {
  if (ages.empty()) return static_cast<void>(std::printf("%s: nothing came back\n", kind.c_str()));
  std::sort(ages.begin(), ages.end());
  const auto at = [&](double p) {
    return ages[static_cast<std::size_t>(p * static_cast<double>(ages.size() - 1))];
  };
  const double shown = static_cast<double>(after.pictures - before.pictures);
  const double coded = static_cast<double>(after.coded - before.coded);
  std::printf("%-5s %zu pictures: p50 %.1f, p95 %.1f, p99 %.1f, max %.1f ms; coding %.2f ms a picture",
              kind.c_str(), ages.size(), at(0.5), at(0.95), at(0.99), ages.back(),
              1e3 * (after.coding_s - before.coding_s) / shown);
  if (coded > 0)
    std::printf(", H.264 %.1f kB each, %llu key pictures",
                1e-3 * static_cast<double>(after.bytes - before.bytes) / coded,
                static_cast<unsigned long long>(after.keys - before.keys));
  std::printf(", %llu left out\n", static_cast<unsigned long long>(after.left_out - before.left_out));
}

}  // namespace

int main(int argc, char** argv) {
  const std::string log = argc > 1 ? argv[1] : "-";
  std::vector<std::string> kinds(argv + std::min(argc, 2), argv + argc);
  if (kinds.empty()) kinds = {"h264", "jpeg", "mjpeg"};
  MemoryBusHub hub;
  const auto bus = hub.connect();
  station::VideoOptions options;
  options.robot = "robot";
  options.now = [] { return runtime::steady_now(); };
  options.stamp = [] { return SensorTime{runtime::wall_now().ns}; };
  station::VideoFeed feed(hub.connect(), options);
  Page page;
  auto server = station::HttpServer::open({});
  if (!server) return std::fprintf(stderr, "%s\n", server.error().message.c_str()), 1;

  page.serve(**server);
  (*server)->on_socket("/ws/video", station::Access::everyone(), feed.socket());
  (*server)->on_stream("/video.mjpg", station::Access::everyone(), station::VideoFeed::kStreamType,
                       feed.stream());
  (*server)->run();
  feed.start();
  const Camera camera(*bus, pictures(log));
  for (const std::string& kind : kinds) {
    const station::VideoCounts before = feed.counts();
    const auto ages = page.ages("http://127.0.0.1:" + std::to_string((*server)->port()) + "/?kind=" + kind);
    print(kind, ages, before, feed.counts());
  }
}
