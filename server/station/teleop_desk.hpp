// /ws/teleop: pages drive robots, each robot by one operator at a time, and stop them. What can move a robot
// fails to a stop: a page that is silent, late, gone, malformed or replaced has let go.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/bus/bus.hpp"
#include "protocols/event.hpp"
#include "protocols/instructor_command.hpp"
#include "server/station/http/web_client.hpp"
#include "server/station/teleop_page.hpp"
#include "server/station/teleop_words.hpp"

namespace parhelion::station {

struct TeleopOptions {
  std::function<WallTime()> now;      ///< steady
  std::function<SensorTime()> stamp;  ///< what messages on the bus say: the wall clock
  /// Who did what. These two may be empty, and are called with the desk locked: they must not call it.
  std::function<void(const std::string& who, const std::string& what)> audit;
  std::function<void(const std::vector<EmergencyStop>&)> stops_changed;
  std::string emergency_stops = channel::mr_emergency_stop;  ///< channel on the bus
  std::string robot = {};                ///< the trainee's, that others may stop and let go, too; empty: none
  std::vector<EmergencyStop> held = {};  ///< from the start: of a server that died
};

/// Thread-safe: the web server's thread brings what pages say, the station's the rest. If one of them hangs,
/// the other still stops the robots, and if both do, the tick after 0.5 s of silence.
class TeleopDesk {
 public:
  /// `bus` is only published on, and outlives the desk.
  TeleopDesk(Bus& bus, TeleopOptions options);
  /// Stops what is driven.
  ~TeleopDesk();
  TeleopDesk(const TeleopDesk&) = delete;
  TeleopDesk& operator=(const TeleopDesk&) = delete;

  /// The desk outlives its server.
  SocketHandler socket();

  /// Those that exist now. Whoever drives one that is gone has let go.
  void set_robots(std::vector<TeleopRobot> robots);
  /// What a console says on the bus: other consoles drive, too.
  void hear(const OperatorWord& word);
  /// What anybody asks of the server: other consoles stop the robot and take stops back, too.
  void hear(const EmergencyStopCommand& command);
  /// What the server answers: an emergency stop is asked for until it is.
  void hear(const Event& event);
  /// At least every 50 ms: releases what fell silent, repeats stops, says who drives.
  void turn();

  /// Holds until reset(): the server is asked to stop the robot, whoever drives it, nothing that a page
  /// asks of it goes out, and stops are said until the server has answered. `robot` empty: all. Twice does no
  /// harm. Error: no such robot, or the bus.
  Status stop(const std::string& robot, const std::string& by);
  /// `robot` empty: all. Whether `by` may is for the caller to see to. Nothing moves before the dead-man was
  /// let go.
  Status reset(const std::string& robot, const std::string& by);
  std::vector<EmergencyStop> stops() const;
  std::vector<Driving> driving() const;

 private:
  /// An emergency stop, or its reset, that the server is told of until it answers.
  struct Order {
    bool stop = true;
    std::uint64_t request = 0;
    WallTime said;
    int times = 0;
    bool answered = false;
  };
  struct Foreign {
    std::string robot;
    WallTime heard;
  };

  void opened(std::shared_ptr<WebClient> client);
  void received(WebClient& client, std::string_view bytes, bool binary);
  void closed(WebClient& client);

  Status act(TeleopPage& page, const TeleopRequest& request);
  Status drive(TeleopPage& page, const std::string& robot);
  Status move(TeleopPage& page, const TeleopRequest& request);
  void answer_ping(TeleopPage& page, const TeleopRequest& request);
  Status hold(const std::string& robot, const std::string& by);
  void obey(const EmergencyStopCommand& command);
  Status say_stop(const TeleopRobot& robot);
  Status say_order(const std::string& robot, Order& order);
  void repeat_orders(WallTime now);
  std::uint64_t next_request();
  void refuse(TeleopPage& page, const Status& why);
  void let_go(TeleopPage& page, bool lost, const std::string& why);
  /// The page that has to let go so that `page` may drive, or nullptr. Error: it may not.
  Result<TeleopPage*> page_to_replace(const TeleopPage& page, const std::string& robot) const;
  const TeleopRobot* find(const std::string& robot) const;
  void tell_all(const std::string& text);
  /// `silent`: its page fell silent, and may take it again.
  void tell_driven(const std::string& robot, bool silent = false);
  void audit(const std::string& who, const std::string& what) const;
  TeleopInstant now() const { return {options_.now(), options_.stamp()}; }
  std::vector<EmergencyStop> held() const;

  Bus& bus_;
  const TeleopOptions options_;
  mutable std::mutex mutex_;
  std::vector<TeleopRobot> robots_;
  std::map<std::uint64_t, std::unique_ptr<TeleopPage>> pages_;  // by client
  std::map<std::string, std::string> held_;                     // by robot: who has stopped it
  std::map<std::string, Order> orders_;                         // by robot: the last
  std::map<std::uint64_t, EmergencyStopCommand> others_;        // orders of other consoles, by request
  std::set<std::uint64_t> own_;                                 // our own newest requests
  std::uint64_t requests_ = 0;
  std::map<std::string, Foreign> foreign_;  // by operator: other consoles that drive
  std::vector<std::uint8_t> payload_;
};

}  // namespace parhelion::station
