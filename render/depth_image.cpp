#include "render/depth_image.hpp"

#include <png.h>
#include <zlib.h>

#include <bit>
#include <csetjmp>
#include <cstring>

#include "render/image_limits.hpp"

namespace parhelion::render {
namespace {

std::string encoding_of(const Image& image) {
  const auto* entry = image.find_metadata("encoding");
  if (!entry) return "raw";
  std::string text(entry->value.begin(), entry->value.end());
  while (!text.empty() && text.back() == '\0') text.pop_back();
  return text;
}

std::size_t pixel_count(const Image& image) {
  return static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
}

Status read_rows(const std::uint8_t* bytes, std::size_t size, int row_stride, const Image& image,
                 DepthPixels& pixels) {
  const std::size_t row = 2 * static_cast<std::size_t>(image.width);
  const std::size_t stride = row_stride > 0 ? static_cast<std::size_t>(row_stride) : row;
  if (stride < row || size < stride * static_cast<std::size_t>(image.height - 1) + row)
    return Error{"depth image: " + std::to_string(size) + " bytes are too few for " +
                 std::to_string(image.width) + "x" + std::to_string(image.height) + " pixels of 16 bits"};
  for (int y = 0; y < image.height; ++y)
    std::memcpy(
        pixels.millimetres.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width),
        bytes + static_cast<std::size_t>(y) * stride, row);
  return {};
}

Status inflate_rows(const Image& image, DepthPixels& pixels) {
  uLongf size = static_cast<uLongf>(2 * pixel_count(image));
  const uLongf expected = size;
  const int status = uncompress(reinterpret_cast<Bytef*>(pixels.millimetres.data()), &size,
                                image.bytes.data(), static_cast<uLong>(image.bytes.size()));
  if (status != Z_OK || size != expected)
    return Error{"depth image: the zlib stream is corrupt or not " + std::to_string(expected) +
                 " bytes long"};
  return {};
}

/// libpng reports errors by longjmp: the functions that call it have no locals with destructors.
struct PngSource {
  const std::uint8_t* bytes;
  std::size_t size, at;
};

void png_take(png_structp png, png_bytep out, png_size_t count) {
  auto* source = static_cast<PngSource*>(png_get_io_ptr(png));
  if (count > source->size - source->at) png_error(png, "truncated");
  std::memcpy(out, source->bytes + source->at, count);
  source->at += count;
}

void png_give(png_structp png, png_bytep bytes, png_size_t count) {
  auto* sink = static_cast<std::vector<std::uint8_t>*>(png_get_io_ptr(png));
  sink->insert(sink->end(), bytes, bytes + count);
}

void png_silent(png_structp, png_const_charp) {}

[[noreturn]] void png_fail(png_structp png, png_const_charp) { png_longjmp(png, 1); }

bool png_decode(PngSource& source, int width, int height, std::uint16_t* pixels) {
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, png_fail, png_silent);
  png_infop header = png ? png_create_info_struct(png) : nullptr;
  if (!header || setjmp(png_jmpbuf(png))) {
    png_destroy_read_struct(&png, &header, nullptr);
    return false;
  }
  png_set_read_fn(png, &source, png_take);
  png_read_info(png, header);
  // The size is checked before anything is allocated for it.
  const bool fits = png_get_image_width(png, header) == static_cast<png_uint_32>(width) &&
                    png_get_image_height(png, header) == static_cast<png_uint_32>(height) &&
                    png_get_bit_depth(png, header) == 16 &&
                    png_get_color_type(png, header) == PNG_COLOR_TYPE_GRAY &&
                    png_get_interlace_type(png, header) == PNG_INTERLACE_NONE;
  if (fits) {
    if constexpr (std::endian::native == std::endian::little) png_set_swap(png);
    png_read_update_info(png, header);
    for (int y = 0; y < height; ++y)
      png_read_row(png, reinterpret_cast<png_bytep>(pixels + static_cast<std::ptrdiff_t>(y) * width),
                   nullptr);
    png_read_end(png, nullptr);
  }
  png_destroy_read_struct(&png, &header, nullptr);
  return fits;
}

bool png_encode(const DepthPixels& pixels, std::vector<std::uint8_t>& bytes) {
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, png_fail, png_silent);
  png_infop header = png ? png_create_info_struct(png) : nullptr;
  if (!header || setjmp(png_jmpbuf(png))) {
    png_destroy_write_struct(&png, &header);
    return false;
  }
  png_set_write_fn(png, &bytes, png_give, nullptr);
  png_set_IHDR(png, header, static_cast<png_uint_32>(pixels.width), static_cast<png_uint_32>(pixels.height),
               16, PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
               PNG_FILTER_TYPE_DEFAULT);
  png_set_compression_level(png, 1);
  png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
  png_write_info(png, header);
  if constexpr (std::endian::native == std::endian::little) png_set_swap(png);
  for (int y = 0; y < pixels.height; ++y)
    png_write_row(png, reinterpret_cast<png_const_bytep>(pixels.millimetres.data() +
                                                         static_cast<std::ptrdiff_t>(y) * pixels.width));
  png_write_end(png, nullptr);
  png_destroy_write_struct(&png, &header);
  return true;
}

Status read_png(const Image& image, DepthPixels& pixels) {
  PngSource source{image.bytes.data(), image.bytes.size(), 0};
  if (!png_decode(source, image.width, image.height, pixels.millimetres.data()))
    return Error{"depth image: not a whole PNG of " + std::to_string(image.width) + "x" +
                 std::to_string(image.height) + " with one channel of 16 bits"};
  return {};
}

}  // namespace

Result<DepthPixels> decode_depth(const Image& image) {
  if (image.format != PixelFormat::depth_mm)
    return Error{"depth image: the pixel format is not 16-bit millimetres ('Z16 ')"};
  if (image.width <= 0 || image.height <= 0 || image.width > kMaxImageSide || image.height > kMaxImageSide)
    return Error{"depth image: " + std::to_string(image.width) + "x" + std::to_string(image.height) +
                 ", expected 1 to " + std::to_string(kMaxImageSide) + " pixels a side"};
  DepthPixels pixels{image.width, image.height, std::vector<std::uint16_t>(pixel_count(image))};
  const std::string encoding = encoding_of(image);
  Status status;
  if (encoding == "raw")
    status = read_rows(image.bytes.data(), image.bytes.size(), image.row_stride, image, pixels);
  else if (encoding == "zlib")
    status = inflate_rows(image, pixels);
  else if (encoding == "png")
    status = read_png(image, pixels);
  else
    status = Error{"depth image: encoding \"" + encoding + "\" is not known; expected raw, png or zlib"};
  if (!status) return status.error();
  for (auto& d : pixels.millimetres)
    if (d == 65535) d = 0;
  return pixels;
}

Result<Image> encode_depth(const DepthPixels& pixels, const Image& like) {
  Image image;
  image.stamp = like.stamp;
  image.width = pixels.width, image.height = pixels.height;
  image.format = PixelFormat::depth_mm;
  image.metadata = like.metadata;
  const std::string encoding = encoding_of(like);
  const std::size_t size = 2 * pixels.millimetres.size();
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(pixels.millimetres.data());
  if (encoding == "raw") {
    image.row_stride = 2 * pixels.width;
    image.bytes.assign(bytes, bytes + size);
  } else if (encoding == "zlib") {
    uLongf packed = compressBound(static_cast<uLong>(size));
    image.bytes.resize(packed);
    if (compress2(image.bytes.data(), &packed, bytes, static_cast<uLong>(size), 1) != Z_OK)
      return Error{"depth image: zlib compression failed"};
    image.bytes.resize(packed);
  } else if (encoding == "png") {
    if (!png_encode(pixels, image.bytes)) return Error{"depth image: PNG encoding failed"};
  } else {
    return Error{"depth image: encoding \"" + encoding + "\" is not known; expected raw, png or zlib"};
  }
  return image;
}

}  // namespace parhelion::render
