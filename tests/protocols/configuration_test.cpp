// Error messages for mistakes in a scenario, a model or a robot description.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "protocols/model.hpp"
#include "protocols/model_overlap.hpp"
#include "protocols/robot.hpp"
#include "protocols/scenario.hpp"
#include "protocols/yaml/document.hpp"
#include "protocols/yaml/schema.hpp"

namespace parhelion {
namespace {

using ::testing::HasSubstr;

std::string scenario_error(const std::string& yaml) {
  const auto scenario = parse_scenario(yaml, "s.yaml");
  return scenario ? "" : scenario.error().message;
}

std::string model_error(const std::string& yaml) {
  const auto model = parse_model(yaml, "m.yaml");
  return model ? "" : model.error().message;
}

std::string robot_error(const std::string& yaml) {
  const auto robot = parse_robot_description(yaml, "r.yaml");
  return robot ? "" : robot.error().message;
}

const std::string kAgent = R"(agents:
  - name: r1
    kind: robot
    pose: {x: 1 m, y: 2 m, yaw: 90 deg}
)";

TEST(Scenario, ConvertsUnitsToSi) {
  const auto scenario = parse_scenario(kAgent + R"(    size: [40 cm, 400 mm, 0.6 m]
    behaviour: {kind: patrol, speed: 1.8 km/h, waypoints: [[1 m, 2 m], [300 cm, -4 m]]}
    laser: utm-30lx
name: corridor
level: 1
seed: 18446744073709551615
physics_rate: 0.5 kHz
injection: {max_error: 10 cm, restore: 0.5}
contact: {silence: 20 ms, stop_distance: 0.2 m}
channels: {SCAN: front/scan, MR_AGENT_r1_SCAN: r1.scan}
)",
                                       "s.yaml");
  ASSERT_TRUE(scenario) << scenario.error().message;
  ASSERT_EQ(scenario->agents.size(), 1U);
  const AgentDefinition& r1 = scenario->agents[0];
  EXPECT_EQ(r1.kind, AgentKind::robot);
  EXPECT_EQ(r1.size, Eigen::Vector3d(0.4, 0.4, 0.6));
  EXPECT_DOUBLE_EQ(r1.T_map_base.yaw(), std::numbers::pi / 2);
  EXPECT_EQ(r1.behaviour.kind, BehaviourKind::patrol);
  EXPECT_DOUBLE_EQ(r1.behaviour.speed, 0.5);
  EXPECT_THAT(r1.behaviour.waypoints, ::testing::ElementsAre(Eigen::Vector2d(1, 2), Eigen::Vector2d(3, -4)));
  EXPECT_EQ(scenario->seed, 18446744073709551615U);
  EXPECT_EQ(scenario->physics_rate, 500);
  EXPECT_EQ(scenario->injection.max_error, 0.1);
  EXPECT_EQ(scenario->injection.restore, 0.5);
  EXPECT_EQ(scenario->contact.silence, 0.02);
  EXPECT_EQ(scenario->contact.slow_distance, ContactLimits().slow_distance);
  EXPECT_EQ(scenario->channels.at("SCAN"), "front/scan");
}

TEST(Scenario, EveryMistakeIsNamedWithItsLine) {
  const std::string message = scenario_error("name: a\nlevel: 4\nagnets: []\nphysics_rate: 240\n");
  EXPECT_EQ(message,
            "s.yaml:2: 'level': expected level <= 3, found '4'\n"
            "s.yaml:3: unknown key 'agnets', did you mean 'agents'?\n"
            "s.yaml:4: 'physics_rate': a unit is missing: expected Hz, kHz, MHz or GHz, such as '240 Hz', "
            "found '240'");
}

struct Mistake {
  const char* yaml;
  const char* words;
};

TEST(Scenario, RefusesInvalidValues) {
  const Mistake mistakes[] = {
      {"level: 0", "s.yaml:1: 'level': expected level >= 1, found '0'"},
      {"level: two", "s.yaml:1: 'level': expected a whole number, found 'two'"},
      {"seed: -1", "expected seed >= 0"},
      {"seed: 18446744073709551616", "expected a whole number"},
      {"physics_rate: 240 m", "expected a finite number with its unit, Hz, kHz, MHz or GHz, found '240 m'"},
      {"physics_rate: .inf Hz", "expected a finite number"},
      {"physics_rate: nan Hz", "expected a finite number"},
      {"physics_rate: 1e400 Hz", "expected a finite number"},
      {"physics_rate: [1 Hz]", "'physics_rate': expected a number with its unit, found a list"},
      {"physics_rate: 5 Hz", "expected physics_rate >= 10 Hz"},
      {"injection: {restore: 1.2}", "expected restore <= 1"},
      {"contact: {silence: 0 ms}", "expected silence > 0 s"},
      {"contact: {stop_distance: 2 m}", "expected stop_distance < slow_distance, found 2 m and 1 m"},
      {"contact: 3", "'contact': expected keys with values, found a single value"},
      {"agents:", "'agents': expected a list, found nothing"},
      {"agents:\n  - {kind: box, pose: {x: 1 m}}", "s.yaml:2: key 'name' is missing in 'agents'"},
      {"agents:\n  - {name: a/b, kind: box, pose: {x: 1 m}}", "found 'a/b'"},
      {"agents:\n  - {name: '', kind: box, pose: {x: 1 m}}", "expected 1 to 32 letters, digits"},
      {"agents:\n  - {name: a, kind: cube, pose: {x: 1 m}}",
       "expected box, barrel, person, robot, container or cable, found 'cube'"},
      {"agents:\n  - {name: a, kind: box, pose: {x: 1 m}, size: [1 m, 2 m]}",
       "expected at least 3 items, found 2"},
      {"agents:\n  - {name: a, kind: robot, pose: {x: 1 m}, camera: 5 Hz}",
       "s.yaml:2: 'camera' is the robot model's, and this agent has none; add 'model'"},
      {"agents:\n  - {name: a, kind: robot, model: rover, pose: {x: 1 m}, camera: 5}", "a unit is missing"},
      {"agents:\n  - {name: a, kind: robot, model: rover, pose: {x: 1 m}, camera: 8 Hz}\n"
       "  - {name: b, kind: robot, model: rover, pose: {x: 2 m}, camera: 4 Hz}",
       "s.yaml:3: 'camera': the agents' cameras take 12 Hz together, more than max_agent_image_rate, 10 Hz"},
      {"agents:\n  - {name: a, kind: box, pose: {x: 1 m}, size: [1 m, 2 m, 0 m]}", "expected size > 0 m"},
      {"agents:\n  - {name: a, kind: box, pose: {pitch: 1 deg}}", "an agent stands upright"},
      {"agents:\n  - name: a\n    kind: box\n    pose: {x: 1 m}\n    behaviour: {kind: patrol}",
       "s.yaml:5: 'behaviour': patrol needs waypoints"},
      {"agents:\n  - {name: a, kind: box, pose: {x: 1 m}}\n  - {name: a, kind: box, pose: {x: 2 m}}",
       "s.yaml:3: name 'a' is taken by the agent in line 2"},
      {"channels: {SCAM: x}", "unknown channel 'SCAM', did you mean 'SCAN'?"},
      {"channels: {SCAN: 'a b'}", "name of a channel: expected 1 to 63"},
      {"name: a\nname: b", "s.yaml:2: key 'name' is a duplicate (first in line 1)"},
      {"- a", "is not a file of the kind 'Scenario': expected keys such as agents, "},
      {"name: rover\nfootprint: [[0 m, 0 m], [1 m, 0 m], [0 m, 1 m]]\nmass: 9 kg\n",
       "is a file of the kind 'Robot description', expected one of the kind 'Scenario'"},
      {"", "s.yaml:1: the file is empty"},
      {"name: a\n---\nname: b", "a second document"},
      {"name: [a", "s.yaml:"},
      {"name: &x a", "anchors and aliases"},
      {"name: !!int a", "tags"},
      {"level: 3\n? [a]\n: b", "a key must be plain text"},
  };
  for (const Mistake& mistake : mistakes) {
    EXPECT_THAT(scenario_error(mistake.yaml), HasSubstr(mistake.words)) << mistake.yaml;
  }
}

TEST(Scenario, RefusesAnOutputThatIsAnInputAfterRenaming) {
  EXPECT_THAT(
      scenario_error("level: 3\nchannels: {SCAN: MR_SCAN}"),
      HasSubstr("s.yaml:2: 'channels': the output MR_SCAN and the input SCAN would both be named 'MR_SCAN'"));
  EXPECT_THAT(scenario_error("channels:\n  MR_SCAN: X\n  SCAN: X"),
              HasSubstr("the output MR_SCAN and the input SCAN"));
  EXPECT_THAT(scenario_error("channels: {MR_CMD: MR_SPAWN}"),
              HasSubstr("the output MR_CMD and the input MR_SPAWN"));
  EXPECT_THAT(scenario_error(kAgent + "channels: {MR_AGENT_r1_SCAN: SCAN}"),
              HasSubstr("the output MR_AGENT_r1_SCAN"));
  EXPECT_THAT(scenario_error("channels: {CAMERA: DEPTH}"),
              HasSubstr("DEPTH and CAMERA would both be named 'DEPTH'"));
  EXPECT_EQ(scenario_error("channels: {SCAN: MR_SCAN, MR_SCAN: SCAN_OUT}"), "") << "a swap does not meet";
}

TEST(Scenario, PathsResolveAgainstTheScenariosFolder) {
  const auto folder = std::filesystem::path(::testing::TempDir()) / "parhelion_scenario";
  std::filesystem::create_directories(folder);
  const auto path = (folder / "s.yaml").string();
  std::ofstream(path) << "model: ../site/model.yaml\nrobot: /robots/r.yaml\n";
  const auto scenario = load_scenario(path);
  ASSERT_TRUE(scenario) << scenario.error().message;
  EXPECT_EQ(scenario->model, (folder.parent_path() / "site/model.yaml").lexically_normal());
  EXPECT_EQ(scenario->robot, "/robots/r.yaml");
  EXPECT_THAT(load_scenario((folder / "none.yaml").string()).error().message,
              HasSubstr("none.yaml: cannot be opened"));
  EXPECT_THAT(load_scenario(folder.string()).error().message, HasSubstr("is a folder"));
}

TEST(Model, RefusesInvalidValues) {
  const std::string wall = "entities:\n  - {name: w, label: wall, pose: {x: 0 m}, size: [2 m, 0.1 m, 2.5 m]";
  const Mistake mistakes[] = {
      {"map_id: a", "key 'entities' is missing"},
      {"entities:\n  - {name: w, label: wal, pose: {}, size: [1 m, 1 m, 1 m]}", "did you mean 'wall'?"},
      {"entities:\n  - {name: '', label: wall, pose: {}, size: [1 m, 1 m, 1 m]}", "'name' is empty"},
      {"entities:\n  - {name: w, label: wall, pose: {}, size: [1 m, 1 m, 1]}", "a unit is missing"},
      {"entities:\n  - {name: w, label: wall, pose: {quaternion: [1, 1, 0, 0]}, size: [1 m, 1 m, 1 m]}",
       "expected length 1"},
      {"entities:\n  - {name: w, label: wall, pose: {quaternion: [0, 0, 0, 0]}, size: [1 m, 1 m, 1 m]}",
       "expected length 1"},
      {"entities:\n  - {name: w, label: wall, pose: {rotation: [1, 0, 0, 0, 1, 0, 0, 0, -1]}, size: [1 m, 1 "
       "m, 1 m]}",
       "right-handed"},
      {"entities:\n  - {name: w, label: wall, pose: {yaw: 0 deg, quaternion: [1, 0, 0, 0]}, size: [1 m, 1 m, "
       "1 m]}",
       "found several"},
  };
  for (const Mistake& mistake : mistakes)
    EXPECT_THAT(model_error(mistake.yaml), HasSubstr(mistake.words)) << mistake.yaml;
  EXPECT_THAT(model_error(wall + ", confidence: 1.5}"), HasSubstr("expected confidence <= 1"));
  EXPECT_THAT(model_error(wall + ", virtual: yes}"), HasSubstr("expected true or false, found 'yes'"));
  EXPECT_THAT(model_error(wall + ", material: {albedo: [2, 0, 0]}}"), HasSubstr("expected albedo <= 1"));
  EXPECT_THAT(model_error(wall + "}\n  - {name: w, label: wall, pose: {x: 9 m}, size: [2 m, 0.1 m, 2.5 m]}"),
              HasSubstr("m.yaml:3: name 'w' is taken by the entity in line 2"));
}

TEST(Model, ReportsBothOfTwoOverlappingWalls) {
  const auto with_second = [](const std::string& second) {
    return model_error(
        "entities:\n  - {name: w1, label: wall, pose: {yaw: 30 deg}, size: [2 m, 0.1 m, 2.5 m]}\n  - " +
        second);
  };
  EXPECT_THAT(
      with_second("{name: w2, label: wall, pose: {yaw: 30 deg, x: 0.05 m}, size: [2 m, 0.1 m, 2.5 m]}"),
      HasSubstr("m.yaml:3: 'w2' overlaps 'w1' (line 2, both wall)"));
  EXPECT_EQ(with_second("{name: w2, label: wall, pose: {yaw: 120 deg}, size: [2 m, 0.1 m, 2.5 m]}"), "")
      << "a crossing";
  EXPECT_EQ(with_second("{name: d, label: door, pose: {yaw: 30 deg}, size: [0.9 m, 0.1 m, 2 m]}"), "")
      << "in its wall";
}

TEST(Model, OverlapFractionOfCrossingAndNestedBoxesIsByVolume) {
  ModelEntity a, b;
  a.size = {4, 2, 2};
  b.size = {1, 1, 1};
  EXPECT_DOUBLE_EQ(overlap_fraction(a, b), 1);
  b.T_map_body = Transform<Map, Body>::planar(2, 0, 0);
  EXPECT_DOUBLE_EQ(overlap_fraction(a, b), 0.5);
  b.T_map_body = Transform<Map, Body>::planar(2, 0, std::numbers::pi / 4);
  EXPECT_NEAR(overlap_fraction(b, a), 0.5, 1e-12);
  b.T_map_body = Transform<Map, Body>::planar(0, 0, 0, 1.25);
  EXPECT_DOUBLE_EQ(overlap_fraction(a, b), 0.25);
  const Eigen::Quaterniond tilt(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX()));
  b.T_map_body = Transform<Map, Body>(tilt, {2, 0, 0});
  EXPECT_NEAR(overlap_fraction(a, b), 0.5, 0.02);
}

TEST(Robot, GivenKeysOverrideThePreset) {
  const auto robot = parse_robot_description(
      "laser: {preset: lms-200, pose: {x: 0.2 m, z: 0.3 m}, range_max: 8 m}", "r.yaml");
  ASSERT_TRUE(robot) << robot.error().message;
  const auto preset = load_laser_preset("lms-200");
  ASSERT_TRUE(preset) << preset.error().message;
  EXPECT_EQ(robot->laser->preset, "lms-200");
  EXPECT_EQ(robot->laser->convention.range_max, 8.F);
  EXPECT_EQ(robot->laser->beams, 361);
  EXPECT_EQ(robot->laser->passes, 2);
  EXPECT_EQ(robot->laser->noise_sigma, preset->noise_sigma);
  EXPECT_EQ(robot->laser->T_base_laser.translation(), Eigen::Vector3d(0.2, 0, 0.3));
}

TEST(Robot, EachShippedPresetIsValid) {
  int presets = 0;
  for (const auto& entry : std::filesystem::directory_iterator(PARHELION_SOURCE_DIR "/fusion/scan/presets")) {
    if (entry.path().extension() != ".yaml") continue;
    const auto laser = load_laser_preset(entry.path().stem().string());
    EXPECT_TRUE(laser) << laser.error().message;
    ++presets;
  }
  EXPECT_GE(presets, 3);
}

TEST(Robot, CameraMountedByItsLinkLooksForward) {
  const std::string lens = "width: 640, height: 480, fx: 500 px, fy: 500 px, cx: 320 px, cy: 240 px}";
  const auto robot =
      parse_robot_description("camera: {pose: {axes: link, x: 0.1 m, z: 1 m}, " + lens, "r.yaml");
  ASSERT_TRUE(robot) << robot.error().message;
  const Eigen::Vector3d ahead = robot->camera->T_base_optical * Eigen::Vector3d(0, 0, 2);
  EXPECT_TRUE(ahead.isApprox(Eigen::Vector3d(2.1, 0, 1), 1e-12)) << ahead.transpose();
  const Eigen::Vector3d right = robot->camera->T_base_optical * Eigen::Vector3d(1, 0, 0);
  EXPECT_TRUE(right.isApprox(Eigen::Vector3d(0.1, -1, 1), 1e-12)) << right.transpose();
}

TEST(Robot, RefusesInvalidValues) {
  const Mistake mistakes[] = {
      {"laser: {preset: lms200, pose: {}}",
       "r.yaml:1: no laser preset is called 'lms200', did you mean 'lms-200'?"},
      {"laser: {preset: ../../x, pose: {}}", "no laser preset is called '../../x'"},
      {"laser: {preset: lms-200}", "key 'pose' is missing in 'laser'"},
      {"laser: {pose: {}}", "key 'range_max' is missing"},
      {"laser: {pose: {}, range_min: 9 m, range_max: 8 m}",
       "expected range_min < range_max, found 9 m and 8 m"},
      {"laser: {pose: {}, range_max: 8 m, passes: 0}", "expected passes >= 1"},
      {"laser: {pose: {}, range_max: 8 m, no_return: never}", "(or infinity or nan)"},
      {"laser: {pose: {}, range_max: 8 m, beams: 3}", "expected angle_increment != 0 rad"},
      {"camera: {width: 640}", "key 'pose' is missing in 'camera'"},
      {"imu: {}", "key 'pose' is missing in 'imu'"},
      {"camera: {pose: {}, width: 1, height: 1, fx: 1 px, fy: 1 px, cx: 0 px, cy: 0 px, head: [{joint: pan, "
       "axis: [0, 1, 1]}]}",
       "expected a direction of length 1"},
      {"camera: {pose: {}, width: 1, height: 1, fx: 1 px, fy: 1 px, cx: 0 px, cy: 0 px, head: [{joint: pan, "
       "axis: [0, 0, 1]}, {joint: pan, axis: [0, 1, 0]}]}",
       "'pan' is a duplicate"},
      {"footprint: [[0 m, 0 m], [0 m, 1 m], [1 m, 0 m]]", "counter-clockwise"},
      {"footprint: [[0 m, 0 m], [1 m, 0 m]]", "expected at least 3 items"},
      {"footprint: [[1 m, 0 m], [-1 m, 1 m], [0 m, -1 m], [0 m, 1 m], [-1 m, -1 m]]", "'footprint'"},
      {"mass: 0 kg", "expected mass > 0 kg"},
      {"velocity_frame: odom", "expected body or local"},
      {"limits: {speed: 3 rad/s}", "expected a finite number with its unit, m/s"},
  };
  for (const Mistake& mistake : mistakes)
    EXPECT_THAT(robot_error(mistake.yaml), HasSubstr(mistake.words)) << mistake.yaml;
}

TEST(Robot, FurtherLasersAreReadWithTheirNames) {
  const auto robot = parse_robot_description(
      "laser: {preset: lms-200, pose: {x: 0.2 m}}\nlasers:\n"
      "  - {name: rear, preset: utm-30lx, pose: {x: -0.2 m, yaw: 180 deg}}\n"
      "  - {name: left_2, preset: urg-04lx, pose: {y: 0.2 m}, range_max: 3 m}\n",
      "r.yaml");
  ASSERT_TRUE(robot) << robot.error().message;
  ASSERT_EQ(robot->further_lasers.size(), 2U);
  EXPECT_EQ(robot->further_lasers[0].name, "rear");
  EXPECT_EQ(robot->further_lasers[1].name, "left_2");
  EXPECT_EQ(robot->laser_at(0).preset, "lms-200");
  EXPECT_EQ(robot->laser_at(1).preset, "utm-30lx");
  EXPECT_EQ(robot->laser_at(2).convention.range_max, 3.F);
}

TEST(Robot, MistakesInFurtherLasersNameTheLine) {
  const std::string first = "laser: {pose: {}, range_max: 8 m}\n";
  const auto rear = [](const std::string& name) {
    return "  - {name: " + name + ", pose: {}, range_max: 8 m}\n";
  };
  const std::pair<std::string, std::string> mistakes[] = {
      {first + "lasers:\n" + rear("rear") + rear("rear"),
       "r.yaml:4: name 'rear' is taken by the laser in line 3: names must be unique"},
      {first + "lasers:\n" + rear("INFO"),
       "r.yaml:3: 'name' of a laser, part of channel names: 'INFO' would give"},
      {first + "lasers:\n" + rear("at-rear"),
       "r.yaml:3: 'name' of a laser, part of channel names: expected 1 to 16 letters, digits and '_'"},
      {first + "lasers:\n  - {pose: {}, range_max: 8 m}",
       "r.yaml:3: key 'name' is missing in a laser of 'lasers'"},
      {first + "lasers:\n  - {name: rear, range_max: 8 m}", "r.yaml:3: key 'pose' is missing"},
      {"lasers:\n" + rear("rear"), "r.yaml:2: 'lasers' are further ones: the first, whose scans are on SCAN"},
      {"laser: {name: front, pose: {}, range_max: 8 m}",
       "r.yaml:1: only the further lasers in 'lasers' have names"},
      {first + "lasers:\n  - {name: rear, pose: {}, range_max: 8 m, head: [{joint: pan, axis: [0, 0, 1]}]}",
       "r.yaml:3: the lasers of SCAN are fixed to the base"},
  };
  for (const auto& [yaml, words] : mistakes) EXPECT_THAT(robot_error(yaml), HasSubstr(words)) << yaml;
}

TEST(Robot, FurtherCamerasAreReadWithTheirNames) {
  const std::string lens = "pose: {}, width: 64, height: 48, fx: 60 px, fy: 60 px, cx: 32 px, cy: 24 px}";
  const auto robot =
      parse_robot_description("cameras:\n  - {name: left, camera: {" + lens +
                                  "}\n  - {name: head, camera: {" + lens + ", depth: {" + lens + "}\n",
                              "r.yaml");
  ASSERT_TRUE(robot) << robot.error().message;
  ASSERT_EQ(robot->further_cameras.size(), 2U);
  EXPECT_EQ(robot->further_cameras[0].name, "left");
  EXPECT_FALSE(robot->depth_at(1).has_value());
  EXPECT_TRUE(robot->camera_at(2) && robot->depth_at(2));
  EXPECT_FALSE(robot->camera_at(0).has_value());
  EXPECT_THAT(robot_error("cameras:\n  - {name: left}"),
              HasSubstr("r.yaml:2: expected 'camera', 'depth' or both"));
  EXPECT_THAT(robot_error("cameras:\n  - {name: RATE, camera: {" + lens + "}"),
              HasSubstr("r.yaml:2: 'name' of a camera"));
  EXPECT_THAT(
      robot_error("cameras:\n  - {name: a, camera: {" + lens + "}\n  - {name: a, depth: {" + lens + "}"),
      HasSubstr("r.yaml:3: name 'a' is taken by the camera in line 2"));
}

TEST(Scenario, ChannelsOfFurtherLasersCanBeRenamed) {
  const auto scenario = parse_scenario("channels: {SCAN_rear: BACK, MR_SCAN_INFO_rear: BACK_INFO}", "s.yaml");
  ASSERT_TRUE(scenario) << scenario.error().message;
  EXPECT_EQ(scenario->channels.at("SCAN_rear"), "BACK");
  const Mistake mistakes[] = {
      {"channels:\n  SCAN_rear: BACK\n  SCAN_left: BACK\n",
       "s.yaml:3: 'channels': SCAN_rear and SCAN_left would both be named 'BACK' on the bus"},
      {"channels:\n  MR_SCAN_rear: SCAN\n",
       "s.yaml:2: 'channels': the output MR_SCAN_rear and the input SCAN would both be named 'SCAN'"},
      {"channels: {SCAN_at-rear: BACK}", "unknown channel 'SCAN_at-rear'"},
      {"channels: {IMU_rear: BACK}", "unknown channel 'IMU_rear'"},
  };
  for (const Mistake& mistake : mistakes) {
    const auto refused = parse_scenario(mistake.yaml, "s.yaml");
    ASSERT_FALSE(refused) << mistake.yaml;
    EXPECT_THAT(refused.error().message, HasSubstr(mistake.words));
  }
}

TEST(YamlDocument, ATabThatIndentsIsNamedWithItsLine) {
  for (const char* text :
       {"name: x\nagents:\n\t- {name: a}\n", "name: x\nagents:\n  - name: a\n",
        "name: x\ntraining:\n\tlimit: 3 s\n", "name: x\nagents:\n  -\tname: a\n    kind: box\n"}) {
    const auto refused = parse_scenario(text, "s.yaml");
    ASSERT_FALSE(refused);
    const bool has_tab = std::string(text).find('\t') != std::string::npos;
    EXPECT_EQ(refused.error().message.find("s.yaml:3: not YAML: a tab") == 0, has_tab)
        << refused.error().message;
  }
  const auto other = parse_scenario("name: \"x\ty\"\nagents: [\n", "s.yaml");
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error().message.find("tab"), std::string::npos) << "a tab inside a text is no mistake";
}

TEST(YamlDocument, KindOfAFileIsGuessedFromItsKeys) {
  const auto kind = [](const std::string& yaml) {
    return yaml::guess_schema(*yaml::read_document(yaml, "f"));
  };
  EXPECT_EQ(kind(to_yaml(Scenario())), "scenario");
  EXPECT_EQ(kind(to_yaml(SemanticModel())), "model");
  EXPECT_EQ(kind(to_yaml(RobotDescription())), "robot");
  EXPECT_EQ(kind("range_max: 3 m\nbeams: 3"), "laser");
  EXPECT_EQ(kind("colour: red"), "");
}

}  // namespace
}  // namespace parhelion
