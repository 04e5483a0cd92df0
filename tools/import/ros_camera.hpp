// Cameras of a bag: CameraInfo to the robot description, images to the wire.
#pragma once

#include "protocols/image.hpp"
#include "tools/import/ros_message.hpp"

namespace parhelion::tools {

/// Pinhole model and lens for images of `width` x `height` (0: the CameraInfo's own). `rectified` images have
/// no distortion and the projection matrix's pinhole model. Error: no focal length, or an unsupported lens
/// model.
Result<CameraIntrinsics> intrinsics(const ros::CameraInfo& camera, int width, int height, bool rectified);

/// The complete CameraInfo as text for `source`.
std::string camera_info_text(const std::string& topic, const ros::CameraInfo& camera);

bool is_depth_encoding(const std::string& encoding);

/// 8-bit colour or grey, or a JPEG or PNG. Error: an encoding without a counterpart on the wire (Bayer and
/// others).
Result<Image> to_colour(ros::Image image);
Result<Image> to_colour(ros::CompressedImage image);
/// 16UC1 and mono16 in millimetres, 32FC1 in metres; compressedDepth of 16UC1.
Result<Image> to_depth(const ros::Image& image);
Result<Image> to_depth(const ros::CompressedImage& image);

}  // namespace parhelion::tools
