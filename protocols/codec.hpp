// Decodes LCM bytes to structs and encodes them. Every decoder validates fingerprint, length, counts, finite
// numbers, ranges and stamps. Its Error names the channel, what was found and what was expected.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/agent.hpp"
#include "protocols/event.hpp"
#include "protocols/hazard.hpp"
#include "protocols/image.hpp"
#include "protocols/instructor_command.hpp"
#include "protocols/joints.hpp"
#include "protocols/operator_status.hpp"
#include "protocols/pose.hpp"
#include "protocols/scan.hpp"
#include "protocols/status.hpp"
#include "protocols/telemetry.hpp"
#include "protocols/twist_command.hpp"
#include "protocols/world.hpp"

namespace parhelion {

using Bytes = std::span<const std::uint8_t>;

/// After an Error the contents of the output are unspecified; its capacity is reused, so that decoding a scan
/// or an image does not allocate once it is large enough. Rejected in every type: a foreign fingerprint,
/// missing or surplus bytes (a signature may follow), inconsistent counts, numbers that are not finite
/// (unless noted), quaternions that are not of unit length, unknown enumerators, stamps outside 1970..2200.

/// NaN, infinities and negative ranges are valid sensor output and accepted. Rejected: no beam or more than
/// 100,000, a step of zero, a non-finite angle, or a number of intensities that is neither zero nor the
/// number of beams.
Status decode(std::string_view channel, Bytes bytes, Scan& scan);
/// Whether the bytes have the fingerprint of a scan (planar_lidar_t) and the length that its counts declare.
bool has_form_of_scan(Bytes bytes);
/// The utime at the beginning of every type; nullopt: too short, or outside 1970..2200.
std::optional<SensorTime> leading_stamp(Bytes bytes);
/// Sides 1..16384; raw formats: size = row_stride * height; depth: metadata "encoding" is raw, png or zlib.
Status decode(std::string_view channel, Bytes bytes, Image& image);
Status decode(std::string_view channel, Bytes bytes, Odometry& odometry);
Status decode(std::string_view channel, Bytes bytes, PoseEstimate& estimate);
Status decode(std::string_view channel, Bytes bytes, PoseStamped& pose);
Status decode(std::string_view channel, Bytes bytes, TwistCommand& command);
/// imu_t, and mbot_imu_t mapped to it. An orientation is a unit quaternion or absent.
Status decode(std::string_view channel, Bytes bytes, ImuSample& sample);
/// 1..256 joints with unique names; positions, velocities and efforts for all of them or for none.
Status decode(std::string_view channel, Bytes bytes, Joints& joints);
Status decode(std::string_view channel, Bytes bytes, AgentSpawn& command);
Status decode(std::string_view channel, Bytes bytes, AgentMove& command);
Status decode(std::string_view channel, Bytes bytes, AgentBehaviour& command);
Status decode(std::string_view channel, Bytes bytes, AgentRemove& command);
Status decode(std::string_view channel, Bytes bytes, AgentFreeze& command);
Status decode(std::string_view channel, Bytes bytes, DoorCommand& command);
Status decode(std::string_view channel, Bytes bytes, FaultCommand& command);
Status decode(std::string_view channel, Bytes bytes, CameraRate& command);
Status decode(std::string_view channel, Bytes bytes, ObjectReport& command);
Status decode(std::string_view channel, Bytes bytes, ScriptStart& command);
Status decode(std::string_view channel, Bytes bytes, TrainingStart& command);
Status decode(std::string_view channel, Bytes bytes, EmergencyStopCommand& command);
/// Decodes the type that `command` already holds. After an Error it holds the stamp and request if they were
/// read, for the reply.
Status decode(std::string_view channel, Bytes bytes, InstructorCommand& command);
Status decode(std::string_view channel, Bytes bytes, OperatorStatus& status);
Status decode(std::string_view channel, Bytes bytes, Event& event);
Status decode(std::string_view channel, Bytes bytes, SessionHeader& header);
Status decode(std::string_view channel, Bytes bytes, ScanInfo& info);
Status decode(std::string_view channel, Bytes bytes, LoopDecision& decision);
Status decode(std::string_view channel, Bytes bytes, ServerStatus& status);
Status decode(std::string_view channel, Bytes bytes, ModelVersion& model);
/// At most 16 values, none negative.
Status decode(std::string_view channel, Bytes bytes, HazardReading& reading);

/// ROBOT: utime and YAML.
struct RobotMessage {
  SensorTime stamp;
  std::string yaml;
};
Status decode(std::string_view channel, Bytes bytes, RobotMessage& message);

/// MR_WORLD on the wire: with names instead of ids, so that a reader needs no other message.
struct WorldMessage {
  struct Entry {
    std::string entity, part;
    AgentKind kind = AgentKind::box;
    BodyOwner owner = BodyOwner::agent;
    bool attitude_known = true;  ///< see BodyState
    std::uint32_t epoch = 0;
    Transform<Map, Body> T_map_body;
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
    Eigen::Vector3d rotation_rate = Eigen::Vector3d::Zero();
  };
  /// What is known of a real person beside the body's pose and velocity.
  struct Person {
    std::string entity;
    double radius = 0;                                     ///< m, of a disc around what was seen
    Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();  ///< m^2, map: of the position at the stamp
    SimulationTime seen;  ///< instant of the last scan that showed the person
  };
  SensorTime stamp;  ///< simulation time of the poses, on the server's clock
  std::uint64_t step = 0;
  std::string robot;  ///< name of the trainee's robot; it has bodies only while its pose is known
  std::vector<Entry> bodies;
  std::vector<Person> persons;  ///< one for each body of a real person
};
Status decode(std::string_view channel, Bytes bytes, WorldMessage& world);

/// Encoders write into `bytes` (resized; no allocation once it is large enough).
void encode(const Scan& scan, std::vector<std::uint8_t>& bytes);
void encode(const Image& image, std::vector<std::uint8_t>& bytes);
void encode(const Odometry& odometry, std::vector<std::uint8_t>& bytes);
void encode(const PoseEstimate& estimate, std::vector<std::uint8_t>& bytes);
void encode(const PoseStamped& pose, std::vector<std::uint8_t>& bytes);
void encode(const TwistCommand& command, std::vector<std::uint8_t>& bytes);
void encode(const ImuSample& sample, std::vector<std::uint8_t>& bytes);
void encode(const Joints& joints, std::vector<std::uint8_t>& bytes);
void encode(const AgentSpawn& command, std::vector<std::uint8_t>& bytes);
void encode(const AgentMove& command, std::vector<std::uint8_t>& bytes);
void encode(const AgentBehaviour& command, std::vector<std::uint8_t>& bytes);
void encode(const AgentRemove& command, std::vector<std::uint8_t>& bytes);
void encode(const AgentFreeze& command, std::vector<std::uint8_t>& bytes);
void encode(const DoorCommand& command, std::vector<std::uint8_t>& bytes);
void encode(const FaultCommand& command, std::vector<std::uint8_t>& bytes);
void encode(const CameraRate& command, std::vector<std::uint8_t>& bytes);
void encode(const ObjectReport& command, std::vector<std::uint8_t>& bytes);
void encode(const ScriptStart& command, std::vector<std::uint8_t>& bytes);
void encode(const TrainingStart& command, std::vector<std::uint8_t>& bytes);
void encode(const EmergencyStopCommand& command, std::vector<std::uint8_t>& bytes);
void encode(const InstructorCommand& command, std::vector<std::uint8_t>& bytes);
void encode(const OperatorStatus& status, std::vector<std::uint8_t>& bytes);
void encode(const Event& event, std::vector<std::uint8_t>& bytes);
void encode(const SessionHeader& header, std::vector<std::uint8_t>& bytes);
void encode(const ScanInfo& info, std::vector<std::uint8_t>& bytes);
void encode(const LoopDecision& decision, std::vector<std::uint8_t>& bytes);
void encode(const ServerStatus& status, std::vector<std::uint8_t>& bytes);
void encode(const ModelVersion& model, std::vector<std::uint8_t>& bytes);
void encode(const HazardReading& reading, std::vector<std::uint8_t>& bytes);
void encode(const RobotMessage& message, std::vector<std::uint8_t>& bytes);
void encode(const WorldMessage& world, std::vector<std::uint8_t>& bytes);

/// Name of the wire type by its fingerprint: "planar_lidar_t"; the fingerprint in hex where unknown, "none"
/// below 8 bytes.
std::string type_name(Bytes bytes);

/// One line of text for `topic echo`: decodes by fingerprint; for unknown types it gives fingerprint and
/// size.
std::string describe(std::string_view channel, Bytes bytes);

}  // namespace parhelion
