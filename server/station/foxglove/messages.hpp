// Writes Parhelion's messages as Foxglove's JSON messages, one whole message for each call. Stamps are
// nanoseconds since the epoch.
#pragma once

#include <cstdint>
#include <string_view>

#include "protocols/codec.hpp"
#include "protocols/robot.hpp"
#include "server/station/foxglove/json_text.hpp"

namespace parhelion::station::foxglove {

/// foxglove.LaserScan: no return, too close and invalid are all written as infinity.
void write_scan(const Scan& scan, const RangeConvention& convention, std::string_view frame, JsonText& out);
/// The same with only the beams that hit an agent; the intensity is the agent's number, from 1.
void write_virtual_returns(const Scan& scan, const ScanInfo& info, std::string_view frame, JsonText& out);

struct NamedTransform {
  std::string_view parent, child;
  Eigen::Isometry3d T_parent_child;
};
/// foxglove.FrameTransforms.
void write_transforms(std::int64_t stamp, const std::vector<NamedTransform>& transforms, JsonText& out);
/// foxglove.PoseInFrame, in `map`.
void write_pose(std::int64_t stamp, const Eigen::Isometry3d& T_map_base, JsonText& out);

/// foxglove.CompressedImage of a JPEG.
void write_jpeg(const Image& image, std::string_view frame, JsonText& out);
/// foxglove.RawImage of grey, RGB or BGR pixels.
void write_pixels(const Image& image, std::string_view frame, JsonText& out);
/// foxglove.RawImage, 16UC1, millimetres. Error: as decode_depth.
Status write_depth(const Image& image, std::string_view frame, JsonText& out);
/// foxglove.CameraCalibration.
void write_calibration(std::int64_t stamp, const CameraIntrinsics& camera, std::string_view frame,
                       JsonText& out);

/// foxglove.Log: collisions, damage, falls and exceeded limits are errors, warnings are warnings.
void write_event(const Event& event, JsonText& out);
/// parhelion.Score, for score_changed and grading_ended.
void write_score(const Event& event, JsonText& out);
/// parhelion.Twist, parhelion.Injection, parhelion.Status.
void write_twist(const TwistCommand& command, JsonText& out);
void write_injection(const ScanInfo& info, JsonText& out);
void write_status(const ServerStatus& status, JsonText& out);

}  // namespace parhelion::station::foxglove
