// A session log written message by message, with known content and of any length, without a simulation.
#pragma once

#include <gtest/gtest.h>

#include "render/jpeg.hpp"
#include "tests/server/tick/synthetic.hpp"

namespace parhelion::test {

struct WrittenSession {
  double seconds = 20;
  int agents = 2;
  std::string scenario = "lesson", task = "into the hall", rule = "touched a thing", text = "beside the door";
  bool training = true, pictures = true, end = true;
  std::vector<double> touches = {4, 6.5, 6.7, 12};  ///< s, of barrel_1
  int picture_width = 160;                          ///< pixels; three quarters as high
  double scan_rate = 10;                            ///< Hz
  bool injected = true;                             ///< barrel_1 is in every scan
  double broken_scan = -1;                          ///< s, time of a truncated scan; negative: none

  tick::Configuration configuration() const {
    Scenario made;
    made.name = scenario;
    for (int i = 1; i <= agents; ++i)
      made.agents.push_back(agent((i == 1 ? "barrel_" : "person_") + std::to_string(i),
                                  i == 1 ? AgentKind::barrel : AgentKind::person, 0, 0.5 * i - 2));
    Zone hall;
    hall.name = "hall";
    hall.outline = {{-1, 0.5}, {1, 0.5}, {1, 2}, {-1, 2}};
    made.zones = {hall};
    if (training) {
      Training& lesson = made.training.emplace();
      lesson.on_command = false;
      lesson.text = "Once round, and into the hall.";
      lesson.pass_mark = 0.5;
      lesson.grades = {{"A", 0.9}, {"B", 0.5}};
      Task reach, never;
      reach.name = task;
      reach.points = 60;
      reach.required = true;
      reach.done.kind = Condition::Kind::reach;
      reach.done.target = "hall";
      never.name = "never";
      never.points = 40;
      never.done.event = EventKind::fell;
      lesson.tasks = {reach, never};
      Penalty touch;
      touch.name = rule;
      touch.points = 3;
      touch.per_impulse = 0.5;
      touch.when.event = EventKind::contact_started;
      lesson.penalties = {touch};
    }
    return *tick::configure(made, robot(), room());
  }

  void write(const std::filesystem::path& path) const {
    auto opened = LogWriter::create(path.string(), true);
    ASSERT_TRUE(opened.ok());
    LogWriter& log = *opened;
    const auto put = [&](const char* channel, double t, const auto& item) {
      const Message made = message(channel, us(t), item);
      ASSERT_TRUE(log.write(made.channel, made.arrival, made.payload).ok());
    };
    const tick::Configuration session = configuration();
    put(channel::kMrSession, 0, tick::session_header(session, SensorTime::from_utime(us(0))));
    std::vector<Image> film;
    for (int i = 0; pictures && i < 7; ++i) film.push_back(picture(i));
    Scan scan = scan_at(1);
    std::size_t touched = 0;
    const int steps = static_cast<int>(seconds * 30);
    for (int i = 1; i <= steps; ++i) {
      const double t = i / 30.0;
      for (; touched < touches.size() && touches[touched] <= t; ++touched)
        put(channel::kMrEvents, t, touch(touches[touched]));
      if (i == 90) put(channel::kMrEvents, t, event(t, EventKind::zone_entered, "hall"));
      put(channel::kMrWorld, t, world(t, static_cast<std::uint64_t>(i)));
      if (i % 2 == 0) {
        put(channel::kTeleop, t + 0.01, TwistCommand{SensorTime::from_utime(us(t)), {0.3, 0, 0.15}});
        const double fraction = i % 60 < 10 ? 0.5 : 1;
        put(channel::kMrCmd, t + 0.01,
            TwistCommand{SensorTime::from_utime(us(t)), {fraction * 0.3, 0, fraction * 0.15}});
        if (pictures) {
          Image& image = film[static_cast<std::size_t>(i / 2) % film.size()];
          image.stamp = SensorTime::from_utime(us(t));
          put(channel::kMrCamera, t + 0.02, image);
        }
      }
      if (static_cast<int>(t * scan_rate) != static_cast<int>((t - 1 / 30.0) * scan_rate)) {
        scan.stamp = SensorTime::from_utime(us(t));
        if (broken_scan >= 0 && t >= broken_scan && t < broken_scan + 1 / scan_rate) {
          for (const char* name : {channel::kScan, channel::kMrScan}) {
            Message half = message(name, us(t), scan);
            half.payload.resize(half.payload.size() / 2);
            ASSERT_TRUE(log.write(half.channel, half.arrival, half.payload).ok());
          }
        }
        put(channel::kScan, t + 0.005 + (i % 90 == 0 ? 0.08 : 0), scan);
        put(channel::kMrScan, t + 0.006, scan);
        ScanInfo info{scan.stamp, true, "", 0.01, {"barrel_1"}, {}};
        info.beam_agent.assign(scan.ranges.size(), -1);
        if (injected) info.beam_agent[info.beam_agent.size() / 2] = 0;
        put(channel::kMrScanInfo, t + 0.006, info);
      }
    }
    if (end)
      put(channel::kLoop, seconds,
          LoopDecision{SensorTime::from_utime(us(seconds)), LoopDecision::Kind::ended, 0});
  }

 private:
  static std::int64_t us(double t) { return kStartUs + static_cast<std::int64_t>(t * 1e6); }
  Event event(double t, EventKind kind, const std::string& object) const {
    Event made;
    made.stamp = SimulationTime::from_utime(us(t));
    made.kind = kind;
    made.subject = robot().name;
    made.object = object;
    made.position = pose_at(t).translation();
    made.text = text;
    return made;
  }
  Event touch(double t) const {
    Event made = event(t, EventKind::contact_started, "barrel_1");
    made.pair = PairKind::real_virtual;
    made.impulse = 4;
    return made;
  }
  WorldMessage world(double t, std::uint64_t step) const {
    WorldMessage made;
    made.stamp = SensorTime::from_utime(us(t));
    made.step = step;
    made.robot = robot().name;
    WorldMessage::Entry own;
    own.entity = robot().name;
    own.part = "base";
    own.owner = BodyOwner::real_robot;
    const Transform<Map, Base> pose = pose_at(t);
    const Eigen::AngleAxisd nod(-0.05 * std::sin(t), Eigen::Vector3d::UnitY());
    own.T_map_body = Transform<Map, Body>(Eigen::Quaterniond(pose.rotation() * nod), pose.translation());
    own.velocity = pose.rotation() * Eigen::Vector3d(0.2356, 0, 0);
    made.bodies = {own};
    for (int i = 1; i <= agents; ++i) {
      WorldMessage::Entry other;
      other.entity = (i == 1 ? "barrel_" : "person_") + std::to_string(i);
      other.part = "body";
      other.kind = i == 1 ? AgentKind::barrel : AgentKind::person;
      other.T_map_body = Transform<Map, Body>::planar(i == 1 ? 0 : std::sin(0.2 * t), 0.5 * i - 2, 0);
      made.bodies.push_back(other);
    }
    return made;
  }
  /// Consecutive pictures differ.
  Image picture(int number) const {
    Image image;
    image.width = picture_width;
    image.height = picture_width * 3 / 4;
    std::vector<std::uint8_t> bgr;
    for (int y = 0; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x)
        for (const int c : {x * 255 / image.width, y * 255 / image.height, (x / 8 + y / 8 + number) % 7 * 30})
          bgr.push_back(static_cast<std::uint8_t>(c));
    render::JpegCodec codec;
    image.bytes = *codec.encode(bgr, {image.width, image.height, 85, {}});
    return image;
  }
};

}  // namespace parhelion::test
