#include "server/tick/scan_path.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <span>

#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "server/tick/bodies_in_sweep.hpp"
#include "server/tick/other_robots.hpp"
#include "server/tick/scan_learning.hpp"

namespace parhelion::tick {
namespace {

/// Only the first laser helps to find the robot's clock: another whose stamps are wrong harms itself alone.
bool is_on_robots_clock(const Message& input, SensorTime last, const ScanPath& path) {
  return path.scan.laser == 0 ? path.pose.clock.add(input.arrival, last)
                              : path.pose.clock.agrees(input.arrival, last);
}

/// Only the first laser is matched to the map.
pose::RefinedPose match_first_laser(const ScanPath& path) {
  return path.scan.laser == 0 ? match_scan(path.scan.real, path.pose) : pose::RefinedPose();
}

/// Whether one beam has a range, or reports that nothing is within range. A value that stands for both no
/// return and too close counts: an empty hall is no fault.
bool one_beam_is_valid(const RangeConvention& convention, std::span<const float> ranges) {
  const float far = convention.no_return_sentinel();
  return std::any_of(ranges.begin(), ranges.end(), [&](float range) {
    const BeamKind kind = convention.classify(range);
    if (kind == BeamKind::hit || kind == BeamKind::no_return) return true;
    return range == far || (std::isnan(range) && std::isnan(far));
  });
}

/// For a scan without a valid beam, by the kinds of its beams.
ScanOutcome no_beam(const RangeConvention& convention, std::span<const float> ranges) {
  const auto too_close =
      static_cast<std::size_t>(std::count_if(ranges.begin(), ranges.end(), [&](float range) {
        return convention.classify(range) == BeamKind::too_close;
      }));
  return {
      Degraded::no_beam,
      "no valid beam: of " + std::to_string(ranges.size()) + " beams " + std::to_string(too_close) +
          " are too close and " + std::to_string(ranges.size() - too_close) +
          " are NaN or negative; see whether the laser is covered or broken, or whether its driver writes "
          "other values than no_return and too_close of the robot description"};
}

ScanOutcome no_pose(pose::NoPose why) { return {Degraded::pose, std::string("no pose: ") + to_string(why)}; }

/// To MR_SCAN_INFO and the report.
void report_match(const pose::RefinedPose& refined, Tally& tally, ScanInfo& info) {
  info.pose = to_string(refined.match);
  if (refined.match == pose::ScanMatch::off || refined.match == pose::ScanMatch::no_prior) return;
  info.residual = refined.residual;
  info.explained = refined.explained;
  ++(refined.match == pose::ScanMatch::matched ? tally.scans_matched : tally.scans_not_matched);
}

ScanOutcome find_sweep_poses(const TickContext& context, const Message& input, const ScanPath& path,
                             SweepPoses& poses) {
  ScanState& scan = path.scan;
  const LaserDescription& laser = laser_of(context, scan);
  const scan::Sweep sweep = scan::beam_times(laser, scan.real, scan.beam_time);
  const SensorTime first = scan.real.stamp + sweep.start;
  const SensorTime last = scan.real.stamp + sweep.end;
  if (!is_on_robots_clock(input, last, path)) {
    return {Degraded::clock, "the stamp is more than a second off the robot's clock"};
  }
  if (!one_beam_is_valid(laser.convention, scan.real.ranges))
    return no_beam(laser.convention, scan.real.ranges);
  const pose::RefinedPose refined = match_first_laser(path);
  report_match(refined, context.tally, scan.info);
  pose::NoPose why{};
  const auto start = robot_pose(path.pose, first, &why);
  if (!start) return no_pose(why);
  const auto end = robot_pose(path.pose, last, &why);
  if (!end) return no_pose(why);
  if (!path.simulation.at(path.pose.clock.to_server(first), scan.world_start) ||
      !path.simulation.at(path.pose.clock.to_server(last), scan.world_end)) {
    return {Degraded::history, "the world at the scan's stamp is older than the history or ahead of it"};
  }
  constexpr int planar[] = {0, 1, 5};
  scan.info.pose_covariance = end->covariance(planar, planar);
  poses = {*start, *end, {start->T_map_base * laser.T_base_laser, end->T_map_base * laser.T_base_laser}};
  return {};
}

/// Largest position error of returns from the bodies of one agent, m.
double worst_error(const pose::PoseAtInstant& pose, std::span<const scan::BodyMotion> bodies) {
  double worst = 0;
  for (const scan::BodyMotion& each : bodies) {
    const double error = pose::predicted_error(pose, each.T_map_body_end.translation());
    if (!(error <= worst)) worst = error;
  }
  return worst;
}

/// Selects agents to inject: within range and with a sufficiently known position. Always complete agents.
ScanOutcome select_bodies(const TickContext& context, const SweepPoses& poses, const ScanPath& path) {
  const Configuration& configuration = context.configuration;
  ScanState& scan = path.scan;
  const double range_max = laser_of(context, scan).convention.range_max;
  const Eigen::Vector3d laser_origin = poses.laser.T_map_laser_end.translation();
  const auto distance = [&](const Transform<Map, Body>& T_map_body) {
    return (T_map_body.translation() - laser_origin).norm();
  };
  bodies_in_sweep(scan.world_start, scan.world_end, scan.motions,
                  [&](const BodyDefinition& body, const BodyState& at) {
                    if (!body.injectable) return false;
                    const double away = distance(at.T_map_body);
                    return away <= range_max || away - bounding_radius(body) <= range_max;
                  });
  bodies_in_sweep(scan.world_start, scan.world_end, scan.doors,
                  [&](const BodyDefinition& body, const BodyState&) {
                    return is_real_door(body) || is_other_robot(body, context.robot().name);
                  });
  if (scan.motions.empty()) ++context.tally.scans_without_agent;
  double nearest = std::numeric_limits<double>::infinity();
  scan.info.predicted_error = pose::predicted_error(poses.end, laser_origin);
  auto kept = scan.motions.begin();
  bool left_out = false;
  for (auto agent = scan.motions.begin(); agent != scan.motions.end();) {
    const auto end = std::find_if(agent, scan.motions.end(), [&](const scan::BodyMotion& each) {
      return each.body->entity != agent->body->entity;
    });
    const double error = worst_error(poses.end, {agent, end});
    if (distance(agent->T_map_body_end) < nearest) {
      nearest = distance(agent->T_map_body_end);
      scan.info.predicted_error = error;
    }
    const bool shown = path.gate.admit(agent->body->entity, error, scan.world_start.stamp,
                                       configuration.scenario.injection, path.simulation);
    kept = shown ? std::copy(agent, end, kept) : kept;
    left_out = left_out || !shown;
    agent = end;
  }
  scan.motions.erase(kept, scan.motions.end());
  if (left_out && scan.motions.empty()) {
    return {Degraded::error,
            "predicted error above the limit for every agent in range, or not yet clearly below it"};
  }
  return {};
}

void cast(const RangeConvention& convention, const SweepPoses& poses, ScanState& scan,
          scan::RayCaster& caster) {
  const scan::BeamSet beams = scan::beam_set(scan.real, scan.beam_time);
  scan.virtual_hits.resize(scan.beam_time.size());
  scan.building_hits.assign(scan.beam_time.size(), {std::numeric_limits<float>::infinity(), -1, 0});
  scan.building_cast = false;
  caster.cast_bodies(poses.laser, beams, scan.motions, convention.range_max, scan.virtual_hits);
  // The wall matters only where a beam without return might be replaced.
  for (std::size_t i = 0; i < scan.virtual_hits.size(); ++i) {
    if (scan.virtual_hits[i].body >= 0 && convention.classify(scan.real.ranges[i]) == BeamKind::no_return) {
      caster.cast_building(poses.laser, beams, scan.doors, convention.range_max, scan.building_hits);
      scan.building_cast = true;
      return;
    }
  }
}

void count_replaced(std::size_t replaced, std::span<const scan::RangeHit> virtual_hits, Tally& tally) {
  tally.beams_replaced += replaced;
  const bool met = std::any_of(virtual_hits.begin(), virtual_hits.end(),
                               [](const scan::RangeHit& hit) { return hit.body >= 0; });
  if (met && replaced == 0) ++tally.scans_all_hidden;
}

/// MR_SCAN_INFO: the agent hit by each replaced beam. The bodies of an agent are contiguous in `motions`.
void name_agents(ScanState& scan) {
  scan.info.agents.clear();
  scan.info.beam_agent.assign(scan.beam_body.size(), -1);
  scan.agents.clear();
  for (const scan::BodyMotion& motion : scan.motions) {
    const bool same = !scan.agents.empty() && motion.body->entity == (&motion - 1)->body->entity;
    scan.agents.push_back({same ? scan.agents.back().first : scan.agents.size(), -1});
  }
  for (std::size_t i = 0; i < scan.beam_body.size(); ++i) {
    if (scan.beam_body[i] < 0) continue;
    const std::size_t first = scan.agents[static_cast<std::size_t>(scan.beam_body[i])].first;
    std::int16_t& named = scan.agents[first].named;
    if (named < 0) {
      named = static_cast<std::int16_t>(scan.info.agents.size());
      scan.info.agents.push_back(scan.motions[first].body->entity);
    }
    scan.info.beam_agent[i] = named;
  }
}

ScanOutcome inject(const TickContext& context, const Message& input, const ScanPath& path, SweepPoses& poses,
                   StageObserver& stages) {
  ScanState& scan = path.scan;
  const ScanOutcome known = find_sweep_poses(context, input, path, poses);
  stages.ended(Stage::pose);
  if (known.cause != Degraded::none) return known;
  context.tally.pose_age_us.add(poses.end.age.microseconds());

  const ScanOutcome selected = select_bodies(context, poses, path);
  stages.ended(Stage::world);
  if (selected.cause != Degraded::none) return selected;

  const LaserDescription& laser = laser_of(context, scan);
  cast(laser.convention, poses, scan, path.site.caster);
  stages.ended(Stage::cast);
  const scan::NoiseKey key{context.configuration.scenario.seed,
                           record_number(context.robot_index, scan.sequence, scan.laser)};
  count_replaced(scan::augment_scan(scan.real, laser, key, scan.virtual_hits, scan.building_hits, scan.out,
                                    scan.beam_body),
                 scan.virtual_hits, context.tally);
  stages.ended(Stage::augment);
  return {};
}

ScanOutcome try_inject(const TickContext& context, const Message& input, const ScanPath& path,
                       SweepPoses& poses, StageObserver& stages) try {
  return inject(context, input, path, poses, stages);
} catch (const std::exception& fault) {
  return {Degraded::fault, fault.what()};
}

/// An unreadable scan is published unchanged, like all unusable ones: with the server the robot receives no
/// less than without it. If even its stamp cannot be read, its arrival is used.
ScanOutcome read_scan(const TickContext& context, const Message& input, ScanState& scan) {
  scan.have_real = false;  // a partly decoded scan is not an occluder
  const Status read = decode(input.channel, input.payload, scan.real);
  scan.info.stamp =
      read ? scan.real.stamp : leading_stamp(input.payload).value_or(SensorTime{input.arrival.ns});
  if (!read) {
    scan.real.ranges.clear();
    refuse(context, read.error());
    return {Degraded::unreadable, read.error().message};
  }
  scan.have_real = true;
  context.tally.beams_total += scan.real.ranges.size();
  return {};
}

/// Publishes the scan unchanged as MR_SCAN, with the reason in MR_SCAN_INFO.
void pass_raw_scan(const Message& input, const std::string& reason, ScanState& scan) {
  scan.mr_scan.assign(input.payload.begin(), input.payload.end());
  scan.info.live = false;
  scan.info.reason = reason;
  scan.info.agents.clear();
  scan.info.beam_agent.assign(scan.real.ranges.size(), -1);
}

void count_degraded(const TickContext& context, Degraded cause, ScanState& scan) {
  ++context.tally.scans_degraded[static_cast<std::size_t>(cause)];
  ++scan.degraded;
}

/// Computes MR_SCAN and MR_SCAN_INFO.
ScanOutcome compute_scan(const TickContext& context, const Message& input, const ScanPath& path,
                         SweepPoses& poses, StageObserver& stages) {
  ScanState& scan = path.scan;
  ScanOutcome outcome = read_scan(context, input, scan);
  stages.ended(Stage::decode);
  scan.info.live = true;
  scan.info.reason.clear();
  scan.info.predicted_error = scan.info.residual = std::numeric_limits<double>::infinity();
  scan.info.pose_covariance.setConstant(std::numeric_limits<double>::infinity());
  scan.info.pose = pose::to_string(pose::ScanMatch::no_prior);
  scan.info.explained = 0;
  if (scan.have_real) outcome = try_inject(context, input, path, poses, stages);
  if (outcome.cause == Degraded::none) {
    encode(scan.out, scan.mr_scan);
  } else {
    pass_raw_scan(input, outcome.text, scan);
    count_degraded(context, outcome.cause, scan);
  }
  ++context.tally.scans_out;
  stages.ended(Stage::encode);
  return outcome;
}

/// To the sink first, then to the outputs, for the log.
void publish_scan(const TickContext& context, const Message& input, const ScanOutcome& outcome,
                  ScanState& scan, ScanSink& sink) {
  const ScanSink::Receipt receipt =
      sink.publish(record_number(context.robot_index, scan.sequence, scan.laser), scan.mr_scan);
  if (receipt.raw) {
    pass_raw_scan(input, "guard: no answer in time", scan);
    if (outcome.cause == Degraded::none) count_degraded(context, Degraded::guard, scan);
  } else if (outcome.cause == Degraded::none) {
    name_agents(scan);  // not before: the robot waits for MR_SCAN
  }
  context.outputs.add(context.channel(channel::kMrScan, scan.laser), receipt.sent)
      .assign(scan.mr_scan.begin(), scan.mr_scan.end());
  encode(scan.info, context.outputs.add(context.channel(channel::kMrScanInfo, scan.laser)));
}

/// A message of another type on SCAN, or not as long as it declares, is not forwarded: receivers of MR_SCAN
/// could not decode it, and a real laser on the channel gets its own results. MR_SCAN_INFO reports it, with
/// the arrival as its stamp.
void report_foreign(const TickContext& context, const Message& input, std::size_t laser) {
  ++context.tally.foreign_scans;
  const Error error{
      input.channel + ": found " + std::to_string(input.payload.size()) + " bytes of " +
      type_name(input.payload) +
      ", expected a planar_lidar_t or lidar_t as long as it declares; not forwarded. Find its publisher, "
      "or rename the channel"};
  refuse(context, error);
  ScanInfo info;
  info.stamp = {input.arrival.ns};
  info.reason = error.message;
  info.predicted_error = std::numeric_limits<double>::infinity();
  encode(info, context.outputs.add(context.channel(channel::kMrScanInfo, laser)));
}

}  // namespace

const LaserDescription& laser_of(const TickContext& context, const ScanState& scan) {
  return scan.beams.corrected ? *scan.beams.corrected : context.robot().laser_at(scan.laser);
}

void process_scan(const TickContext& context, const Message& input, const ScanPath& path, ScanSink& sink,
                  StageObserver& stages) {
  if (!has_form_of_scan(input.payload)) return report_foreign(context, input, path.scan.laser);
  ++path.scan.sequence;
  ++context.tally.scans_in;
  ++context.tally.scans_of_real_lasers;
  path.injection.last_scan = context.now;
  SweepPoses poses;
  const ScanOutcome outcome = compute_scan(context, input, path, poses, stages);
  publish_scan(context, input, outcome, path.scan, sink);
  learn_from_scan(context, outcome, poses, path);
}

void handle_line(const TickContext& context, const Message& input, ScanState& scan) {
  if (!context.robot().line_laser)
    return refuse(context, {input.channel + ": the robot description has no 'line_laser'"});
  Scan line;
  if (const Status read = decode(input.channel, input.payload, line); !read)
    return refuse(context, read.error());
  scan.line = std::move(line);
}

}  // namespace parhelion::tick
