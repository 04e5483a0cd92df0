// The whole server live on this machine: plays a localized log with 30 Hz video onto LCM like a robot, with
// `parhelion serve`, `parhelion slam` and a subscriber beside it, and prints the server's report.
//   bench_server_live PARHELION LOG MODEL SCENARIO MAP [SECONDS [SPEED]]
// LOG: with-camera.lcm of the demo; MAP: the ROS map YAML that SLAM localizes in. SPEED: factor on the
// recording's rate, for more scans per second. The recording is played forwards and backwards in turn, so
// that there are no jumps.
#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <iterator>
#include <string>
#include <thread>
#include <vector>

#include "protocols/bus/log_file.hpp"
#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "server/runtime/wall_clock.hpp"

namespace {

using namespace parhelion;

pid_t start(std::vector<std::string> arguments) {
  const pid_t pid = fork();
  if (pid != 0) return pid;
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  execv(argv[0], argv.data());
  _exit(127);
}

/// The recording's scans, odometry and images, stamps relative to the first.
struct Played {
  std::vector<Message> inputs;
  std::vector<Message> images;
  std::string robot_yaml;
};

Played read(const std::string& path) {
  Played played;
  auto reader = LogReader::open(path);
  while (reader.ok()) {
    auto next = reader->next();
    if (!next.ok() || !*next) break;
    Message& message = **next;
    RobotMessage robot;
    if (message.channel == channel::kRobot && decode(message.channel, message.payload, robot).ok()) {
      played.robot_yaml = robot.yaml;
    }
    if (message.channel == channel::kScan || message.channel == channel::kOdometry)
      played.inputs.push_back(message);
    if (message.channel == channel::kCamera) played.images.push_back(message);
  }
  return played;
}

struct Due {
  Duration after;  ///< the start
  const Message* message;
};

/// The inputs forwards and backwards at `speed`, for `duration`.
std::vector<Due> back_and_forth(const std::vector<Message>& inputs, double speed, double duration) {
  const ArrivalTime first = inputs.front().arrival, last = inputs.back().arrival;
  std::vector<Due> all;
  double begun = 0;
  for (bool forwards = true; begun < duration; forwards = !forwards) {
    for (std::size_t i = 1; i < inputs.size(); ++i) {
      const Message& each = forwards ? inputs[i] : inputs[inputs.size() - 1 - i];
      const Duration elapsed = forwards ? each.arrival - first : last - each.arrival;
      all.push_back({seconds(begun + elapsed.seconds() / speed), &each});
    }
    begun += (last - first).seconds() / speed;
  }
  return all;
}

/// Publishes with current stamps: `to_now` is added to the recorded ones.
template <class T>
void publish(Bus& bus, const Message& message, Duration to_now) {
  T item;
  if (!decode(message.channel, message.payload, item).ok()) return;
  item.stamp = item.stamp + to_now;
  std::vector<std::uint8_t> payload;
  encode(item, payload);
  (void)bus.publish(message.channel, payload);
}

void wait_until(WallTime due) {
  const Duration left = due - runtime::wall_now();
  if (left.ns > 0) std::this_thread::sleep_for(std::chrono::nanoseconds(left.ns));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 6)
    return std::fprintf(stderr, "usage: %s PARHELION LOG MODEL SCENARIO MAP [SECONDS [SPEED]]\n", argv[0]), 2;
  const std::string program = argv[1], url = "udpm://239.255.76.67:7699?ttl=0&recv_buf_size=4194304";
  const double duration = argc > 6 ? std::stod(argv[6]) : 50, speed = argc > 7 ? std::stod(argv[7]) : 1;
  const Played played = read(argv[2]);
  if (played.inputs.empty() || played.images.empty()) return std::fprintf(stderr, "nothing to play\n"), 1;
  std::ofstream("/tmp/bench-live-robot.yaml") << played.robot_yaml;

  const pid_t server = start({program, "serve", argv[4], "--robot", "/tmp/bench-live-robot.yaml", "-o",
                              "/tmp/bench-live-session.lcm", "--force", "--report",
                              "/tmp/bench-live-report.json", "--url", url, "--no-restart"});
  const pid_t slam = start({program, "slam", "--map", argv[5], "--start", "0,0,0", "--robot",
                            "/tmp/bench-live-robot.yaml", "--url", url});
  auto subscriber = open_network_bus(url), robot = open_network_bus(url);
  if (!subscriber.ok() || !robot.ok() || !(*subscriber)->subscribe("MR_.*", 1000).ok()) return 1;
  std::this_thread::sleep_for(std::chrono::seconds(2));  // wait until both processes have started; nothing is
                                                         // measured before

  const std::vector<Due> inputs = back_and_forth(played.inputs, speed, duration);
  const WallTime begun = runtime::wall_now();
  std::size_t next_input = 0, frame = 0, received = 0;
  while ((runtime::wall_now() - begun).seconds() < duration && next_input < inputs.size()) {
    const Message& input = *inputs[next_input].message;
    const WallTime input_due = begun + inputs[next_input].after;
    const WallTime frame_due = begun + seconds(static_cast<double>(frame) / 30);
    wait_until(std::min(input_due, frame_due));
    if (input_due <= frame_due) {
      ++next_input;
      const Duration to_now{input_due.ns - input.arrival.ns};
      input.channel == channel::kScan ? publish<Scan>(**robot, input, to_now)
                                      : publish<Odometry>(**robot, input, to_now);
    } else {
      const Message& image = played.images[(frame++ / 3) % played.images.size()];
      publish<Image>(**robot, image, Duration{frame_due.ns - image.arrival.ns});
    }
    Message message;
    while (*(*subscriber)->receive(message, milliseconds(0))) ++received;
  }
  for (const pid_t pid : {slam, server}) {
    kill(pid, SIGINT);
    int status = 0;
    waitpid(pid, &status, 0);
  }
  std::printf("messages heard by the subscriber: %zu; frames sent: %zu\n", received, frame);
  std::ifstream report("/tmp/bench-live-report.json");
  std::cout << std::string(std::istreambuf_iterator<char>(report), {});
  return 0;
}
