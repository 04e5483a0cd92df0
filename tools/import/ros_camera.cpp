#include "tools/import/ros_camera.hpp"

#include <cmath>
#include <cstring>
#include <sstream>

#include "tools/import/image_files.hpp"

namespace parhelion::tools {
namespace {

template <class Array>
void append(std::ostringstream& text, const char* name, const Array& values) {
  text << ", " << name << " [";
  const char* separator = "";
  for (const double value : values) {
    text << separator << value;
    separator = " ";
  }
  text << "]";
}

Status copy_distortion(const ros::CameraInfo& camera, CameraIntrinsics& out) {
  const auto copy = [&](std::size_t max_coefficients) {
    for (std::size_t i = 0; i < std::min(max_coefficients, camera.d.size()); ++i)
      out.distortion[i] = camera.d[i];
  };
  bool none = true;
  for (const double d : camera.d) none = none && d == 0;
  if (camera.distortion_model == "equidistant" || camera.distortion_model == "fisheye") {
    out.lens = CameraIntrinsics::Lens::fisheye;
    copy(4);
    return {};
  }
  const bool rational = camera.distortion_model == "rational_polynomial";
  bool tail = false;
  for (std::size_t i = 5; i < camera.d.size(); ++i) tail = tail || camera.d[i] != 0;
  if (none || camera.distortion_model == "plumb_bob" || (rational && !tail)) {
    copy(5);
    return {};
  }
  return Error{"distortion model '" + camera.distortion_model.substr(0, 40) +
               "' is not known here; plumb_bob or equidistant is expected"};
}

Result<std::vector<std::uint8_t>> packed_rows(const ros::Image& image, std::size_t pixel_bytes) {
  const std::size_t row = image.width * pixel_bytes;
  if (image.step < row || image.data.size() < std::size_t{image.step} * image.height) {
    return Error{std::to_string(image.data.size()) + " bytes for " + std::to_string(image.width) + "x" +
                 std::to_string(image.height) + " pixels of " + std::to_string(pixel_bytes) + " bytes"};
  }
  std::vector<std::uint8_t> pixels(row * image.height);
  for (std::size_t y = 0; y < image.height; ++y) {
    std::memcpy(pixels.data() + y * row, image.data.data() + y * image.step, row);
  }
  return pixels;
}

}  // namespace

Result<CameraIntrinsics> intrinsics(const ros::CameraInfo& camera, int width, int height, bool rectified) {
  CameraIntrinsics out;
  const double fx = rectified ? camera.p[0] : camera.k[0], fy = rectified ? camera.p[5] : camera.k[4];
  const double cx = rectified ? camera.p[2] : camera.k[2], cy = rectified ? camera.p[6] : camera.k[5];
  if (!(fx > 0 && fy > 0) || camera.width == 0 || camera.height == 0) {
    return Error{"a CameraInfo without calibration (focal length " + std::to_string(fx) + ")"};
  }
  out.width = width > 0 ? width : static_cast<int>(camera.width);
  out.height = height > 0 ? height : static_cast<int>(camera.height);
  // Binned images are smaller than the size that K refers to. Pixel centres are at integers, hence the
  // halves.
  const double sx = static_cast<double>(out.width) / camera.width,
               sy = static_cast<double>(out.height) / camera.height;
  out.fx = fx * sx;
  out.fy = fy * sy;
  out.cx = (cx + 0.5) * sx - 0.5;
  out.cy = (cy + 0.5) * sy - 0.5;
  if (rectified) return out;
  if (const Status lens = copy_distortion(camera, out); !lens) return lens.error();
  return out;
}

std::string camera_info_text(const std::string& topic, const ros::CameraInfo& camera) {
  std::ostringstream text;
  text.precision(17);
  text << "CameraInfo " << topic << ": frame " << camera.header.frame << ", " << camera.width << "x"
       << camera.height << ", distortion model '" << camera.distortion_model << "'";
  append(text, "D", camera.d);
  append(text, "K", camera.k);
  append(text, "R", camera.r);
  append(text, "P", camera.p);
  text << ", binning " << camera.binning_x << "x" << camera.binning_y << ", region of interest "
       << camera.roi_x << " " << camera.roi_y << " " << camera.roi_width << "x" << camera.roi_height
       << (camera.roi_rectify ? " rectified" : "");
  return text.str();
}

bool is_depth_encoding(const std::string& encoding) {
  return encoding == "16UC1" || encoding == "mono16" || encoding == "32FC1" ||
         encoding.find("compressedDepth") != std::string::npos;
}

Result<Image> to_colour(ros::Image image) {
  Image out;
  out.stamp = image.header.stamp;
  out.width = static_cast<int>(image.width);
  out.height = static_cast<int>(image.height);
  if (image.encoding == "rgb8" || image.encoding == "8UC3") {
    out.format = image.encoding == "rgb8" ? PixelFormat::rgb : PixelFormat::bgr;
  } else if (image.encoding == "bgr8") {
    out.format = PixelFormat::bgr;
  } else if (image.encoding == "mono8" || image.encoding == "8UC1") {
    out.format = PixelFormat::gray;
  } else {
    return Error{"image encoding '" + image.encoding.substr(0, 40) + "'; rgb8, bgr8 or mono8 is expected"};
  }
  const std::size_t pixel_bytes = out.format == PixelFormat::gray ? 1 : 3;
  auto pixels = packed_rows(image, pixel_bytes);
  if (!pixels) return pixels.error();
  out.row_stride = static_cast<int>(image.width * pixel_bytes);
  out.bytes = std::move(*pixels);
  return out;
}

Result<Image> to_colour(ros::CompressedImage image) {
  return colour_image(std::move(image.data), image.header.stamp);
}

Result<Image> to_depth(const ros::Image& image) {
  const bool metres = image.encoding == "32FC1";
  auto pixels = packed_rows(image, metres ? 4 : 2);
  if (!pixels) return pixels.error();
  if (image.big_endian) return Error{"a big-endian depth image; little-endian is expected"};
  DepthMillimetres depth{static_cast<int>(image.width), static_cast<int>(image.height), {}, false};
  depth.mm.resize(std::size_t{image.width} * image.height);
  if (!metres) {
    if (!pixels->empty()) std::memcpy(depth.mm.data(), pixels->data(), pixels->size());
    return depth_image(depth, image.header.stamp);
  }
  for (std::size_t i = 0; i < depth.mm.size(); ++i) {
    float m = 0;
    std::memcpy(&m, pixels->data() + 4 * i, 4);
    const double mm = std::round(m * 1000.0);
    depth.mm[i] = mm > 0 && mm < 65535 ? static_cast<std::uint16_t>(mm) : std::uint16_t{0};
  }
  return depth_image(depth, image.header.stamp);
}

Result<Image> to_depth(const ros::CompressedImage& image) {
  constexpr std::size_t transport_header = 12;  // compressed_depth_image_transport: format and two parameters
  if (image.format.find("16UC1") == std::string::npos || image.data.size() <= transport_header) {
    return Error{"depth format '" + image.format.substr(0, 40) + "'; 16UC1; compressedDepth is expected"};
  }
  std::vector<std::uint8_t> png(image.data.begin() + transport_header, image.data.end());
  const auto depth = read_depth_png(png, 1000);
  if (!depth) return depth.error();
  return depth_image(std::move(png), depth->width, depth->height, image.header.stamp);
}

}  // namespace parhelion::tools
