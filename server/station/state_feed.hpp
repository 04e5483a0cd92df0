// The session for pages: decodes each bus message once, encodes it once, and sends it to each page at its
// rate.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "protocols/bus/bus.hpp"
#include "server/simulation/entity_shapes.hpp"
#include "server/station/audience.hpp"
#include "server/station/feed_json.hpp"
#include "server/station/placed_agents.hpp"
#include "server/station/robot_feed.hpp"
#include "server/station/site_json.hpp"
#include "server/tick/configuration.hpp"
#include "server/tick/operator_admission.hpp"

namespace parhelion::station {

/// An operator whom pages list: the newest status, and when the first one and that came.
struct ShownOperator {
  OperatorStatus status;
  WallTime first, last;
  bool is_repeated() const { return last - first >= tick::SeenNames::kRepeat; }
};

struct FeedOptions {
  HelloFields hello_fields;  ///< everything except the instants
  /// The server's clock (live: wall time; recording: time of the playback), for the age of sensors.
  std::function<ArrivalTime()> clock;
  std::function<ControlState()> control;  ///< may be empty
  std::function<bool()> stopped;          ///< an emergency stop is active; may be empty
};

/// Not thread-safe: used by the station's worker only.
class StateFeed {
 public:
  StateFeed(std::shared_ptr<const tick::Configuration> configuration, FeedOptions options);

  /// Channels to subscribe to, with their queue lengths.
  std::vector<std::pair<std::string, int>> channels() const;
  void take(const Message& message, WallTime now);
  /// Pages get the reason until the next message arrives.
  void bus_failed(const std::string& why) { bus_error_ = why; }
  /// Periodic work: rates, ages, remaining times. At least 20 times a second. `now`: steady clock, as above.
  void look(WallTime now);

  /// Sends the current state to the new page.
  void open(std::shared_ptr<WebClient> client);
  void close(std::uint64_t client) { audience_.subscribers().close(client); }
  void subscribe(std::uint64_t client, const Subscription& wanted);
  Subscribers& subscribers() { return audience_.subscribers(); }
  Audience& audience() { return audience_; }

  SimulationTime begun() const { return start(); }  ///< epoch: no session yet
  double t(SimulationTime instant) const { return (instant - start()).seconds(); }
  ControlState control() const;
  SimulationTime now() const { return simulation_time(options_.clock()); }
  bool recorded() const { return options_.hello_fields.recorded; }
  const ServerStatus& status() const { return status_; }
  const HelloFields& hello_fields() const { return options_.hello_fields; }
  const PlacedAgents& placed() const { return placed_; }
  /// Names of the agents in the newest MR_WORLD, without the trainee's robot.
  std::vector<std::string> present_agents();
  const tick::Configuration& configuration() const { return *configuration_; }
  /// Of the newest MR_WORLD; none: no such entity.
  std::optional<Transform<Map, Base>> place_of(const std::string& entity);
  /// Passes events to the instructor service, which waits for replies to its commands.
  std::function<void(const Event&)> event_received;
  /// A new version of the building: JSON for HTTP clients.
  std::function<void(std::string json, std::uint64_t version)> model_changed;
  /// MR_SESSION arrived: earlier messages belong to another session.
  std::function<void()> restarted;

 private:
  enum class Kind : std::uint8_t {
    none,
    session,
    world,
    event,
    scan,
    mr_scan,
    scan_info,
    further_scan_info,  ///< of a laser after the first, which pages do not draw
    odometry,
    pose_cov,
    pose,
    status,
    operators,
    joints,
    hazard,
    model,
    command,
    agent_scan,
    depth,
    picture,
    watched
  };
  struct Channel {
    Kind kind = Kind::none;
    std::string canonical;
    int capacity = 1;
    std::size_t robot = 0;  ///< whose it is; 0 for those of the session
  };
  void add_further_sensors(std::size_t robot);
  void add(const char* canonical, Kind kind, int capacity, std::optional<SensorWatch::Clock> watched);
  void record(const Channel& channel, SensorTime stamp);

  SimulationTime start() const { return start_.value_or(SimulationTime{}); }
  void note_start(SimulationTime at);
  void restart(SimulationTime at);
  void handle_world(const Message& message, WallTime now);
  bool read_world();
  void handle_event(const Message& message);
  void handle_scan(const Message& message, std::size_t robot, ScanFrame::Source source);
  void handle_scan_info(const Message& message, std::size_t robot);
  void handle_further_scan_info(const Message& message, std::size_t robot);
  void handle_picture(std::size_t robot, WallTime now);
  void look_from_agents(WallTime now);
  void handle_agent_scan(const Message& message);
  void handle_operator(const Message& message, WallTime now);
  void handle_model(const Message& message);
  void handle_depth(const Message& message, std::size_t robot, WallTime now);
  void send_world(WallTime now);
  void send_augmented_scan(std::size_t robot, const ScanInfo* info);
  /// The entity that each beam hit, as numbers in the table of a page's view.
  using EntitiesIn = std::function<std::vector<std::int16_t>(const View& view)>;
  void send_scan(std::size_t robot, const Scan& scan, ScanFrame frame, int slot,
                 const EntitiesIn& entities = {});
  void greet_about_robot(const Subscriber& subscriber);
  void place(Subscriber& subscriber);
  void look_at_robot(std::size_t robot, bool second, bool half);
  void send_readings(std::size_t robot);
  void send_plans();
  void send_people();
  void greet(Subscriber& subscriber);
  std::string hello(const Identity& who) const;
  std::string entities(const View& view) const;
  std::string status_text(const RobotFeed& robot, const View& view) const;
  std::string robots_text(const View& view) const;
  std::string zones_text(const View& view) const;
  std::string events_text(const std::vector<Event>& events, const View& view) const;
  std::string plans_text(const View& view) const;
  std::string operators_text(const View& view) const;
  std::string injection_text(const RobotFeed& robot, const View& view) const;
  void update(View& view, WallTime now);
  void forget_silent_operators(WallTime now);
  bool make_room_for(const std::string& operator_on_bus, WallTime now);
  void note_pages();
  void send_operators();

  std::shared_ptr<const tick::Configuration> configuration_;
  FeedOptions options_;
  std::unordered_map<std::string, Channel> channels_;  ///< by channel name on the bus
  std::optional<SimulationTime> start_;

  simulation::EntityShapes shapes_;
  runtime::Knowledge knowledge_;
  Audience audience_;
  PlacedAgents placed_;
  std::vector<RobotFeed> robots_;  ///< by index
  AgentPlaces agents_;

  Message world_message_;  ///< the newest MR_WORLD, decoded on demand
  bool world_unread_ = false;
  WorldMessage world_;
  std::deque<Event> events_;       ///< the last ones of the session
  std::vector<Event> new_events_;  ///< not sent yet
  Scan scan_;
  ServerStatus status_;
  std::string bus_error_;  ///< why the bus delivers nothing; empty: it works
  std::map<std::string, ShownOperator> operators_;
  std::set<std::string>
      page_operators_;  ///< names on the bus of those who have a page open, at the last look
  tick::SeenNames seen_names_;
  std::uint64_t model_version_ = 0;
  bool operators_changed_ = false;
  bool people_shown_ = false;
  WallTime second_, half_, quarter_, depth_due_, agents_look_;  ///< due times of periodic work
  WallTime looked_;                                             ///< steady clock of the last look()
  std::string sent_control_;
};

}  // namespace parhelion::station
