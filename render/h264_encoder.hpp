// H.264 for live video, by OpenH264: constrained baseline, one reference, no B frames, one thread, so that
// each input picture immediately gives its own output picture.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "protocols/status.hpp"
#include "protocols/time.hpp"
#include "render/i420_picture.hpp"

namespace parhelion::render {

struct H264Options {
  int bit_rate = 2'000'000;  ///< bit/s, target; 50 kbit/s to 50 Mbit/s
  double rate = 30;          ///< Hz, expected picture rate; 1 to 120
};

/// One coded picture in Annex B form (ITU-T H.264) with start codes; a key picture includes its parameter
/// sets.
struct H264Picture {
  std::vector<std::uint8_t> bytes;
  bool key = false;  ///< can be decoded without earlier pictures
};

/// The picture size is fixed. One thread at a time.
class H264Encoder {
 public:
  /// Even width and height, 16 to 3840. Error: out of these bounds, or OpenH264 does not start.
  static Result<std::unique_ptr<H264Encoder>> create(int width, int height, const H264Options& options);
  ~H264Encoder();
  H264Encoder(const H264Encoder&) = delete;
  H264Encoder& operator=(const H264Encoder&) = delete;

  /// The first picture is a key picture, later ones only with `key`. `stamp` is used for rate control. Error:
  /// a picture of another size, or OpenH264 rejects it.
  Result<H264Picture> encode(const I420Picture& picture, SensorTime stamp, bool key);
  /// Applies from the next picture on; same bounds as in the options.
  Status set_bit_rate(int bit_rate);
  int width() const { return width_; }
  int height() const { return height_; }

 private:
  struct Codec;
  H264Encoder(int width, int height, std::unique_ptr<Codec> codec);

  int width_, height_;
  std::unique_ptr<Codec> codec_;
};

}  // namespace parhelion::render
