// planar_lidar_t and scan_info_t. Nothing is allocated once the vectors are large enough.
#include "parhelion/planar_lidar_t.hpp"
#include "parhelion/scan_info_t.hpp"
#include "protocols/codec_wire.hpp"

namespace parhelion {
namespace {

constexpr std::size_t kMaxBeams = 100'000;
constexpr double kMaxAngle = 100;  // rad: several turns; more indicates a corrupt field

}  // namespace

Status decode(std::string_view channel, Bytes bytes, Scan& scan) {
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
  wire::Reader reader("", "planar_lidar_t", planar_lidar_t::getHash(), bytes);
  reader.number<std::int64_t>("utime");
  for (const char* field : {"nranges", "nintensities"})
    reader.skip(field, reader.count(field, sizeof(float), kMaxBeams) * sizeof(float));
  reader.skip("rad0 and radstep", 2 * sizeof(float));
  return reader.status().ok();
}

void encode(const Scan& scan, std::vector<std::uint8_t>& bytes) {
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
