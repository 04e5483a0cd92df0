// For any input the original is sent with the reason, and nothing crashes (promises 2 and 7).
#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "render/depth_image.hpp"
#include "render/i420_picture.hpp"
#include "tests/render/scenes.hpp"

namespace parhelion::render {
namespace {

using namespace test;

class BadInput : public testing::Test {
 protected:
  void SetUp() override {
    auto made = Compositor::create({});
    ASSERT_TRUE(made.ok()) << made.error().message;
    compositor_ = std::move(*made);
  }
  /// The original bytes, and a reason that contains `word`.
  void expect_original(const RenderJob& job, const std::string& word) {
    const RenderAnswer answer = compositor_->compose(job);
    EXPECT_FALSE(answer.drawn);
    EXPECT_EQ(answer.image.bytes, job.image.bytes);
    EXPECT_NE(answer.reason.find(word), std::string::npos) << "reason: " << answer.reason;
    EXPECT_FALSE(compositor_->compose_pixels(job).ok());
  }
  std::unique_ptr<Compositor> compositor_;
};

TEST_F(BadInput, CameraWithoutCalibration) {
  RenderJob job = robot_job(jpeg_image());
  job.camera.intrinsics.fx = 0;
  expect_original(job, "not calibrated");
  job.camera.intrinsics.fx = std::numeric_limits<double>::quiet_NaN();
  expect_original(job, "not calibrated");
  job = robot_job(jpeg_image());
  job.camera.intrinsics.width = 0;
  expect_original(job, "not calibrated");
}

TEST_F(BadInput, CorruptAndEmptyJpeg) {
  RenderJob job = robot_job(jpeg_image());
  job.image.bytes.resize(job.image.bytes.size() / 2);
  expect_original(job, "JPEG");
  job.image.bytes.clear();
  expect_original(job, "JPEG");
  job.image.bytes = noise(5000);
  expect_original(job, "JPEG");
}

TEST_F(BadInput, FlippedBitsNeverCrash) {
  const RenderJob good = robot_job(jpeg_image(160, 120));
  std::mt19937 random(3);
  for (int i = 0; i < 200; ++i) {
    RenderJob job = good;
    for (int k = 0; k < 4; ++k)
      job.image.bytes[random() % job.image.bytes.size()] ^= static_cast<std::uint8_t>(1U << random() % 8);
    const RenderAnswer answer = compositor_->compose(job);
    if (!answer.drawn) {
      EXPECT_EQ(answer.image.bytes, job.image.bytes);
    }
  }
}

TEST_F(BadInput, SizeDiffersFromTheCalibration) {
  RenderJob job = robot_job(jpeg_image(640, 360));
  expect_original(job, "aspect");
  job = robot_job(jpeg_image(320, 240));  // the same aspect ratio: the intrinsics are scaled
  EXPECT_TRUE(compositor_->compose(job).drawn);
}

TEST_F(BadInput, RawImagesWithAWrongSize) {
  for (const PixelFormat format : {PixelFormat::gray, PixelFormat::rgb, PixelFormat::bgr}) {
    RenderJob job = robot_job(raw_image(format));
    job.image.bytes.resize(job.image.bytes.size() - 1);
    expect_original(job, "too few");
    job = robot_job(raw_image(format));
    job.image.row_stride = 10;
    expect_original(job, "too few");
    job.image.width = 1'000'000, job.image.height = 1'000'000;
    expect_original(job, "8192");
    job.image.height = -1;
    expect_original(job, "8192");
  }
  RenderJob job = robot_job(raw_image(PixelFormat::gray));
  job.image.format = static_cast<PixelFormat>(1234);
  expect_original(job, "1234");
}

TEST_F(BadInput, NonFinitePose) {
  RenderJob job = robot_job(jpeg_image());
  job.T_map_optical = Transform<Map, CameraOptical>(
      {Eigen::Quaterniond::Identity(), Eigen::Vector3d(std::numeric_limits<double>::quiet_NaN(), 0, 0)});
  expect_original(job, "finite");
}

TEST_F(BadInput, UnreadableDepthStillGivesTheImageAndTheReason) {
  RenderJob job = robot_job(jpeg_image());
  job.depth = Image{};
  job.depth->format = PixelFormat::depth_mm;
  job.depth->width = 640, job.depth->height = 480;
  job.depth->bytes = noise(100);
  job.depth->metadata = {{"encoding", {'p', 'n', 'g'}}};
  job.depth_camera.intrinsics = job.camera.intrinsics;
  const RenderAnswer answer = compositor_->compose(job);
  EXPECT_TRUE(answer.drawn);
  EXPECT_NE(answer.reason.find("PNG"), std::string::npos) << answer.reason;
  ASSERT_TRUE(answer.depth);
  EXPECT_EQ(answer.depth->bytes, job.depth->bytes);
}

TEST_F(BadInput, BodiesBehindInAndAroundTheCamera) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> near(-1.5, 1.5), angle(-3.14, 3.14), size(0.001, 3);
  for (int i = 0; i < 150; ++i) {
    World world;
    for (int k = 0; k < 4; ++k)
      world.add(
          "thing", {shape(static_cast<ShapeKind>(random() % 4), {size(random), size(random), size(random)})},
          Transform<Map, Body>(
              {Eigen::Quaterniond(Eigen::AngleAxisd(angle(random), Eigen::Vector3d(1, 2, 3).normalized())),
               {near(random), near(random), near(random)}}));
    RenderJob job = robot_job(raw_image(PixelFormat::bgr, 96, 72));
    job.camera = pinhole(96, 72, 60);
    if (i % 3 == 1) job.camera.intrinsics.distortion = {-0.3, 0.1, 0, 0, 0};
    if (i % 3 == 2)
      job.camera.intrinsics.lens = CameraIntrinsics::Lens::fisheye,
      job.camera.intrinsics.fx = job.camera.intrinsics.fy = 30;
    job.T_map_optical = look({0, 0, 0.2}, angle(random), 0.3 * angle(random));
    job.world = world.snapshot;
    const auto pixels = compositor_->compose_pixels(job);
    ASSERT_TRUE(pixels.ok()) << pixels.error().message;
    for (std::size_t p = 0; p < job.image.bytes.size(); ++p) {
      if (!pixels->mask[p / 3]) {
        ASSERT_EQ(pixels->bgr[p], job.image.bytes[p]);
      }
    }
  }
}

TEST_F(BadInput, CameraInsideABodySeesNothingOfIt) {
  World world;
  world.add("round us", {shape(ShapeKind::box, {2, 2, 2})}, Transform<Map, Body>::planar(0, 0, 0.3, 0.5));
  RenderJob job = robot_job(jpeg_image());
  job.world = world.snapshot;
  job.floor_z = -100;
  EXPECT_FALSE(compositor_->compose(job).drawn);
}

TEST(DepthImage, RoundTripsEveryEncodingAndRefusesWrongSizes) {
  for (const std::string encoding : {"raw", "png", "zlib"}) {
    DepthPixels pixels{64, 48, std::vector<std::uint16_t>(64 * 48)};
    std::mt19937 random(5);
    for (auto& d : pixels.millimetres) d = static_cast<std::uint16_t>(random() % 9000);
    Image like;
    like.format = PixelFormat::depth_mm;
    like.metadata = {{"encoding", {encoding.begin(), encoding.end()}}};
    const auto image = encode_depth(pixels, like);
    ASSERT_TRUE(image.ok());
    const auto back = decode_depth(*image);
    ASSERT_TRUE(back.ok()) << back.error().message;
    EXPECT_EQ(back->millimetres, pixels.millimetres);
    Image cut = *image;
    cut.bytes.resize(cut.bytes.size() / 2);
    EXPECT_FALSE(decode_depth(cut).ok());
    Image lie = *image;
    lie.width = 65, lie.row_stride = 0;
    EXPECT_FALSE(decode_depth(lie).ok());
    lie.width = 2'000'000'000;
    EXPECT_FALSE(decode_depth(lie).ok());
  }
  Image unknown;
  unknown.format = PixelFormat::depth_mm;
  unknown.width = unknown.height = 4;
  unknown.metadata = {{"encoding", {'l', 'z', '4'}}};
  EXPECT_NE(decode_depth(unknown).error().message.find("lz4"), std::string::npos);
}

TEST(Jpeg, KeepsQualityAndSubsamplingOfTheSource) {
  for (const int quality : {30, 50, 75, 90, 95, 100})
    for (const auto subsampling : {JpegFormat::Subsampling::yuv444, JpegFormat::Subsampling::yuv422,
                                   JpegFormat::Subsampling::yuv420, JpegFormat::Subsampling::gray}) {
      JpegCodec codec;
      const Image image = jpeg_image(320, 240, quality, subsampling);
      const auto format = codec.read_header(image.bytes);
      ASSERT_TRUE(format.ok());
      EXPECT_EQ(format->quality, quality);
      EXPECT_EQ(format->subsampling, subsampling);
    }
}

/// Progressive, 8x8 pixels of gray: a scan for DC, then one bit plane of one coefficient each, as ITU-T T.81
/// allows.
std::vector<std::uint8_t> progressive_jpeg(int scans) {
  std::vector<std::uint8_t> bytes{0xFF, 0xD8};
  const auto add = [&](std::uint8_t marker, const std::vector<std::uint8_t>& segment) {
    const auto size = static_cast<std::uint8_t>(segment.size() + 2);
    bytes.insert(bytes.end(), {0xFF, marker, 0, size});
    bytes.insert(bytes.end(), segment.begin(), segment.end());
  };
  std::vector<std::uint8_t> table(65, 16);
  table[0] = 0;
  add(0xDB, table);
  add(0xC2, {8, 0, 8, 0, 8, 1, 1, 0x11, 0});
  for (const std::uint8_t kind : {0x00, 0x10}) {
    std::vector<std::uint8_t> code(18, 0);  // one code, a zero bit: no difference, end of block
    code[0] = kind, code[1] = 1;
    add(0xC4, code);
  }
  for (int scan = 0; scan < scans; ++scan) {
    const int plane = 13 - (scan - 1) / 63;
    const auto coefficient = static_cast<std::uint8_t>(scan == 0 ? 0 : 1 + (scan - 1) % 63);
    const int bits = scan == 0 ? 0 : (plane == 13 ? 0 : plane + 1) << 4 | plane;
    add(0xDA, {1, 1, 0, coefficient, coefficient, static_cast<std::uint8_t>(bits)});
    bytes.push_back(0x7F);
  }
  bytes.insert(bytes.end(), {0xFF, 0xD9});
  return bytes;
}

TEST(Jpeg, RefusesImagesOfSoManyScansThatTheyWouldTakeMinutes) {
  JpegCodec codec;
  I420Reader reader;
  I420Picture picture;
  std::vector<std::uint8_t> pixels;
  for (const int scans : {1, 10, 32, 33, 882}) {
    Image image;
    image.bytes = progressive_jpeg(scans);
    const auto decoded = codec.decode(image.bytes, pixels);
    EXPECT_EQ(decoded.ok(), scans <= 32) << scans << (decoded ? "" : ": " + decoded.error().message);
    EXPECT_EQ(reader.read(image, picture).ok(), scans <= 32) << scans;
  }
}

/// A bit error on the way from the camera costs one picture, not the session's.
TEST(Jpeg, ReadsImagesAfterADamagedOne) {
  const Image image = jpeg_image(48, 32);
  JpegCodec codec;
  I420Reader reader;
  std::vector<std::uint8_t> expected, pixels;
  ASSERT_TRUE(codec.decode(image.bytes, expected));
  std::mt19937 random(1);
  int refused = 0;
  for (std::size_t at = 0; at < image.bytes.size(); ++at) {
    Image damaged = image;
    if (at % 2 == 0) {
      damaged.bytes[at] = static_cast<std::uint8_t>(random());
    } else {
      damaged.bytes.resize(at);
    }
    I420Picture picture;
    refused += !codec.decode(damaged.bytes, pixels);
    refused += !reader.read(damaged, picture).ok();
    const auto read = codec.decode(image.bytes, pixels);
    ASSERT_TRUE(read) << "after damage of byte " << at << ": " << read.error().message;
    ASSERT_EQ(pixels, expected) << "after damage of byte " << at;
    const Status planes = reader.read(image, picture);
    ASSERT_TRUE(planes.ok()) << "after damage of byte " << at << ": " << planes.error().message;
  }
  EXPECT_GT(refused, static_cast<int>(image.bytes.size())) << "half of them are truncated";
}

}  // namespace
}  // namespace parhelion::render
