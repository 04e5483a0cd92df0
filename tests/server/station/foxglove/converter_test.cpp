#include "server/station/foxglove/converter.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/server/review/written_session.hpp"

namespace parhelion::station::foxglove {
namespace {

using nlohmann::json;

TEST(FoxgloveConverter, EachAgentCameraHasItsOwnImageTopic) {
  std::map<std::string, json> messages;
  Converter converter([&](const Converted& each) { messages[each.channel.topic] = json::parse(each.json); });
  converter.begin(test::WrittenSession().configuration(), ArrivalTime{1'000'000'000});
  Image picture;
  picture.stamp = SensorTime{2'500'000'000};
  picture.width = 16;
  picture.height = 8;
  picture.row_stride = 48;
  picture.format = PixelFormat::rgb;
  picture.bytes.assign(16 * 8 * 3, 90);
  ASSERT_TRUE(converter.take(test::message("MR_AGENT_robot_1_CAMERA", 3'000'000, picture)).ok());
  const json& raw = messages["/agents/robot_1/camera/raw"];
  EXPECT_EQ(raw["frame_id"], "robot_1/camera_optical");
  EXPECT_EQ(raw["width"], 16);
  EXPECT_EQ(raw["timestamp"], (json{{"sec", 2}, {"nsec", 500'000'000}}));
  ASSERT_TRUE(converter.take(test::message("MR_AGENT__CAMERA", 3'000'000, picture)).ok()) << "of nobody";
  EXPECT_FALSE(messages.contains("/agents//camera/raw"));
}

}  // namespace
}  // namespace parhelion::station::foxglove
