// planar_lidar_t, lidar_t and scan_info_t. Nothing is allocated once the vectors are large enough.
#include <numbers>

#include "parhelion/lidar_t.hpp"
#include "parhelion/planar_lidar_t.hpp"
#include "parhelion/scan_info_t.hpp"
#include "protocols/codec_wire.hpp"

namespace parhelion {
namespace {

constexpr std::size_t kMaxBeams = 100'000;
/// Bytes of one beam in lidar_t: range, angle, time, intensity.
constexpr std::size_t kLidarBeamSize = 3 * sizeof(float) + sizeof(std::int64_t);
constexpr double kMaxAngle = 100;  // rad: several turns; more indicates a corrupt field

constexpr double kMaxBeamDelay = 1;  // s from the stamp; more indicates another clock

bool is_lidar(Bytes bytes) {
  return bytes.size() >= sizeof(std::int64_t) &&
         wire::big_endian<std::int64_t>(bytes.data()) == lidar_t::getHash();
}

/// The mean of the steps between neighbours, each within half a turn.
float mean_step(const std::vector<float>& angles) {
  double swept = 0;
  for (std::size_t i = 1; i < angles.size(); ++i)
    swept += std::remainder(double{angles[i]} - double{angles[i - 1]}, 2 * std::numbers::pi);
  return angles.size() > 1 ? static_cast<float>(swept / static_cast<double>(angles.size() - 1)) : 0;
}

void check_angles(wire::Reader& reader, const std::vector<float>& angles) {
  for (const float angle : angles) {
    if (std::abs(angle) <= kMaxAngle) continue;
    return reader.fail_value("thetas", angle, "a finite angle within several turns");
  }
}

void check_times(wire::Reader& reader, const Scan& scan) {
  if (!reader.ok() || !scan.is_timed()) return;
  for (const std::int64_t time : scan.times) {
    const double delay = (static_cast<double>(time) - static_cast<double>(scan.stamp.utime())) * 1e-6;
    if (std::abs(delay) <= kMaxBeamDelay) continue;
    return reader.fail_value("times", delay, "at most 1 s from utime, or one instant for all beams");
  }
}

Status decode_lidar(std::string_view channel, Bytes bytes, Scan& scan) {
  wire::Reader reader(channel, "lidar_t", lidar_t::getHash(), bytes);
  scan.stamp = reader.utime();
  const std::size_t beams = reader.count("num_ranges", kLidarBeamSize, kMaxBeams);
  reader.check(beams > 0, "num_ranges", "0", "at least one beam");
  reader.floats("ranges", beams, scan.ranges);
  reader.floats("thetas", beams, scan.angles);
  scan.times.resize(reader.ok() ? beams : 0);
  for (std::int64_t& time : scan.times) time = reader.number<std::int64_t>("times");
  reader.floats("intensities", beams, scan.intensities);
  check_angles(reader, scan.angles);
  check_times(reader, scan);
  if (!reader.ok()) return reader.status();
  scan.angle_min = scan.angles.front();
  scan.angle_increment = mean_step(scan.angles);
  return reader.status();
}

void encode_lidar(const Scan& scan, std::vector<std::uint8_t>& bytes) {
  wire::Writer writer(lidar_t::getHash(), bytes);
  writer.number(scan.stamp.utime());
  writer.count(scan.ranges.size());
  writer.floats(scan.ranges);
  writer.floats(scan.angles);
  for (const std::int64_t time : scan.times) writer.number(time);
  writer.floats(scan.intensities);
}

}  // namespace

Status decode(std::string_view channel, Bytes bytes, Scan& scan) {
  if (is_lidar(bytes)) return decode_lidar(channel, bytes, scan);
  scan.angles.clear();
  scan.times.clear();
  wire::Reader reader(channel, "planar_lidar_t", planar_lidar_t::getHash(), bytes);
  scan.stamp = reader.utime();
  const std::size_t beams = reader.count("nranges", sizeof(float), kMaxBeams);
  reader.check(beams > 0, "nranges", "0", "at least one beam");
  reader.floats("ranges", beams, scan.ranges);
  const std::size_t intensities = reader.count("nintensities", sizeof(float), kMaxBeams);
  if (intensities != 0 && intensities != beams) {
    reader.check_range("nintensities", static_cast<std::int64_t>(intensities),
                       static_cast<std::int64_t>(beams), static_cast<std::int64_t>(beams));
  }
  reader.floats("intensities", intensities, scan.intensities);
  scan.angle_min = reader.bounded<float>("rad0", kMaxAngle);
  scan.angle_increment = reader.bounded<float>("radstep", kMaxAngle);
  reader.check(scan.angle_increment != 0, "radstep", "0", "the angle between two beams, not 0");
  if (std::abs(scan.angle_increment) * static_cast<double>(beams) > kMaxAngle) {
    reader.fail_value("radstep", scan.angle_increment, "beams within several turns");
  }
  return reader.status();
}

bool has_form_of_scan(Bytes bytes) {
  if (is_lidar(bytes)) {
    wire::Reader reader("", "lidar_t", lidar_t::getHash(), bytes);
    reader.number<std::int64_t>("utime");
    reader.skip("beams", reader.count("num_ranges", kLidarBeamSize, kMaxBeams) * kLidarBeamSize);
    return reader.status().ok();
  }
  wire::Reader reader("", "planar_lidar_t", planar_lidar_t::getHash(), bytes);
  reader.number<std::int64_t>("utime");
  for (const char* field : {"nranges", "nintensities"})
    reader.skip(field, reader.count(field, sizeof(float), kMaxBeams) * sizeof(float));
  reader.skip("rad0 and radstep", 2 * sizeof(float));
  return reader.status().ok();
}

void encode(const Scan& scan, std::vector<std::uint8_t>& bytes) {
  if (!scan.angles.empty()) return encode_lidar(scan, bytes);
  wire::Writer writer(planar_lidar_t::getHash(), bytes);
  writer.number(scan.stamp.utime());
  writer.count(scan.ranges.size());
  writer.floats(scan.ranges);
  writer.count(scan.intensities.size());
  writer.floats(scan.intensities);
  writer.number(scan.angle_min);
  writer.number(scan.angle_increment);
}

Status decode(std::string_view channel, Bytes bytes, ScanInfo& info) {
  wire::Reader reader(channel, "scan_info_t", scan_info_t::getHash(), bytes);
  info.stamp = reader.utime();
  info.live = reader.boolean("live");
  reader.text("reason", info.reason);
  info.predicted_error = reader.number<double>("predicted_error");
  if (!(info.predicted_error >= 0)) {
    reader.fail_value("predicted_error", info.predicted_error, "metres, not negative, or infinity");
  }
  reader.text("pose", info.pose);
  for (int i = 0; i < 9; ++i) {
    const double value = reader.number<double>("pose_covariance");
    if (std::isnan(value)) reader.fail_value("pose_covariance", value, "a number or infinity");
    info.pose_covariance(i / 3, i % 3) = value;
  }
  info.residual = reader.number<double>("residual");
  if (!(info.residual >= 0))
    reader.fail_value("residual", info.residual, "metres, not negative, or infinity");
  info.explained = reader.number<double>("explained");
  if (!(info.explained >= 0 && info.explained <= 1)) reader.fail_value("explained", info.explained, "0 to 1");
  info.agents.resize(reader.count("nagents", 5, INT16_MAX));
  for (std::string& name : info.agents) reader.text("agents", name);
  info.beam_agent.resize(reader.count("nbeams", sizeof(std::int16_t), kMaxBeams));
  for (std::int16_t& agent : info.beam_agent) {
    agent = reader.number<std::int16_t>("beam_agent");
    reader.check_range("beam_agent", agent, -1, static_cast<std::int64_t>(info.agents.size()) - 1);
  }
  return reader.status();
}

void encode(const ScanInfo& info, std::vector<std::uint8_t>& bytes) {
  wire::Writer writer(scan_info_t::getHash(), bytes);
  writer.number(info.stamp.utime());
  writer.boolean(info.live);
  writer.text(info.reason);
  writer.number(info.predicted_error);
  writer.text(info.pose);
  for (int i = 0; i < 9; ++i) writer.number(info.pose_covariance(i / 3, i % 3));
  writer.number(info.residual);
  writer.number(info.explained);
  writer.count(info.agents.size());
  for (const std::string& name : info.agents) writer.text(name);
  writer.count(info.beam_agent.size());
  for (const std::int16_t agent : info.beam_agent) writer.number(agent);
}

}  // namespace parhelion
