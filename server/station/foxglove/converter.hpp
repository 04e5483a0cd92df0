// Converts a session, message by message, to Foxglove's channels: for an MCAP file and for the Foxglove
// WebSocket.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/bus/bus.hpp"
#include "server/station/foxglove/mesh_scene.hpp"
#include "server/station/foxglove/messages.hpp"
#include "server/station/foxglove/scene.hpp"
#include "server/tick/configuration.hpp"

namespace parhelion::station::foxglove {

/// One topic; its messages are JSON.
struct Channel {
  std::uint16_t id = 0;  ///< from 1, in the order of their first message
  std::string topic;     ///< "/mr_scan"
  std::string schema;    ///< "foxglove.LaserScan", a name for schema_text()
  bool keeps = false;    ///< rare and complete: a client that connects later needs the last message
};

struct Converted {
  const Channel& channel;
  ArrivalTime arrival;  ///< of the source message
  std::int64_t stamp;   ///< ns, the message's own time field
  std::string_view json;
};

/// Frames: `map`, `base_link` (the trainee's robot), `laser`, `camera_optical`, `depth_optical`, and an
/// agent's name, `<name>/laser` and `<name>/camera_optical` (without a transform), and `<name>/<part>` of
/// bodies that are meshes. Stamps are those of the
/// source messages: a sensor message has the sensor's stamp.
class Converter {
 public:
  /// `send` gets each message; its text is valid until it returns. `wanted`: true if a channel with `keeps`
  /// false has a subscriber; empty: always.
  explicit Converter(std::function<void(const Converted&)> send,
                     std::function<bool(const Channel&)> wanted = {});

  /// Same effect as MR_SESSION, for a client that joins a bus after it was sent.
  void begin(const tick::Configuration& configuration, ArrivalTime arrival);
  /// Messages before MR_SESSION are skipped, and so are those without a Foxglove counterpart. Error: the
  /// message cannot be decoded.
  Status take(const Message& message);

  bool begun() const { return configuration_.has_value(); }
  /// One line for each kind of content that could not be shown, without repetition.
  const std::vector<std::string>& omissions() const { return omissions_; }

 private:
  using Handler = Status (Converter::*)(const Message&);

  void listen(const char* canonical, Handler handler);
  const Channel& channel(std::string_view topic, const char* schema, bool keeps = false);
  bool wanted(const Channel& channel) const { return channel.keeps || !wanted_ || wanted_(channel); }
  void send(const Channel& channel, const Message& message, std::int64_t stamp);
  void omit(const std::string& what);

  Status session(const Message& message);
  Status scan(const Message& message);
  Status injected_scan(const Message& message);
  Status scan_info(const Message& message);
  Status agent_scan(const Message& message, const std::string& agent);
  Status estimate(const Message& message);
  Status plain_pose(const Message& message);
  Status world(const Message& message);
  Status camera(const Message& message) { return image("/camera", "camera_optical", message); }
  Status injected_camera(const Message& message) { return image("/mr_camera", "camera_optical", message); }
  Status depth(const Message& message) { return depth_image("/depth/image", message); }
  Status injected_depth(const Message& message) { return depth_image("/mr_depth/image", message); }
  Status asked(const Message& message) { return twist("/teleop", message); }
  Status given(const Message& message) { return twist("/mr_cmd", message); }
  Status joint_state(const Message& message);
  Status event(const Message& message);
  Status agent_spawn(const Message& message);
  Status model(const Message& message);
  Status server_status(const Message& message);

  Status image(const std::string& camera, const std::string& frame, const Message& message);
  Status depth_image(const char* topic, const Message& message);
  Status twist(const char* topic, const Message& message);
  void moved(const Message& message, std::int64_t stamp, const Eigen::Isometry3d& T_map_base);
  void virtual_returns(const Message& message);
  void mounts(const Message& message, std::int64_t stamp);
  void meshes(const Message& message, std::int64_t stamp);
  void building(const SemanticModel& model, const Message& message);

  std::function<void(const Converted&)> send_;
  std::function<bool(const Channel&)> wanted_;
  std::map<std::string, Handler, std::less<>> handlers_;
  std::deque<Channel> channels_;  ///< addresses stay valid
  std::map<std::string, const Channel*, std::less<>> by_topic_;
  std::optional<tick::Configuration> configuration_;
  std::optional<simulation::EntityShapes> shapes_;
  WorldScene world_scene_;
  MeshScene mesh_scene_;
  std::map<std::string, LaserDescription> presets_;  ///< of agents' lasers, by name
  std::map<std::string, double> joints_;             ///< rad or m
  std::optional<ArrivalTime> mounts_sent_, world_sent_;
  bool mounts_changed_ = false;
  Scan scan_, pending_scan_;
  ScanInfo pending_info_;
  Image image_;
  WorldMessage world_;
  JsonText json_;
  std::vector<std::string> omissions_;
};

}  // namespace parhelion::station::foxglove
