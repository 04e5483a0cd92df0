// The encoder's output is decoded by the same library's decoder.
#include "render/h264_encoder.hpp"

#include <gtest/gtest.h>
#include <wels/codec_api.h>

#include <cmath>
#include <cstring>

#include "render/i420_picture.hpp"
#include "render/jpeg.hpp"

namespace parhelion::render {
namespace {

/// A disc that moves over colour gradients; BGR.
std::vector<std::uint8_t> drawn(int width, int height, int moment) {
  std::vector<std::uint8_t> bgr;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const bool disc = std::hypot(x - 40 - 3 * moment, y - height / 2) < 20;
      bgr.push_back(static_cast<std::uint8_t>(disc ? 30 : 255 * x / width));
      bgr.push_back(static_cast<std::uint8_t>(disc ? 200 : 255 * y / height));
      bgr.push_back(static_cast<std::uint8_t>(disc ? 250 : 100));
    }
  }
  return bgr;
}

Image raw(int width, int height, PixelFormat format, std::vector<std::uint8_t> bytes) {
  Image image;
  image.width = width;
  image.height = height;
  image.row_stride = width * (format == PixelFormat::gray ? 1 : 3);
  image.format = format;
  image.bytes = std::move(bytes);
  return image;
}

Image jpeg(int width, int height, JpegFormat::Subsampling subsampling, int moment = 0) {
  JpegCodec codec;
  auto bytes = codec.encode(drawn(width, height, moment), {width, height, 95, subsampling});
  EXPECT_TRUE(bytes.ok());
  Image image;
  image.width = width;
  image.height = height;
  image.bytes = std::move(*bytes);
  return image;
}

double difference(const std::vector<std::uint8_t>& one, const std::vector<std::uint8_t>& other) {
  EXPECT_EQ(one.size(), other.size());
  double sum = 0;
  for (std::size_t i = 0; i < one.size(); ++i) sum += std::abs(one[i] - other[i]);
  return sum / static_cast<double>(one.size());
}

class Decoder {
 public:
  Decoder() {
    EXPECT_EQ(WelsCreateDecoder(&decoder_), 0);
    SDecodingParam wanted{};
    wanted.sVideoProperty.eVideoBsType = VIDEO_BITSTREAM_AVC;
    EXPECT_EQ(decoder_->Initialize(&wanted), 0);
  }
  ~Decoder() {
    decoder_->Uninitialize();
    WelsDestroyDecoder(decoder_);
  }
  Decoder(const Decoder&) = delete;
  Decoder& operator=(const Decoder&) = delete;

  /// The luma of the picture decoded from it; empty: none.
  std::vector<std::uint8_t> luma(const H264Picture& picture) {
    unsigned char* planes[3] = {};
    SBufferInfo out{};
    if (decoder_->DecodeFrameNoDelay(picture.bytes.data(), static_cast<int>(picture.bytes.size()), planes,
                                     &out) != dsErrorFree ||
        out.iBufferStatus != 1)
      return {};
    const SSysMEMBuffer& size = out.UsrData.sSystemBuffer;
    std::vector<std::uint8_t> rows;
    for (int row = 0; row < size.iHeight; ++row) {
      const unsigned char* begin = planes[0] + static_cast<std::ptrdiff_t>(row) * size.iStride[0];
      rows.insert(rows.end(), begin, begin + size.iWidth);
    }
    return rows;
  }

 private:
  ISVCDecoder* decoder_ = nullptr;
};

SensorTime at(int frame) { return SensorTime{} + milliseconds(33 * (frame + 1)); }

TEST(I420Reader, ConvertsEveryFormatToTheSamePicture) {
  I420Reader reader;
  I420Picture reference, picture;
  ASSERT_TRUE(reader.read(raw(64, 48, PixelFormat::bgr, drawn(64, 48, 0)), reference).ok());
  std::vector<std::uint8_t> rgb = drawn(64, 48, 0);
  for (std::size_t i = 0; i < rgb.size(); i += 3) std::swap(rgb[i], rgb[i + 2]);
  ASSERT_TRUE(reader.read(raw(64, 48, PixelFormat::rgb, std::move(rgb)), picture).ok());
  EXPECT_EQ(picture.y, reference.y);
  EXPECT_EQ(picture.u, reference.u);
  using Subsampling = JpegFormat::Subsampling;
  for (const auto subsampling : {Subsampling::yuv420, Subsampling::yuv422, Subsampling::yuv440,
                                 Subsampling::yuv444, Subsampling::yuv411, Subsampling::gray}) {
    ASSERT_TRUE(reader.read(jpeg(64, 48, subsampling), picture).ok());
    EXPECT_LT(difference(picture.y, reference.y), 3) << static_cast<int>(subsampling);
    if (subsampling == Subsampling::gray) {
      EXPECT_EQ(picture.u, std::vector<std::uint8_t>(64 * 48 / 4, 128));
      continue;
    }
    EXPECT_LT(difference(picture.u, reference.u), 4) << static_cast<int>(subsampling);
    EXPECT_LT(difference(picture.v, reference.v), 4) << static_cast<int>(subsampling);
  }
}

TEST(I420Reader, CropsAnOddColumnAndRow) {
  I420Reader reader;
  I420Picture picture, reference;
  for (const Image& image :
       {raw(65, 49, PixelFormat::bgr, drawn(65, 49, 0)), jpeg(65, 49, JpegFormat::Subsampling::yuv420),
        jpeg(65, 49, JpegFormat::Subsampling::yuv444)}) {
    ASSERT_TRUE(reader.read(image, picture).ok());
    EXPECT_EQ(picture.width, 64);
    EXPECT_EQ(picture.height, 48);
    EXPECT_EQ(picture.y.size(), 64U * 48U);
    if (reference.y.empty()) reference = picture;
    EXPECT_LT(difference(picture.y, reference.y), 3);
  }
}

TEST(I420Reader, RefusesInvalidPictures) {
  I420Reader reader;
  I420Picture picture;
  Image cut = jpeg(64, 48, JpegFormat::Subsampling::yuv420);
  cut.bytes.resize(cut.bytes.size() / 2);
  EXPECT_FALSE(reader.read(cut, picture).ok());
  EXPECT_FALSE(reader.read(raw(64, 48, PixelFormat::bgr, std::vector<std::uint8_t>(100)), picture).ok());
  EXPECT_FALSE(reader.read(raw(64, 48, PixelFormat::depth_mm, drawn(64, 48, 0)), picture).ok());
  EXPECT_FALSE(reader.read(raw(1, 48, PixelFormat::gray, std::vector<std::uint8_t>(48)), picture).ok());
  EXPECT_FALSE(reader.read(Image{}, picture).ok());
}

TEST(H264Encoder, EncodesEachPictureImmediatelyAsConstrainedBaseline) {
  I420Reader reader;
  I420Picture picture;
  auto encoder = H264Encoder::create(320, 240, {});
  ASSERT_TRUE(encoder.ok()) << encoder.error().message;
  Decoder decoder;
  for (int frame = 0; frame < 12; ++frame) {
    ASSERT_TRUE(reader.read(jpeg(320, 240, JpegFormat::Subsampling::yuv420, frame), picture).ok());
    const auto coded = (*encoder)->encode(picture, at(frame), frame == 7);
    ASSERT_TRUE(coded.ok()) << coded.error().message;
    EXPECT_EQ(coded->key, frame == 0 || frame == 7) << frame;
    if (coded->key) {
      const std::uint8_t start_and_sps[] = {0, 0, 0, 1, 0x67, 66};
      ASSERT_GT(coded->bytes.size(), 8U);
      EXPECT_EQ(std::memcmp(coded->bytes.data(), start_and_sps, sizeof start_and_sps), 0);
      EXPECT_EQ(coded->bytes[6] & 0x40, 0x40) << "constraint_set1: constrained baseline";
    }
    const auto seen = decoder.luma(*coded);
    ASSERT_FALSE(seen.empty()) << "no picture came out for picture " << frame;
    EXPECT_LT(difference(seen, picture.y), 4) << frame;
  }
}

TEST(H264Encoder, FollowsTheBitRate) {
  I420Reader reader;
  I420Picture picture;
  auto encoder = H264Encoder::create(320, 240, {3'000'000, 30});
  ASSERT_TRUE(encoder.ok());
  // Noise, which needs the maximum bit rate.
  std::uint32_t random = 1;
  const auto bytes_of = [&](int frames) {
    std::size_t bytes = 0;
    for (int frame = 0; frame < frames; ++frame) {
      std::vector<std::uint8_t> bgr = drawn(320, 240, frame);
      for (std::uint8_t& each : bgr) {
        random = random * 1664525U + 1013904223U;
        each = static_cast<std::uint8_t>(each / 2 + (random >> 26));
      }
      EXPECT_TRUE(reader.read(raw(320, 240, PixelFormat::bgr, std::move(bgr)), picture).ok());
      bytes += (*encoder)->encode(picture, at(frame), false).value().bytes.size();
    }
    return bytes;
  };
  const std::size_t before = bytes_of(20);
  ASSERT_TRUE((*encoder)->set_bit_rate(400'000).ok());
  bytes_of(10);
  EXPECT_LT(bytes_of(20) * 2, before);
}

TEST(H264Encoder, RefusesUnsupportedSizes) {
  EXPECT_FALSE(H264Encoder::create(641, 480, {}).ok());
  EXPECT_FALSE(H264Encoder::create(8, 480, {}).ok());
  EXPECT_FALSE(H264Encoder::create(640, 4000, {}).ok());
  EXPECT_FALSE(H264Encoder::create(640, 480, {0, 30}).ok());
  EXPECT_FALSE(H264Encoder::create(640, 480, {1'000'000, std::nan("")}).ok());
  auto encoder = H264Encoder::create(64, 48, {});
  ASSERT_TRUE(encoder.ok());
  I420Reader reader;
  I420Picture picture;
  ASSERT_TRUE(reader.read(raw(32, 32, PixelFormat::gray, std::vector<std::uint8_t>(1024)), picture).ok());
  EXPECT_FALSE((*encoder)->encode(picture, at(0), false).ok());
}

}  // namespace
}  // namespace parhelion::render
