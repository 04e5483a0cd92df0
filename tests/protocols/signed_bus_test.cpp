// The bus with signatures, beside strangers on the same bus.
#include "protocols/authentication/signed_bus.hpp"

#include <gtest/gtest.h>

#include <map>

namespace parhelion {
namespace {

class SignedBusTest : public ::testing::Test {
 protected:
  SignedBusTest() {
    const Sender rover{"rover", new_secret(), {"robot"}, {}};
    const Keys server{"server", new_secret(), seconds(1.0), {rover}};
    server_ = sign(hub_.connect(), server, [this](const RefusedMessage& message) {
      ++refused_[std::string(message.channel) + " " + to_string(message.fault)];
    });
    rover_ = sign(hub_.connect(), {rover.name, rover.secret, seconds(1.0), {}}, {});
    stranger_ = hub_.connect();
    EXPECT_TRUE(server_->subscribe(".*", 10'000));
  }

  MemoryBusHub hub_;
  std::unique_ptr<Bus> server_, rover_, stranger_;
  std::map<std::string, int> refused_;
  Message message_;
};

TEST_F(SignedBusTest, ReceivesWhatWasSentWithoutTheTrailer) {
  const std::vector<std::uint8_t> payload{1, 2, 3};
  ASSERT_TRUE(rover_->publish("SCAN", payload));
  ASSERT_TRUE(*server_->receive(message_, seconds(1.0)));
  EXPECT_EQ(message_.channel, "SCAN");
  EXPECT_EQ(message_.payload, payload);
  ASSERT_TRUE(server_->publish("MR_CMD", payload));
  ASSERT_TRUE(*server_->receive(message_, seconds(1.0))) << "its own message";
  EXPECT_EQ(message_.payload, payload);
  EXPECT_TRUE(refused_.empty());
}

/// A key is one sender, from however many programs and sockets it sends.
TEST_F(SignedBusTest, NumbersASenderByItsKey) {
  const Sender slam{"slam", new_secret(), {"localization"}, {}};
  const Keys keys{"server", new_secret(), seconds(1.0), {slam}};
  const auto server = sign(hub_.connect(), keys, {});
  ASSERT_TRUE(server->subscribe("POSE_COV", 10).ok());
  const Keys own{slam.name, slam.secret, seconds(1.0), {}};
  const auto one = sign(hub_.connect(), own, {}), other = sign(hub_.connect(), own, {});
  ASSERT_TRUE(one->publish("POSE_COV", std::vector<std::uint8_t>{1}).ok());
  ASSERT_TRUE(*server->receive(message_, seconds(1.0)));
  const std::uint64_t sender = message_.sender;
  EXPECT_NE(sender, 0U);
  ASSERT_TRUE(other->publish("POSE_COV", std::vector<std::uint8_t>{2}).ok());
  ASSERT_TRUE(*server->receive(message_, seconds(1.0)));
  EXPECT_EQ(message_.sender, sender);
  ASSERT_TRUE(rover_->publish("SCAN", std::vector<std::uint8_t>{1}).ok());
  ASSERT_TRUE(*server_->receive(message_, seconds(1.0)));
  EXPECT_NE(message_.sender, sender);
}

TEST_F(SignedBusTest, PassesOnNothingOfStrangersAndNamesTheReasons) {
  ASSERT_TRUE(stranger_->subscribe("SCAN", 10));
  ASSERT_TRUE(rover_->publish("SCAN", std::vector<std::uint8_t>{7}));
  Message recorded;
  ASSERT_TRUE(*stranger_->receive(recorded, seconds(1.0)));
  for (int i = 0; i < 1000; ++i) {
    ASSERT_TRUE(stranger_->publish("SCAN", std::vector<std::uint8_t>{1, 2, 3}));
    ASSERT_TRUE(stranger_->publish("SCAN", recorded.payload));
    ASSERT_TRUE(stranger_->publish("ODOMETRY", recorded.payload));
  }
  int accepted = 0;
  for (int idle = 0; idle < 10;) {
    const auto came = server_->receive(message_, Duration{0});
    ASSERT_TRUE(came);
    if (*came) {
      EXPECT_EQ(message_.payload, std::vector<std::uint8_t>{7});
      ++accepted;
    }
    idle = *came ? 0 : idle + 1;
  }
  EXPECT_EQ(accepted, 1);
  EXPECT_EQ(refused_["SCAN not signed"], 1000);
  EXPECT_EQ(refused_["SCAN received before, or overtaken by a newer one"], 1000);
  EXPECT_EQ(refused_["ODOMETRY signed with another secret, or changed on the way"], 1000);
}

TEST_F(SignedBusTest, AFloodOfRefusedMessagesDoesNotKeepTheCaller) {
  for (int i = 0; i < 5000; ++i) ASSERT_TRUE(stranger_->publish("SCAN", std::vector<std::uint8_t>{1}));
  EXPECT_FALSE(*server_->receive(message_, Duration{0}));
  EXPECT_LE(refused_["SCAN not signed"], 1000);
}

}  // namespace
}  // namespace parhelion
