#include "render/h264_encoder.hpp"

#include <wels/codec_api.h>

#include <algorithm>
#include <string>
#include <utility>

namespace parhelion::render {
namespace {

constexpr int kMinSide = 16, kMaxSide = 3840;                  // px; the maximum is OpenH264's own
constexpr int kMinBitRate = 50'000, kMaxBitRate = 50'000'000;  // bit/s

Error openh264_error(const std::string& what, int code) {
  return Error{"H.264: OpenH264 " + what + " (code " + std::to_string(code) + ")"};
}

/// JPEG's colours (full range, BT.601 matrix, sRGB primaries and curve), signalled in the stream.
void set_colours(SSpatialLayerConfig& layer) {
  layer.bVideoSignalTypePresent = true;
  layer.uiVideoFormat = VF_UNDEF;
  layer.bFullRange = true;
  layer.bColorDescriptionPresent = true;
  layer.uiColorPrimaries = CP_BT709;
  layer.uiTransferCharacteristics = TRC_IEC61966_2_1;
  layer.uiColorMatrix = CM_SMPTE170M;
}

SEncParamExt parameters(ISVCEncoder& encoder, int width, int height, const H264Options& options) {
  SEncParamExt wanted{};
  encoder.GetDefaultParams(&wanted);
  wanted.iUsageType = CAMERA_VIDEO_REAL_TIME;
  wanted.iPicWidth = width;
  wanted.iPicHeight = height;
  wanted.iTargetBitrate = options.bit_rate;
  wanted.iMaxBitrate = UNSPECIFIED_BIT_RATE;
  wanted.iRCMode = RC_BITRATE_MODE;
  wanted.fMaxFrameRate = static_cast<float>(options.rate);
  wanted.iComplexityMode = LOW_COMPLEXITY;
  wanted.uiIntraPeriod = 0;  // key pictures only on request
  wanted.iNumRefFrame = 1;
  wanted.eSpsPpsIdStrategy = CONSTANT_ID;
  wanted.iEntropyCodingModeFlag = 0;  // CAVLC: the only one in baseline
  wanted.bEnableFrameSkip = false;    // one output picture per input picture
  wanted.iMultipleThreadIdc = 1;
  wanted.bEnableSceneChangeDetect = false;
  wanted.bEnableDenoise = false;
  wanted.iTemporalLayerNum = 1;
  wanted.iSpatialLayerNum = 1;
  SSpatialLayerConfig& layer = wanted.sSpatialLayers[0];
  layer.iVideoWidth = width;
  layer.iVideoHeight = height;
  layer.fFrameRate = wanted.fMaxFrameRate;
  layer.iSpatialBitrate = options.bit_rate;
  layer.iMaxSpatialBitrate = UNSPECIFIED_BIT_RATE;
  layer.uiProfileIdc = PRO_BASELINE;
  layer.sSliceArgument.uiSliceMode = SM_SINGLE_SLICE;
  set_colours(layer);
  return wanted;
}

}  // namespace

struct H264Encoder::Codec {
  Codec() {
    if (WelsCreateSVCEncoder(&encoder) != 0) encoder = nullptr;
  }
  ~Codec() {
    if (encoder == nullptr) return;
    encoder->Uninitialize();
    WelsDestroySVCEncoder(encoder);
  }
  Codec(const Codec&) = delete;
  Codec& operator=(const Codec&) = delete;

  ISVCEncoder* encoder = nullptr;
};

H264Encoder::H264Encoder(int width, int height, std::unique_ptr<Codec> codec)
    : width_(width), height_(height), codec_(std::move(codec)) {}

H264Encoder::~H264Encoder() = default;

Result<std::unique_ptr<H264Encoder>> H264Encoder::create(int width, int height, const H264Options& options) {
  const auto fits = [](int side) { return side >= kMinSide && side <= kMaxSide && side % 2 == 0; };
  if (!fits(width) || !fits(height))
    return Error{"H.264: " + std::to_string(width) + "x" + std::to_string(height) +
                 " pixels, expected even sides from 16 to 3840; such video goes out as JPEG"};
  if (options.bit_rate < kMinBitRate || options.bit_rate > kMaxBitRate)
    return Error{"H.264: bit rate " + std::to_string(options.bit_rate) +
                 " bit/s, expected 50000 to 50000000"};
  if (!(options.rate >= 1 && options.rate <= 120))
    return Error{"H.264: " + std::to_string(options.rate) + " pictures a second, expected 1 to 120"};
  auto codec = std::make_unique<Codec>();
  if (codec->encoder == nullptr) return openh264_error("cannot make an encoder", -1);
  int quiet = WELS_LOG_QUIET;
  codec->encoder->SetOption(ENCODER_OPTION_TRACE_LEVEL, &quiet);
  const SEncParamExt wanted = parameters(*codec->encoder, width, height, options);
  if (const int code = codec->encoder->InitializeExt(&wanted); code != 0)
    return openh264_error("does not start", code);
  return std::unique_ptr<H264Encoder>(new H264Encoder(width, height, std::move(codec)));
}

Result<H264Picture> H264Encoder::encode(const I420Picture& picture, SensorTime stamp, bool key) {
  if (picture.width != width_ || picture.height != height_)
    return Error{"H.264: a picture of " + std::to_string(picture.width) + "x" +
                 std::to_string(picture.height) + " for an encoder of " + std::to_string(width_) + "x" +
                 std::to_string(height_)};
  if (key) {
    if (const int code = codec_->encoder->ForceIntraFrame(true); code != 0)
      return openh264_error("makes no key picture", code);
  }
  SSourcePicture source{};
  source.iColorFormat = videoFormatI420;
  source.iPicWidth = width_;
  source.iPicHeight = height_;
  source.iStride[0] = width_;
  source.iStride[1] = source.iStride[2] = width_ / 2;
  // OpenH264 only reads the planes, although its interface is not const.
  source.pData[0] = const_cast<unsigned char*>(picture.y.data());
  source.pData[1] = const_cast<unsigned char*>(picture.u.data());
  source.pData[2] = const_cast<unsigned char*>(picture.v.data());
  source.uiTimeStamp = stamp.ns / 1'000'000;
  SFrameBSInfo coded{};
  if (const int code = codec_->encoder->EncodeFrame(&source, &coded); code != cmResultSuccess)
    return openh264_error("cannot encode a picture", code);
  H264Picture result;
  result.key = coded.eFrameType == videoFrameTypeIDR;
  result.bytes.reserve(static_cast<std::size_t>(std::max(coded.iFrameSizeInBytes, 0)));
  for (int i = 0; i < coded.iLayerNum; ++i) {
    const SLayerBSInfo& layer = coded.sLayerInfo[i];
    std::ptrdiff_t size = 0;
    for (int nal = 0; nal < layer.iNalCount; ++nal) size += layer.pNalLengthInByte[nal];
    result.bytes.insert(result.bytes.end(), layer.pBsBuf, layer.pBsBuf + size);
  }
  if (result.bytes.empty()) return Error{"H.264: OpenH264 skipped a picture"};
  return result;
}

Status H264Encoder::set_bit_rate(int bit_rate) {
  SBitrateInfo wanted{SPATIAL_LAYER_ALL, std::clamp(bit_rate, kMinBitRate, kMaxBitRate)};
  if (const int code = codec_->encoder->SetOption(ENCODER_OPTION_BITRATE, &wanted); code != 0)
    return openh264_error("does not take the bit rate", code);
  return {};
}

}  // namespace parhelion::render
