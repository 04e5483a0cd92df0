#include "tests/fault/stranger.hpp"

#include <chrono>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <thread>

#include "protocols/authentication/signed_bus.hpp"
#include "tests/fault/server_under_test.hpp"
#include "tests/fault/stand_in_robot.hpp"

namespace parhelion::test {
namespace {

constexpr std::size_t kRemembered = 5000;  // messages
constexpr double kForgedSpeed = 0.7;       // m/s

std::unique_ptr<Bus> open(const std::string& url) {
  auto bus = open_network_bus(url);
  if (!bus) throw std::runtime_error(bus.error().message);
  return std::move(*bus);
}

TwistCommand forward() { return {{runtime::wall_now().ns}, {kForgedSpeed, 0, 0}}; }

}  // namespace

Stranger::Stranger(std::string url, std::uint64_t seed)
    : url_(std::move(url)), bus_(open(url_)), raw_(url_), to_machine_(url_, "127.0.0.1"), random_(seed) {
  if (const Status subscribed = bus_->subscribe(".*", 2000); !subscribed)
    throw std::runtime_error(subscribed.error().message);
}

void Stranger::listen(Duration time) {
  const WallTime until = runtime::steady_now() + time;
  Message message;
  while (runtime::steady_now() < until) {
    const auto came = bus_->receive(message, until - runtime::steady_now());
    if (!came || !*came) continue;
    received_.push_back(message);
    if (received_.size() > kRemembered)
      received_.erase(received_.begin() + static_cast<long>(below(kRemembered)));
  }
}

const Message& Stranger::received() { return received_[below(received_.size())]; }

Message Stranger::forgery() {
  const SensorTime now{runtime::wall_now().ns};
  EmergencyStopCommand release{.stamp = now, .request = 1 + below(1000), .robot = robot().name};
  PoseEstimate pose;
  pose.stamp = now;
  pose.state = SlamState::tracking;
  pose.map_id = "synthetic";
  pose.covariance = PoseCovariance::Identity() * 1e-6;
  AgentSpawn box{.stamp = now, .request = 1 + below(1000)};
  box.agent = agent("box", AgentKind::box, 2, 0);
  switch (below(9)) {
    case 0:
      return message(channel::kMrEmergencyStop, 0, release);
    case 1:
      return message(channel::kMrCmd, 0, forward());
    case 2:
      return message(channel::kPoseCov, 0, pose);
    case 3:
      return message(channel::kMrSpawn, 0, box);
    case 4:
      return message(channel::kScan, 0, scan_at(1));
    case 5:
      return message(channel::kJointCmd, 0, Joints{now, {"arm"}, {1}, {}, {}});
    case 6:
      return message(channel::kOperators, 0,
                     OperatorStatus{now, "ann", robot().name, OperatorStatus::State::drives, "keyboard"});
    case 7:
      return message(channel::kRobot, 0, RobotMessage{now, to_yaml(robot())});
    default:
      return message(channel::kTeleop, 0, forward());
  }
}

Message Stranger::damaged(Message message) {
  auto& bytes = message.payload;
  if (bytes.empty()) return message;
  if (below(3) == 0) bytes.resize(below(bytes.size()));
  for (std::size_t left = below(3) == 0 ? below(80) : 0; left > 0; --left)
    bytes.push_back(static_cast<std::uint8_t>(random_()));
  for (std::size_t left = 1 + below(4); left > 0 && !bytes.empty(); --left)
    bytes[below(bytes.size())] ^= static_cast<std::uint8_t>(1U << below(8));
  return message;
}

Message Stranger::with_trailer_of_another(Message message) {
  const auto& other = received().payload;
  if (other.size() >= kSignatureSize)
    message.payload.insert(message.payload.end(), other.end() - kSignatureSize, other.end());
  return message;
}

Message Stranger::signed_with_own_key(const Message& message) {
  constexpr const char* names[] = {"server", "rover", "ann", "stranger"};
  Signer signer(names[below(std::size(names))], new_secret());
  Message forged = message;
  signer.sign(message.channel, message.payload, {runtime::wall_now().ns}, forged.payload);
  return forged;
}

Datagram Stranger::random_datagram() {
  Datagram bytes{'L', 'C', '0', static_cast<std::uint8_t>(below(2) == 0 ? '2' : '3')};
  for (std::size_t left = below(1000); left > 0; --left)
    bytes.push_back(static_cast<std::uint8_t>(random_()));
  return bytes;
}

void Stranger::publish(const char* kind, const Message& message) {
  ++sent_[kind];
  (void)bus_->publish(message.channel, message.payload);
}

void Stranger::attack() {
  switch (below(9)) {
    case 0:
      return publish("forged, not signed", forgery());
    case 1:
      return publish("received, repeated", received());
    case 2:
      return publish("received, on another channel", {received().channel, {}, received().payload});
    case 3:
      return publish("received, with flipped bits, cut or longer", damaged(received()));
    case 4:
      return publish("forged, with the trailer of another message", with_trailer_of_another(forgery()));
    case 5:
      return publish("forged, signed with a key of its own under the name of another",
                     signed_with_own_key(forgery()));
    case 6:
      ++sent_["random datagrams"];
      return raw_.send(random_datagram());
    case 7:
      ++sent_["fragments that lie"];
      return raw_.send(fragment({static_cast<std::uint32_t>(random_()), static_cast<std::uint32_t>(random_()),
                                 static_cast<std::uint32_t>(random_()), static_cast<std::uint16_t>(below(9)),
                                 static_cast<std::uint16_t>(below(9))},
                                forgery().channel, received().payload));
    default:
      ++sent_["forged, to the machine's own address"];
      return to_machine_.send(short_message(forgery()));
  }
}

namespace {

class Site {
 public:
  explicit Site(int port)
      : server_(port, keys()), robot_url_("udpm://239.255.76.68:" + std::to_string(port) + "?ttl=0") {
    relay_ = std::make_unique<Process>(std::vector<std::string>{"relay", "--keys", file("rover"), "--url",
                                                                server_.url(), "--robot-url", robot_url_},
                                       folder_ / "relay.txt");
    auto motor = open(robot_url_);
    if (!motor->subscribe(channel::kMrCmd, 100)) throw std::runtime_error("cannot subscribe");
    robot_ = std::make_unique<StandInRobot>(join("rover"), std::move(motor));
    ann_ = join("ann");
  }

  std::string url() const { return server_.url(); }
  StandInRobot& robot() { return *robot_; }
  std::string output() const { return server_.output() + bytes_of(folder_ / "relay.txt"); }

  /// The trainee holds the stick until the robot moves or `time` is over.
  bool drives(Duration time) {
    const WallTime until = runtime::steady_now() + time;
    for (int i = 0; runtime::steady_now() < until; ++i) {
      const double speed = i < 20 ? 0 : 0.3;  // the dead-man is pressed after the start
      send(message(channel::kTeleop, 0, TwistCommand{{runtime::wall_now().ns}, {speed, 0, 0}}));
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
      if (robot_->record().moves) return true;
    }
    return false;
  }
  void stop(bool engaged) {
    for (std::uint64_t i = 0; i < 3; ++i)
      send(message(channel::kMrEmergencyStop, 0,
                   EmergencyStopCommand{.stamp = {runtime::wall_now().ns},
                                        .request = ++requests_,
                                        .robot = parhelion::test::robot().name,
                                        .engaged = engaged}));
    std::this_thread::sleep_for(std::chrono::seconds(1));
    robot_->mark();
  }

 private:
  std::string file(const std::string& name) const { return folder_ / (name + ".keys"); }
  std::string keys() {
    for (const std::vector<std::string>& sender :
         {std::vector<std::string>{"rover", "--role", "robot", "--role", "localization"},
          std::vector<std::string>{"ann", "--role", "trainee"}}) {
      std::vector<std::string> arguments{"key", "new"};
      arguments.insert(arguments.end(), sender.begin(), sender.end());
      arguments.insert(arguments.end(), {"--server", file("server"), "-o", file(sender.front())});
      const Ran made = run(arguments, folder_ / "key.txt");
      if (made.exit != 0) throw std::runtime_error(made.output);
    }
    return file("server");
  }
  std::unique_ptr<Bus> join(const std::string& name) const {
    const auto keys = load_keys(file(name));
    if (!keys) throw std::runtime_error(keys.error().message);
    return sign(open(server_.url()), *keys, {});
  }
  void send(const Message& message) { (void)ann_->publish(message.channel, message.payload); }

  TemporaryFolder folder_;
  ServerUnderTest server_;
  const std::string robot_url_;
  std::unique_ptr<Process> relay_;
  std::unique_ptr<StandInRobot> robot_;
  std::unique_ptr<Bus> ann_;
  std::uint64_t requests_ = 0;
};

}  // namespace

bool withstands_stranger(int port, Duration time) {
  Site site(port);
  if (!site.drives(seconds(20.0))) throw std::runtime_error("does not drive: " + site.output());
  Stranger stranger(site.url(), 1);
  std::jthread trainee([&] { site.drives(seconds(3.0)); });
  stranger.listen(seconds(3.0));
  trainee.join();
  site.stop(true);
  bool moved = false;
  const WallTime until = runtime::steady_now() + time;
  while (runtime::steady_now() < until && !moved) {
    stranger.attack();
    stranger.listen(milliseconds(2));
    moved = site.robot().record().fastest > 0;
  }
  const bool still_stopped = !site.drives(seconds(3.0));
  site.stop(false);
  const bool works = site.drives(seconds(10.0));
  for (const auto& [kind, count] : stranger.sent())
    std::printf("| %s | %llu |\n", kind.c_str(), static_cast<unsigned long long>(count));
  std::printf("the robot %s, the stop %s, afterwards the trainee %s\n", moved ? "MOVED" : "never moved",
              still_stopped ? "held" : "WAS LIFTED", works ? "released it and drove" : "COULD NOT DRIVE");
  return !moved && still_stopped && works;
}

}  // namespace parhelion::test
