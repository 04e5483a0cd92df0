// Messages about a session to pages.
#include "server/station/state_feed.hpp"

#include <gmock/gmock.h>

#include <set>

#include "server/simulation/bodies/bodies.hpp"
#include "server/station/operator_name.hpp"
#include "tests/number_at.hpp"
#include "tests/server/station/feed_fixture.hpp"
#include "tests/server/tick/several_lasers.hpp"

namespace parhelion::test {
namespace {

using testing::ElementsAre;

TEST_F(FeedTest, APageReceivesTheCurrentStateWhenItOpens) {
  start(configuration({agent("box_1", AgentKind::box, 1, 0)}));
  kWorld({body("box_1", "box", AgentKind::box, 1)});
  report_event(EventKind::movement_started, "box_1");
  const auto client = open(1, station::Role::observer, "bo");
  const auto hello = client->newest("hello");
  EXPECT_EQ(hello["who"]["name"], "bo");
  EXPECT_EQ(hello["who"]["role"], "observer");
  EXPECT_EQ(hello["session"]["started_us"], kStartUs);
  EXPECT_EQ(hello["session"]["mode"], "live");
  EXPECT_EQ(client->newest("events")["list"].size(), 1U);
  EXPECT_FALSE(client->newest("status").is_null());
}

TEST_F(FeedTest, PagesShowTheAccountNameOfTheDriver) {
  start(configuration({}));
  const auto client = open(1, station::Role::trainee, "tess");
  OperatorStatus status;
  status.stamp = sensor_time();
  status.name = station::operator_name({"tess", station::Role::trainee});
  status.robot = "synthetic";
  status.state = OperatorStatus::State::drives;
  status.text = "browser";
  take(channel::kOperators, status);
  pass(0.6);
  ASSERT_EQ(client->newest("operators")["list"].size(), 1U);
  EXPECT_EQ(client->newest("operators")["list"][0]["name"], "tess");
}

/// Anybody on the bus can send one, and pages get the last 500 when they open.
TEST_F(FeedTest, AnEventOfAMegabyteIsNotKept) {
  start(configuration({}));
  Event event;
  event.stamp = at(0);
  event.kind = EventKind::movement_started;
  for (const std::size_t size : {std::size_t{1'000'000}, std::size_t{1'000}}) {
    event.text = std::string(size, 'x');
    take(channel::kMrEvents, event);
  }
  const auto events = open()->newest("events");
  ASSERT_EQ(events["list"].size(), 1U);
  EXPECT_EQ(events["list"][0]["text"].get<std::string>().size(), 1'000U);
}

class OperatorsFeedTest : public FeedTest {
 protected:
  void send_status(const std::string& name) {
    OperatorStatus status;
    status.stamp = sensor_time();
    status.name = name;
    status.robot = "synthetic";
    status.state = OperatorStatus::State::drives;
    take(channel::kOperators, status);
  }
  static std::set<std::string> names_in(const nlohmann::json& operators) {
    std::set<std::string> names;
    for (const auto& each : operators["list"]) names.insert(each["name"]);
    return names;
  }
};

/// New names all the time: who repeats his, as consoles do, is listed, and so is who has a page.
TEST_F(OperatorsFeedTest, AFloodOfNewNamesHidesNoOperator) {
  start(configuration({}));
  const auto ada = open(1, station::Role::instructor, "ada"), tess = open(2, station::Role::trainee, "tess");
  const std::string page = station::operator_name({"tess", station::Role::trainee});
  int next = 0;
  for (int step = 0; step < 20; ++step) {
    for (int i = 0; i < 100; ++i) send_status("operator_" + std::to_string(next++));
    if (step >= 5 && step % 4 == 0) send_status("anna");
    if (step == 5) send_status(page);
    pass(0.1);
    if (step == 6) {
      EXPECT_TRUE(names_in(ada->newest("operators")).contains("tess")) << "at once";
    }
    if (step < 14) continue;
    EXPECT_TRUE(names_in(ada->newest("operators")).contains("anna")) << step;
    EXPECT_LE(names_in(ada->newest("operators")).size(), 64U);
  }
}

/// Names come from the bus: pages list some of a flood, and others again when it is over.
TEST_F(OperatorsFeedTest, PagesListABoundedNumberOfOperators) {
  start(configuration({}));
  const auto client = open();
  for (int i = 0; i < 1000; ++i) send_status("operator_" + std::to_string(i));
  pass(0.6);
  EXPECT_EQ(client->newest("operators")["list"].size(), 64U);
  pass(2);
  send_status("tess");
  pass(0.6);
  EXPECT_EQ(client->newest("operators")["list"].size(), 1U);
}

TEST_F(FeedTest, PublishesEntitiesWithShapesAndFramesWithPoses) {
  start(configuration({agent("box_1", AgentKind::box, 1, 0)}));
  const auto client = open();
  t_ = 2.5;
  kWorld({body("box_1", "box", AgentKind::box, 1.25)});
  const auto entities = client->newest("entities");
  ASSERT_EQ(entities["list"].size(), 1U);
  EXPECT_EQ(entities["list"][0]["name"], "box_1");
  EXPECT_EQ(entities["list"][0]["kind"], "box");
  const int form = entities["list"][0]["parts"][0]["form"];
  ASSERT_GE(form, 0);
  EXPECT_EQ(entities["forms"][form][0]["shape"], "box");

  const auto frames = client->frames(1);
  ASSERT_EQ(frames.size(), 1U);
  const std::string& frame = frames[0];
  ASSERT_EQ(frame.size(), 16U + 32U);
  EXPECT_EQ(number_at<std::uint16_t>(frame, 2), entities["table"].get<int>());
  EXPECT_EQ(number_at<std::uint32_t>(frame, 4), 1U);
  EXPECT_DOUBLE_EQ(number_at<double>(frame, 8), 2.5);
  EXPECT_EQ(number_at<std::uint16_t>(frame, 16), entities["list"][0]["parts"][0]["id"].get<int>());
  EXPECT_FLOAT_EQ(number_at<float>(frame, 20), 1.25F);
  EXPECT_FLOAT_EQ(number_at<float>(frame, 44), 1.0F);  // qw
}

TEST_F(FeedTest, PersonsReuseTheSameShapes) {
  std::vector<AgentDefinition> persons;
  std::vector<WorldMessage::Entry> bodies;
  for (int i = 0; i < 20; ++i) {
    const std::string name = "person_" + std::to_string(i);
    persons.push_back(agent(name, AgentKind::person, 0, 0));
    for (const BodyDefinition& each : simulation::agent_bodies(persons.back(), 1))
      bodies.push_back(body(name, each.part, AgentKind::person, i));
  }
  start(configuration(persons));
  const auto client = open();
  kWorld(bodies);
  const auto entities = client->newest("entities");
  EXPECT_EQ(entities["list"].size(), 20U);
  EXPECT_LE(entities["forms"].size(), 9U);
}

TEST_F(FeedTest, LimitsAChangingTableToFourMessagesASecond) {
  start(configuration({}));
  const auto client = open();
  std::vector<WorldMessage::Entry> bodies;
  for (int i = 0; i < 30; ++i) {  // one more per frame, for a second
    bodies.push_back(body("box_" + std::to_string(i), "box", AgentKind::box, i));
    kWorld(bodies);
    pass(1.0 / 30);
  }
  const auto tables = client->messages_of_type("entities");
  EXPECT_GE(tables.size(), 3U);
  EXPECT_LE(tables.size(), 5U);
  const std::string last = client->frames(1).back();
  EXPECT_EQ(number_at<std::uint16_t>(last, 2), tables.back()["table"].get<int>());
  EXPECT_LE(number_at<std::uint32_t>(last, 4), tables.back()["list"].size());
}

TEST_F(FeedTest, APageGetsTheWorldAtItsOwnRate) {
  start(configuration({}));
  const auto fast = open(1), slow = open(2);
  station::Subscription wanted;
  wanted.world_hz = 10;
  feed_->subscribe(2, wanted);
  for (int i = 0; i < 60; ++i) {
    kWorld({body("box_1", "box", AgentKind::box, i)});
    pass(1.0 / 30);
  }
  EXPECT_GE(fast->frames(1).size(), 58U);
  EXPECT_GE(slow->frames(1).size(), 18U);
  EXPECT_LE(slow->frames(1).size(), 22U);
}

TEST_F(FeedTest, DepthPointsAreSentInTheMapFrameOnRequest) {
  tick::Configuration configuration = test::configuration({});
  DepthCameraDescription camera;
  camera.intrinsics.width = 4;
  camera.intrinsics.height = 2;
  camera.intrinsics.fx = camera.intrinsics.fy = 4;
  camera.intrinsics.cx = 2;
  camera.intrinsics.cy = 1;
  // Looks along the robot's x axis, 0.2 m in front and 0.5 m up.
  camera.T_base_optical = {Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5), {0.2, 0, 0.5}};
  camera.range_min = 0.1;
  camera.range_max = 8;
  configuration.robot.depth = camera;
  start(configuration);
  const auto asks = open(1), other = open(2);
  station::Subscription points;
  points.points = true;
  feed_->subscribe(1, points);
  for (const Message& each : drive(0.5)) {
    if (each.channel == channel::kOdometry || each.channel == channel::kPoseCov) feed_->take(each, now());
  }
  Image image;
  image.stamp = scan_at(0.3).stamp;
  image.width = 4;
  image.height = 2;
  image.row_stride = 8;
  image.format = PixelFormat::depth_mm;
  image.metadata.push_back({"encoding", {'r', 'a', 'w'}});
  image.bytes.assign(16, 0);
  const auto set = [&](std::size_t pixel, int millimetres) {
    image.bytes[2 * pixel] = static_cast<std::uint8_t>(millimetres & 0xff);
    image.bytes[2 * pixel + 1] = static_cast<std::uint8_t>(millimetres >> 8);
  };
  set(6, 3000);  // u 2, v 1: on the axis
  set(1, 9000);  // beyond the range
  set(7, 1000);  // u 3: a quarter of its depth to the right
  take(channel::kDepth, image);
  take(channel::kDepth, image);  // before any page subscribes
  EXPECT_TRUE(other->frames(3).empty());
  const auto frames = asks->frames(3);
  ASSERT_EQ(frames.size(), 1U);
  ASSERT_EQ(number_at<std::uint32_t>(frames[0], 4), 2U);
  ASSERT_EQ(frames[0].size(), 16U + 2 * 16U);
  const auto T_map_base = pose_at(0.3);
  const Eigen::Vector3d ahead = T_map_base.isometry() * Eigen::Vector3d(3.2, 0, 0.5),
                        right = T_map_base.isometry() * Eigen::Vector3d(1.2, -0.25, 0.5);
  for (int k = 0; k < 3; ++k) {
    const auto at = static_cast<std::size_t>(16 + 4 * k);
    EXPECT_NEAR(number_at<float>(frames[0], at), ahead[k], 0.02) << k;
    EXPECT_NEAR(number_at<float>(frames[0], at + 16), right[k], 0.02) << k;
  }
  t_ = 0.25;
  image.bytes.resize(3);
  take(channel::kDepth, image);
  EXPECT_EQ(asks->frames(3).size(), 1U) << "a broken image shows nothing";
}

TEST_F(FeedTest, ScansContainLaserPoseAndBeamHits) {
  start(configuration({agent("box_1", AgentKind::box, 1, 0)}));
  const auto client = open();
  kWorld({body("box_1", "box", AgentKind::box, 1)});
  for (const Message& each : drive(0.5)) {
    if (each.channel == channel::kOdometry || each.channel == channel::kPoseCov) feed_->take(each, now());
  }
  const Scan scan = scan_at(0.3);
  take(channel::kScan, scan);
  take(channel::kMrScan, scan);
  ScanInfo info;
  info.stamp = scan.stamp;
  info.live = true;
  info.agents = {"box_1"};
  info.beam_agent.assign(scan.ranges.size(), -1);
  info.beam_agent[3] = 0;
  take(channel::kMrScanInfo, info);

  const auto frames = client->frames(2);
  ASSERT_EQ(frames.size(), 2U);
  const std::string& augmented = frames[1];
  const std::size_t n = scan.ranges.size();
  ASSERT_EQ(augmented.size(), 40 + 6 * n);
  EXPECT_EQ(augmented[1], 1);
  const auto T_map_laser = pose_at(0.3) * robot().laser->T_base_laser;
  EXPECT_NEAR(number_at<float>(augmented, 16), T_map_laser.translation().x(), 0.01);
  EXPECT_NEAR(number_at<float>(augmented, 20), T_map_laser.translation().y(), 0.01);
  EXPECT_NEAR(number_at<float>(augmented, 24), T_map_laser.yaw(), 0.01);
  EXPECT_EQ(number_at<float>(augmented, 40), scan.ranges[0]);
  EXPECT_EQ(number_at<std::int16_t>(augmented, 40 + 4 * n + 2 * 2), -1);
  EXPECT_EQ(number_at<std::int16_t>(augmented, 40 + 4 * n + 2 * 3), 0);
}

TEST_F(FeedTest, AScanWithUnknownPoseReportsIt) {
  start(configuration({}));
  const auto client = open();
  take(channel::kScan, scan_at(0.3));
  ASSERT_EQ(client->frames(2).size(), 1U);
  EXPECT_TRUE(std::isnan(number_at<float>(client->frames(2)[0], 16)));
}

TEST_F(FeedTest, AWorldOfAThousandAgentsIsEncodedOnce) {
  start(configuration({}));
  std::vector<std::shared_ptr<ListeningClient>> clients;
  for (std::uint64_t i = 1; i <= 22; ++i) clients.push_back(open(i));
  std::vector<WorldMessage::Entry> bodies;
  for (int i = 0; i < 1000; ++i) bodies.push_back(body("box_" + std::to_string(i), "box", AgentKind::box, i));
  kWorld(bodies);
  for (const auto& client : clients) {
    ASSERT_EQ(client->frames(1).size(), 1U);
    EXPECT_EQ(client->frames(1)[0].size(), 16U + 32U * 1000U);
  }
}

TEST_F(FeedTest, SensorsAreReportedWithRateAgeAndLoss) {
  start(configuration({}));
  const auto client = open();
  for (int i = 0; i < 40; ++i) {
    pass(0.05);
    if (i % 4 == 3) continue;  // one of four is lost
    Odometry odometry;
    odometry.stamp = sensor_time();
    take(channel::kOdometry, odometry);
  }
  pass(1.0);
  nlohmann::json odometry, scan;
  const auto status = client->newest("status");
  for (const auto& sensor : status["sensors"]) {
    if (sensor["name"] == "ODOMETRY") odometry = sensor;
    if (sensor["name"] == "SCAN") scan = sensor;
  }
  EXPECT_EQ(scan["state"], "none");
  EXPECT_TRUE(scan["age_ms"].is_null());
  EXPECT_EQ(odometry["state"], "lost");
  EXPECT_NEAR(odometry["age_ms"].get<double>(), 1050, 60);
  EXPECT_NEAR(odometry["loss"].get<double>(), 0.25, 0.05);
  EXPECT_NEAR(odometry["rate_hz"].get<double>(), 15, 1);
}

TEST_F(FeedTest, SensorsListTheScansOfEachLaserAndTheirAnswers) {
  start(two_lasers_configuration({}));
  const auto client = open();
  for (int i = 0; i < 40; ++i) {
    pass(0.1);
    Scan scan;
    scan.stamp = sensor_time();
    take(channel::kScan, scan);
    if (i >= 20) continue;  // falls silent
    take(kRearScan, scan);
    take(kMrRearScan, scan);
  }
  pass(1.0);
  std::map<std::string, std::string> states;
  const auto status = client->newest("status");
  for (const auto& sensor : status["sensors"]) states[sensor["name"]] = sensor["state"];
  EXPECT_EQ(states["SCAN_rear"], "lost");
  EXPECT_EQ(states["MR_SCAN_rear"], "lost");
  EXPECT_NE(states["SCAN"], "none");
  EXPECT_FALSE(states.contains("MR_SCAN_INFO_rear"));
}

TEST_F(FeedTest, TasksReportTheirRemainingTimeAndEnd) {
  tick::Configuration graded = configuration({});
  Training training;
  training.on_command = false;
  training.pass_mark = 0.5;
  Task task;
  task.name = "door";
  task.text = "Go through the door";
  task.points = 50;
  task.limit = 20;
  training.tasks = {task};
  graded.scenario.training = training;
  start(graded);
  const auto client = open();
  EXPECT_EQ(client->newest("score")["tasks"][0]["state"], "waiting");
  report_event(EventKind::task_started, "robot", "door", 50);
  pass(5);
  auto score = client->newest("score");
  EXPECT_EQ(score["tasks"][0]["state"], "running");
  EXPECT_NEAR(score["tasks"][0]["left_s"].get<double>(), 15, 0.1);
  report_event(EventKind::task_done, "robot", "door", 50);
  report_event(EventKind::score_changed, "robot", "door", 50);
  report_event(EventKind::grading_ended, "robot", "", 50);
  pass(0.1);
  score = client->newest("score");
  EXPECT_EQ(score["tasks"][0]["state"], "done");
  EXPECT_EQ(score["score"], 50);
  EXPECT_EQ(score["possible"], 50);
  EXPECT_EQ(score["passed"], true);
}

TEST_F(FeedTest, ANewSessionHeaderClearsEarlierEvents) {
  start(configuration({}));
  const auto client = open();
  kWorld({body("box_1", "box", AgentKind::box, 1)});
  report_event(EventKind::movement_started, "box_1");
  pass(0.1);
  SessionHeader header;
  header.stamp = SensorTime::from_utime(kStartUs);
  take(channel::kMrSession, header);
  EXPECT_EQ(client->messages_of_type("hello").size(), 2U);
  EXPECT_EQ(client->newest("events")["list"].size(), 0U);
}

TEST_F(FeedTest, UnreadableMessagesChangeNothing) {
  start(configuration({}));
  const auto client = open();
  const std::size_t before = client->sent.size();
  for (const auto& [channel, capacity] : feed_->channels()) {
    feed_->take({channel, ArrivalTime::from_utime(kStartUs), {}}, now());
    feed_->take({channel, ArrivalTime::from_utime(kStartUs), std::vector<std::uint8_t>(100, 0xA5)}, now());
  }
  feed_->take({"MR_AGENT__SCAN", ArrivalTime::from_utime(kStartUs), {1, 2, 3}}, now());
  EXPECT_EQ(client->sent.size(), before);
}

}  // namespace
}  // namespace parhelion::test
