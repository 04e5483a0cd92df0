// All attacks at once against the real server, while a robot sends it scans.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <thread>

#include "protocols/channels.hpp"
#include "protocols/instructor_command.hpp"
#include "server/runtime/wall_clock.hpp"
#include "server/station/http/accounts.hpp"
#include "server/station/http/password.hpp"
#include "tests/server/tick/synthetic.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/tools/process.hpp"
#include "tests/tools/station/attacks.hpp"

namespace parhelion::tools {
namespace {

using attack::Json;
using test::RawAnswer;
using test::RawClient;

constexpr const char* kPassword = "correct horse";
constexpr double kBarrelDistance = 2;  ///< m, ahead of the robot

class AttackTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::ofstream(folder_ / "model.yaml") << to_yaml(test::room());
    std::ofstream(folder_ / "robot.yaml") << to_yaml(test::robot());
    Scenario scenario;
    scenario.name = "attack";
    const Eigen::Vector3d ahead = test::pose_at(0) * Eigen::Vector3d(kBarrelDistance, 0, 0);
    scenario.agents = {test::agent("barrel", AgentKind::barrel, ahead.x(), ahead.y())};
    scenario.model = "model.yaml";
    scenario.robot = "robot.yaml";
    std::ofstream(folder_ / "scenario.yaml") << to_yaml(scenario);
    make_accounts();
    auto bus = open_network_bus(test::bus_url());
    ASSERT_TRUE(bus.ok()) << bus.error().message;
    bus_ = std::move(*bus);
    for (const char* output : {channel::kMrScan, channel::kTeleop, channel::kJointCmd})
      ASSERT_TRUE(bus_->subscribe(output, 1000).ok());
    for (const char* command : kInstructorChannels) ASSERT_TRUE(bus_->subscribe(command, 1000).ok());
    server_.emplace(
        std::vector<std::string>{"serve", folder_ / "scenario.yaml", "-o", folder_ / "s.lcm", "--url",
                                 test::bus_url(), "--no-restart", "--state-folder", folder_ / "state",
                                 "--http", "127.0.0.1:0", "--report", folder_ / "report.json"},
        folder_ / "serve.txt");
    const WallTime deadline = runtime::steady_now() + seconds(20.0);
    while (port_ == 0 && server_->running() && runtime::steady_now() < deadline) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      const std::string output = test::bytes_of(folder_ / "serve.txt"), before = "http://127.0.0.1:";
      const std::size_t at = output.find(before),
                        end = output.find_first_not_of("0123456789", at + before.size());
      if (at != std::string::npos && end != std::string::npos)
        port_ = static_cast<std::uint16_t>(std::stoi(output.substr(at + before.size())));
    }
    ASSERT_NE(port_, 0) << test::bytes_of(folder_ / "serve.txt");
    // From the first pose on, the barrel is in the robot's scans.
    for (int tries = 0; tries < 200 && injected_ == 0; ++tries) {
      (void)answered(milliseconds(100));
      ASSERT_TRUE(server_->running()) << test::bytes_of(folder_ / "serve.txt");
    }
    ASSERT_GT(injected_, 0U) << test::bytes_of(folder_ / "serve.txt");
  }

  void make_accounts() {
    const std::filesystem::path site = folder_ / "state";
    std::filesystem::create_directories(site);
    std::filesystem::permissions(site, std::filesystem::perms::owner_all);
    auto accounts = station::Accounts::open(site / "accounts.json");
    const auto hash = station::hash_password(kPassword);
    ASSERT_TRUE(accounts && hash);
    for (const station::Role role :
         {station::Role::admin, station::Role::instructor, station::Role::trainee, station::Role::observer})
      ASSERT_TRUE((*accounts)->put(std::string(station::role_name(role)), role, *hash));
  }
  /// Of the account that has its role as name.
  std::string cookie(const std::string& name) const {
    const RawAnswer answer = RawClient(port_).post(
        "/api/v1/login", R"({"name":")" + name + R"(","password":")" + kPassword + "\"}");
    EXPECT_EQ(answer.status, 204) << name;
    const std::string header = answer.headers.at("set-cookie");
    return header.substr(0, header.find(';'));
  }

  /// Sends a scan and the pose of a robot that stands in the room; true if MR_SCAN returns the scan. A scan
  /// without the barrel ahead is counted: the server must list it in its report.
  bool answered(Duration patience) {
    scan_.stamp = SensorTime::from_utime(runtime::wall_now().ns / 1000);
    const Transform<Map, Base> T_map_base = test::pose_at(0);
    publish(channel::kOdometry, Odometry{scan_.stamp, T_map_base.as<Odom, Base>()});
    publish(channel::kScan, scan_);
    const WallTime deadline = runtime::steady_now() + patience;
    for (Message message; runtime::steady_now() < deadline;) {
      const auto came = bus_->receive(message, deadline - runtime::steady_now());
      if (!came || !*came) continue;
      Scan scan;
      if (message.channel != channel::kMrScan) {
        ++commands_;
      } else if (decode(message.channel, message.payload, scan).ok() && scan.stamp == scan_.stamp) {
        take(scan);
        PoseEstimate estimate;
        estimate.stamp = scan_.stamp;
        estimate.T_map_base = T_map_base;
        estimate.covariance = PoseCovariance::Identity() * 1e-4;
        estimate.covariance(5, 5) = 1e-6;
        estimate.map_id = test::room().map_id;
        estimate.state = SlamState::tracking;
        publish(channel::kPoseCov, estimate);
        return true;
      }
    }
    return false;
  }
  void publish(const char* channel, const auto& item) {
    const Message message = test::message(channel, 0, item);
    EXPECT_TRUE(bus_->publish(message.channel, message.payload).ok());
  }
  /// Every beam is unchanged, or ends at the barrel.
  void take(const Scan& scan) {
    ASSERT_EQ(scan.ranges.size(), scan_.ranges.size());
    const double from_laser = kBarrelDistance - test::robot().laser->T_base_laser.translation().x();
    std::size_t at_barrel = 0;
    for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
      if (scan.ranges[i] == scan_.ranges[i]) continue;
      ++at_barrel;
      const double angle = scan.angle_min + static_cast<double>(i) * scan.angle_increment;
      EXPECT_NEAR(angle, 0, 0.3) << "the barrel is straight ahead";
      EXPECT_NEAR(scan.ranges[i], from_laser, 0.5) << "and nowhere else";
      EXPECT_LT(scan.ranges[i], scan_.ranges[i]);
    }
    injected_ += at_barrel >= 10;
    untouched_ += at_barrel == 0;
    EXPECT_TRUE(at_barrel == 0 || at_barrel >= 10) << at_barrel << " beams";
  }

  const test::TemporaryFolder folder_;
  std::unique_ptr<Bus> bus_;
  std::optional<test::Process> server_;
  std::uint16_t port_ = 0;
  Scan scan_ = test::scan_at(0);
  std::size_t injected_ = 0, untouched_ = 0;  ///< scans
  int commands_ = 0;                          ///< on all channels with commands
};

TEST_F(AttackTest, AttacksAreRefusedAndLoggedWhileScansArePublished) {
  attack::Cookies cookies{cookie("admin"), cookie("instructor"), cookie("trainee"), cookie("observer"),
                          cookie("trainee")};
  ASSERT_EQ(RawClient(port_).post("/api/v1/logout", "", cookies.over).status, 204);

  struct Attack {
    std::function<void(const attack::Attacker&, const attack::Cookies&)> commit;
    std::vector<std::string> noted;  ///< expected entries of the audit log, among others
  };
  const auto malformed_messages_to = [](const char* path) {
    return [path](const attack::Attacker& attacker, const attack::Cookies& known) {
      attack::with_malformed_messages(attacker, path, known);
    };
  };
  const std::vector<Attack> attacks = {
      {attack::without_a_cookie, {"GET /ws/state", "GET /ws/teleop", "GET /ws/video", "GET /video.mjpg"}},
      {attack::with_anothers_role, {"GET /api/v1/accounts", "POST /api/v1/accounts", "GET /ws/teleop"}},
      {attack::with_a_cookie_that_is_over, {"GET /api/v1/model", "GET /ws/teleop"}},
      {attack::from_another_site, {"GET /ws/teleop", "POST /api/v1/logout", "GET /healthz"}},
      {attack::with_requests_too_long, {"a request"}},
      {attack::with_paths_out_of_the_page, {"GET /../accounts.json", "GET /%2e%2e/accounts.json"}},
      {attack::as_a_trainee_who_instructs, {"spawn a", "end"}},
      {attack::with_script_in_names, {"account " + attack::kMarkup, "log in as " + attack::kMarkup}},
      {attack::with_ten_thousand_passwords, {"log in as admin", "try a password of admin"}},
      {attack::with_broken_and_enormous_frames, {"message on /ws/state", "message on /ws/teleop"}},
      {malformed_messages_to("/ws/state"), {"unreadable message"}},
      {malformed_messages_to("/ws/teleop"), {"message on /ws/teleop"}},
      {malformed_messages_to("/ws/video"), {"message on /ws/video"}}};
  const auto address_of = [](std::size_t attack) { return "127.0.0." + std::to_string(10 + attack); };
  // While the other attacks last: requests that never end, and a page that never reads.
  std::vector<std::unique_ptr<RawClient>> slow;
  for (int i = 0; i < 200; ++i) {
    slow.push_back(std::make_unique<RawClient>(port_));
    ASSERT_TRUE(slow.back()->send("GET /healthz HTTP/1.1\r\nX-Slow: "));
  }
  RawClient unresponsive(port_);
  ASSERT_EQ(unresponsive.open_socket("/ws/state", cookies.observer).status, 101);

  std::atomic<std::size_t> over = 0;
  std::vector<std::thread> attackers;
  for (std::size_t i = 0; i < attacks.size(); ++i) {
    attackers.emplace_back([&, i] {
      attacks[i].commit(attack::Attacker(port_, address_of(i)), cookies);
      ++over;
    });
  }
  const std::size_t injected_before = injected_;
  std::size_t scans = 0;
  for (bool fine = true; fine && (over < attacks.size() || scans < 100); ++scans) {
    fine = answered(seconds(20.0));
    EXPECT_TRUE(fine) << "scan " << scans << " was not answered";
    (void)slow[scans % slow.size()]->send("x");
  }
  for (std::thread& each : attackers) each.join();
  EXPECT_EQ(commands_, 0) << "nobody was told to move, or to come";
  EXPECT_EQ(RawClient(port_).get("/healthz").status, 200);

  // Each is recorded with its source address.
  const Json log = Json::parse(RawClient(port_).get("/api/v1/audit", cookies.admin).body)["entries"];
  for (std::size_t i = 0; i < attacks.size(); ++i) {
    for (const std::string& noted : attacks[i].noted) {
      const bool found = std::any_of(log.begin(), log.end(), [&](const Json& entry) {
        return entry["from"] == address_of(i) && entry["what"] == noted && entry["outcome"] != "done";
      });
      EXPECT_TRUE(found) << noted << " from " << address_of(i);
    }
  }

  server_->signal(SIGINT);
  EXPECT_EQ(server_->wait(), 0) << test::bytes_of(folder_ / "serve.txt");
  const Json report = Json::parse(test::bytes_of(folder_ / "report.json"));
  EXPECT_EQ(report["scans"]["in"], report["scans"]["out"]) << report["scans"];
  EXPECT_GE(report["scans"]["in"].get<std::size_t>(), scans);
  // Injection continued: the report lists each scan without the barrel (late, or before the first pose).
  std::printf("%zu scans while it was attacked, %zu of them with the barrel\n", scans,
              injected_ - injected_before);
  EXPECT_GE(injected_ - injected_before, scans * 9 / 10) << report["scans"];
  std::size_t degraded = 0;
  for (const auto& [why, count] : report["scans"]["degraded"].items()) degraded += count.get<std::size_t>();
  EXPECT_LE(untouched_, degraded) << report["scans"];
}

}  // namespace
}  // namespace parhelion::tools
