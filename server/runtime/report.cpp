#include "server/runtime/report.hpp"

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "protocols/channel_map.hpp"
#include "server/tick/grading_path.hpp"
#include "server/tick/state.hpp"

namespace parhelion::runtime {
namespace {

nlohmann::ordered_json percentiles(const tick::Percentiles& p) {
  return {
      {"count", p.count()}, {"p50", p.at(0.50)}, {"p90", p.at(0.90)}, {"p99", p.at(0.99)}, {"max", p.max()}};
}

std::uint64_t degraded_total(const tick::Tally& tally) {
  std::uint64_t total = 0;
  for (const std::uint64_t count : tally.scans_degraded) total += count;
  return total;
}

const char* advice_for(tick::Degraded why) {
  switch (why) {
    case tick::Degraded::pose:
      return "no pose of the robot, or none that is tracking; see `parhelion slam` and its --start";
    case tick::Degraded::error:
      return "predicted error above the limit; see `max_error` of the scenario, and the map that "
             "SLAM uses";
    case tick::Degraded::clock:
      return "stamps disagree with the robot's clock";
    case tick::Degraded::history:
      return "stamps older than the stored history, or ahead of it";
    case tick::Degraded::unreadable:
      return "messages that cannot be read as a scan";
    case tick::Degraded::guard:
      return "no result in time";
    case tick::Degraded::no_beam:
      return "no beam has a valid range; check whether the laser is covered or broken, and what its driver "
             "writes";
    case tick::Degraded::none:
    case tick::Degraded::fault:
      break;
  }
  return "an internal error of the server; its events have the text";
}

std::string scan_count(std::uint64_t count) {
  return std::to_string(count) + (count == 1 ? " scan" : " scans");
}

/// The most frequent reason of degraded scans as a line; empty: there are hardly any, as at the start of each
/// session.
std::string why_degraded(const tick::Tally& tally) {
  constexpr std::uint64_t few = 100;  // one scan of so many
  const auto& counts = tally.scans_degraded;
  const auto max_count = std::max_element(counts.begin(), counts.end());
  if (*max_count * few <= tally.scans_of_real_lasers) return {};
  const auto why = static_cast<tick::Degraded>(max_count - counts.begin());
  return "because " + scan_count(*max_count) + ": " + advice_for(why) + "\n";
}

/// Why none of the other scans shows an agent, as a line; empty: one does, or there are none. Nothing is
/// injected into the scans of a simulated laser: it measures the agents.
std::string why_no_agent(const tick::Tally& tally) {
  const std::uint64_t degraded = degraded_total(tally);
  if (tally.beams_replaced > 0 || tally.scans_of_real_lasers <= degraded) return {};
  if (tally.scans_without_agent >= tally.scans_of_real_lasers - degraded)
    return "because no agent was within the range of the laser\n";
  if (tally.scans_all_hidden > 0)
    return "because " + scan_count(tally.scans_all_hidden) +
           " hit agents only behind real obstacles; the others hit none\n";
  return "because no beam hit an agent: do agents stand where the laser sees, and do they reach its "
         "height?\n";
}

using Json = nlohmann::ordered_json;

Json scans_json(const tick::Tally& tally) {
  Json degraded = Json::object();
  for (std::size_t i = 1; i < tick::kDegradedKinds; ++i) {
    if (tally.scans_degraded[i] > 0)
      degraded[to_string(static_cast<tick::Degraded>(i))] = tally.scans_degraded[i];
  }
  return {{"in", tally.scans_in},
          {"out", tally.scans_out},
          {"degraded", degraded},
          {"not_in_log", tally.scans_left_out},
          {"foreign", tally.foreign_scans},
          {"matched", tally.scans_matched},
          {"not_matched", tally.scans_not_matched}};
}

Json latencies_json(const Report& report) {
  Json json = {{"scan", percentiles(report.scan_us)},
               {"scan_in_to_out", percentiles(report.scan_in_to_out_us)},
               {"frame", percentiles(report.frame_us)},
               {"physics_step", percentiles(report.physics_step_us)},
               {"physics_wait", percentiles(report.physics_wait_us)},
               {"slam", percentiles(report.tally.slam_us)}};
  if (report.tally.agent_frames_in > 0) json["agent_frame"] = percentiles(report.agent_frame_us);
  return json;
}

/// Of several robots, and of several lasers, each by its name.
void add_robots_and_lasers(const Report& report, Json& json) {
  for (const RobotReport& robot : report.robots) {
    json["robots"][robot.name] = {
        {"scans", {{"in", robot.scans_in}, {"degraded", robot.scans_degraded}}},
        {"guard_fired", robot.guard_fired},
        {"latency_us",
         {{"scan", percentiles(robot.scan_us)}, {"scan_in_to_out", percentiles(robot.scan_in_to_out_us)}}}};
  }
  for (const LaserReport& laser : report.lasers) {
    json["lasers"][robot_channel(laser.name, laser.robot)] = {
        {"scans", {{"in", laser.scans_in}, {"degraded", laser.scans_degraded}}},
        {"guard_fired", laser.guard_fired}};
  }
}

Json events_json(const tick::Tally& tally) {
  Json events = Json::object();
  for (std::size_t i = 0; i < tally.events.size(); ++i) {
    if (tally.events[i] > 0) events[to_string(static_cast<EventKind>(i))] = tally.events[i];
  }
  return events;
}

void add_grades(const Report& report, Json& json) {
  if (report.grade) {
    json["score"] = report.grade->grade.score;
    json["grade"] = Json::parse(to_json(*report.grade));
  }
  if (report.grades.size() > 1) {
    for (const GradedSession& each : report.grades) json["grades"][each.robot] = Json::parse(to_json(each));
  }
}

/// One kind of refused messages does not hide another: the newest eight, each with its count.
std::string refusals(const tick::Tally& tally) {
  constexpr std::size_t max_kinds = 8;
  std::string text;
  for (std::size_t i = 0; i < std::min(max_kinds, tally.refusals.size()); ++i) {
    const tick::Refusal& refusal = tally.refusals[tally.refusals.size() - 1 - i];
    text += (text.empty() ? "" : "; ") + std::to_string(refusal.count) + " x " + refusal.text;
  }
  return text;
}

/// Counts and times of the whole session, without those that it does not have.
std::string measured(const Report& report) {
  const tick::Tally& tally = report.tally;
  char line[512];
  std::snprintf(line, sizeof line, "scans   %llu in, %llu out, %llu degraded; %llu of %llu beams replaced\n",
                static_cast<unsigned long long>(tally.scans_in),
                static_cast<unsigned long long>(tally.scans_out),
                static_cast<unsigned long long>(degraded_total(tally)),
                static_cast<unsigned long long>(tally.beams_replaced),
                static_cast<unsigned long long>(tally.beams_total));
  std::string text = line;
  if (tally.frames_in > 0) {
    std::snprintf(line, sizeof line, "frames  %llu in, %llu out, %llu with virtual bodies, %llu dropped\n",
                  static_cast<unsigned long long>(tally.frames_in),
                  static_cast<unsigned long long>(tally.frames_out),
                  static_cast<unsigned long long>(tally.frames_composited),
                  static_cast<unsigned long long>(report.frames_dropped));
    text += line;
  }
  if (report.scan_us.count() > 0) {
    std::snprintf(line, sizeof line,
                  "scan    %.0f us median, %.0f us p99 (waiting for physics: %.0f us p99)\n",
                  report.scan_us.at(0.5), report.scan_us.at(0.99), report.physics_wait_us.at(0.99));
    text += line;
  }
  std::snprintf(line, sizeof line, "time    %.1f s of log in %.1f s: %.1f times real time\n",
                report.log_seconds, report.wall_seconds,
                report.wall_seconds > 0 ? report.log_seconds / report.wall_seconds : 0.0);
  return text + line;
}

}  // namespace

void StageClock::begin(std::size_t robot) {
  robot_ = robot;
  begun_ = last_ = waited_ = steady_now();
}

void StageClock::ended(tick::Stage stage) {
  const WallTime now = steady_now();
  switch (stage) {
    case tick::Stage::physics_step:
      physics_step_us.add((now - last_).microseconds());
      break;
    case tick::Stage::physics_wait:
      waited_ = now;
      break;
    case tick::Stage::encode:
      scan_us.add((now - waited_).microseconds());
      robots_scan_us[robot_].add((now - waited_).microseconds());
      physics_wait_us.add((waited_ - begun_).microseconds());
      break;
    default:
      break;
  }
  last_ = now;
}

void report_completeness(const Outbox& outbox, Report& report) {
  report.complete = outbox.complete() && report.tally.scans_left_out == 0;
  report.incomplete_because = outbox.log_error();
  if (report.tally.scans_left_out == 0) return;
  if (!report.incomplete_because.empty()) report.incomplete_because += "; ";
  report.incomplete_because +=
      std::to_string(report.tally.scans_left_out) +
      " scans were published unchanged and are not in the session log: the queue was full";
}

void report_robots(const std::vector<tick::RobotState>& robots, const StageClock& stages, Report& report) {
  report.lasers.clear();
  for (const tick::RobotState& robot : robots) {
    for (const tick::FurtherLaser& laser : robot.further_lasers)
      report.lasers.push_back({robots.size() < 2 ? "" : robot.name, laser.injection.laser,
                               laser.scan.sequence, laser.scan.degraded});
  }
  if (robots.size() < 2) return;
  report.robots.clear();
  for (const tick::RobotState& robot : robots) {
    RobotReport own;
    own.name = robot.name;
    own.scans_in = robot.scan.sequence;
    own.scans_degraded = robot.scan.degraded;
    for (const tick::FurtherLaser& laser : robot.further_lasers) {
      own.scans_in += laser.scan.sequence;
      own.scans_degraded += laser.scan.degraded;
    }
    own.scan_us = stages.robots_scan_us[robot.index];
    report.robots.push_back(std::move(own));
  }
}

void note_what_images_lack(const RobotDescription& robot, const std::string& render_fault, Report& report) {
  if (!render_fault.empty()) report.notes["render"] = render_fault;
  if (report.tally.frames_in > 0 && !robot.camera && !robot.depth && robot.further_cameras.empty()) {
    report.notes["calibration"] =
        "robot description '" + robot.name + "' has no 'camera' section: images are published unchanged";
  }
}

std::vector<GradedSession> grades_now(const tick::Configuration& configuration,
                                      const tick::LiveGrading* grading, const std::string& log) {
  std::vector<GradedSession> grades;
  if (grading == nullptr) return grades;
  const std::vector<std::string> robots = tick::graded_robots(configuration);
  for (std::size_t i = 0; i < robots.size(); ++i)
    grades.push_back({log, configuration.scenario.name, robots[i], grading->graders[i].grade(), 0});
  return grades;
}

ServerStatus to_status(const Report& report, ArrivalTime now) {
  const auto number = [](std::uint64_t count) { return static_cast<double>(count); };
  const tick::Tally& tally = report.tally;
  ServerStatus status;
  status.stamp = {now.ns};
  status.values = {{"scans_in", number(tally.scans_in)},
                   {"scans_out", number(tally.scans_out)},
                   {"scans_degraded", number(degraded_total(tally))},
                   {"scan_us_p50", report.scan_us.at(0.5)},
                   {"scan_us_p99", report.scan_us.at(0.99)},
                   {"physics_wait_us_p99", report.physics_wait_us.at(0.99)},
                   {"frames_in", number(tally.frames_in)},
                   {"frames_out", number(tally.frames_out)},
                   {"frames_dropped", number(report.frames_dropped)},
                   {"frame_us_p50", report.frame_us.at(0.5)},
                   {"frame_us_p99", report.frame_us.at(0.99)},
                   {"inputs_dropped", number(report.inputs_dropped)},
                   {"inputs_refused", number(tally.refused_inputs)},
                   {"scans_foreign", number(tally.foreign_scans)},
                   {"guard_fired", number(report.guard_fired)},
                   {"session_complete", report.complete ? 1.0 : 0.0}};
  for (const RobotReport& robot : report.robots) {
    const auto add = [&](const char* key, double value) {
      status.values.emplace_back(std::string(key) + "." + robot.name, value);
    };
    add("scans_in", number(robot.scans_in));
    add("scans_degraded", number(robot.scans_degraded));
    add("scan_us_p50", robot.scan_us.at(0.5));
    add("scan_us_p99", robot.scan_us.at(0.99));
    add("guard_fired", number(robot.guard_fired));
  }
  for (const LaserReport& laser : report.lasers) {
    const auto add = [&](const char* key, std::uint64_t value) {
      status.values.emplace_back(robot_channel(sensor_channel(key, laser.name), laser.robot), number(value));
    };
    add("scans_in", laser.scans_in);
    add("scans_degraded", laser.scans_degraded);
    add("guard_fired", laser.guard_fired);
  }
  if (report.messages_refused)
    status.values.emplace_back("messages_refused", number(*report.messages_refused));
  if (tally.radio_power) status.values.emplace_back("radio_dbm", *tally.radio_power);
  if (tally.battery_left) status.values.emplace_back("battery_left", *tally.battery_left);
  for (const auto& [key, text] : report.notes) status.notes.emplace_back(key, text);
  if (!tally.last_refusal.empty()) status.notes.emplace_back("last_refusal", tally.last_refusal);
  if (!tally.refusals.empty()) status.notes.emplace_back("refusals", refusals(tally));
  if (!report.complete) status.notes.emplace_back("session_log", report.incomplete_because);
  return status;
}

std::string to_json(const Report& report) {
  const tick::Tally& tally = report.tally;
  Json json;
  json["source"] = report.source;
  json["complete"] = report.complete;
  if (!report.complete) json["incomplete_because"] = report.incomplete_because;
  json["scans"] = scans_json(tally);
  json["beams"] = {{"total", tally.beams_total}, {"replaced", tally.beams_replaced}};
  json["frames"] = {{"in", tally.frames_in},
                    {"out", tally.frames_out},
                    {"composited", tally.frames_composited},
                    {"dropped", report.frames_dropped}};
  if (tally.agent_frames_in > 0)
    json["agent_frames"] = {{"in", tally.agent_frames_in},
                            {"out", tally.agent_frames_out},
                            {"dropped", report.agent_frames_dropped}};
  json["latency_us"] = latencies_json(report);
  json["pose"] = {{"age_ms",
                   {{"p50", tally.pose_age_us.at(0.5) / 1e3},
                    {"p99", tally.pose_age_us.at(0.99) / 1e3},
                    {"max", tally.pose_age_us.max() / 1e3}}}};
  add_robots_and_lasers(report, json);
  json["events"] = events_json(tally);
  json["inputs"] = {{"refused", tally.refused_inputs},
                    {"last_refusal", tally.last_refusal},
                    {"dropped", report.inputs_dropped},
                    {"arrivals_corrected", report.arrivals_corrected},
                    {"log_damage_bytes", report.log_damage_bytes}};
  json["seconds"] = {
      {"log", report.log_seconds},
      {"wall", report.wall_seconds},
      {"times_real_time", report.wall_seconds > 0 ? report.log_seconds / report.wall_seconds : 0.0}};
  add_grades(report, json);
  json["hash"] = report.hash;
  json["notes"] = report.notes;
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string summary(const Report& report) {
  const tick::Tally& tally = report.tally;
  std::string text = measured(report) + why_degraded(tally) + why_no_agent(tally);
  char line[512];
  for (const RobotReport& robot : report.robots) {
    std::snprintf(line, sizeof line, "robot   %s: %llu scans, %llu degraded; %.0f us median, %.0f us p99\n",
                  robot.name.c_str(), static_cast<unsigned long long>(robot.scans_in),
                  static_cast<unsigned long long>(robot.scans_degraded), robot.scan_us.at(0.5),
                  robot.scan_us.at(0.99));
    text += line;
  }
  for (const LaserReport& laser : report.lasers) {
    std::snprintf(line, sizeof line, "laser   %s: %llu scans, %llu degraded\n",
                  robot_channel(laser.name, laser.robot).c_str(),
                  static_cast<unsigned long long>(laser.scans_in),
                  static_cast<unsigned long long>(laser.scans_degraded));
    text += line;
  }
  if (tally.agent_frames_in > 0)
    text += "agents  " + std::to_string(tally.agent_frames_out) + " of " +
            std::to_string(tally.agent_frames_in) + " images of agents' cameras, " +
            std::to_string(report.agent_frames_dropped) + " dropped\n";
  if (tally.refused_inputs > 0) {
    text +=
        "refused " + std::to_string(tally.refused_inputs) + " inputs, the last: " + tally.last_refusal + "\n";
  }
  if (const auto slam = report.notes.find("slam"); slam != report.notes.end())
    text += "slam    " + slam->second + "\n";
  for (const char* key : {"calibration", "render"}) {
    const auto lack = report.notes.find(key);
    if (lack != report.notes.end()) text += "images  " + lack->second + "\n";
  }
  if (report.log_damage_bytes > 0) {
    const auto where = report.notes.find("log");
    text += "damaged " + std::to_string(report.log_damage_bytes) + " bytes of the log were lost" +
            (where == report.notes.end() ? "" : ", the last: " + where->second) + "\n";
  }
  for (const GradedSession& each : report.grades) text += "grade   " + to_text(each);
  if (!report.complete) text += "INCOMPLETE: " + report.incomplete_because + "\n";
  return text;
}

}  // namespace parhelion::runtime
