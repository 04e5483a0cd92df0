#include "server/station/scan_frames.hpp"

#include <algorithm>
#include <limits>

#include "server/simulation/robots/base_body.hpp"
#include "server/station/byte_writer.hpp"

namespace parhelion::station {
namespace {

constexpr std::size_t kHeaderBytes = 40;

pose::PoseTrackOptions place_options(const tick::Configuration& configuration) {
  pose::PoseTrackOptions options;
  options.map_id = configuration.model.map_id;
  return options;
}

const WorldMessage::Entry* first_body(const WorldMessage& world, const std::string& agent) {
  const auto found = std::find_if(world.bodies.begin(), world.bodies.end(),
                                  [&](const WorldMessage::Entry& body) { return body.entity == agent; });
  return found == world.bodies.end() ? nullptr : &*found;
}

}  // namespace

std::string scan_bytes(const Scan& scan, const ScanFrame& frame) {
  constexpr float unknown = std::numeric_limits<float>::quiet_NaN();
  const auto& place = frame.T_map_laser;
  const auto nearest = nearest_beams(scan);
  ByteWriter bytes(kHeaderBytes + 6 * scan.ranges.size());
  bytes.put(std::uint8_t{2});
  bytes.put(static_cast<std::uint8_t>(frame.source));
  bytes.put(frame.part);
  bytes.put(static_cast<std::uint32_t>(scan.ranges.size()));
  bytes.put(frame.t);
  bytes.put(place ? static_cast<float>(place->translation().x()) : unknown);
  bytes.put(place ? static_cast<float>(place->translation().y()) : unknown);
  bytes.put(place ? static_cast<float>(place->yaw()) : unknown);
  bytes.put(scan.angle_min);
  bytes.put(scan.angle_increment);
  bytes.put(std::uint32_t{0});
  for (const auto& beam : nearest) bytes.put(beam ? scan.ranges[*beam] : unknown);
  for (const auto& beam : nearest)
    bytes.put(beam && *beam < frame.entities.size() ? frame.entities[*beam] : std::int16_t{-1});
  return bytes.take();
}

RobotPlace::RobotPlace(const tick::Configuration& configuration, std::size_t robot)
    : configuration_(configuration), robot_(configuration.robot_at(robot)) {
  restart();
}

void RobotPlace::restart() { track_.emplace(robot_, place_options(configuration_)); }

void RobotPlace::take(PoseEstimate estimate) {
  // A map that SLAM is still building is assumed to match the model's, as in the server.
  const auto& trainee = configuration_.scenario.trainee;
  if (trainee && trainee->slam && estimate.map_id.empty()) estimate.map_id = configuration_.model.map_id;
  track_->add(estimate);
}

void RobotPlace::take(const PoseStamped& pose) {
  const auto& known = configuration_.scenario.pose;
  if (!known) return;
  PoseEstimate estimate;
  estimate.stamp = pose.stamp;
  estimate.T_map_base = pose.T_map_base;
  estimate.covariance.diagonal().head<3>().setConstant(known->position_sigma * known->position_sigma);
  estimate.covariance.diagonal().tail<3>().setConstant(known->yaw_sigma * known->yaw_sigma);
  estimate.map_id = configuration_.model.map_id;
  estimate.state = SlamState::tracking;
  track_->add(estimate);
}

std::optional<Transform<Map, Base>> RobotPlace::base_at(SensorTime t) const {
  const auto pose = track_->at(t);
  return pose ? std::optional(pose->T_map_base) : std::nullopt;
}

std::optional<Transform<Map, Laser>> RobotPlace::laser_at(SensorTime t) const {
  const auto pose = track_->at(t);
  if (!pose || !robot_.laser) return std::nullopt;
  return pose->T_map_base * robot_.laser->T_base_laser;
}

void AgentPlaces::take(const WorldMessage& world) {
  std::swap(worlds_[0], worlds_[1]);
  worlds_[1] = world;
}

std::optional<Transform<Map, Laser>> AgentPlaces::laser_at(const std::string& agent,
                                                           const Transform<Base, Laser>& T_base_laser,
                                                           SimulationTime t) const {
  const WorldMessage::Entry* newer = first_body(worlds_[1], agent);
  if (newer == nullptr) return std::nullopt;
  Transform<Map, Base> T_map_base = simulation::base_of(newer->T_map_body);
  const WorldMessage::Entry* older = first_body(worlds_[0], agent);
  const double between = (worlds_[1].stamp - worlds_[0].stamp).seconds();
  if (older != nullptr && older->epoch == newer->epoch && between > 0) {
    const double fraction = (t - SimulationTime{worlds_[0].stamp.ns}).seconds() / between;
    T_map_base =
        interpolate(simulation::base_of(older->T_map_body), T_map_base, std::clamp(fraction, 0.0, 2.0));
  }
  return T_map_base * T_base_laser;
}

}  // namespace parhelion::station
