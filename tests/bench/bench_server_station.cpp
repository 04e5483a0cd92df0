// Cost of pages for the scan path: a live server with and without its base station and 22 pages, interleaved:
// 20 observers, a trainee without commands, and an instructor that places and removes a person every two
// seconds. Without pages a console on LCM does that, so that both servers process the same scans in the same
// world. A stationary robot in a room of wandering robots sends 361 beams at 20 Hz over LCM. Video has its
// own bench.
//   bench_server_station PARHELION [ROUNDS [SECONDS [AGENTS [WHICH [signed [stranger]]]]]]
// WHICH: both (interleaved), pages or nobody. `signed`: server and robot sign and verify every message.
// `stranger`: somebody without keys sends up to 2,000 messages a second on their inputs. As
// issue 6 requires, in 200 minutes: bench_server_station PARHELION 10 600 30; memory alone, in ten:
// bench_server_station PARHELION 1 600 30 pages
#include <fcntl.h>
#include <poll.h>
#include <sys/wait.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stop_token>
#include <thread>
#include <vector>

#include "fusion/scan/augment.hpp"
#include "protocols/authentication/signed_bus.hpp"
#include "protocols/bus/bus.hpp"
#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "server/runtime/wall_clock.hpp"
#include "tests/bench/plain_web_socket.hpp"
#include "tests/server/tick/synthetic.hpp"
#include "tests/temporary_folder.hpp"

namespace {

using namespace parhelion;
namespace fs = std::filesystem;

constexpr std::uint16_t kPort = 8402;
constexpr const char* kUrl = "udpm://239.255.76.67:7702?ttl=0&recv_buf_size=4194304";
constexpr double kScanPeriod = 0.05013;  // s: not synchronous with the server's clock
constexpr double kSettled = 3;           // s before the first memory measurement
constexpr int kLooks = 10;               // number of memory measurements

void pass(double s) { std::this_thread::sleep_for(std::chrono::duration<double>(s)); }

SemanticModel hall() {
  SemanticModel model;
  model.map_id = "synthetic";
  model.entities = {test::wall("wall 1", 0, -12, 0, 40), test::wall("wall 2", 0, 12, 0, 40),
                    test::wall("wall 3", -20, 0, std::numbers::pi / 2, 24),
                    test::wall("wall 4", 20, 0, std::numbers::pi / 2, 24)};
  return model;
}

RobotDescription description() {
  RobotDescription robot = test::robot();
  robot.laser->beams = 361;
  robot.laser->angle_increment = std::numbers::pi / 360;
  return robot;
}

void make_keys(const std::string& program, const fs::path& folder) {
  const std::string command = "'" + program + "' key new rover --role robot --role localization --server '" +
                              (folder / "server.keys").string() + "' -o '" +
                              (folder / "rover.keys").string() + "' > /dev/null";
  if (std::system(command.c_str()) != 0) throw std::runtime_error(command + ": failed");
}

std::unique_ptr<Bus> open_robot_bus(const fs::path& folder, bool with_keys) {
  auto bus = open_network_bus(kUrl);
  if (!bus) throw std::runtime_error(bus.error().message);
  if (!with_keys) return std::move(*bus);
  const auto keys = load_keys(folder / "rover.keys");
  if (!keys) throw std::runtime_error(keys.error().message);
  return sign(std::move(*bus), *keys, {});
}

void write_files(const fs::path& folder, int agents, bool with_keys) {
  Scenario scenario;
  scenario.name = "bench";
  scenario.model = "model.yaml";
  scenario.robot = "robot.yaml";
  scenario.authentication = with_keys;
  for (int i = 0; i < agents; ++i) {
    AgentDefinition agent = test::agent("robot_" + std::to_string(i), AgentKind::robot, -18 + 1.5 * (i % 24),
                                        -10 + 2.0 * (i / 24), BehaviourKind::wander);
    if (std::hypot(agent.T_map_base.translation().x(), agent.T_map_base.translation().y()) > 2.5)
      scenario.agents.push_back(agent);
  }
  std::ofstream(folder / "model.yaml") << to_yaml(hall());
  std::ofstream(folder / "robot.yaml") << to_yaml(description());
  std::ofstream(folder / "scenario.yaml") << to_yaml(scenario);
}

pid_t start_server(const std::string& program, const fs::path& folder, bool with_pages, bool with_keys) {
  std::vector<std::string> arguments{program,
                                     "serve",
                                     folder / "scenario.yaml",
                                     "-o",
                                     folder / "session.lcm",
                                     "--report",
                                     folder / "report.json",
                                     "--force",
                                     "--no-restart",
                                     "--url",
                                     kUrl};
  if (with_keys) arguments.insert(arguments.end(), {"--keys", folder / "server.keys"});
  if (with_pages) {
    fs::remove_all(folder / "state");
    arguments.insert(arguments.end(),
                     {"--http", "127.0.0.1:" + std::to_string(kPort), "--state-folder", folder / "state"});
  }
  fs::remove(folder / "news");  // of the previous run
  const pid_t pid = fork();
  if (pid != 0) return pid;
  const int news = open((folder / "news").c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  dup2(news, 2);
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  execv(argv[0], argv.data());
  _exit(127);
}

/// The server's output so far, once it contains `word`.
std::string await_news(const fs::path& folder, const std::string& word) {
  for (int i = 0; i < 200; ++i) {
    std::ifstream file(folder / "news");
    const std::string text(std::istreambuf_iterator<char>(file), {});
    if (text.find(word) != std::string::npos) return text;
    pass(0.05);
  }
  throw std::runtime_error("the server has not said '" + word + "'");
}

/// The instructor's command to place or remove the person.
InstructorCommand person(bool comes) {
  const SensorTime now = SensorTime::from_utime(runtime::wall_now().utime());
  if (!comes) return AgentRemove{.stamp = now, .agent = "p"};
  return AgentSpawn{.stamp = now, .agent = test::agent("p", AgentKind::person, 5, 3, BehaviourKind::stay)};
}

/// The robot: stands still and publishes its sensors for `duration`. `commands`: a console beside it sends
/// the commands that an instructor gives on a page.
void send_scans(Bus& bus, double duration, bool commands) {
  const RobotDescription robot = description();
  Scan scan = test::exact_scan(*robot.laser, {}, hall());
  PoseEstimate estimate;
  estimate.covariance = PoseCovariance::Identity() * 1e-5;
  estimate.map_id = "synthetic";
  estimate.state = SlamState::tracking;
  std::vector<std::uint8_t> payload;
  const auto send = [&](const char* name, const auto& item) {
    encode(item, payload);
    (void)bus.publish(name, payload);
  };
  const WallTime begun = runtime::steady_now();
  int commands_sent = 0;
  for (int i = 0; i < duration / kScanPeriod; ++i) {
    const Duration left = begun + seconds(i * kScanPeriod) - runtime::steady_now();
    if (left.ns > 0) std::this_thread::sleep_for(std::chrono::nanoseconds(left.ns));
    const SensorTime now = SensorTime::from_utime(runtime::wall_now().utime());
    send(channel::kOdometry, Odometry{now, {}});
    scan.stamp = estimate.stamp = now;
    send(channel::kScan, scan);
    if (i % 5 == 0) send(channel::kPoseCov, estimate);
    if (commands && i * kScanPeriod > commands_sent + 1) {
      const InstructorCommand command = person(commands_sent++ % 2 == 0);
      send(channel_of(command), command);
    }
  }
}

/// The pages, in a separate process, until the server ends: reads everything as fast as it arrives. Writes
/// the bytes per second to `out`.
[[noreturn]] void run_pages(const std::string& setup_link, double duration, int out) {
  const std::string token = setup_link.substr(setup_link.find("token=") + 6);
  const std::string admin =
      bench::post(kPort, "/api/v1/setup", "",
                  R"({"token":")" + token + R"(","name":"ada","password":"a long password"})");
  std::vector<std::string> cookies{admin};
  for (const char* role : {"trainee", "observer"}) {
    bench::post(
        kPort, "/api/v1/accounts", admin,
        std::string(R"({"name":")") + role + R"(","role":")" + role + R"(","password":"a long password"})");
    cookies.push_back(bench::post(kPort, "/api/v1/login", "",
                                  std::string(R"({"name":")") + role + R"(","password":"a long password"})"));
  }
  std::vector<pollfd> pages;
  for (int i = 0; i < 22; ++i)
    pages.push_back(
        {bench::open_web_socket(kPort, "/ws/state", cookies[static_cast<std::size_t>(std::min(i, 2))]),
         POLLIN, 0});
  std::vector<char> buffer(1 << 20);
  std::uint64_t bytes = 0;
  const WallTime begun = runtime::steady_now();
  const auto elapsed = [&] { return (runtime::steady_now() - begun).seconds(); };
  int placed = 0, ponged = 0;
  for (bool open = true; open;) {
    if (elapsed() > placed + 1) {
      bench::send_text(pages[0].fd,
                       placed++ % 2 == 0
                           ? R"({"type":"agent","action":"spawn","name":"p","kind":"person","x":5,"y":3})"
                           : R"({"type":"agent","action":"remove","name":"p"})");
    }
    if (elapsed() > 5 * (ponged + 1)) {
      ++ponged;
      for (const pollfd& page : pages) bench::pong(page.fd);
    }
    poll(pages.data(), pages.size(), 100);
    for (const pollfd& page : pages) {
      if ((page.revents & (POLLIN | POLLHUP)) == 0) continue;
      const ssize_t n = recv(page.fd, buffer.data(), buffer.size(), 0);
      open = open && n > 0;
      bytes += static_cast<std::uint64_t>(std::max<ssize_t>(n, 0));
    }
  }
  if (elapsed() < duration / 2) throw std::runtime_error("a page was closed");
  const double rate = static_cast<double>(bytes) / elapsed();  // until the server ended
  (void)!write(out, &rate, sizeof rate);
  _exit(0);
}

/// Resident memory of a process, kB.
long resident(pid_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/status");
  std::string word;
  long kilobytes = 0;
  while (file >> word) {
    if (word == "VmRSS:") file >> kilobytes;
  }
  return kilobytes;
}

/// Somebody without keys: unsigned messages on each input in turn, up to 2,000 a second.
void send_as_stranger(const fs::path& folder, const std::stop_token& stop) {
  const std::unique_ptr<Bus> bus = open_robot_bus(folder, false);
  const std::vector<std::uint8_t> payload(64, 1);
  while (!stop.stop_requested()) {
    for (const char* name : {channel::kScan, channel::kOdometry, channel::kPoseCov, channel::kTeleop,
                             channel::kJointCmd, channel::kMrSpawn, channel::kMrEmergencyStop}) {
      (void)bus->publish(name, payload);
      std::this_thread::sleep_for(std::chrono::microseconds(500));
    }
  }
}

struct Run {
  double p50 = 0, p99 = 0;   // us, from arrival on the bus to sent
  double megabytes = 0;      // per second, to all pages
  std::vector<long> memory;  // kB, ten equally spaced measurements
};

Run run(const std::string& program, const fs::path& folder, double duration, bool with_pages, bool with_keys,
        bool with_stranger) {
  const pid_t server = start_server(program, folder, with_pages, with_keys);
  await_news(folder, "serving");
  int ends[2] = {-1, -1};
  pid_t pages = 0;
  if (with_pages) {
    const std::string news = await_news(folder, "token=");
    const std::size_t at = news.rfind("http", news.find("token="));
    if (pipe(ends) != 0) throw std::runtime_error("no pipe");
    pages = fork();
    if (pages == 0) {
      (void)!nice(19);  // browsers run elsewhere
      try {
        run_pages(news.substr(at, news.find('\n', at) - at), duration, ends[1]);
      } catch (const std::exception& fault) {
        std::fprintf(stderr, "pages: %s\n", fault.what());
        _exit(1);
      }
    }
    pass(1.5);  // log-ins use memory and processor time on purpose; afterwards the load is steady
  }
  const std::unique_ptr<Bus> robot = open_robot_bus(folder, with_keys);
  Run result;
  std::jthread stranger;
  if (with_stranger)
    stranger = std::jthread([&](const std::stop_token& stop) { send_as_stranger(folder, stop); });
  std::thread memory([&] {
    pass(kSettled);
    for (int i = 0; i < kLooks; ++i) {
      result.memory.push_back(resident(server));
      if (i + 1 < kLooks) pass((duration - 2.5 - kSettled) / (kLooks - 1));
    }
  });
  send_scans(*robot, duration - 2, !with_pages);
  memory.join();
  kill(server, SIGINT);
  int status = 0;
  waitpid(server, &status, 0);
  if (with_pages) {
    waitpid(pages, &status, 0);
    double rate = 0;
    if (WEXITSTATUS(status) == 0 && read(ends[0], &rate, sizeof rate) == sizeof rate)
      result.megabytes = rate / 1e6;
  }
  std::ifstream file(folder / "report.json");
  const auto report = nlohmann::json::parse(file);
  const auto& scan = report["latency_us"]["scan_in_to_out"];
  result.p50 = scan["p50"];
  result.p99 = scan["p99"];
  long long degraded = 0;
  for (const auto& count : report["scans"]["degraded"]) degraded += count.get<long long>();
  std::printf("%s  %lld scans, %lld as they came  p50 %7.1f us  p99 %8.1f us  resident",
              with_pages ? "22 pages" : "nobody  ", report["scans"]["in"].get<long long>(), degraded,
              result.p50, result.p99);
  for (const long kilobytes : result.memory) std::printf(" %ld", kilobytes);
  std::printf(" kB");
  if (with_pages) std::printf("  %.1f MB/s to the pages", result.megabytes);
  std::printf("\n");
  std::fflush(stdout);
  return result;
}

double middle(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2)
    return std::fprintf(
               stderr,
               "usage: %s PARHELION [ROUNDS [SECONDS [AGENTS [both|pages|nobody [signed [stranger]]]]]]\n",
               argv[0]),
           2;
  const int rounds = argc > 2 ? std::stoi(argv[2]) : 3;
  const double duration = argc > 3 ? std::stod(argv[3]) : 12;
  const int agents = argc > 4 ? std::stoi(argv[4]) : 50;
  const std::string which = argc > 5 ? argv[5] : "both";
  const test::TemporaryFolder folder;
  const fs::path path = folder / "";
  const bool with_keys = argc > 6 && argv[6] == std::string("signed");
  const bool with_stranger = argc > 7 && argv[7] == std::string("stranger");
  if (with_keys) make_keys(argv[1], path);
  write_files(path, agents, with_keys);
  std::vector<double> p50[2], p99[2];
  for (int i = 0; i < rounds; ++i) {
    for (const bool with_pages : {i % 2 == 1, i % 2 == 0}) {
      if (which == (with_pages ? "nobody" : "pages")) continue;
      const Run result = run(argv[1], path, duration, with_pages, with_keys, with_stranger);
      p50[with_pages].push_back(result.p50);
      p99[with_pages].push_back(result.p99);
    }
  }
  if (p50[0].empty() || p50[1].empty()) return 0;
  const double without = middle(p50[0]), with = middle(p50[1]);
  std::printf(
      "middle of %d: p50 %.1f us without, %.1f us with (%+.1f %%); p99 %.1f us without, %.1f us with\n",
      rounds, without, with, 100 * (with / without - 1), middle(p99[0]), middle(p99[1]));
  return 0;
}
