#include "server/station/foxglove/messages.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "protocols/yaml/base64.hpp"
#include "render/depth_image.hpp"

namespace parhelion::station::foxglove {
namespace {

constexpr float kNothing = std::numeric_limits<float>::infinity();

/// A laser scan without its ranges and intensities.
void begin_scan(const Scan& scan, std::string_view frame, JsonText& out) {
  const auto beams = static_cast<double>(scan.ranges.size());
  out.clear();
  out.open('{').key("timestamp").time(scan.stamp.ns).key("frame_id").string(frame);
  out.key("pose").pose(Eigen::Isometry3d::Identity());
  out.key("start_angle").number(scan.angle_min);
  out.key("end_angle").number(scan.angle_min + static_cast<double>(scan.angle_increment) * (beams - 1));
}

enum class LogLevel : std::int8_t { info = 2, warning = 3, error = 4 };

LogLevel level_of(EventKind kind) {
  switch (kind) {
    case EventKind::contact_started:
    case EventKind::person_touched:
    case EventKind::joint_broken:
    case EventKind::door_unhinged:
    case EventKind::fell:
    case EventKind::tipped_over:
    case EventKind::pitch_limit:
    case EventKind::roll_limit:
    case EventKind::yaw_rate_limit:
    case EventKind::dropped:
    case EventKind::hazard_triggered:
    case EventKind::task_failed:
      return LogLevel::error;
    case EventKind::command_refused:
    case EventKind::localization_lost:
    case EventKind::relocalized:
    case EventKind::odometry_changed:
    case EventKind::poses_conflict:
    case EventKind::scans_conflict:
    case EventKind::dose_warning:
    case EventKind::dose_limit:
    case EventKind::speed_limited:
    case EventKind::injection_suspended:
    case EventKind::joint_overload:
    case EventKind::payload_exceeded:
    case EventKind::joint_limited:
    case EventKind::encoders_lost:
    case EventKind::pitch_warning:
    case EventKind::roll_warning:
    case EventKind::yaw_rate_warning:
    case EventKind::collision_predicted:
    case EventKind::tipping_predicted:
    case EventKind::radio_lost:
    case EventKind::battery_low:
    case EventKind::battery_empty:
    case EventKind::console_lost:
    case EventKind::foreign_publisher:
    case EventKind::goal_unreachable:
    case EventKind::points_deducted:
      return LogLevel::warning;
    default:
      return LogLevel::info;
  }
}

/// "contact started: robot_1, wall 7 (12.5 N s): text".
std::string sentence(const Event& event) {
  std::string text = to_string(event.kind);
  std::replace(text.begin(), text.end(), '_', ' ');
  if (!event.subject.empty()) text += ": " + event.subject;
  if (!event.object.empty()) text += ", " + event.object;
  char figure[32];
  if (event.impulse > 0) {
    std::snprintf(figure, sizeof figure, " (%.3g N s)", event.impulse);
    text += figure;
  } else if (event.value != 0) {
    std::snprintf(figure, sizeof figure, " (%.4g)", event.value);
    text += figure;
  }
  if (!event.text.empty()) text += ": " + event.text;
  return event.undetectable ? text + " (undetectable)" : text;
}

struct RawPixels {
  int width = 0, height = 0;
  std::string_view encoding;
  std::int64_t step = 0;  ///< bytes per row
  std::span<const std::uint8_t> bytes;
};

void write_raw_image(SensorTime stamp, const RawPixels& pixels, std::string_view frame, JsonText& out) {
  out.clear();
  out.open('{').key("timestamp").time(stamp.ns).key("frame_id").string(frame);
  out.key("width").integer(pixels.width).key("height").integer(pixels.height);
  out.key("encoding").unescaped(pixels.encoding).key("step").integer(pixels.step);
  out.key("data").unescaped(yaml::to_base64(pixels.bytes)).close('}');
}

}  // namespace

void write_scan(const Scan& scan, const RangeConvention& convention, std::string_view frame, JsonText& out) {
  const Scan even = evenly_spaced(scan);
  begin_scan(even, frame, out);
  out.key("ranges").open('[');
  for (const float range : even.ranges)
    out.number(convention.classify(range) == BeamKind::hit ? range : kNothing);
  out.close(']').key("intensities").open('[');
  for (const float intensity : even.intensities) out.number(intensity);
  out.close(']').close('}');
}

void write_virtual_returns(const Scan& scan, const ScanInfo& info, std::string_view frame, JsonText& out) {
  begin_scan(scan, frame, out);
  const auto nearest = nearest_beams(scan);
  const auto replaced = [&](const std::optional<std::size_t>& beam) {
    return beam && *beam < info.beam_agent.size() && info.beam_agent[*beam] >= 0;
  };
  out.key("ranges").open('[');
  for (const auto& beam : nearest) out.number(replaced(beam) ? scan.ranges[*beam] : kNothing);
  out.close(']').key("intensities").open('[');
  for (const auto& beam : nearest) out.integer(replaced(beam) ? info.beam_agent[*beam] + 1 : 0);
  out.close(']').close('}');
}

void write_transforms(std::int64_t stamp, const std::vector<NamedTransform>& transforms, JsonText& out) {
  out.clear();
  out.open('{').key("transforms").open('[');
  for (const NamedTransform& each : transforms) {
    out.open('{').key("timestamp").time(stamp);
    out.key("parent_frame_id").string(each.parent).key("child_frame_id").string(each.child);
    out.key("translation").vector(each.T_parent_child.translation());
    out.key("rotation").quaternion(each.T_parent_child.linear()).close('}');
  }
  out.close(']').close('}');
}

void write_pose(std::int64_t stamp, const Eigen::Isometry3d& T_map_base, JsonText& out) {
  out.clear();
  out.open('{').key("timestamp").time(stamp).key("frame_id").unescaped("map");
  out.key("pose").pose(T_map_base).close('}');
}

void write_jpeg(const Image& image, std::string_view frame, JsonText& out) {
  out.clear();
  out.open('{').key("timestamp").time(image.stamp.ns).key("frame_id").string(frame);
  out.key("data").unescaped(yaml::to_base64(image.bytes)).key("format").unescaped("jpeg").close('}');
}

void write_pixels(const Image& image, std::string_view frame, JsonText& out) {
  const char* encoding = image.format == PixelFormat::gray  ? "mono8"
                         : image.format == PixelFormat::rgb ? "rgb8"
                                                            : "bgr8";
  write_raw_image(image.stamp, {image.width, image.height, encoding, image.row_stride, image.bytes}, frame,
                  out);
}

Status write_depth(const Image& image, std::string_view frame, JsonText& out) {
  const auto depth = render::decode_depth(image);
  if (!depth) return depth.error();
  std::vector<std::uint8_t> bytes;
  bytes.reserve(2 * depth->millimetres.size());
  for (const std::uint16_t millimetres : depth->millimetres) {
    bytes.push_back(static_cast<std::uint8_t>(millimetres & 0xFF));
    bytes.push_back(static_cast<std::uint8_t>(millimetres >> 8));
  }
  write_raw_image(image.stamp,
                  {depth->width, depth->height, "16UC1", 2 * static_cast<std::int64_t>(depth->width), bytes},
                  frame, out);
  return {};
}

void write_calibration(std::int64_t stamp, const CameraIntrinsics& camera, std::string_view frame,
                       JsonText& out) {
  const bool fisheye = camera.lens == CameraIntrinsics::Lens::fisheye;
  const auto row = [&](std::initializer_list<double> values) {
    out.open('[');
    for (const double value : values) out.number(value);
    out.close(']');
  };
  out.clear();
  out.open('{').key("timestamp").time(stamp).key("frame_id").string(frame);
  out.key("width").integer(camera.width).key("height").integer(camera.height);
  out.key("distortion_model").unescaped(fisheye ? "kannala_brandt" : "plumb_bob");
  out.key("D").open('[');
  for (std::size_t i = 0; i < (fisheye ? 4U : 5U); ++i) out.number(camera.distortion[i]);
  out.close(']').key("K");
  row({camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1});
  out.key("R");
  row({1, 0, 0, 0, 1, 0, 0, 0, 1});
  out.key("P");
  row({camera.fx, 0, camera.cx, 0, 0, camera.fy, camera.cy, 0, 0, 0, 1, 0});
  out.close('}');
}

void write_event(const Event& event, JsonText& out) {
  out.clear();
  out.open('{').key("timestamp").time(event.stamp.ns);
  out.key("level").integer(static_cast<std::int64_t>(level_of(event.kind)));
  out.key("message").string(sentence(event)).key("name").string(event.subject);
  out.key("file").unescaped("").key("line").integer(0).close('}');
}

void write_score(const Event& event, JsonText& out) {
  out.clear();
  out.open('{').key("timestamp").time(event.stamp.ns).key("score").number(event.value).close('}');
}

void write_twist(const TwistCommand& command, JsonText& out) {
  const Twist2& twist = command.twist;
  out.clear();
  out.open('{').key("timestamp").time(command.stamp.ns);
  out.key("vx").number(twist.vx).key("vy").number(twist.vy).key("wz").number(twist.wz).close('}');
}

void write_injection(const ScanInfo& info, JsonText& out) {
  const auto replaced = std::count_if(info.beam_agent.begin(), info.beam_agent.end(),
                                      [](std::int16_t agent) { return agent >= 0; });
  out.clear();
  out.open('{').key("timestamp").time(info.stamp.ns).key("live").boolean(info.live);
  out.key("reason").string(info.reason).key("predicted_error").number(info.predicted_error);
  out.key("replaced_beams").integer(replaced).close('}');
}

void write_status(const ServerStatus& status, JsonText& out) {
  out.clear();
  out.open('{').key("timestamp").time(status.stamp.ns).key("values").open('[');
  for (const auto& [name, value] : status.values)
    out.open('{').key("name").string(name).key("value").number(value).close('}');
  out.close(']').key("notes").open('[');
  for (const auto& [name, note] : status.notes)
    out.open('{').key("name").string(name).key("text").string(note).close('}');
  out.close(']').close('}');
}

}  // namespace parhelion::station::foxglove
