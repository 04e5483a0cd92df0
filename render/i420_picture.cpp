#include "render/i420_picture.hpp"

#include <turbojpeg.h>

#include <algorithm>
#include <array>
#include <string>

namespace parhelion::render {
namespace {

constexpr std::uint8_t kNoChroma = 128;

void resize(I420Picture& picture, int width, int height) {
  picture.width = width & ~1;
  picture.height = height & ~1;
  const std::size_t pixels =
      static_cast<std::size_t>(picture.width) * static_cast<std::size_t>(picture.height);
  picture.y.resize(pixels);
  picture.u.resize(pixels / 4);
  picture.v.resize(pixels / 4);
}

struct Plane {
  const std::vector<std::uint8_t>& bytes;
  int stride;
};

/// Means of `across` x `down` samples, rounded; both 1 or 2.
void shrink(const Plane& from, int across, int down, int width, int height, std::vector<std::uint8_t>& to) {
  const unsigned count = static_cast<unsigned>(across * down);
  for (int row = 0; row < height; ++row) {
    const std::uint8_t* above = from.bytes.data() + static_cast<std::ptrdiff_t>(row) * down * from.stride;
    const std::uint8_t* below = above + static_cast<std::ptrdiff_t>(down - 1) * from.stride;
    std::uint8_t* out = to.data() + static_cast<std::ptrdiff_t>(row) * width;
    if (count == 1) {
      std::copy_n(above, width, out);
      continue;
    }
    for (int x = 0; x < width; ++x) {
      const int left = x * across, right = left + across - 1;
      const unsigned sum = across == 2 && down == 2
                               ? above[left] + above[right] + below[left] + below[right] + 2U
                               : (across == 2 ? above[left] + above[right] : above[left] + below[left]) + 1U;
      out[x] = static_cast<std::uint8_t>(sum / count);
    }
  }
}

/// Chroma samples of the JPEG per output sample, horizontally and vertically; {0, 0}: converted through RGB.
std::array<int, 2> chroma_steps(JpegFormat::Subsampling subsampling) {
  switch (subsampling) {
    case JpegFormat::Subsampling::yuv420:
      return {1, 1};
    case JpegFormat::Subsampling::yuv422:
      return {1, 2};
    case JpegFormat::Subsampling::yuv440:
      return {2, 1};
    case JpegFormat::Subsampling::yuv444:
      return {2, 2};
    default:
      return {0, 0};
  }
}

int turbojpeg_subsampling(JpegFormat::Subsampling subsampling) {
  switch (subsampling) {
    case JpegFormat::Subsampling::yuv422:
      return TJSAMP_422;
    case JpegFormat::Subsampling::yuv440:
      return TJSAMP_440;
    case JpegFormat::Subsampling::yuv444:
      return TJSAMP_444;
    case JpegFormat::Subsampling::gray:
      return TJSAMP_GRAY;
    default:
      return TJSAMP_420;
  }
}

void make_room(std::vector<std::uint8_t>& plane, int component, const JpegFormat& format, int subsampling) {
  plane.resize(tjPlaneSizeYUV(component, format.width, 0, format.height, subsampling));
}

}  // namespace

I420Reader::I420Reader() : decompressor_(tjInitDecompress()), compressor_(tjInitCompress()) {}

I420Reader::~I420Reader() {
  if (decompressor_) tjDestroy(decompressor_);
  if (compressor_) tjDestroy(compressor_);
}

Status I420Reader::read(const Image& image, I420Picture& picture) {
  if (image.format == PixelFormat::mjpeg) return read_jpeg(image, picture);
  const bool gray = image.format == PixelFormat::gray;
  if (!gray && image.format != PixelFormat::rgb && image.format != PixelFormat::bgr)
    return Error{"image: pixel format " + std::to_string(static_cast<int>(image.format)) +
                 ", expected JPEG, RGB, BGR or gray"};
  const int row = image.width * (gray ? 1 : 3);
  if (image.width < 2 || image.height < 2 || image.row_stride < row ||
      image.bytes.size() <
          static_cast<std::size_t>(image.row_stride) * static_cast<std::size_t>(image.height))
    return Error{"image: " + std::to_string(image.bytes.size()) + " bytes are no " +
                 std::to_string(image.width) + "x" + std::to_string(image.height) + " pixels in rows of " +
                 std::to_string(image.row_stride) + " bytes"};
  resize(picture, image.width, image.height);
  const int tj_format = gray ? TJPF_GRAY : image.format == PixelFormat::rgb ? TJPF_RGB : TJPF_BGR;
  return convert(image.bytes.data(), image.row_stride, tj_format, picture);
}

Status I420Reader::convert(const std::uint8_t* pixels, int stride, int tj_format, I420Picture& picture) {
  if (tj_format == TJPF_GRAY) {
    for (int row = 0; row < picture.height; ++row)
      std::copy_n(pixels + static_cast<std::ptrdiff_t>(row) * stride, picture.width,
                  picture.y.data() + static_cast<std::ptrdiff_t>(row) * picture.width);
    std::fill(picture.u.begin(), picture.u.end(), kNoChroma);
    std::fill(picture.v.begin(), picture.v.end(), kNoChroma);
    return {};
  }
  std::array<unsigned char*, 3> planes{picture.y.data(), picture.u.data(), picture.v.data()};
  if (tjEncodeYUVPlanes(compressor_, pixels, picture.width, stride, picture.height, tj_format, planes.data(),
                        nullptr, TJSAMP_420, 0) != 0)
    return Error{std::string("image: cannot be converted: ") + tjGetErrorStr2(compressor_)};
  return {};
}

Status I420Reader::read_jpeg(const Image& image, I420Picture& picture) {
  const auto format = codec_.read_header(image.bytes);
  if (!format) return format.error();
  if (format->width < 2 || format->height < 2)
    return Error{"JPEG: " + std::to_string(format->width) + "x" + std::to_string(format->height) +
                 ", expected at least 2 pixels a side"};
  resize(picture, format->width, format->height);
  const bool direct =
      format->subsampling == JpegFormat::Subsampling::gray || chroma_steps(format->subsampling)[0] != 0;
  if (direct) return read_planes(image.bytes, *format, picture);
  if (const auto decoded = codec_.decode(image.bytes, bgr_); !decoded) return decoded.error();
  return convert(bgr_.data(), 3 * format->width, TJPF_BGR, picture);
}

Status I420Reader::read_planes(const std::vector<std::uint8_t>& jpeg, const JpegFormat& format,
                               I420Picture& picture) {
  const int subsampling = turbojpeg_subsampling(format.subsampling);
  const bool gray = subsampling == TJSAMP_GRAY;
  const bool as_it_is =
      subsampling == TJSAMP_420 && picture.width == format.width && picture.height == format.height;
  std::array<unsigned char*, 3> planes{picture.y.data(), picture.u.data(), picture.v.data()};
  if (!as_it_is) {
    make_room(luma_, 0, format, subsampling);
    if (!gray) make_room(blue_, 1, format, subsampling);
    if (!gray) make_room(red_, 2, format, subsampling);
    planes = {luma_.data(), gray ? nullptr : blue_.data(), gray ? nullptr : red_.data()};
  }
  if (tjDecompressToYUVPlanes(decompressor_, jpeg.data(), jpeg.size(), planes.data(), format.width, nullptr,
                              format.height, TJFLAG_STOPONWARNING) != 0)
    return Error{std::string("JPEG: the stream is corrupt: ") + tjGetErrorStr2(decompressor_)};
  if (as_it_is) return {};
  shrink({luma_, tjPlaneWidth(0, format.width, subsampling)}, 1, 1, picture.width, picture.height, picture.y);
  if (gray) {
    std::fill(picture.u.begin(), picture.u.end(), kNoChroma);
    std::fill(picture.v.begin(), picture.v.end(), kNoChroma);
    return {};
  }
  const auto [across, down] = chroma_steps(format.subsampling);
  const int stride = tjPlaneWidth(1, format.width, subsampling);
  shrink({blue_, stride}, across, down, picture.width / 2, picture.height / 2, picture.u);
  shrink({red_, stride}, across, down, picture.width / 2, picture.height / 2, picture.v);
  return {};
}

}  // namespace parhelion::render
