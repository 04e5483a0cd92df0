// The only file of the importers that includes OpenCV.
#include "tools/import/image_files.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <optional>

namespace parhelion::tools {
namespace {

constexpr std::size_t kLargestFile = 256U << 20;

bool is_jpeg(std::span<const std::uint8_t> file) {
  return file.size() > 3 && file[0] == 0xFF && file[1] == 0xD8 && file[2] == 0xFF;
}

struct Size {
  int width, height;
};

/// Offset of the first segment with one of these markers (ITU-T T.81, B.1.1); nullopt: the file ends before.
template <class IsWanted>
std::optional<std::size_t> jpeg_segment(std::span<const std::uint8_t> file, IsWanted is_wanted) {
  std::size_t at = 2;
  while (at + 9 < file.size() && file[at] == 0xFF) {
    const std::uint8_t marker = file[at + 1];
    if (is_wanted(marker)) return at;
    if (marker == 0xFF) {
      ++at;
      continue;
    }
    at += 2U + file[at + 2] * 256U + file[at + 3];
  }
  return std::nullopt;
}

/// From the start-of-frame segment (ITU-T T.81, B.2.2).
std::optional<Size> jpeg_size(std::span<const std::uint8_t> file) {
  const auto frame = jpeg_segment(file, [](std::uint8_t marker) {
    return marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
  });
  if (!frame) return std::nullopt;
  return Size{file[*frame + 7] * 256 + file[*frame + 8], file[*frame + 5] * 256 + file[*frame + 6]};
}

/// nullopt: OpenCV cannot read it. OpenCV throws on some damage and returns an empty image on other.
cv::Mat decode_file(std::span<const std::uint8_t> file, int flags) {
  try {
    const cv::Mat bytes(1, static_cast<int>(file.size()), CV_8UC1, const_cast<std::uint8_t*>(file.data()));
    return cv::imdecode(bytes, flags);
  } catch (const cv::Exception&) {
    return {};
  }
}

ImageMetadata text_metadata(const std::string& key, const std::string& value) {
  return {key, {value.begin(), value.end()}};
}

}  // namespace

bool is_cut_jpeg(std::span<const std::uint8_t> file) {
  if (!is_jpeg(file)) return false;
  // Before the first scan a thumbnail may have an end marker of its own.
  const auto scan = jpeg_segment(file, [](std::uint8_t marker) { return marker == 0xDA; });
  if (!scan) return true;
  constexpr std::uint8_t end_marker[] = {0xFF, 0xD9};
  const auto pixels = file.subspan(*scan);
  return std::search(pixels.begin(), pixels.end(), std::begin(end_marker), std::end(end_marker)) ==
         pixels.end();
}

Result<Image> colour_image(std::vector<std::uint8_t> file, SensorTime stamp) {
  Image image;
  image.stamp = stamp;
  if (is_jpeg(file)) {
    const auto size = jpeg_size(file);
    if (!size) return Error{"a JPEG without a frame header"};
    image.width = size->width;
    image.height = size->height;
    image.format = PixelFormat::mjpeg;
    image.bytes = std::move(file);
    return image;
  }
  const cv::Mat pixels = decode_file(file, cv::IMREAD_COLOR);
  if (pixels.empty()) return Error{"an image that cannot be read: JPEG or PNG is expected"};
  image.width = pixels.cols;
  image.height = pixels.rows;
  image.row_stride = pixels.cols * 3;
  image.format = PixelFormat::bgr;
  const cv::Mat whole = pixels.isContinuous() ? pixels : pixels.clone();
  image.bytes.assign(whole.data, whole.data + whole.total() * whole.elemSize());
  return image;
}

Result<GreyPixels> read_grey(std::span<const std::uint8_t> file) {
  const cv::Mat pixels = decode_file(file, cv::IMREAD_GRAYSCALE);
  if (pixels.empty()) return Error{"an image that cannot be read: JPEG or PNG is expected"};
  const cv::Mat whole = pixels.isContinuous() ? pixels : pixels.clone();
  return GreyPixels{whole.cols, whole.rows, {whole.data, whole.data + whole.total()}};
}

Result<DepthMillimetres> read_depth_png(std::span<const std::uint8_t> file, double units_per_metre) {
  const cv::Mat pixels = decode_file(file, cv::IMREAD_UNCHANGED);
  if (pixels.empty()) return Error{"a depth image that cannot be read: a 16-bit grey PNG is expected"};
  if (pixels.type() != CV_16UC1) return Error{"a depth image that is not 16-bit grey"};
  DepthMillimetres depth{pixels.cols, pixels.rows, {}, units_per_metre == 1000};
  depth.mm.reserve(pixels.total());
  const double mm_per_unit = 1000 / units_per_metre;
  constexpr std::uint16_t none = 65535;  // 7-Scenes' value for no measurement, besides 0
  for (int row = 0; row < pixels.rows; ++row) {
    const auto* line = pixels.ptr<std::uint16_t>(row);
    for (int column = 0; column < pixels.cols; ++column) {
      const double mm = line[column] == none ? 0 : std::round(line[column] * mm_per_unit);
      depth.mm.push_back(mm < none ? static_cast<std::uint16_t>(mm) : std::uint16_t{0});
      depth.as_written = depth.as_written && line[column] != none;
    }
  }
  return depth;
}

Result<Image> depth_image(const DepthMillimetres& depth, SensorTime stamp) {
  const cv::Mat pixels(depth.height, depth.width, CV_16UC1, const_cast<std::uint16_t*>(depth.mm.data()));
  std::vector<std::uint8_t> png;
  try {
    // Level 1: a third larger than the best level, five times as fast.
    if (cv::imencode(".png", pixels, png, {cv::IMWRITE_PNG_COMPRESSION, 1})) {
      return depth_image(std::move(png), depth.width, depth.height, stamp);
    }
  } catch (const cv::Exception&) {
  }
  return Error{"a depth image that cannot be written as PNG"};
}

Image depth_image(std::vector<std::uint8_t> png, int width, int height, SensorTime stamp) {
  Image image;
  image.stamp = stamp;
  image.width = width;
  image.height = height;
  image.format = PixelFormat::depth_mm;
  image.bytes = std::move(png);
  image.metadata.push_back(text_metadata("encoding", "png"));
  return image;
}

Result<std::vector<std::uint8_t>> read_file(const std::string& path) {
  // A pipe or a device could keep the reader waiting for ever.
  std::error_code code;
  if (const auto status = std::filesystem::status(path, code);
      std::filesystem::exists(status) && !std::filesystem::is_regular_file(status))
    return Error{path + ": is no regular file, expected an image"};
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) return Error{path + ": cannot be opened: " + std::strerror(errno)};
  const auto size = static_cast<std::size_t>(file.tellg());
  if (size > kLargestFile) return Error{path + ": larger than 256 MiB"};
  std::vector<std::uint8_t> bytes(size);
  file.seekg(0);
  file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size));
  if (!file) return Error{path + ": cannot be read: " + std::strerror(errno)};
  return bytes;
}

}  // namespace parhelion::tools
