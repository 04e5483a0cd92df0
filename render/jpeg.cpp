#include "render/jpeg.hpp"

#include <turbojpeg.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <string>

#include "render/image_limits.hpp"

namespace parhelion::render {
namespace {

/// Annex K.1, in zigzag order as in DQT.
constexpr std::array<int, 64> kLuminance = {
    16, 11,  12, 14, 12, 10, 16,  14,  13,  14, 18, 17,  16,  19,  24,  40,  26, 24,  22,  22, 24, 49,
    35, 37,  29, 40, 58, 51, 61,  60,  57,  51, 56, 55,  64,  72,  92,  78,  64, 68,  87,  69, 55, 56,
    80, 109, 81, 87, 95, 98, 103, 104, 103, 62, 77, 113, 121, 112, 100, 120, 92, 101, 103, 99};

/// libjpeg's jpeg_quality_scaling and jpeg_add_quant_table for 8-bit tables.
int scaled(int base, int quality) {
  const int percent = quality < 50 ? 5000 / quality : 200 - 2 * quality;
  return std::clamp((base * percent + 50) / 100, 1, 255);
}

/// A progressive image of 200 kB can have 883 scans over 8192x8192 pixels, which take 40 s. libjpeg's own
/// progression has 10.
constexpr long kMaxScans = 32;

/// SOS markers: coded data has a zero after each 0xFF. Those of a thumbnail count, too.
long count_scans(const std::vector<std::uint8_t>& jpeg) {
  constexpr std::array<std::uint8_t, 2> start_of_scan{0xFF, 0xDA};
  long scans = 0;
  for (auto at = jpeg.begin();; ++at, ++scans) {
    at = std::search(at, jpeg.end(), start_of_scan.begin(), start_of_scan.end());
    if (at == jpeg.end()) return scans;
  }
}

Error turbojpeg_error(void* handle, const char* what) {
  return Error{std::string("JPEG: ") + what + ": " + tjGetErrorStr2(handle)};
}

JpegFormat::Subsampling from_turbojpeg(int subsampling) {
  switch (subsampling) {
    case TJSAMP_444:
      return JpegFormat::Subsampling::yuv444;
    case TJSAMP_422:
      return JpegFormat::Subsampling::yuv422;
    case TJSAMP_GRAY:
      return JpegFormat::Subsampling::gray;
    case TJSAMP_440:
      return JpegFormat::Subsampling::yuv440;
    case TJSAMP_411:
      return JpegFormat::Subsampling::yuv411;
    default:
      return JpegFormat::Subsampling::yuv420;
  }
}

int to_turbojpeg(JpegFormat::Subsampling subsampling) {
  switch (subsampling) {
    case JpegFormat::Subsampling::yuv444:
      return TJSAMP_444;
    case JpegFormat::Subsampling::yuv422:
      return TJSAMP_422;
    case JpegFormat::Subsampling::yuv420:
      return TJSAMP_420;
    case JpegFormat::Subsampling::gray:
      return TJSAMP_GRAY;
    case JpegFormat::Subsampling::yuv440:
      return TJSAMP_440;
    case JpegFormat::Subsampling::yuv411:
      return TJSAMP_411;
  }
  return TJSAMP_420;
}

/// The 64 entries of luminance table 0, zigzag; empty where the stream has none.
std::vector<int> luminance_table(const std::vector<std::uint8_t>& jpeg) {
  std::size_t i = 2;
  while (i + 4 <= jpeg.size() && jpeg[i] == 0xFF) {
    const int marker = jpeg[i + 1];
    const std::size_t length = static_cast<std::size_t>(jpeg[i + 2]) << 8 | jpeg[i + 3];
    const std::size_t end = i + 2 + length;
    if (marker == 0xDA || length < 2 || end > jpeg.size()) break;
    if (marker == 0xDB) {
      for (std::size_t p = i + 4; p < end;) {
        const bool wide = jpeg[p] >> 4, luminance = (jpeg[p] & 15) == 0;
        const std::size_t bytes = wide ? 128 : 64;
        if (++p + bytes > end) return {};
        if (luminance) {
          std::vector<int> table(64);
          for (std::size_t k = 0; k < 64; ++k)
            table[k] = wide ? jpeg[p + 2 * k] << 8 | jpeg[p + 2 * k + 1] : jpeg[p + k];
          return table;
        }
        p += bytes;
      }
    }
    i = end;
  }
  return {};
}

}  // namespace

int estimate_jpeg_quality(const std::vector<std::uint8_t>& jpeg) {
  const std::vector<int> table = luminance_table(jpeg);
  if (table.empty()) return 90;
  int best = 90;
  long best_error = -1;
  for (int quality = 1; quality <= 100; ++quality) {
    long error = 0;
    for (std::size_t k = 0; k < 64; ++k) error += std::abs(scaled(kLuminance[k], quality) - table[k]);
    if (best_error < 0 || error < best_error) best = quality, best_error = error;
  }
  return best;
}

JpegCodec::JpegCodec() : decompressor_(tjInitDecompress()), compressor_(tjInitCompress()) {}

JpegCodec::~JpegCodec() {
  if (decompressor_) tjDestroy(decompressor_);
  if (compressor_) tjDestroy(compressor_);
}

/// libjpeg-turbo 2.1 stays in the middle of a header that it cannot read, and refuses every later image.
void JpegCodec::renew_decompressor() {
  if (decompressor_) tjDestroy(decompressor_);
  decompressor_ = tjInitDecompress();
}

Result<JpegFormat> JpegCodec::read_header(const std::vector<std::uint8_t>& jpeg) {
  JpegFormat format;
  int subsampling = 0, colour_space = 0;
  if (jpeg.empty()) return Error{"JPEG: the image has no bytes"};
  if (tjDecompressHeader3(decompressor_, jpeg.data(), jpeg.size(), &format.width, &format.height,
                          &subsampling, &colour_space) != 0) {
    const Error error = turbojpeg_error(decompressor_, "the header cannot be read");
    renew_decompressor();
    return error;
  }
  if (format.width < 1 || format.height < 1 || format.width > kMaxImageSide || format.height > kMaxImageSide)
    return Error{"JPEG: " + std::to_string(format.width) + "x" + std::to_string(format.height) +
                 ", expected 1 to " + std::to_string(kMaxImageSide) + " pixels a side"};
  if (const long scans = count_scans(jpeg); scans > kMaxScans)
    return Error{"JPEG: " + std::to_string(scans) + " scans, expected at most " + std::to_string(kMaxScans)};
  if (colour_space == TJCS_CMYK || colour_space == TJCS_YCCK)
    return Error{"JPEG: CMYK is not handled; send YCbCr or gray"};
  format.subsampling = from_turbojpeg(subsampling);
  format.quality = estimate_jpeg_quality(jpeg);
  return format;
}

Result<JpegFormat> JpegCodec::decode(const std::vector<std::uint8_t>& jpeg, std::vector<std::uint8_t>& bgr) {
  auto format = read_header(jpeg);
  if (!format) return format;
  bgr.resize(3 * static_cast<std::size_t>(format->width) * static_cast<std::size_t>(format->height));
  if (tjDecompress2(decompressor_, jpeg.data(), jpeg.size(), bgr.data(), format->width, 0, format->height,
                    TJPF_BGR, TJFLAG_STOPONWARNING) != 0)
    return turbojpeg_error(decompressor_, "the stream is corrupt");
  return format;
}

Result<std::vector<std::uint8_t>> JpegCodec::encode(const std::vector<std::uint8_t>& bgr,
                                                    const JpegFormat& format) {
  if (format.width < 1 || format.height < 1 ||
      bgr.size() != 3 * static_cast<std::size_t>(format.width) * static_cast<std::size_t>(format.height))
    return Error{"JPEG: the pixels are not width * height * 3 bytes"};
  const int subsampling = to_turbojpeg(format.subsampling);
  buffer_.resize(tjBufSize(format.width, format.height, subsampling));
  unsigned char* out = buffer_.data();
  unsigned long size = buffer_.size();
  if (tjCompress2(compressor_, bgr.data(), format.width, 0, format.height, TJPF_BGR, &out, &size, subsampling,
                  format.quality, TJFLAG_NOREALLOC) != 0)
    return turbojpeg_error(compressor_, "cannot be encoded");
  return std::vector<std::uint8_t>(out, out + size);
}

}  // namespace parhelion::render
