// image_t with its metadata.
#include "parhelion/image_t.hpp"
#include "protocols/codec_wire.hpp"

namespace parhelion {
namespace {

/// Of any camera's image, also of those that are passed on without being drawn into: the renderer's own limit
/// (render/image_limits.hpp) is smaller, and its error names the camera.
constexpr std::int64_t kMaxSide = 16'384;

/// Bytes per pixel, 0 where the bytes are a compressed stream.
int bytes_per_pixel(wire::Reader& reader, const Image& image) {
  switch (image.format) {
    case PixelFormat::mjpeg:
      return 0;
    case PixelFormat::gray:
      return 1;
    case PixelFormat::rgb:
    case PixelFormat::bgr:
      return 3;
    case PixelFormat::depth_mm:
      break;
  }
  const ImageMetadata* encoding = image.find_metadata("encoding");
  const std::string_view name =
      encoding == nullptr
          ? std::string_view()
          : std::string_view(reinterpret_cast<const char*>(encoding->value.data()), encoding->value.size());
  reader.check(name == "raw" || name == "png" || name == "zlib", "metadata",
               "a depth image without a known \"encoding\"", "\"raw\", \"png\" or \"zlib\"");
  return name == "raw" ? 2 : 0;
}

void check_size(wire::Reader& reader, const Image& image) {
  const std::int64_t pixel = bytes_per_pixel(reader, image);
  if (pixel == 0) {
    reader.check(!image.bytes.empty(), "size", "0", "a compressed image");
    return;
  }
  reader.check_range("row_stride", image.row_stride, image.width * pixel, INT32_MAX);
  const std::int64_t whole = std::int64_t{image.row_stride} * image.height;
  reader.check_range("size", static_cast<std::int64_t>(image.bytes.size()), whole, whole);
}

PixelFormat pixel_format(wire::Reader& reader) {
  const auto format = static_cast<PixelFormat>(reader.number<std::int32_t>("pixelformat"));
  switch (format) {
    case PixelFormat::gray:
    case PixelFormat::rgb:
    case PixelFormat::bgr:
    case PixelFormat::mjpeg:
    case PixelFormat::depth_mm:
      return format;
  }
  reader.check(false, "pixelformat", std::to_string(static_cast<std::int32_t>(format)).c_str(),
               "MJPEG 1196444237, RGB 859981650, BGR 861030210, GRAY 1497715271 or depth 540422490");
  return PixelFormat::mjpeg;
}

}  // namespace

const ImageMetadata* Image::find_metadata(const std::string& key) const {
  for (const ImageMetadata& entry : metadata) {
    if (entry.key == key) return &entry;
  }
  return nullptr;
}

Status decode(std::string_view channel, Bytes bytes, Image& image) {
  wire::Reader reader(channel, "image_t", image_t::getHash(), bytes);
  image.stamp = reader.utime();
  image.width = reader.number<std::int32_t>("width");
  reader.check_range("width", image.width, 1, kMaxSide);
  image.height = reader.number<std::int32_t>("height");
  reader.check_range("height", image.height, 1, kMaxSide);
  image.row_stride = reader.number<std::int32_t>("row_stride");
  reader.check_range("row_stride", image.row_stride, 0, INT32_MAX);
  image.format = pixel_format(reader);
  reader.raw("data", reader.count("size", 1, INT32_MAX), image.bytes);
  image.metadata.resize(reader.count("nmetadata", 9, 1000));
  for (ImageMetadata& entry : image.metadata) {
    reader.text("metadata.key", entry.key);
    reader.raw("metadata.value", reader.count("metadata.n", 1, INT32_MAX), entry.value);
  }
  if (reader.ok()) check_size(reader, image);
  return reader.status();
}

void encode(const Image& image, std::vector<std::uint8_t>& bytes) {
  wire::Writer writer(image_t::getHash(), bytes);
  writer.number(image.stamp.utime());
  writer.number(std::int32_t{image.width});
  writer.number(std::int32_t{image.height});
  writer.number(std::int32_t{image.row_stride});
  writer.number(static_cast<std::int32_t>(image.format));
  writer.count(image.bytes.size());
  writer.raw(image.bytes);
  writer.count(image.metadata.size());
  for (const ImageMetadata& entry : image.metadata) {
    writer.text(entry.key);
    writer.count(entry.value.size());
    writer.raw(entry.value);
  }
}

}  // namespace parhelion
