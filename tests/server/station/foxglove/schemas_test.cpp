#include "server/station/foxglove/schemas.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace parhelion::station::foxglove {
namespace {

using nlohmann::json;

/// Foxglove refuses a channel with an error if the schema of an object does not name its members.
void expect_readable(const json& schema, const std::string& where) {
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

TEST(FoxgloveSchemas, EveryObjectNamesItsMembersAndEveryListWhatIsInIt) {
  for (const char* name :
       {"foxglove.LaserScan", "foxglove.PoseInFrame", "foxglove.FrameTransforms", "foxglove.CompressedImage",
        "foxglove.RawImage", "foxglove.CameraCalibration", "foxglove.SceneUpdate", "foxglove.Log",
        "parhelion.Twist", "parhelion.Injection", "parhelion.Score", "parhelion.Status"}) {
    const std::string text = schema_text(name);
    ASSERT_FALSE(text.empty()) << name;
    expect_readable(json::parse(text), name);
  }
}

}  // namespace
}  // namespace parhelion::station::foxglove
