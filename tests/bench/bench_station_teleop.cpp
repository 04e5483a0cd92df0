// Latency from a key in a page to the robot's command: a message on a real WebSocket, the teleop service,
// TELEOP on LCM, a live server, MR_CMD back on LCM. Prints ms from sending to receiving, for presses and
// releases.
//   bench_station_teleop PARHELION SCENARIO [URL [PRESSES]]
// SCENARIO: one with a simulated robot, such as server/scenarios/workshop.yaml.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "server/runtime/wall_clock.hpp"
#include "server/station/http/http_server.hpp"
#include "server/station/teleop_service.hpp"

namespace {

using namespace parhelion;

pid_t start(std::vector<std::string> words) {
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  pid_t pid = 0;
  return posix_spawn(&pid, argv[0], nullptr, nullptr, argv.data(), environ) == 0 ? pid : 0;
}

/// A minimal client of /ws/teleop for short messages.
class PageSocket {
 public:
  explicit PageSocket(std::uint16_t port) {
    socket_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const int on = 1;
    setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(port);
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (connect(socket_, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0) return;
    const std::string host = "127.0.0.1:" + std::to_string(port);
    write("GET /ws/teleop HTTP/1.1\r\nHost: " + host + "\r\nOrigin: http://" + host +
          "\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
          "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n");
    char answer[13] = {};
    open_ = recv(socket_, answer, 12, MSG_WAITALL) == 12 && std::string(answer) == "HTTP/1.1 101";
  }
  ~PageSocket() { ::close(socket_); }
  PageSocket(const PageSocket&) = delete;
  PageSocket& operator=(const PageSocket&) = delete;

  bool open() const { return open_; }
  void send_text(const std::string& text) {
    std::string frame{static_cast<char>(0x81)};
    if (text.size() < 126) {
      frame += static_cast<char>(0x80 | text.size());
    } else {
      frame += {static_cast<char>(0xFE), static_cast<char>(text.size() >> 8), static_cast<char>(text.size())};
    }
    write(frame + std::string(4, '\0') + text);  // masked with zeros
    char incoming[4096];
    while (recv(socket_, incoming, sizeof incoming, MSG_DONTWAIT) > 0) {
    }
  }

 private:
  void write(const std::string& bytes) {
    open_ = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL) > 0;
  }
  int socket_ = -1;
  bool open_ = false;
};

/// Waits for MR_CMD with or without a turn; nullopt: none within a second.
std::optional<WallTime> await_command(Bus& bus, bool turns) {
  const WallTime until = runtime::steady_now() + seconds(1.0);
  Message message;
  while (runtime::steady_now() < until) {
    const auto came = bus.receive(message, until - runtime::steady_now());
    TwistCommand command;
    if (!came || !*came || message.channel != channel::kMrCmd) continue;
    if (decode(message.channel, message.payload, command) && (command.twist.wz != 0) == turns)
      return runtime::steady_now();
  }
  return std::nullopt;
}

/// The trainee's robot, once a server publishes its world.
std::string robot_on(Bus& bus) {
  const WallTime until = runtime::steady_now() + seconds(60.0);
  Message message;
  while (runtime::steady_now() < until) {
    const auto came = bus.receive(message, seconds(1.0));
    WorldMessage world;
    if (!came || !*came || message.channel != channel::kMrWorld) continue;
    if (!decode(message.channel, message.payload, world)) continue;
    for (const station::DrivenRobot& robot : station::robots_in(world)) {
      if (robot.teleop == channel::kTeleop) return robot.name;
    }
  }
  return "";
}

void print(const char* what, std::vector<double> ms, int lost) {
  if (ms.empty()) return static_cast<void>(std::printf("%s: none was answered\n", what));
  std::sort(ms.begin(), ms.end());
  const auto at = [&](double p) {
    return ms[static_cast<std::size_t>(p * static_cast<double>(ms.size() - 1))];
  };
  std::printf("%-8s %zu: p50 %.2f, p95 %.2f, p99 %.2f, max %.2f ms; not answered within a second: %d\n", what,
              ms.size(), at(0.5), at(0.95), at(0.99), ms.back(), lost);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3)
    return std::fprintf(stderr, "usage: bench_station_teleop PARHELION SCENARIO [URL [PRESSES]]\n"), 2;
  const std::string url = argc > 3 ? argv[3] : "udpm://239.255.76.67:7702?ttl=0";
  const int presses = argc > 4 ? std::atoi(argv[4]) : 300;
  auto outgoing = open_network_bus(url), incoming = open_network_bus(url);
  if (!outgoing || !incoming)
    return std::fprintf(stderr, "%s\n", (outgoing ? incoming : outgoing).error().message.c_str()), 1;
  for (const char* channel : {channel::kMrCmd, channel::kMrWorld})
    if (!(*incoming)->subscribe(channel, 100)) return 1;
  const std::string session =
      std::filesystem::temp_directory_path() / ("bench_station_teleop-" + std::to_string(getpid()) + ".lcm");
  const pid_t server_process =
      start({argv[1], "serve", argv[2], "--url", url, "--no-restart", "--force", "-o", session});
  const std::string robot = robot_on(**incoming);

  station::TeleopService service(
      **outgoing,
      {[] { return runtime::steady_now(); }, [] { return SensorTime{runtime::wall_now().ns}; }, {}, {}, {}});
  station::TeleopRobot driven;
  driven.driven = {robot, channel::kTeleop, channel::kJointCmd};
  service.set_robots({driven});
  auto web = station::HttpServer::open({});
  if (!web || robot.empty())
    return std::fprintf(stderr, "no server, or no robot\n"), kill(server_process, SIGTERM), 1;
  (*web)->on_socket("/ws/teleop", station::Access::everyone(), service.socket());
  (*web)->run();
  std::atomic<bool> stop = false;
  std::thread station([&] {
    for (; !stop; std::this_thread::sleep_for(std::chrono::milliseconds(20))) service.turn();
  });

  PageSocket page((*web)->port());
  page.send_text(R"({"type":"drive","robot":")" + robot + "\"}");
  std::vector<double> pressed, released;
  int lost_presses = 0, lost_releases = 0;
  for (int i = 1; i <= presses && page.open(); ++i) {
    page.send_text(R"({"type":"release"})");
    static_cast<void>(await_command(**incoming, false));
    std::this_thread::sleep_for(std::chrono::milliseconds(20 + i * 7 % 30));
    char text[160];
    std::snprintf(text, sizeof text, R"({"type":"twist","seq":%d,"at_ms":%.3f,"vx":0,"vy":0,"wz":%g})", i,
                  Duration{runtime::steady_now().ns}.seconds() * 1e3, i % 2 == 0 ? 0.4 : -0.4);
    WallTime begun = runtime::steady_now();
    page.send_text(text);
    auto answer = await_command(**incoming, true);
    if (answer) pressed.push_back((*answer - begun).seconds() * 1e3);
    lost_presses += !answer;
    std::this_thread::sleep_for(std::chrono::milliseconds(30));
    begun = runtime::steady_now();
    page.send_text(R"({"type":"release"})");
    answer = await_command(**incoming, false);
    if (answer) released.push_back((*answer - begun).seconds() * 1e3);
    lost_releases += !answer;
  }
  print("pressed", pressed, lost_presses);
  print("released", released, lost_releases);
  stop = true;
  station.join();
  kill(server_process, SIGTERM);
  waitpid(server_process, nullptr, 0);
  unlink(session.c_str());
}
