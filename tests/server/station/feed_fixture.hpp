// A feed in the synthetic room with a receiving page. The test controls bus and clock.
#pragma once

#include "server/station/state_feed.hpp"
#include "tests/server/station/listening_client.hpp"
#include "tests/server/tick/synthetic.hpp"

namespace parhelion::test {

class FeedTest : public testing::Test {
 protected:
  void start(const tick::Configuration& configuration, bool recorded = false) {
    station::FeedOptions options;
    options.hello_fields.recorded = recorded;
    options.clock = [this] { return ArrivalTime::from_utime(kStartUs) + seconds(t_); };
    feed_ = std::make_unique<station::StateFeed>(std::make_shared<const tick::Configuration>(configuration),
                                                 options);
    SessionHeader header;
    header.stamp = SensorTime::from_utime(kStartUs);
    take(channel::kMrSession, header);
  }
  std::shared_ptr<ListeningClient> open(std::uint64_t id = 1, station::Role role = station::Role::instructor,
                                        const std::string& name = "ada") {
    auto client = std::make_shared<ListeningClient>(id, role, name);
    feed_->open(client);
    return client;
  }
  WallTime now() const { return WallTime{1'000'000'000'000} + seconds(t_); }
  void take(const std::string& channel, const auto& item) {
    feed_->take(message(channel, kStartUs, item), now());
  }
  void pass(double s) {
    t_ += s;
    feed_->look(now());
  }
  SensorTime sensor_time() const { return SensorTime::from_utime(kStartUs) + seconds(t_); }
  SimulationTime at(double t) const { return SimulationTime{kStartUs * 1000} + seconds(t); }

  void report_event(EventKind kind, const std::string& subject, const std::string& object = {},
                    double value = 0) {
    Event event;
    event.stamp = at(t_);
    event.kind = kind;
    event.subject = subject;
    event.object = object;
    event.value = value;
    take(channel::kMrEvents, event);
  }
  static WorldMessage::Entry body(const std::string& entity, const std::string& part, AgentKind kind,
                                  double x, BodyOwner owner = BodyOwner::agent) {
    WorldMessage::Entry entry;
    entry.entity = entity;
    entry.part = part;
    entry.kind = kind;
    entry.owner = owner;
    entry.T_map_body = Transform<Map, Body>::planar(x, 0, 0);
    return entry;
  }
  void kWorld(std::vector<WorldMessage::Entry> bodies) {
    WorldMessage message;
    message.stamp = sensor_time();
    message.bodies = std::move(bodies);
    take(channel::kMrWorld, message);
  }

  double t_ = 0;  // s of the session
  std::unique_ptr<station::StateFeed> feed_;
};

}  // namespace parhelion::test
