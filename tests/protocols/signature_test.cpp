// Signatures: what is accepted, each reason to refuse, and that plain decoders still read signed messages.
#include "protocols/authentication/signature.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "tests/protocols/codec_samples.hpp"

namespace parhelion {
namespace {

constexpr SensorTime kNow = SensorTime::from_utime(1'700'000'000'000'000);

class SignatureTest : public ::testing::Test {
 protected:
  SignatureTest() {
    rover_ = {"rover", new_secret(), {"robot"}, {}};
    ann_ = {"ann", new_secret(), {"trainee"}, {"CONSOLE_.*"}};
    server_ = {"server", new_secret(), seconds(1.0), {rover_, ann_}};
    verifier_.emplace(server_);
    signer_.emplace(rover_.name, rover_.secret);
  }

  std::vector<std::uint8_t> signed_by(Signer& signer, const std::string& channel, SensorTime now = kNow) {
    std::vector<std::uint8_t> message;
    signer.sign(channel, payload_, now, message);
    return message;
  }
  std::optional<SignatureFault> fault(const std::string& channel, const std::vector<std::uint8_t>& message,
                                      SensorTime now = kNow) {
    return verifier_->verify(channel, message, now).fault;
  }

  const std::vector<std::uint8_t> payload_{1, 2, 3, 4, 5, 6, 7, 8, 9};
  Sender rover_, ann_;
  Keys server_;
  std::optional<Verifier> verifier_;
  std::optional<Signer> signer_;
};

TEST_F(SignatureTest, AMessageIsAcceptedOnceAndHasItsSender) {
  const auto message = signed_by(*signer_, "SCAN");
  EXPECT_EQ(message.size(), payload_.size() + kSignatureSize);
  const auto verdict = verifier_->verify("SCAN", message, kNow);
  EXPECT_FALSE(verdict.fault);
  EXPECT_EQ(verdict.sender, "rover");
  EXPECT_EQ(fault("SCAN", message), SignatureFault::replayed);
}

TEST_F(SignatureTest, EachBitOfAMessageIsProtected) {
  const auto good = signed_by(*signer_, "SCAN");
  for (std::size_t bit = 0; bit < good.size() * 8; ++bit) {
    auto bad = good;
    bad[bit / 8] ^= static_cast<std::uint8_t>(1U << (bit % 8));
    EXPECT_TRUE(fault("SCAN", bad)) << "bit " << bit;
  }
  EXPECT_FALSE(fault("SCAN", good)) << "no forgery may use up the counter";
}

TEST_F(SignatureTest, AMessageIsValidOnItsOwnChannelOnly) {
  EXPECT_EQ(fault("ODOMETRY", signed_by(*signer_, "SCAN")), SignatureFault::bad_signature);
}

TEST_F(SignatureTest, ASenderMayPublishOnlyWhatItsRolesAndChannelsPermit) {
  EXPECT_EQ(fault("TELEOP", signed_by(*signer_, "TELEOP")), SignatureFault::wrong_channel);
  Signer ann(ann_.name, ann_.secret);
  EXPECT_FALSE(fault("TELEOP", signed_by(ann, "TELEOP")));
  EXPECT_FALSE(fault("CONSOLE_7", signed_by(ann, "CONSOLE_7")));
  EXPECT_FALSE(fault("MR_AGENT_dog_TELEOP", signed_by(ann, "MR_AGENT_dog_TELEOP")));
  for (const char* channel : {"SCAN", "MR_CMD", "MR_SPAWN", "MR_AGENT_dog_SCAN", "POSE_COV"})
    EXPECT_EQ(fault(channel, signed_by(ann, channel)), SignatureFault::wrong_channel) << channel;
}

TEST_F(SignatureTest, ARolesChannelsIncludeThoseOfEachOfSeveralRobots) {
  EXPECT_FALSE(fault("SCAN.rover_2", signed_by(*signer_, "SCAN.rover_2")));
  EXPECT_EQ(fault("MR_CMD.rover_2", signed_by(*signer_, "MR_CMD.rover_2")), SignatureFault::wrong_channel);
}

TEST_F(SignatureTest, ARolesChannelsIncludeThoseOfEachFurtherLaser) {
  for (const char* channel : {"SCAN_rear", "SCAN_rear.rover_2"})
    EXPECT_FALSE(fault(channel, signed_by(*signer_, channel))) << channel;
  for (const char* channel : {"MR_SCAN_rear", "MR_SCAN_INFO_rear", "SCAN_", "SCAN_a/b"})
    EXPECT_EQ(fault(channel, signed_by(*signer_, channel)), SignatureFault::wrong_channel) << channel;
  Signer server(server_.name, server_.secret);
  for (const char* channel : {"MR_SCAN_rear", "MR_SCAN_INFO_rear.rover_2"})
    EXPECT_FALSE(fault(channel, signed_by(server, channel))) << channel;
}

TEST_F(SignatureTest, OthersAreRefusedByName) {
  EXPECT_EQ(fault("SCAN", payload_), SignatureFault::not_signed);
  EXPECT_EQ(fault("SCAN", {}), SignatureFault::not_signed);
  Signer stranger("stranger", new_secret()), impostor("rover", new_secret());
  EXPECT_EQ(fault("SCAN", signed_by(stranger, "SCAN")), SignatureFault::unknown_sender);
  EXPECT_EQ(fault("SCAN", signed_by(impostor, "SCAN")), SignatureFault::bad_signature);
}

TEST_F(SignatureTest, TheClockOfASenderMayDifferByKeysClock) {
  for (const double late : {-0.99, 0.0, 0.99})
    EXPECT_FALSE(fault("SCAN", signed_by(*signer_, "SCAN", kNow - seconds(late)))) << late;
  for (const double late : {-1.01, 1.01, 3600.0})
    EXPECT_EQ(fault("SCAN", signed_by(*signer_, "SCAN", kNow - seconds(late))), SignatureFault::wrong_time)
        << late;
}

TEST_F(SignatureTest, MessagesMayArriveInAnotherOrderWithinTheWindow) {
  std::vector<std::vector<std::uint8_t>> messages;
  for (int i = 0; i < 3000; ++i) messages.push_back(signed_by(*signer_, "SCAN"));
  EXPECT_FALSE(fault("SCAN", messages[2000]));
  EXPECT_FALSE(fault("SCAN", messages[2000 - 1023]));
  EXPECT_EQ(fault("SCAN", messages[2000 - 1023]), SignatureFault::replayed);
  EXPECT_EQ(fault("SCAN", messages[2000 - 1024]), SignatureFault::replayed) << "beyond the window";
  EXPECT_FALSE(fault("SCAN", messages[2999]));
  EXPECT_EQ(fault("SCAN", messages[2000]), SignatureFault::replayed);
  EXPECT_FALSE(fault("SCAN", messages[2001])) << "a slot that an older counter had used";
}

// A stranger keeps a command that was lost here, and sends it after the stop.
TEST_F(SignatureTest, ACommandThatANewerOneHasOvertakenIsRefused) {
  Signer ann(ann_.name, ann_.secret), server(server_.name, server_.secret);
  for (const char* channel : {"TELEOP", "TELEOP.rover_2", "JOINT_CMD", "MR_EMERGENCY_STOP", "CONSOLE_1"}) {
    const auto lost = signed_by(ann, channel), stop = signed_by(ann, channel);
    EXPECT_FALSE(fault(channel, stop)) << channel;
    EXPECT_EQ(fault(channel, lost), SignatureFault::replayed) << channel;
    EXPECT_FALSE(fault(channel, signed_by(ann, channel))) << channel;
  }
  const auto lost = signed_by(server, "MR_CMD"), scan = signed_by(server, "MR_SCAN"),
             stop = signed_by(server, "MR_CMD");
  EXPECT_FALSE(fault("MR_CMD", stop));
  EXPECT_EQ(fault("MR_CMD", lost), SignatureFault::replayed);
  EXPECT_FALSE(fault("MR_SCAN", scan)) << "of sensor data each message counts";
}

// The counters of the run before are gone.
TEST_F(SignatureTest, AMessageFromBeforeTheStartIsRefused) {
  Signer ann(ann_.name, ann_.secret);
  const auto before = signed_by(ann, "TELEOP", kNow - seconds(0.1)), after = signed_by(ann, "TELEOP", kNow);
  verifier_.emplace(server_, kNow);
  EXPECT_EQ(fault("TELEOP", before, kNow + seconds(0.1)), SignatureFault::wrong_time);
  EXPECT_FALSE(fault("TELEOP", after, kNow + seconds(0.1)));
}

RC_GTEST_FIXTURE_PROP(SignatureTest, AnyOrderOfRepeatedMessagesIsAcceptedOncePerMessage, ()) {
  std::vector<std::vector<std::uint8_t>> messages;
  for (int i = 0; i < 40; ++i) messages.push_back(signed_by(*signer_, "SCAN"));
  const auto order = *rc::gen::container<std::vector<std::size_t>>(rc::gen::inRange<std::size_t>(0, 40));
  std::set<std::size_t> seen;
  for (const std::size_t i : order)
    RC_ASSERT(fault("SCAN", messages[i]).has_value() == !seen.insert(i).second);
}

TEST_F(SignatureTest, ASenderMayRunTwiceAndStartAgain) {
  Signer again(rover_.name, rover_.secret);
  for (int i = 0; i < 3; ++i) {
    EXPECT_FALSE(fault("SCAN", signed_by(*signer_, "SCAN")));
    EXPECT_FALSE(fault("SCAN", signed_by(again, "SCAN")));
  }
}

TEST_F(SignatureTest, MemoryForRunsIsBoundedAndAReplayOfAForgottenRunIsTooOld) {
  std::vector<std::uint8_t> first;
  for (int i = 0; i < 64; ++i) {
    Signer run(rover_.name, rover_.secret);
    const auto message = signed_by(run, "SCAN");
    if (i == 0) first = message;
    EXPECT_FALSE(fault("SCAN", message));
  }
  Signer one_more(rover_.name, rover_.secret);
  EXPECT_EQ(fault("SCAN", signed_by(one_more, "SCAN")), SignatureFault::too_many_runs);
  const SensorTime later = kNow + seconds(1.5);
  EXPECT_FALSE(fault("SCAN", signed_by(one_more, "SCAN", later), later));
  EXPECT_EQ(fault("SCAN", first, later), SignatureFault::wrong_time);
}

TEST_F(SignatureTest, TheProgramAcceptsItsOwnMessagesOnEachChannelOnce) {
  Signer own(server_.name, server_.secret);
  const auto message = signed_by(own, "MR_CMD");
  EXPECT_FALSE(fault("MR_CMD", message));
  EXPECT_EQ(fault("MR_CMD", message), SignatureFault::replayed);
}

class SignedSample : public ::testing::TestWithParam<test::Sample> {};
INSTANTIATE_TEST_SUITE_P(Signature, SignedSample, ::testing::ValuesIn(test::samples()),
                         [](const auto& instance) { return instance.param.type; });

TEST_P(SignedSample, DecodesWithItsSignature) {
  Signer signer("rover", new_secret());
  std::vector<std::uint8_t> message;
  signer.sign("CHANNEL", GetParam().bytes, kNow, message);
  const Status status = GetParam().decode(message);
  EXPECT_TRUE(status) << status.error().message;
  message.back() ^= 1;
  EXPECT_FALSE(GetParam().decode(message)) << "other surplus bytes are refused";
}

}  // namespace
}  // namespace parhelion
