#include "tools/validate.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "protocols/bus/log_file.hpp"
#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "protocols/model.hpp"
#include "protocols/robot.hpp"
#include "protocols/scenario.hpp"
#include "server/runtime/replay.hpp"
#include "tests/recordings.hpp"
#include "tests/server/tick/synthetic.hpp"
#include "tests/temporary_folder.hpp"

namespace parhelion::tools {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class Validate : public ::testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directories(folder_); }
  std::string file(const std::string& name, const std::string& text) const {
    const auto path = folder_ / name;
    std::ofstream(path, std::ios::binary) << text;
    return path.string();
  }
  const test::TemporaryFolder temporary_;  // of each test: they run at the same time
  const std::filesystem::path folder_ = temporary_ / "files";
};

TEST_F(Validate, WarnsOfAModelFloorAwayFromTheRobots) {
  SemanticModel model;
  model.entities.resize(1);
  model.entities[0].name = "floor";
  model.entities[0].label = EntityLabel::floor;
  model.entities[0].size = {5, 5, 0.1};
  model.entities[0].T_map_body = Transform<Map, Body>::planar(0, 0, 0, -1.35);
  EXPECT_THAT(validate_file(file("low.yaml", to_yaml(model))).notes,
              ElementsAre(AllOf(HasSubstr("z = -1.30 m"), HasSubstr("--floor-to-zero"))));
  model.entities[0].T_map_body = Transform<Map, Body>::planar(0, 0, 0, -0.05);
  EXPECT_THAT(validate_file(file("level.yaml", to_yaml(model))).notes, IsEmpty());
}

TEST_F(Validate, EveryShippedScenarioIsInOrder) {
  int scenarios = 0;
  for (const auto& entry :
       std::filesystem::recursive_directory_iterator(PARHELION_SOURCE_DIR "/server/scenarios")) {
    if (entry.path().extension() != ".yaml") continue;
    // Models of real sites are built from recordings, which are not shipped.
    if (const auto scenario = load_scenario(entry.path().string());
        scenario && !std::filesystem::exists(scenario->model))
      continue;
    const auto verdict = validate_file(entry.path().string());
    EXPECT_THAT(verdict.errors, IsEmpty()) << entry.path();
    scenarios += verdict.summary.starts_with("scenario");
  }
  EXPECT_GE(scenarios, 20);
}

TEST_F(Validate, ReportsTheKindOfEachFile) {
  EXPECT_THAT(validate_file(file("m.yaml", to_yaml(SemanticModel()))).summary,
              HasSubstr("semantic model, 0 entities"));
  EXPECT_THAT(validate_file(file("r.yaml", to_yaml(RobotDescription()))).summary,
              HasSubstr("robot description 'robot'"));
  EXPECT_THAT(validate_file(PARHELION_SOURCE_DIR "/fusion/scan/presets/s3000.yaml").summary,
              HasSubstr("laser preset"));
  const auto none = validate_file(file("x.yaml", "colour: red\n"));
  EXPECT_THAT(none.errors, ElementsAre(HasSubstr("none of its keys")));
  EXPECT_THAT(validate_file((folder_ / "absent.yaml").string()).errors,
              ElementsAre(HasSubstr("cannot be opened")));
  EXPECT_THAT(validate_file(folder_.string()).errors, ElementsAre(HasSubstr("is a folder")));
  EXPECT_THAT(validate_file(file("empty", "")).errors, ElementsAre(HasSubstr("the file is empty")));
}

std::string write_checked_log(const std::string& path, const std::vector<Message>& messages) {
  auto writer = LogWriter::create(path, true);
  EXPECT_TRUE(writer);
  EXPECT_TRUE(writer->write(messages));
  return path;
}

/// A robot that level 3 can use.
const char* const kUsableRobot =
    "laser: {preset: lms-200, pose: {x: 0 m}}\nfootprint: [[-0.3 m, -0.3 m], [0.3 m, -0.3 m], [0.3 m, 0.3 "
    "m], [-0.3 m, 0.3 "
    "m]]\n";

// A laser cannot tell people from walls that are unknown.
TEST_F(Validate, NotesThatPeopleAreNotTrackedWithoutAModel) {
  file("robot.yaml", kUsableRobot);
  EXPECT_THAT(validate_file(file("s.yaml", "level: 3\nrobot: robot.yaml\n")).notes,
              ElementsAre(HasSubstr("real people and obstacles are not tracked")));
  file("room.yaml", to_yaml(test::room()));
  EXPECT_THAT(validate_file(file("s.yaml", "level: 3\nrobot: robot.yaml\nmodel: room.yaml\n")).notes,
              IsEmpty());
  EXPECT_THAT(
      validate_file(file("s.yaml", "level: 1\ntrainee: {model: rover, pose: {x: 0 m, y: 0 m}}\n")).notes,
      IsEmpty());
}

TEST_F(Validate, WarnsOfARobotInMillimetres) {
  const auto verdict = validate_file(
      file("r.yaml",
           "laser: {preset: lms-200, pose: {x: 0 m}}\n"
           "footprint: [[-300 m, -200 m], [300 m, -200 m], [300 m, 200 m], [-300 m, 200 m]]\n"));
  EXPECT_THAT(verdict.errors, IsEmpty());
  EXPECT_THAT(verdict.notes, ElementsAre(AllOf(HasSubstr("warning"), HasSubstr("millimetres"))));
}

TEST_F(Validate, ScenarioIsCheckedWithTheFilesThatItNames) {
  file("model.yaml", to_yaml(SemanticModel()));
  file("robot.yaml", kUsableRobot);
  const auto good = validate_file(file("s.yaml", "level: 3\nmodel: model.yaml\nrobot: robot.yaml\n"));
  EXPECT_THAT(good.errors, IsEmpty());
  EXPECT_THAT(good.summary, HasSubstr("scenario '', level 3, 0 agents"));

  file("robot.yaml", "mass: 0 kg\n");
  EXPECT_THAT(validate_file(file("s.yaml", "model: none.yaml\nrobot: robot.yaml\n")).errors,
              ElementsAre(AllOf(HasSubstr("s.yaml:1: model "), HasSubstr("none.yaml does not exist"),
                                HasSubstr("parhelion demo --headless --fast --folder " + folder_.string()))));
  EXPECT_THAT(validate_file(file("s.yaml", "model: model.yaml\nrobot: robot.yaml\n")).errors,
              ElementsAre(HasSubstr("robot.yaml:1: 'mass': expected mass > 0 kg")));
  EXPECT_THAT(validate_file(file("s.yaml",
                                 "agents:\n  - {name: a, kind: box, pose: {x: 1 m}}\n"
                                 "  - {name: b, kind: robot, pose: {x: 4 m}, laser: lms201}\n"))
                  .errors,
              ElementsAre(AllOf(HasSubstr("s.yaml:3: "), HasSubstr("no laser preset is called 'lms201'"))));
  EXPECT_THAT(validate_file(file("s.yaml", "agnets: []\n")).errors,
              ElementsAre(HasSubstr("did you mean 'agents'?")));
}

TEST_F(Validate, RefusesWhatServeAndReplayRefuseWithTheirErrors) {
  file("no_footprint.yaml", "laser: {preset: lms-200, pose: {x: 0 m}}\n");
  file("no_laser.yaml", "name: r\n");
  file("workshop_model.yaml", "entities: []\n");
  const std::pair<const char*, const char*> cases[] = {
      {"name: x\nlevel: 1\n", "s.yaml:2: scenario 'x': level 1 needs the trainee's robot"},
      {"robot: no_footprint.yaml\n", "no_footprint.yaml:1: robot description 'robot' has a footprint of 0"},
      {"robot: no_laser.yaml\n", "no_laser.yaml:1: robot description 'r' has no laser"},
      {"name: x\nagents:\n  - {name: a, kind: box, pose: {x: 1 m}}\n"
       "  - {name: b, kind: box, pose: {x: 1 m}}\n",
       "s.yaml:4: scenario agent 'b': "},
      {"name: x\nagents:\n  - {name: case_1, kind: box, pose: {x: 1 m}}\n"
       "  - {name: drum, kind: barrel, pose: {x: 3 m}}\nhazards:\n"
       "  - {name: device, kind: device, agent: case_2, tilt: 30 deg}\n",
       "s.yaml:6: hazard 'device': there is no agent 'case_2', did you mean 'case_1'? There are: case_1, "
       "drum"},
      {"name: x\ntraining:\n  tasks:\n    - {name: t, points: 1, done: {still: 1 s}}\n  penalties:\n"
       "    - {name: p, points: 1, when: {event: dose_limit, object: lead}}\n",
       "s.yaml:6: penalty 'p': there is no dose of 'lead'; there are: radiation, gas"},
      {"name: x\nmodel: workshop_modell.yaml\n",
       "workshop_modell.yaml does not exist, did you mean 'workshop_model.yaml'? `parhelion demo"},
      {"name: x\ndoors:\n  - {name: door 1, locked: true}\n",
       "s.yaml:3: scenario door 'door 1': the model has no door of this name; none is defined"},
      {"name: x\ntraining:\n  tasks:\n    - {name: s, points: 1, done: {still: 1 s}}\n"
       "    - {name: t, points: 1, done: {pass: dor 1}}\n",
       "s.yaml:5: task 't': there is no door 'dor 1'"}};
  const std::string log = write_checked_log((folder_ / "s.lcm").string(), test::drive(1));
  for (const auto& [text, words] : cases) {
    const std::string path = file("s.yaml", text);
    const auto verdict = validate_file(path);
    ASSERT_THAT(verdict.errors, ElementsAre(HasSubstr(words)));
    runtime::ReplayOptions options;
    options.log = log;
    options.scenario = path;
    const auto report = runtime::replay(options);
    ASSERT_FALSE(report) << text;
    EXPECT_THAT(verdict.errors[0], HasSubstr(report.error().message));
  }
  EXPECT_THAT(validate_file(file("cart.urdf", "<robot name='cart'/>\n")).errors,
              ElementsAre(HasSubstr("cart.urdf:1: XML, such as a URDF; expected YAML")));
  EXPECT_THAT(validate_file(file("noise.lcm", std::string("noise\0noise", 11))).errors,
              ElementsAre(HasSubstr("noise.lcm: is not an LCM log")));
  EXPECT_THAT(validate_file((folder_ / "no_footprint.yaml").string()).errors,
              ElementsAre(HasSubstr("has a footprint of 0 corners")));
}

TEST_F(Validate, AWaypointInAWallOrOutsideTheSiteIsNamedWithItsLine) {
  file("room.yaml", to_yaml(test::room()));
  const auto errors_with = [&](const std::string& waypoint) {
    return validate_file(file("s.yaml",
                              "model: room.yaml\nagents:\n  - name: walker\n    kind: person\n"
                              "    pose: {x: 1 m, y: 1 m}\n    behaviour:\n      kind: patrol\n"
                              "      waypoints:\n        - [2 m, 2 m]\n        - " +
                                  waypoint + "\n"))
        .errors;
  };
  EXPECT_THAT(errors_with("[3 m, 2 m]"), IsEmpty());
  EXPECT_THAT(errors_with("[5.02 m, 1 m]"),
              ElementsAre(HasSubstr("s.yaml:10: agent 'walker': waypoint 2: (5.02, 1.00) is in 'wall 4'")));
  EXPECT_THAT(
      errors_with("[500 m, 0 m]"),
      ElementsAre(AllOf(HasSubstr("s.yaml:3: "), HasSubstr("waypoint (500.00, 0.00) is far outside"))));
}

TEST_F(Validate, WarnsOfALimitThatTheStraightPathDoesNotMeet) {
  file("room.yaml", to_yaml(test::room()));
  const auto notes_with = [&](const std::string& first, const std::string& second) {
    const auto verdict = validate_file(
        file("s.yaml",
             "level: 1\nmodel: room.yaml\ntrainee: {model: rover, pose: {x: -4 m}}\nzones:\n"
             "  - {name: east, box: {center: [3 m, 0 m], size: [1 m, 1 m]}}\n"
             "  - {name: west, box: {center: [-3 m, 0 m], size: [1 m, 1 m]}}\ntraining:\n  tasks:\n"
             "    - {name: go, points: 1, limit: " +
                 first +
                 ", done: {reach: east}}\n"
                 "    - {name: back, points: 1, limit: " +
                 second + ", done: {reach: west}}\n"));
    EXPECT_THAT(verdict.errors, IsEmpty());
    return verdict.notes;
  };
  EXPECT_THAT(notes_with("10 min", "10 min"), IsEmpty());
  EXPECT_THAT(notes_with("1 s", "10 min"),
              ElementsAre(AllOf(HasSubstr("warning: "), HasSubstr("s.yaml:9: task 'go': its limit of 1.0 s"),
                                HasSubstr("6.50 m"))));
  EXPECT_THAT(
      notes_with("10 min", "1 s"),
      ElementsAre(AllOf(HasSubstr("s.yaml:10: task 'back': its limit of 1.0 s"), HasSubstr("5.00 m"))));
}

Message message(const char* channel, std::int64_t arrival_us, const Scan& scan) {
  Message out{channel, ArrivalTime::from_utime(arrival_us), {}};
  encode(scan, out.payload);
  return out;
}

TEST_F(Validate, LogEventsAreCountedAndMistakesReported) {
  Scan scan;
  scan.stamp = SensorTime::from_utime(1'600'000'000'000'000);
  scan.ranges = {1, 2, 3};
  scan.angle_increment = 0.1F;
  std::vector<Message> messages{message(channel::kScan, 10, scan)};
  scan.stamp = scan.stamp + seconds(0.1);
  messages.push_back(message(channel::kScan, 20, scan));
  messages.push_back(message("OTHER", 30, scan));
  const std::string path = (folder_ / "a.lcm").string();
  const auto good = validate_file(write_checked_log(path, messages));
  EXPECT_THAT(good.errors, IsEmpty());
  EXPECT_THAT(good.summary, HasSubstr("LCM log, 3 events on 2 channels, 0.000 s"));
  EXPECT_THAT(good.notes, ElementsAre(HasSubstr("OTHER"), HasSubstr("SCAN")));

  messages.push_back(message(channel::kOdometry, 40, scan));
  messages.push_back({"FOREIGN", ArrivalTime::from_utime(50), {1, 2, 3, 4, 5, 6, 7, 8, 9}});
  messages.push_back(message(channel::kScan, 60, scan));
  messages.back().payload.resize(30);
  const auto bad = validate_file(write_checked_log(path, messages));
  ASSERT_EQ(bad.errors.size(), 2U);
  EXPECT_THAT(bad.errors[0], HasSubstr("channel ODOMETRY: 1 of 1 messages cannot be used; first: event 3"));
  EXPECT_THAT(bad.errors[0], HasSubstr("expected pose2D_t"));
  EXPECT_THAT(bad.errors[1], HasSubstr("channel SCAN: 1 of 3"));
  EXPECT_THAT(bad.notes[0], HasSubstr("not a type of Parhelion"));
}

TEST_F(Validate, StampsOfASensorThatDoNotAdvanceAreNoted) {
  std::vector<Message> messages;
  Scan scan;
  scan.ranges = {1, 2, 3};
  scan.angle_increment = 0.1F;
  for (const double t : {1.0, 1.1, 1.1, 1.3, 1.2, 1.4}) {
    scan.stamp = SensorTime{} + seconds(t);
    for (const char* channel : {"SCAN_rear", "OTHER"}) {
      messages.push_back(message(channel, static_cast<std::int64_t>(messages.size()), scan));
    }
  }
  const auto verdict = validate_file(write_checked_log((folder_ / "d.lcm").string(), messages));
  EXPECT_THAT(verdict.errors, IsEmpty());
  EXPECT_THAT(verdict.notes,
              ElementsAre(HasSubstr("OTHER"), HasSubstr("SCAN_rear"),
                          HasSubstr("warning: SCAN_rear: 2 stamps are not later than the one before, first "
                                    "in event 4: ")));
}

TEST_F(Validate, ADamagedLogIsAnErrorButTheRestIsCounted) {
  Scan scan;
  scan.stamp = SensorTime::from_utime(1'600'000'000'000'000);
  scan.ranges = {1, 2, 3};
  scan.angle_increment = 0.1F;
  std::vector<Message> messages;
  for (int i = 0; i < 10; ++i) messages.push_back(message(channel::kScan, i, scan));
  const std::string path = write_checked_log((folder_ / "b.lcm").string(), messages);
  const auto size = std::filesystem::file_size(path);
  std::fstream(path, std::ios::in | std::ios::out | std::ios::binary)
      .seekp(static_cast<long>(size / 2))
      .write("XXXXXXXXXXXXXXXXXXXXXXXXXXXXXXXXXXXXXXXXXXXXXXXXXXXXXXXXXXXX", 60);
  std::filesystem::resize_file(path, size - 5);
  const auto verdict = validate_file(path);
  EXPECT_GE(verdict.errors.size(), 2U);
  EXPECT_THAT(verdict.errors.back(), HasSubstr("bytes lost"));
  EXPECT_THAT(verdict.summary, HasSubstr("events on 1 channel,"));
}

TEST_F(Validate, YamlInsideALogIsChecked) {
  Message robot{channel::kRobot, ArrivalTime::from_utime(1), {}};
  encode(RobotMessage{SensorTime::from_utime(1'600'000'000'000'000), "mass: heavy"}, robot.payload);
  const auto verdict = validate_file(write_checked_log((folder_ / "c.lcm").string(), {robot}));
  EXPECT_THAT(verdict.errors,
              ElementsAre(HasSubstr("ROBOT:1: 'mass': expected a finite number with its unit, kg or g")));
}

TEST_F(Validate, ALogOfAnotherRealRobotIsValid) {
  const auto path = test::recording("lcm-mbot/drive_square_odometry.lcmlog");
  PARHELION_NEEDS_RECORDING(path);
  const auto verdict = validate_file(path.string());
  EXPECT_THAT(verdict.errors, IsEmpty());
  EXPECT_THAT(verdict.notes, ::testing::Contains(HasSubstr("pose2D_t")));
}

}  // namespace
}  // namespace parhelion::tools
