// Encodes one robot's pictures, each once for all viewers: H.264 and JPEG.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "protocols/image.hpp"
#include "render/h264_encoder.hpp"
#include "render/i420_picture.hpp"
#include "render/jpeg.hpp"
#include "server/station/video/video_messages.hpp"

namespace parhelion::station {

/// Requested encodings of a picture.
struct VideoWanted {
  bool h264 = false, jpeg = false;
  bool key = false;          ///< of H.264: a key frame
  int bit_rate = 2'000'000;  ///< bit/s, of H.264
};

struct CodedPicture {
  int width = 0, height = 0;             ///< pixels
  bool key = false;                      ///< of `h264`
  std::vector<std::uint8_t> h264, jpeg;  ///< empty: not requested, or not possible; see `h264_fault`
  std::string h264_fault;
};

/// Keeps an encoder as long as H.264 is requested. One thread at a time.
class VideoCoder {
 public:
  /// A JPEG image is copied unchanged to `jpeg`, and decoded only for H.264. If H.264 is not possible, `jpeg`
  /// is filled in its place. Error: the image cannot be decoded.
  Result<CodedPicture> code(const Image& image, const VideoWanted& wanted);
  int bit_rate() const { return bit_rate_; }

 private:
  Status code_h264(const Image& image, const VideoWanted& wanted, CodedPicture& coded);
  Status follow(int bit_rate);
  Status code_jpeg(const Image& image, CodedPicture& coded);

  render::I420Reader reader_;
  render::I420Picture picture_;
  render::JpegCodec jpeg_;
  std::vector<std::uint8_t> bgr_;
  std::unique_ptr<render::H264Encoder> encoder_;
  int bit_rate_ = 0;
};

}  // namespace parhelion::station
