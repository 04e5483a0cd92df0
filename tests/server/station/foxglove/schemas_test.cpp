#include "server/station/foxglove/schemas.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "server/station/foxglove/messages.hpp"

namespace parhelion::station::foxglove {
namespace {

using nlohmann::json;

/// Foxglove refuses a channel with an error if the schema of an object does not name its members.
void expect_readable(const json& schema, const std::string& where) {
  if (schema.contains("oneOf")) return;  // an enumeration
  ASSERT_TRUE(schema.contains("type")) << where;
  if (schema["type"] == "object") {
    ASSERT_TRUE(schema.contains("properties") && !schema["properties"].empty()) << where;
    for (const auto& [name, member] : schema["properties"].items())
      expect_readable(member, where + "." + name);
  } else if (schema["type"] == "array") {
    ASSERT_TRUE(schema.contains("items")) << where;
    expect_readable(schema["items"], where + "[]");
  }
}

/// Each member is one of the schema's and none that is required is missing.
void expect_conforms(const json& value, const json& schema, const std::string& where) {
  if (schema.contains("oneOf")) {
    const auto is_value = [&](const json& option) { return option["const"] == value; };
    EXPECT_TRUE(std::any_of(schema["oneOf"].begin(), schema["oneOf"].end(), is_value)) << where;
    return;
  }
  const std::string type = schema["type"];
  if (type == "object") {
    ASSERT_TRUE(value.is_object()) << where;
    for (const json& name : schema.value("required", json::array()))
      EXPECT_TRUE(value.contains(name.get<std::string>())) << where << "." << name;
    for (const auto& [name, member] : value.items()) {
      ASSERT_TRUE(schema["properties"].contains(name)) << where << "." << name;
      expect_conforms(member, schema["properties"][name], where + "." + name);
    }
  } else if (type == "array") {
    ASSERT_TRUE(value.is_array()) << where;
    for (const json& element : value) expect_conforms(element, schema["items"], where + "[]");
  } else {
    EXPECT_TRUE(type == "number"    ? value.is_number()
                : type == "integer" ? value.is_number_integer()
                : type == "boolean" ? value.is_boolean()
                                    : value.is_string())
        << where << " should be " << type;
  }
}

void expect_conforms(const JsonText& message, const char* schema) {
  expect_conforms(json::parse(message.text()), json::parse(schema_text(schema)), schema);
}

TEST(FoxgloveSchemas, ObjectsListTheirMembersAndListsTheirItemTypes) {
  for (const char* name :
       {"foxglove.LaserScan", "foxglove.PoseInFrame", "foxglove.FrameTransforms", "foxglove.CompressedImage",
        "foxglove.RawImage", "foxglove.CameraCalibration", "foxglove.SceneUpdate", "foxglove.Log",
        "parhelion.Twist", "parhelion.Injection", "parhelion.Score", "parhelion.Status"}) {
    const std::string text = schema_text(name);
    ASSERT_FALSE(text.empty()) << name;
    expect_readable(json::parse(text), name);
  }
}

TEST(FoxgloveSchemas, MessagesConformToTheirSchemas) {
  JsonText text;
  Scan scan;
  scan.ranges = {1.0F, 2.0F};
  scan.intensities = {3.0F, 4.0F};
  RangeConvention convention;
  convention.range_max = 10;
  write_scan(scan, convention, "laser", text);
  expect_conforms(text, "foxglove.LaserScan");
  write_transforms(1'500'000'000, {{"map", "base", Eigen::Isometry3d::Identity()}}, text);
  expect_conforms(text, "foxglove.FrameTransforms");
  write_pose(1'500'000'000, Eigen::Isometry3d::Identity(), text);
  expect_conforms(text, "foxglove.PoseInFrame");
  Image image;
  image.bytes = {1, 2, 3};
  write_jpeg(image, "camera", text);
  expect_conforms(text, "foxglove.CompressedImage");
  image.width = 3;
  image.height = 1;
  image.row_stride = 3;
  image.format = PixelFormat::gray;
  write_pixels(image, "camera", text);
  expect_conforms(text, "foxglove.RawImage");
  write_calibration(1'500'000'000, CameraIntrinsics(), "camera", text);
  expect_conforms(text, "foxglove.CameraCalibration");
  write_event(Event(), text);
  expect_conforms(text, "foxglove.Log");
  write_twist(TwistCommand(), text);
  expect_conforms(text, "parhelion.Twist");
  write_injection(ScanInfo(), text);
  expect_conforms(text, "parhelion.Injection");
  write_status(ServerStatus(), text);
  expect_conforms(text, "parhelion.Status");
}

}  // namespace
}  // namespace parhelion::station::foxglove
