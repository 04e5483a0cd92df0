// The defaults in the schemas, and therefore in the references in docs/, are those of the program.
#include "tests/schema_defaults.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "protocols/course.hpp"
#include "protocols/model.hpp"
#include "protocols/model_objects.hpp"
#include "protocols/robot.hpp"
#include "protocols/scenario.hpp"

namespace parhelion::test {
namespace {

using testing::IsEmpty;
using Json = SchemaDefaults::Json;

template <class Parse>
SchemaDefaults::Read reader(Parse parse) {
  return [parse](const std::string& yaml) -> std::optional<std::string> {
    const auto read = parse(yaml, "document", {});
    if (!read) return std::nullopt;
    return to_yaml(*read);
  };
}

SchemaDefaults::Read scenario_reader() {
  return reader([](const std::string& yaml, const std::string& origin, std::optional<std::uint64_t> seed) {
    return parse_scenario(yaml, origin, seed);
  });
}

Json scenario_with(const std::string& condition) {
  return Json::parse(R"({"training": {"tasks": [{"name": "t", "points": 1, "done": )" + condition + "}]}}");
}

TEST(SchemaDefaults, OfAScenario) {
  SchemaDefaults defaults("scenario", scenario_reader());
  const Json agent = Json::parse(
      R"({"name": "a", "kind": "person", "pose": {}, "behaviour": {"waypoints": [["1 m", "2 m"]]}})");
  Json document = Json::parse(R"({
    "level": 1, "injection": {}, "contact": {}, "trainee": {"model": "rover", "pose": {}},
    "zones": [{"name": "z", "box": {"center": ["0 m", "0 m"], "size": ["1 m", "1 m"]}}],
    "scripts": [{"name": "s", "when": {"time": "1 s"}, "do": [
      {"behave": {"name": "a", "behaviour": {}}}, {"move": {"name": "a", "pose": {}}}]}],
    "doors": [{"name": "d"}],
    "hazards": [
      {"name": "h", "kind": "radiation", "position": ["0 m", "0 m", "0 m"], "dose_rate": "1 uSv/h"},
      {"name": "g", "kind": "gas", "position": ["0 m", "0 m", "0 m"], "concentration": "1 ppm"}],
    "hazard_sensor": {}, "radio": {"position": ["0 m", "0 m", "0 m"]}, "battery": {},
    "faults": [{"camera_loss": 0.5}],
    "training": {
      "tasks": [{"name": "t", "points": 1, "done": {"reach": "z"}}],
      "penalties": [{"name": "p", "per_impulse": 1, "when": {"reach": "z"}},
                    {"name": "q", "points": 1, "when": {"reach": "z"}}]}})");
  document["agents"] = Json::array({agent});
  Json spawned = agent;
  spawned["name"] = "b";
  document["scripts"][0]["do"].push_back({{"spawn", spawned}});
  defaults.compare(document);
  // The level determines which other keys are allowed.
  defaults.compare(Json::object());
  EXPECT_THAT(defaults.differences(), IsEmpty());
  EXPECT_THAT(defaults.missing(), IsEmpty());
}

TEST(SchemaDefaults, OfACondition) {
  const auto read = scenario_reader();
  SchemaDefaults conditions(
      "condition", [&](const std::string& condition) { return read(scenario_with(condition).dump()); });
  conditions.compare(Json::parse(R"({"event": "contact_started"})"));
  conditions.compare(Json::parse(R"({"near": "a", "distance": "1 m"})"));
  EXPECT_THAT(conditions.differences(), IsEmpty());
  EXPECT_THAT(conditions.missing(), IsEmpty());
}

TEST(SchemaDefaults, OfARobotDescription) {
  SchemaDefaults defaults("robot", reader([](const std::string& yaml, const std::string& origin, int) {
                            return parse_robot_description(yaml, origin);
                          }));
  const Json camera = Json::parse(
      R"({"pose": {}, "head": [{"joint": "pan", "axis": [0, 0, 1]}], "width": 4, "height": 3,
          "fx": "4 px", "fy": "4 px", "cx": "2 px", "cy": "1 px"})");
  const Json laser = Json::parse(
      R"({"pose": {}, "range_max": "8 m", "range_noise": {"sigma": ["1 cm", "1 cm", "1 cm", "1 cm", "1 cm", "1 cm"]}})");
  Json document = Json::parse(R"({"imu": {"pose": {}}, "limits": {}, "attitude": {}, "odometry": {},
    "footprint": [["0 m", "0 m"], ["1 m", "0 m"], ["0 m", "1 m"]]})");
  document["laser"] = laser;
  document["line_laser"] = laser;
  document["camera"] = camera;
  document["depth"] = camera;
  document["lasers"].push_back(laser);
  document["lasers"][0]["name"] = "rear";
  document["cameras"].push_back({{"name", "left"}, {"camera", camera}, {"depth", camera}});
  defaults.compare(document);
  EXPECT_THAT(defaults.differences(), IsEmpty());
  EXPECT_THAT(defaults.missing(), IsEmpty());
}

TEST(SchemaDefaults, OfAModel) {
  SchemaDefaults defaults("model", [](const std::string& yaml) -> std::optional<std::string> {
    const auto model = parse_model(yaml, "document");
    const auto remarks = parse_remarks(yaml, "document");
    if (!model || !remarks) return std::nullopt;
    return to_yaml(*model) + to_yaml(*remarks);
  });
  const Json door = Json::parse(R"({"name": "d", "label": "door", "pose": {}, "size": ["1 m", "0.1 m", "2 m"],
    "material": {}, "hinge": {"axis": ["-0.5 m", "0 m"]}})");
  const Json wall =
      Json::parse(R"({"name": "w", "label": "wall", "pose": {"x": "5 m"}, "size": ["1 m", "0.1 m", "2 m"]})");
  const Json chair =
      Json::parse(R"({"name": "c", "kind": "chair", "pose": {}, "size": ["0.5 m", "0.5 m", "0.9 m"]})");
  defaults.compare({{"T_map_cloud", Json::object()},
                    {"entities", {door, wall}},
                    {"relations", {{{"kind", "above"}, {"from", "d"}, {"to", "w"}}}},
                    {"objects", {chair}},
                    {"doubts", {{{"entity", "w"}, {"place", {"0 m", "0 m", "0 m"}}, {"reason", "r"}}}}});
  EXPECT_THAT(defaults.differences(), IsEmpty());
  EXPECT_THAT(defaults.missing(), IsEmpty());
}

TEST(SchemaDefaults, OfACourse) {
  SchemaDefaults defaults("course", [](const std::string& yaml) -> std::optional<std::string> {
    const auto course = parse_course(yaml, "document");
    if (!course) return std::nullopt;
    return std::to_string(course->ranking.at(0).from);
  });
  defaults.compare(Json::parse(
      R"({"course": "c", "programmes": [{"scenario": "s.yaml"}], "ranking": [{"name": "r", "passed": 1}]})"));
  EXPECT_THAT(defaults.differences(), IsEmpty());
  EXPECT_THAT(defaults.missing(), IsEmpty());
}

}  // namespace
}  // namespace parhelion::test
