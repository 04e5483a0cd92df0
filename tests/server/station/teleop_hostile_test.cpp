// Malformed or hostile messages of a page stop its robot and affect nobody else.
#include <cmath>

#include "tests/server/station/teleop_fixture.hpp"

namespace parhelion::station {
namespace {

TEST_F(TeleopServiceTest, StopsOnAnUnreadableMessage) {
  for (const char* bad : {"",
                          "x",
                          "[]",
                          "null",
                          R"({"type":"twist"})",
                          R"({"type":"fly"})",
                          R"({"type":7})",
                          R"({"type":"twist","seq":1e9,"at_ms":1,"vx":NaN,"vy":0,"wz":0})",
                          R"({"type":"twist","seq":1e9,"at_ms":1,"vx":1e999,"vy":0,"wz":0})",
                          R"({"type":"twist","seq":1e9,"at_ms":1,"vx":null,"vy":0,"wz":0})",
                          R"({"type":"twist","seq":1e9,"at_ms":1,"vx":"1","vy":0,"wz":0})",
                          R"({"type":"twist","seq":-1,"at_ms":1,"vx":1,"vy":0,"wz":0})",
                          R"({"type":"twist","seq":1.5,"at_ms":1,"vx":1,"vy":0,"wz":0})",
                          R"({"type":"twist","seq":1e9,"at_ms":1e300,"vx":1,"vy":0,"wz":0})",
                          R"({"type":"twist","seq":1e9,"at_ms":1,"vx":1,"vy":0,"wz":0,"more":1})",
                          R"({"type":"joints","seq":1e9,"at_ms":1,"names":["arm"],"velocities":[]})",
                          R"({"type":"joints","seq":1e9,"at_ms":1,"names":"arm","velocities":[1]})",
                          R"({"type":"joints","seq":1e9,"at_ms":1,"names":[1],"velocities":[1]})",
                          R"({"type":"ping","at_ms":1,"pong_us":1})",
                          R"({"type":"drive","robot":["trainee"]})"}) {
    auto client = open("anna");
    drive(*client);
    twist(*client, 0.5);
    discard_published();
    send_text(*client, bad);
    const auto speeds = published()[channel::kTeleop];
    ASSERT_FALSE(speeds.empty()) << bad;
    EXPECT_FALSE(moves(speeds)) << bad;
    EXPECT_NE(client->texts("refused").back().find(R"("rearm":true)"), std::string::npos) << bad;
    close(*client);
    discard_published();
  }
}

TEST_F(TeleopServiceTest, ClosesPagesThatSendInvalidOrTooManyMessages) {
  auto client = open("anna");
  drive(*client);
  for (int i = 0; i < 20; ++i) handler_.received(*client, std::string(8, '\0'), true);
  EXPECT_EQ(client->closed_with, 1008);
  EXPECT_TRUE(service_->driving().empty());
  auto other = open("bert");
  drive(*other);
  for (int i = 0; i < 400; ++i) twist(*other, 0.5);
  EXPECT_EQ(other->closed_with, 1008);
  EXPECT_EQ(published()[channel::kTeleop].back(), 0);
}

TEST_F(TeleopServiceTest, KeepsRandomMessagesWithinTheRobotLimits) {
  const std::string model = R"({"type":"twist","seq":5,"at_ms":1000,"vx":0.5,"vy":0.1,"wz":-0.2})";
  std::uint64_t random = 7;
  int moved = 0;
  for (int i = 0; i < 1000; ++i) {
    auto client = open("anna");
    drive(*client);
    std::string text = model;
    for (int change = i % 4; change > 0; --change) {
      random = random * 6364136223846793005U + 1442695040888963407U;
      text[(random >> 33) % text.size()] = static_cast<char>(random >> 24);
    }
    send_text(*client, text);
    moved += moves(published()[channel::kTeleop]);
    EXPECT_LE(std::abs(last_.vx), 1.0) << text;
    EXPECT_LE(std::abs(last_.wz), 2.0) << text;
    EXPECT_EQ(last_.vy, 0) << text;
    close(*client);
    discard_published();
  }
  EXPECT_GE(moved, 250) << "those that were left as they are";
}

}  // namespace
}  // namespace parhelion::station
