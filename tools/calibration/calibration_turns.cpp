#include "tools/calibration/calibration_turns.hpp"

#include <cmath>

#include "protocols/bus/log_file.hpp"
#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "tools/calibration/calibration_log.hpp"
#include "tools/calibration/image_turns.hpp"

namespace parhelion::tools {
namespace {

void calibrate(const std::vector<pose::LaserPose>& laser, const pose::TurnPath& path, TurnSensor& sensor) {
  auto found = pose::calibrate_turns(laser, path, {sensor.name, sensor.before, sensor.has_bias});
  if (!found) {
    sensor.note = found.error().message;
    return;
  }
  sensor.found = std::move(*found);
}

}  // namespace

TurnSensor calibrate_imu(const RecordedDrive& drive, const RobotDescription& robot,
                         const std::vector<pose::LaserPose>& laser) {
  TurnSensor sensor{"IMU", robot.imu ? robot.imu->time_offset : 0, {}, {}, true};
  if (drive.inertial.empty()) {
    if (robot.imu) sensor.note = "the log has no sample of the IMU";
  } else if (!robot.imu) {
    sensor.note = "the robot description has no 'imu': its mounting is unknown";
  } else {
    calibrate(laser, pose::TurnPath(drive.inertial, *robot.imu), sensor);
  }
  return sensor;
}

TurnSensor calibrate_camera(const CalibrationOptions& options, const RobotDescription& robot,
                            std::size_t images, const std::vector<pose::LaserPose>& laser,
                            const CalibrationProgress& progress) {
  TurnSensor sensor{"camera", robot.camera ? robot.camera->time_offset : 0, {}, {}, false};
  const auto without = [&sensor](std::string why) {
    sensor.note = std::move(why);
    return sensor;
  };
  if (images == 0) return without(robot.camera ? "the log has no image of the camera" : "");
  if (!robot.camera) return without("the robot description has no 'camera': its lens is unknown");
  if (laser.empty()) return without("no scan has a pose");
  auto turns = ImageTurns::create(*robot.camera);
  if (!turns) return without(turns.error().message);
  auto reader = LogReader::open(options.input.string());
  if (!reader) return without(reader.error().message);
  const SensorTime from = laser.front().stamp - seconds(2), to = laser.back().stamp + seconds(2);
  for (;;) {
    const auto event = reader->next();
    if (!event) continue;
    if (!event->has_value()) break;
    if (progress) progress(static_cast<double>(reader->offset()), static_cast<double>(reader->size()));
    Image image;
    if ((*event)->channel != options.camera_channel ||
        !decode((*event)->channel, (*event)->payload, image).ok() || image.stamp < from || image.stamp > to)
      continue;
    turns->add(image);
  }
  calibrate(laser, pose::TurnPath(turns->turns()), sensor);
  const ImageTurnCounts& counts = turns->counts();
  if (!sensor.found && counts.images > 0 && 2 * (counts.refused + counts.unmatched) > counts.images) {
    sensor.note += " (of " + std::to_string(counts.images) + " images " + std::to_string(counts.refused) +
                   " cannot be used and " + std::to_string(counts.unmatched) + " show too little)";
  }
  return sensor;
}

void add_offset_error(double sigma, TurnSensor& sensor) {
  if (sensor.found) sensor.found->time_offset.sigma = std::hypot(sensor.found->time_offset.sigma, sigma);
}

RobotDescription with_time_offsets(RobotDescription robot, const TurnSensor& imu, const TurnSensor& camera) {
  if (robot.imu && imu.found && imu.found->time_offset.shown)
    robot.imu->time_offset = imu.found->time_offset.value;
  if (robot.camera && camera.found && camera.found->time_offset.shown)
    robot.camera->time_offset = camera.found->time_offset.value;
  return robot;
}

}  // namespace parhelion::tools
