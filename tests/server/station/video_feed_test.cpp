// The newest picture for each page that keeps up, encoded once; a frozen picture never looks live.
#include "server/station/video/video_feed.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <utility>

#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "server/runtime/wall_clock.hpp"
#include "tests/number_at.hpp"
#include "tests/server/station/recording_client.hpp"

namespace parhelion::station {
namespace {

constexpr char kFrameKind = 5;  ///< first byte of a video frame, see video_message()

struct Seen {
  VideoCodec codec;
  bool key;
  PictureState state;
  std::uint32_t sequence;
  std::int64_t stamp_us, server_us, drawn_us;
  std::uint16_t width, height;
  std::string picture;
};

std::vector<Seen> frames(const RecordingClient& client) {
  std::vector<Seen> all;
  for (const auto& sent : client.sent) {
    if (!sent.binary) continue;
    const std::string& bytes = *sent.bytes;
    EXPECT_GT(bytes.size(), kVideoHeader);
    EXPECT_EQ(bytes[0], kFrameKind);
    all.push_back({static_cast<VideoCodec>(bytes[1]), bytes[2] != 0, static_cast<PictureState>(bytes[3]),
                   test::number_at<std::uint32_t>(bytes, 4), test::number_at<std::int64_t>(bytes, 8),
                   test::number_at<std::int64_t>(bytes, 16), test::number_at<std::int64_t>(bytes, 24),
                   test::number_at<std::uint16_t>(bytes, 32), test::number_at<std::uint16_t>(bytes, 34),
                   bytes.substr(kVideoHeader)});
  }
  return all;
}

class VideoFeedTest : public testing::Test {
 protected:
  VideoFeedTest() : robot_(hub_.connect()) {
    VideoOptions options;
    options.robot = "trainee";
    options.now = [this] { return now_; };
    options.stamp = [this] { return wall(); };
    feed_ = std::make_unique<VideoFeed>(hub_.connect(), options);
    feed_->set_robots({"trainee", "robot_2"});
  }
  SensorTime wall() const { return SensorTime{1'700'000'000'000'000'000 + now_.ns}; }

  std::shared_ptr<RecordingClient> look(const std::string& query, bool stream = false) {
    auto client = RecordingClient::make(++clients_, "anna", Role::observer, query);
    (stream ? feed_->stream() : feed_->socket()).opened(client);
    feed_->turn(Duration{});
    return client;
  }
  void send_text(RecordingClient& client, const std::string& text) {
    feed_->socket().received(client, text, false);
  }
  /// Publishes a picture taken `ago` s before, and runs the feed once.
  Image show(const char* channel = channel::kMrCamera, double ago = 0.02, const std::string& reason = "") {
    Image image = picture_;
    image.stamp = wall() - seconds(ago);
    if (!reason.empty()) image.metadata.push_back({"parhelion.reason", {reason.begin(), reason.end()}});
    publish(channel, image);
    return image;
  }
  void publish(const char* channel, const Image& image) {
    std::vector<std::uint8_t> payload;
    encode(image, payload);
    ASSERT_TRUE(robot_->publish(channel, payload).ok());
    feed_->turn(Duration{});
  }
  void pass(double s) {
    now_ = now_ + seconds(s);
    feed_->turn(Duration{});
  }
  static Image jpeg(int width, int height) {
    std::vector<std::uint8_t> bgr;
    for (int i = 0; i < width * height * 3; ++i) bgr.push_back(static_cast<std::uint8_t>(i % 251));
    Image image;
    image.width = width;
    image.height = height;
    image.bytes =
        render::JpegCodec().encode(bgr, {width, height, 80, render::JpegFormat::Subsampling::yuv420}).value();
    return image;
  }

  MemoryBusHub hub_;
  std::unique_ptr<Bus> robot_;
  WallTime now_{1'000'000'000};
  std::uint64_t clients_ = 0;
  Image picture_ = jpeg(64, 48);
  std::unique_ptr<VideoFeed> feed_;
};

TEST_F(VideoFeedTest, ForwardsJpegUnchangedWithItsAge) {
  auto client = look("robot=trainee&codec=jpeg");
  const std::int64_t before = runtime::wall_now().utime();
  const Image image = show(channel::kMrCamera, 0.035);
  const auto seen = frames(*client);
  ASSERT_EQ(seen.size(), 1U);
  EXPECT_EQ(seen[0].picture, std::string(image.bytes.begin(), image.bytes.end()));
  EXPECT_EQ(seen[0].codec, VideoCodec::jpeg);
  EXPECT_EQ(seen[0].state, PictureState::live);
  EXPECT_EQ(seen[0].server_us - seen[0].stamp_us, 35'000);
  EXPECT_GE(seen[0].drawn_us, before) << "the time of arrival on the bus";
  EXPECT_LE(seen[0].drawn_us, runtime::wall_now().utime());
  EXPECT_EQ(seen[0].width, 64);
  EXPECT_EQ(seen[0].height, 48);
}

TEST_F(VideoFeedTest, EncodesOncePerStreamAndNeverWithoutViewers) {
  show();
  EXPECT_EQ(feed_->counts().pictures, 0U);
  auto anna = look("codec=h264"), bert = look("codec=h264");
  for (int i = 0; i < 5; ++i) {
    show();
    pass(0.033);
  }
  EXPECT_EQ(feed_->counts().coded, 5U);
  ASSERT_EQ(frames(*anna).size(), 5U);
  EXPECT_EQ(frames(*anna)[0].codec, VideoCodec::h264);
  EXPECT_TRUE(frames(*anna)[0].key);
  EXPECT_FALSE(frames(*anna)[1].key);
  for (std::size_t i = 0; i < anna->sent.size(); ++i) {
    if (anna->sent[i].binary) {
      EXPECT_EQ(anna->sent[i].bytes, bert->sent[i].bytes) << "one buffer for both";
    }
  }
}

TEST_F(VideoFeedTest, StartsALateViewerWithARequestedKeyframe) {
  auto anna = look("codec=h264");
  show();
  pass(0.033);
  auto bert = look("codec=h264");
  show();
  EXPECT_TRUE(frames(*bert).empty()) << "key pictures are not made faster than one in 0.3 s";
  EXPECT_EQ(frames(*anna).size(), 2U);
  pass(0.3);
  show();
  ASSERT_EQ(frames(*bert).size(), 1U);
  EXPECT_TRUE(frames(*bert)[0].key);
  pass(0.4);
  send_text(*bert, R"({"type":"key"})");
  show();
  EXPECT_TRUE(frames(*bert).back().key);
  pass(0.4);
  show();
  EXPECT_FALSE(frames(*bert).back().key);
}

TEST_F(VideoFeedTest, SkipsFramesForASlowViewerUntilAKeyframe) {
  auto fast = look("codec=h264"), slow = look("codec=h264");
  show();
  pass(0.4);
  slow->waiting = 1'000'000;
  for (int i = 0; i < 6; ++i) {
    show();
    pass(0.1);
  }
  EXPECT_EQ(frames(*slow).size(), 1U);
  EXPECT_EQ(frames(*fast).size(), 7U);
  slow->waiting = 0;
  show();
  ASSERT_EQ(frames(*slow).size(), 2U);
  EXPECT_TRUE(frames(*slow)[1].key);
  std::uint32_t last = 0;
  for (const Seen& frame : frames(*fast))
    EXPECT_EQ(frame.sequence, ++last) << "a viewer that keeps up receives every frame";
}

TEST_F(VideoFeedTest, ReplacesQueuedPicturesWithTheNewest) {
  auto client = look("codec=jpeg");
  std::vector<std::uint8_t> payload;
  Image newest = picture_;
  for (int i = 0; i < 4; ++i) {
    newest.stamp = wall() - milliseconds(10 - i);
    encode(newest, payload);
    ASSERT_TRUE(robot_->publish(channel::kMrCamera, payload).ok());
  }
  feed_->turn(Duration{});
  feed_->turn(Duration{});
  ASSERT_EQ(frames(*client).size(), 1U);
  EXPECT_EQ(frames(*client)[0].stamp_us, newest.stamp.utime());
  client->waiting = 500'000;
  show();
  EXPECT_EQ(frames(*client).size(), 1U) << "nothing is put behind what waits already";
}

/// Runs `during` inside receive(), as a page may connect while the feed waits for a picture.
class ReceivingBus final : public Bus {
 public:
  explicit ReceivingBus(std::unique_ptr<Bus> bus) : bus_(std::move(bus)) {}
  Status publish(std::string_view channel, std::span<const std::uint8_t> payload) override {
    return bus_->publish(channel, payload);
  }
  Result<bool> receive(Message& message, Duration timeout) override {
    if (during) std::exchange(during, nullptr)();
    return bus_->receive(message, timeout);
  }
  Status subscribe(const std::string& pattern, int capacity) override {
    return bus_->subscribe(pattern, capacity);
  }
  std::uint64_t dropped() const override { return bus_->dropped(); }

  std::function<void()> during;

 private:
  std::unique_ptr<Bus> bus_;
};

TEST_F(VideoFeedTest, ARobotOfTheSessionIsNeverReportedAsMissing) {
  VideoOptions options;
  options.robot = "trainee";
  options.now = [this] { return now_; };
  options.stamp = [this] { return wall(); };
  auto bus = std::make_unique<ReceivingBus>(hub_.connect());
  ReceivingBus& receiving = *bus;
  VideoFeed feed(std::move(bus), options);
  auto client = RecordingClient::make(++clients_, "anna", Role::observer, "codec=jpeg");
  receiving.during = [&] { feed.socket().opened(client); };
  feed.turn(Duration{});
  EXPECT_TRUE(client->texts().empty()) << "its source is made in the next turn";
  feed.turn(Duration{});
  ASSERT_EQ(client->texts().size(), 1U);
  EXPECT_EQ(client->texts()[0].find("no robot"), std::string::npos);
}

TEST_F(VideoFeedTest, ReportsWhenAPictureIsStaleAndWhy) {
  auto client = look("codec=jpeg");
  ASSERT_EQ(client->texts().size(), 1U);
  EXPECT_NE(client->texts()[0].find(R"("state":"none")"), std::string::npos);
  EXPECT_NE(client->texts()[0].find("MR_CAMERA"), std::string::npos);
  show();
  EXPECT_NE(client->texts().back().find(R"("state":"live")"), std::string::npos);
  pass(0.45);
  EXPECT_EQ(client->texts().size(), 2U);
  pass(0.1);
  EXPECT_NE(client->texts().back().find(R"("state":"stale")"), std::string::npos);
  show();
  EXPECT_NE(client->texts().back().find(R"("state":"live")"), std::string::npos);
  auto other = look("robot=nobody&codec=jpeg");
  EXPECT_NE(other->texts().back().find("no robot 'nobody'"), std::string::npos);
}

TEST_F(VideoFeedTest, MarksPicturesWithoutDrawnBodiesAsCameraOnly) {
  auto client = look("codec=jpeg");
  show(channel::kMrCamera, 0.02, "no pose: lost");
  EXPECT_EQ(frames(*client).back().state, PictureState::original);
  EXPECT_NE(client->texts().back().find("no pose: lost"), std::string::npos);
  show(channel::kCamera);
  EXPECT_EQ(frames(*client).size(), 1U) << "not used while augmented pictures arrive";
  pass(0.6);
  show(channel::kCamera);
  ASSERT_EQ(frames(*client).size(), 2U);
  EXPECT_EQ(frames(*client).back().state, PictureState::original);
  EXPECT_NE(client->texts().back().find("the camera's own"), std::string::npos);
  show();
  EXPECT_EQ(frames(*client).back().state, PictureState::live);
}

TEST_F(VideoFeedTest, ShowsAnAgentsCamera) {
  auto client = look("robot=robot_2&codec=h264");
  show("MR_AGENT_robot_2_CAMERA", 0.08);
  const auto seen = frames(*client);
  ASSERT_EQ(seen.size(), 1U);
  EXPECT_EQ(seen[0].state, PictureState::simulated);
  EXPECT_EQ(seen[0].server_us - seen[0].stamp_us, 80'000);
  pass(0.6);
  EXPECT_NE(client->texts().back().find(R"("state":"stale")"), std::string::npos);
  EXPECT_NE(client->texts().back().find("no picture on MR_AGENT_robot_2_CAMERA"), std::string::npos);
}

TEST_F(VideoFeedTest, StreamsAnAgentCameraFromItsRenamedChannel) {
  VideoOptions options;
  options.robot = "trainee";
  options.now = [this] { return now_; };
  options.stamp = [this] { return wall(); };
  options.agent_camera = [](const std::string& agent) { return "site/" + agent; };
  feed_ = std::make_unique<VideoFeed>(hub_.connect(), options);
  feed_->set_robots({"trainee", "robot_2"});
  auto client = look("robot=robot_2&codec=jpeg");
  show("MR_AGENT_robot_2_CAMERA");
  EXPECT_TRUE(frames(*client).empty());
  show("site/robot_2");
  EXPECT_EQ(frames(*client).size(), 1U);
}

TEST_F(VideoFeedTest, EncodesRawImagesAndChangingSizes) {
  auto video = look("codec=h264"), jpegs = look("codec=jpeg");
  for (const auto format : {PixelFormat::rgb, PixelFormat::bgr, PixelFormat::gray}) {
    const int bytes = format == PixelFormat::gray ? 1 : 3;
    Image image;
    image.stamp = wall();
    image.width = 32, image.height = 24, image.row_stride = 32 * bytes;
    image.format = format;
    image.bytes.assign(static_cast<std::size_t>(32 * 24 * bytes), 200);
    publish(channel::kMrCamera, image);
    pass(0.4);
    EXPECT_EQ(frames(*video).back().width, 32);
    const std::string coded = frames(*jpegs).back().picture;
    std::vector<std::uint8_t> bgr;
    ASSERT_TRUE(render::JpegCodec().decode({coded.begin(), coded.end()}, bgr).ok());
    EXPECT_NEAR(bgr[100], 200, 3);
  }
  picture_ = jpeg(96, 64);
  show();
  EXPECT_TRUE(frames(*video).back().key) << "another size begins anew";
  picture_ = jpeg(10, 10);
  show();
  EXPECT_EQ(frames(*video).back().codec, VideoCodec::jpeg) << "too small for H.264";
}

TEST_F(VideoFeedTest, ReportsAnUnreadablePictureAndContinues) {
  auto client = look("codec=h264");
  Image broken = picture_;
  broken.stamp = wall();
  broken.bytes.resize(broken.bytes.size() / 2);
  publish(channel::kMrCamera, broken);
  EXPECT_TRUE(frames(*client).empty());
  EXPECT_NE(client->texts().back().find("JPEG"), std::string::npos);
  ASSERT_TRUE(robot_->publish(channel::kMrCamera, std::vector<std::uint8_t>{1, 2, 3}).ok());
  feed_->turn(Duration{});
  EXPECT_EQ(feed_->counts().refused, 2U);
  show();
  EXPECT_EQ(frames(*client).size(), 1U);
  EXPECT_NE(client->texts().back().find(R"("why":"")"), std::string::npos);
}

TEST_F(VideoFeedTest, DelaysAndDropsPicturesForAFault) {
  auto client = look("codec=jpeg");
  const double delay = 0.2, loss = 0.3;  // s; fraction
  feed_->impair(delay, 0);
  show(channel::kMrCamera, 0.02);
  EXPECT_TRUE(frames(*client).empty());
  pass(0.19);
  EXPECT_TRUE(frames(*client).empty());
  pass(0.01);
  ASSERT_EQ(frames(*client).size(), 1U);
  EXPECT_EQ(frames(*client)[0].server_us - frames(*client)[0].stamp_us, 220'000)
      << "the stamp stays that of the exposure, so that the page shows the delay";
  feed_->impair(0, loss);
  for (int i = 0; i < 300; ++i) {
    show();
    pass(0.033);
  }
  EXPECT_NEAR(static_cast<double>(frames(*client).size() - 1), 210, 25);
}

TEST_F(VideoFeedTest, StreamsJpegInPartsThatEndWithTheBoundary) {
  auto stream = look("robot=trainee", true);
  const Image image = show();
  ASSERT_EQ(stream->sent.size(), 2U);
  const std::string boundary = "\r\n--frame\r\n", jpeg(image.bytes.begin(), image.bytes.end());
  EXPECT_EQ(*stream->sent[0].bytes, boundary);
  EXPECT_EQ(*stream->sent[1].bytes, "Content-Type: image/jpeg\r\nContent-Length: " +
                                        std::to_string(jpeg.size()) + "\r\n\r\n" + jpeg + boundary);
  EXPECT_GE(stream->sent[1].slot, 0);
}

TEST_F(VideoFeedTest, AnswersClockMessagesAndClosesInvalidClients) {
  auto client = look("codec=jpeg");
  send_text(*client, R"({"type":"clock","at_ms":12.5})");
  EXPECT_NE(client->texts("clock").back().find(R"("at_ms":12.5)"), std::string::npos);
  for (const char* bad : {"", "{}", R"({"type":"ack","sequence":-1})", R"({"type":"ack","sequence":1e12})",
                          R"({"type":"ack"})", R"({"type":"clock","at_ms":null})", "[1]"})
    send_text(*client, bad);
  EXPECT_EQ(client->closed_with, 0);
  for (int i = 0; i < 20; ++i) feed_->socket().received(*client, "x", true);
  EXPECT_EQ(client->closed_with, 1008);
}

/// 10 s over a link that loses a tenth of its packets and retransmits like TCP: acknowledged late, never
/// lost.
TEST_F(VideoFeedTest, ContinuesOverALossyLink) {
  for (const double loss : {0.02, 0.1}) {
    auto client = look("codec=h264");
    struct Ack {
      std::uint32_t sequence;
      WallTime at;
    };
    std::vector<Ack> acks;
    std::uint64_t random = 3;
    WallTime link_free = now_, shown = now_;
    Duration longest;
    std::size_t handled = client->sent.size();
    std::uint32_t last = 0;
    for (const WallTime end = now_ + seconds(10.0); now_ < end;) {
      show();
      std::size_t waiting = 0;
      for (; handled < client->sent.size(); ++handled) {
        const std::string& bytes = *client->sent[handled].bytes;
        if (!client->sent[handled].binary) continue;
        Duration latency = milliseconds(5);
        for (std::size_t packet = 0; packet <= bytes.size() / 1400; ++packet) {
          random = random * 6364136223846793005U + 1442695040888963407U;
          if (static_cast<double>(random >> 11) * 0x1p-53 < loss) latency = latency + milliseconds(200);
        }
        link_free = std::max(link_free + milliseconds(1), now_ + latency);
        acks.push_back({test::number_at<std::uint32_t>(bytes, 4), link_free});
        // What a decoder can show: key pictures, and what follows without a gap.
        const auto sequence = test::number_at<std::uint32_t>(bytes, 4);
        EXPECT_TRUE(bytes[2] != 0 || sequence == last + 1) << "a gap that no key picture follows";
        last = sequence;
      }
      for (const Ack& ack : acks) {
        if (ack.at > now_) {
          waiting += 2000;
          continue;
        }
        longest = std::max(longest, ack.at - shown);
        shown = ack.at;
        send_text(*client, R"({"type":"ack","sequence":)" + std::to_string(ack.sequence) + "}");
      }
      std::erase_if(acks, [&](const Ack& ack) { return ack.at <= now_; });
      client->waiting = waiting;
      pass(0.0333);
    }
    EXPECT_GT(frames(*client).size(), loss > 0.05 ? 100U : 200U) << loss;
    EXPECT_LT(longest.seconds(), 1.5) << loss;
    feed_->socket().closed(*client);
    feed_->turn(Duration{});
  }
}

}  // namespace
}  // namespace parhelion::station
