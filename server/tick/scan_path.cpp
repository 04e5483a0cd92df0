// SCAN to MR_SCAN: the world at the scan's own instant, cast beam by beam, injected as promise 1 says.
#include <cmath>
#include <exception>
#include <limits>
#include <span>

#include "server/tick/bodies_in_sweep.hpp"
#include "server/tick/tick.hpp"

namespace parhelion::tick {
namespace {

struct Verdict {
  Degraded why = Degraded::no;
  std::string text;  // empty where live
};

/// The robot and the world at the first and last beam.
struct Moment {
  pose::PoseAtInstant start, end;
  scan::LaserMotion laser;
};

Verdict no_pose(pose::NoPose why) { return {Degraded::pose, std::string("no pose: ") + to_string(why)}; }

Verdict find_moment(const Configuration& configuration, const Message& input, State& state, Moment& moment) {
  const LaserDescription& laser = *configuration.robot.laser;
  ScanPath& path = state.scan;
  const scan::Sweep sweep = scan::beam_times(laser, path.real.ranges.size(), path.beam_time);
  const SensorTime first = path.real.stamp + sweep.start;
  const SensorTime last = path.real.stamp + sweep.end;
  if (!state.robot_clock.add(input.arrival, last)) {
    return {Degraded::clock, "the stamp is more than a second off the robot's clock"};
  }
  pose::NoPose why{};
  const auto start = robot_pose(state, first, &why);
  if (!start) return no_pose(why);
  const auto end = robot_pose(state, last, &why);
  if (!end) return no_pose(why);
  if (!state.simulation.at(state.robot_clock.to_server(first), path.world_start) ||
      !state.simulation.at(state.robot_clock.to_server(last), path.world_end)) {
    return {Degraded::history, "the world at the scan's stamp is older than the history or ahead of it"};
  }
  moment = {*start, *end, {start->T_map_base * laser.T_base_laser, end->T_map_base * laser.T_base_laser}};
  return {};
}

/// Where a return from these bodies, one agent's, is known worst, m.
double worst_error(const pose::PoseAtInstant& pose, std::span<const scan::BodyMotion> bodies) {
  double worst = 0;
  for (const scan::BodyMotion& each : bodies) {
    const double error = pose::predicted_error(pose, each.T_map_body_end.translation());
    if (!(error <= worst)) worst = error;
  }
  return worst;
}

/// Agents to inject: within range, and known well enough where they stand. Whole agents, never halves.
Verdict select_bodies(const Configuration& configuration, const Moment& moment, State& state) {
  ScanPath& path = state.scan;
  const double range_max = configuration.robot.laser->convention.range_max;
  const Eigen::Vector3d eye = moment.laser.T_map_laser_end.translation();
  const auto distance = [&](const Transform<Map, Body>& T_map_body) {
    return (T_map_body.translation() - eye).norm();
  };
  bodies_in_sweep(path.world_start, path.world_end, path.motions,
                  [&](const BodyDefinition& body, const BodyState& at) {
                    return body.injectable && distance(at.T_map_body) - bounding_radius(body) <= range_max;
                  });
  bodies_in_sweep(path.world_start, path.world_end, path.doors,
                  [](const BodyDefinition& body, const BodyState&) { return is_real_door(body); });
  double nearest = std::numeric_limits<double>::infinity();
  path.info.predicted_error = pose::predicted_error(moment.end, eye);
  auto kept = path.motions.begin();
  bool left_out = false;
  for (auto agent = path.motions.begin(); agent != path.motions.end();) {
    const auto end = std::find_if(agent, path.motions.end(), [&](const scan::BodyMotion& each) {
      return each.body->entity != agent->body->entity;
    });
    const double error = worst_error(moment.end, {agent, end});
    if (distance(agent->T_map_body_end) < nearest) {
      nearest = distance(agent->T_map_body_end);
      path.info.predicted_error = error;
    }
    const bool shown = state.gate.admit(agent->body->entity, error, path.world_start.stamp,
                                        configuration.scenario.injection, state.simulation);
    kept = shown ? std::copy(agent, end, kept) : kept;
    left_out = left_out || !shown;
    agent = end;
  }
  path.motions.erase(kept, path.motions.end());
  if (left_out && path.motions.empty()) {
    return {Degraded::error,
            "predicted error above the limit for every agent in range, or not yet well below"};
  }
  return {};
}

void cast(const Configuration& configuration, const Moment& moment, State& state) {
  ScanPath& path = state.scan;
  const RangeConvention& convention = configuration.robot.laser->convention;
  const scan::BeamSet beams{path.real.angle_first, path.real.angle_step, path.beam_time};
  path.virtual_hits.resize(path.beam_time.size());
  path.building_hits.assign(path.beam_time.size(), {std::numeric_limits<float>::infinity(), -1, 0});
  path.building_cast = false;
  state.caster.cast_bodies(moment.laser, beams, path.motions, convention.range_max, path.virtual_hits);
  // The wall matters only to a beam that came back empty and might be replaced.
  for (std::size_t i = 0; i < path.virtual_hits.size(); ++i) {
    if (path.virtual_hits[i].body >= 0 && convention.classify(path.real.ranges[i]) == BeamKind::no_return) {
      state.caster.cast_building(moment.laser, beams, path.doors, convention.range_max, path.building_hits);
      path.building_cast = true;
      return;
    }
  }
}

void name_agents(State& state) {
  ScanPath& path = state.scan;
  path.info.agents.clear();
  path.info.beam_agent.assign(path.beam_body.size(), -1);
  for (std::size_t i = 0; i < path.beam_body.size(); ++i) {
    if (path.beam_body[i] < 0) continue;
    const std::string& entity = path.motions[static_cast<std::size_t>(path.beam_body[i])].body->entity;
    auto found = std::find(path.info.agents.begin(), path.info.agents.end(), entity);
    if (found == path.info.agents.end()) found = path.info.agents.insert(found, entity);
    path.info.beam_agent[i] = static_cast<std::int16_t>(found - path.info.agents.begin());
  }
}

/// Real returns that the model does not explain keep the agents off: people are not in the model. After the
/// answer, so that the scan does not wait for it.
void note_unexplained(const Configuration& configuration, const Moment& moment, State& state) {
  ScanPath& path = state.scan;
  const scan::BeamSet beams{path.real.angle_first, path.real.angle_step, path.beam_time};
  const LaserDescription& laser = *configuration.robot.laser;
  if (!path.building_cast)
    state.caster.cast_building(moment.laser, beams, path.doors, laser.convention.range_max,
                               path.building_hits);
  const double sigma = pose::predicted_error(moment.end, moment.laser.T_map_laser_end.translation());
  state.obstacles.clear();
  for (const scan::UnexplainedDisc& disc :
       state.unexplained.find(path.real, laser, moment.laser, path.beam_time, path.building_hits, sigma)) {
    state.obstacles.push_back({disc.center, disc.radius});
  }
  state.obstacles_seen = path.last_scan;
  state.simulation.set_real_obstacles(state.obstacles);
}

Verdict inject(const Configuration& configuration, const Message& input, State& state, Moment& moment,
               StageObserver& observer) {
  ScanPath& path = state.scan;
  const Verdict known = find_moment(configuration, input, state, moment);
  observer.ended(Stage::pose);
  if (known.why != Degraded::no) return known;
  state.tally.pose_age_us.add(moment.end.age.microseconds());

  const Verdict selected = select_bodies(configuration, moment, state);
  observer.ended(Stage::world);
  if (selected.why != Degraded::no) return selected;

  cast(configuration, moment, state);
  observer.ended(Stage::cast);
  const scan::NoiseKey key{configuration.scenario.seed, path.sequence};
  state.tally.beams_replaced +=
      scan::augment_scan(path.real, *configuration.robot.laser, key, path.virtual_hits, path.building_hits,
                         path.out, path.beam_body);
  name_agents(state);
  observer.ended(Stage::augment);
  return {};
}

Verdict try_inject(const Configuration& configuration, const Message& input, State& state, Moment& moment,
                   StageObserver& observer) try {
  return inject(configuration, input, state, moment, observer);
} catch (const std::exception& fault) {
  return {Degraded::fault, fault.what()};
}

void degrade(const Verdict& verdict, State& state) {
  ScanPath& path = state.scan;
  path.info.live = false;
  path.info.reason = verdict.text;
  path.info.agents.clear();
  path.info.beam_agent.assign(path.real.ranges.size(), -1);
  ++state.tally.scans_degraded[static_cast<std::size_t>(verdict.why)];
}

/// A scan whose bytes cannot be read goes out as it came, as all others that cannot be used: behind the
/// server the robot sees no less than without it. Its stamp, where not even that can be read, is its arrival.
Verdict read_scan(const Message& input, State& state) {
  ScanPath& path = state.scan;
  path.have_real = false;  // what is half read is no occluder
  const Status read = decode(input.channel, input.payload, path.real);
  path.info.stamp =
      read ? path.real.stamp : leading_stamp(input.payload).value_or(SensorTime{input.arrival.ns});
  if (!read) {
    path.real.ranges.clear();
    refuse(read.error(), state);
    return {Degraded::unreadable, read.error().message};
  }
  path.have_real = true;
  state.tally.beams_total += path.real.ranges.size();
  return {};
}

/// A message of another type on SCAN is no scan. It is not sent on: a receiver of MR_SCAN could not read it,
/// and a real laser beside it has its own answers. MR_SCAN_INFO says so, with the arrival as its stamp.
void report_foreign(const Configuration& configuration, const Message& input, State& state,
                    Outputs& outputs) {
  ++state.tally.foreign_scans;
  const Error error{input.channel + ": found " + type_name(input.payload) +
                    ", expected planar_lidar_t; not sent on. Find who publishes it, or rename the channel"};
  refuse(error, state);
  ScanInfo info;
  info.stamp = {input.arrival.ns};
  info.reason = error.message;
  info.predicted_error = std::numeric_limits<double>::infinity();
  encode(info, outputs.add(configuration.channels.bus(channel::mr_scan_info)));
}

}  // namespace

const char* to_string(Degraded why) {
  switch (why) {
    case Degraded::no:
      return "none";
    case Degraded::pose:
      return "pose";
    case Degraded::error:
      return "predicted_error";
    case Degraded::clock:
      return "clock";
    case Degraded::history:
      return "history";
    case Degraded::robot_mismatch:
      return "robot_mismatch";
    case Degraded::unreadable:
      return "unreadable";
    case Degraded::guard:
      return "guard";
    case Degraded::fault:
      return "fault";
  }
  return "?";
}

void answer_scan(const Configuration& configuration, const Message& input, State& state, Outputs& outputs,
                 StageObserver& observer) {
  if (!claims_to_be_scan(input.payload)) return report_foreign(configuration, input, state, outputs);
  ScanPath& path = state.scan;
  ++path.sequence;
  ++state.tally.scans_in;
  path.last_scan = simulation_time(input.arrival);
  Verdict verdict = read_scan(input, state);
  observer.ended(Stage::decode);
  path.info.live = true;
  path.info.reason.clear();
  path.info.predicted_error = std::numeric_limits<double>::infinity();

  Moment moment;
  if (path.have_real) verdict = try_inject(configuration, input, state, moment, observer);
  std::vector<std::uint8_t>& scan_out = outputs.add(configuration.channels.bus(channel::mr_scan));
  if (verdict.why == Degraded::no) {
    encode(path.out, scan_out);
  } else {
    scan_out.assign(input.payload.begin(), input.payload.end());
    degrade(verdict, state);
  }
  ++state.tally.scans_out;
  observer.ended(Stage::encode);
  observer.answered(scan_out);
  encode(path.info, outputs.add(configuration.channels.bus(channel::mr_scan_info)));
  note_injection(configuration, path.last_scan, verdict.text, state, outputs);
  // Without a model everything real is unexplained, and there is nothing to tell people from walls.
  if (verdict.why == Degraded::no && (state.model ? *state.model : configuration.model).entities.size() > 0)
    note_unexplained(configuration, moment, state);
  // The pose is known, and whether agents can be injected is another matter.
  if (verdict.why == Degraded::no || verdict.why == Degraded::error)
    sight_doors(configuration, moment.laser,
                pose::predicted_error(moment.end, moment.laser.T_map_laser_end.translation()), state);
}

void substitute_raw_scan(const Configuration& configuration, const Message& input, State& state,
                         Outputs& outputs) {
  // One that was degraded anyway is counted already.
  if (state.scan.live) ++state.tally.scans_degraded[static_cast<std::size_t>(Degraded::guard)];
  const std::string scan_name = configuration.channels.bus(channel::mr_scan);
  const std::string info_name = configuration.channels.bus(channel::mr_scan_info);
  for (Outputs::Entry& entry : outputs.entries()) {
    if (entry.channel == scan_name) entry.payload.assign(input.payload.begin(), input.payload.end());
    if (entry.channel != info_name) continue;
    ScanInfo info;
    if (!decode(entry.channel, entry.payload, info)) continue;
    info.live = false;
    info.reason = "guard: no answer in time";
    info.agents.clear();
    std::fill(info.beam_agent.begin(), info.beam_agent.end(), std::int16_t{-1});
    encode(info, entry.payload);
  }
}

}  // namespace parhelion::tick
