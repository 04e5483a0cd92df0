#include "tests/loop/closed_loop.hpp"

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "server/runtime/wall_clock.hpp"
#include "tests/tools/process.hpp"

namespace parhelion::test {
namespace {

using Json = nlohmann::json;

constexpr double kReady = 30, kPatience = 60, kGraded = 3;  // s
constexpr double kCarelessPatience = 25;                    // s: it may stand before an obstacle for ever
constexpr double kShoulder = 1.2;                           // rad, where the arm is brought
constexpr double kTeleopSilence = 0.5;                      // s, of the scenario

std::string example(const std::string& name) {
  return std::string(PARHELION_BINARY_DIR) + "/examples/robot/" + name;
}

std::string number(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.4f", value);
  return text;
}

void write(const std::filesystem::path& path, const std::string& text) {
  std::ofstream file(path);
  file << text;
  if (!file.flush()) throw std::runtime_error(path.string() + ": cannot be written");
}

class ClosedLoop {
 public:
  ClosedLoop(std::uint64_t seed, Arrangement arrangement, const std::filesystem::path& folder)
      : folder_(folder), site_(make_site(seed)), arrangement_(arrangement) {
    report_.seed = seed;
    report_.arrangement = arrangement;
    const int port = 20'000 + static_cast<int>((static_cast<std::uint64_t>(getpid()) + seed) % 20'000);
    setenv("LCM_DEFAULT_URL", ("udpm://239.255.76.67:" + std::to_string(port) + "?ttl=0").c_str(), 1);
  }

  DriveReport run() {
    try {
      write_site();
      drive();
      check();
    } catch (const std::runtime_error& error) {
      report_.not_run = error.what();
    }
    return report_;
  }

 private:
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  std::string text(const std::string& name) const { return bytes_of(path(name)); }
  bool lifts() const { return arrangement_ == Arrangement::trainee_lifts; }
  bool drives_itself() const { return arrangement_ == Arrangement::robot_drives_itself; }

  void write_site() {
    const pose::GridMap map = survey_map(site_);
    if (const Status saved = pose::save_ros_map(map, path("site")); !saved)
      throw std::runtime_error(saved.error().message);
    write(path("model.yaml"), to_yaml(survey_model(site_, map.id)));
    write(path("building.txt"), true_building(site_));
    write(path("scenario.yaml"), to_yaml(loop_scenario(site_, arrangement_)));
    for (const char* file : {"body.yaml", "body.urdf"})
      std::filesystem::copy_file(std::string(PARHELION_SOURCE_DIR) + "/examples/robot/" + file, path(file),
                                 std::filesystem::copy_options::overwrite_existing);
    const Ran valid = test::run({"validate", path("scenario.yaml")}, path("validate.txt"));
    if (valid.exit != 0) throw std::runtime_error(valid.output);
  }

  static void add_route(std::vector<std::string>& arguments, const std::vector<Eigen::Vector2d>& route) {
    for (const Eigen::Vector2d& p : route) {
      arguments.emplace_back("--to");
      arguments.push_back(number(p.x()) + "," + number(p.y()));
    }
  }
  std::vector<std::string> robot_arguments() const {
    const std::string description = std::string(PARHELION_SOURCE_DIR) + "/examples/robot/robot.yaml";
    // Its clock is seconds off, and its encoders' stamps are late.
    std::vector<std::string> arguments{"--building",      path("building.txt"),
                                       "--description",   description,
                                       "--seed",          std::to_string(site_.seed),
                                       "--clock-offset",  number(3.7 - static_cast<double>(site_.seed % 7)),
                                       "--odometry-late", "0.015",
                                       "--image-rate",    "1"};
    if (drives_itself()) add_route(arguments, site_.route);
    return arguments;
  }
  std::vector<std::string> trainee_arguments() const {
    if (lifts()) {
      const LiftPlaces at = lift_places(site_);
      return {"--patience", number(kPatience),
              "--lift",     number(at.thing.x()) + "," + number(at.thing.y()) + "," + number(at.height),
              "--into",     number(at.container.x()) + "," + number(at.container.y())};
    }
    const bool careless = arrangement_ == Arrangement::careless_trainee_drives;
    std::vector<std::string> arguments{"--patience", number(careless ? kCarelessPatience : kPatience)};
    if (drives_itself())
      arguments.insert(arguments.end(), {"--agent", "robot_1"});
    else
      arguments.insert(arguments.end(), {"--shoulder", number(kShoulder)});
    if (careless) arguments.insert(arguments.end(), {"--careless", "yes"});
    add_route(arguments, drives_itself() ? site_.other_route : site_.route);
    return arguments;
  }

  /// Receives until `done(message)`; false: not within `s`.
  template <class Done>
  bool receive_until(double s, const Done& done) {
    const WallTime deadline = runtime::steady_now() + seconds(s);
    Message message;
    while (runtime::steady_now() < deadline) {
      const auto received = bus_->receive(message, milliseconds(20));
      if (!received) throw std::runtime_error(received.error().message);
      if (done(*received ? &message : nullptr)) return true;
    }
    return false;
  }

  void drive() {
    auto bus = open_network_bus("");
    if (!bus) throw std::runtime_error(bus.error().message);
    bus_ = std::move(*bus);
    if (!bus_->subscribe("MR_SCAN_INFO|MR_EVENTS", 1000)) throw std::runtime_error("cannot subscribe");
    const Pose2& start = site_.start;
    Process server({"serve", path("scenario.yaml"), "-o", path("session.lcm"), "--report", path("live.json"),
                    "--state-folder", path("state"), "--no-restart", "--force"},
                   path("serve.txt"));
    Process slam({"slam", "--map", path("site.yaml"), "--start",
                  number(start.x) + "," + number(start.y) + "," + number(start.yaw) + "rad"},
                 path("slam.txt"));
    Process robot(robot_arguments(), path("robot.txt"), example("example_robot"));
    if (!receive_until(kReady,
                       [&](const Message* message) { return message != nullptr && is_live(*message); }))
      throw std::runtime_error("no live scan: " + reason_ + "\n" + text("serve.txt") + text("slam.txt") +
                               text("robot.txt"));
    const WallTime begin = runtime::steady_now();
    Process trainee(trainee_arguments(), path("trainee.txt"), example("example_trainee"));
    await_goals(trainee);
    report_.seconds = (runtime::steady_now() - begin).seconds();
    await_grade();
    robot.signal(SIGTERM);
    if (robot.wait() != 0) throw std::runtime_error("the robot has died: " + text("robot.txt"));
    slam.signal(SIGTERM);
    server.signal(SIGTERM);
    if (server.wait() != 0) throw std::runtime_error("the server has failed: " + text("serve.txt"));
  }
  bool is_live(const Message& message) {
    ScanInfo info;
    if (message.channel != channel::kMrScanInfo || !decode(message.channel, message.payload, info))
      return false;
    reason_ = info.reason;
    return info.live;
  }
  void await_goals(Process& trainee) {
    receive_until(kPatience + 10, [&](const Message*) {
      const bool arrived = !drives_itself() || text("robot.txt").find("goal reached") != std::string::npos;
      return !trainee.running() && arrived;
    });
  }
  void await_grade() {
    receive_until(kGraded, [&](const Message* message) {
      Event event;
      return message != nullptr && message->channel == channel::kMrEvents &&
             decode(message->channel, message->payload, event).ok() && event.kind == EventKind::grading_ended;
    });
  }

  void check() {
    const Json robot = last_line(text("robot.txt"));
    report_.bumps = robot.at("bumps");
    report_.obstacle_stops = robot.at("obstacle_stops");
    std::string trainee = text("trainee.txt");
    trainee = trainee.substr(0, trainee.find('\n'));
    if (trainee == "goal reached") trainee = "reached";
    report_.goal = trainee;
    if (drives_itself()) {
      report_.other_goal = trainee;
      report_.goal = robot.at("goal") == "reached"
                         ? "reached"
                         : "not reached: " + robot.at("waits_for").get<std::string>();
    }
    const auto description =
        load_robot_description(std::string(PARHELION_SOURCE_DIR) + "/examples/robot/robot.yaml");
    if (!description) throw std::runtime_error(description.error().message);
    report_.log = check_log(path("session.lcm"), *description, kTeleopSilence);
    if (report_.goal != "reached" && !report_.log.limited_by.empty())
      report_.goal += ", MR_CMD is limited: " + report_.log.limited_by;
    else if (report_.goal != "reached" && report_.obstacle_stops > 0)
      report_.goal += ", the robot's own obstacle stop";
    const bool arm_obeyed = std::abs(report_.log.joints["shoulder"] - kShoulder) < 0.01;
    if (!drives_itself() && !lifts() && (report_.log.joint_commands == 0 || !arm_obeyed))
      report_.log.violations.emplace_back("the arm is not where it was brought");
    compare();
  }
  static Json last_line(std::string text) {
    while (!text.empty() && text.back() == '\n') text.pop_back();
    return Json::parse(text.substr(text.rfind('\n') + 1));
  }
  /// The grade and the bytes of the live server, of its log, and of a replay.
  void compare() {
    const Ran replayed = test::run({"replay", path("session.lcm"), "-o", path("replayed.lcm"), "--report",
                                    path("replayed.json"), "--force"},
                                   path("replay.txt"));
    if (replayed.exit != 0) throw std::runtime_error(replayed.output);
    const Ran graded = test::run({"grade", path("session.lcm"), "--json"}, path("grade.json"));
    if (graded.exit != 0) throw std::runtime_error(graded.output);
    const Json live = Json::parse(text("live.json"));
    report_.score = live.at("score");
    const Json grades[] = {live.at("grade"), Json::parse(text("grade.json")),
                           Json::parse(text("replayed.json")).at("grade")};
    for (const int i : {1, 2}) {
      Json a = grades[0], b = grades[i];
      a.erase("log"), b.erase("log");
      if (a != b)
        report_.differences += i == 1 ? "the log's grade is another; " : "the replay's grade is another; ";
    }
    report_.differences += output_difference(path("session.lcm"), path("replayed.lcm"));
  }

  std::filesystem::path folder_;
  Site site_;
  Arrangement arrangement_;
  std::unique_ptr<Bus> bus_;
  std::string reason_;  ///< why the newest scan was not live
  DriveReport report_;
};

}  // namespace

std::vector<std::string> DriveReport::failures() const {
  if (!not_run.empty()) return {not_run};
  std::vector<std::string> found = log.violations;
  const bool touches = arrangement == Arrangement::trainee_lifts;  // the hand, what it lifts
  if (log.contacts > 0 && !touches)
    found.push_back(std::to_string(log.contacts) + " contacts with what was shown");
  if (log.nearest_shown <= 0) found.emplace_back("something shown is inside the robot's outline");
  if (bumps > 0) found.push_back(std::to_string(bumps) + " contacts with the building");
  if (log.scans == 0) found.emplace_back("no scan in the log");
  if (goal.empty()) found.emplace_back("neither the goal nor a reason");
  if (!differences.empty()) found.push_back(differences);
  return found;
}

DriveReport drive_loop(std::uint64_t seed, Arrangement arrangement, const std::filesystem::path& folder) {
  return ClosedLoop(seed, arrangement, folder).run();
}

}  // namespace parhelion::test
