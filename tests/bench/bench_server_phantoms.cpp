// Do phantoms stand still? Replays a session, takes the pose with which each scan was injected, and compares
// it with the truth, or with a trajectory computed afterwards by MRPT's ICP.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <deque>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>
#include <set>
#include <string>
#include <vector>

#include "fusion/semantic/grid/extrude.hpp"
#include "protocols/bus/log_file.hpp"
#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "server/runtime/replay.hpp"
#include "server/tick/state.hpp"
#include "tests/bench/reference_trajectory.hpp"
#include "tests/fusion/pose/trajectory_error.hpp"
#include "tests/fusion/pose/true_drive.hpp"

namespace parhelion {
namespace {

constexpr double kPhantomDistance = 8;  ///< m, from the laser
constexpr int kDirections = 16;         ///< over the laser's field of view
constexpr double kCore = 0.1;           ///< m, half of an agent's width that must be in free sight
constexpr double kClear = 0.3;          ///< m, of free sight behind an agent

struct SeenAgent {
  std::string name;
  Eigen::Vector2d p_map;
};

struct SeenScan {
  Scan scan;
  std::optional<Pose2> used;  ///< T_map_base with which it was injected; none: no pose
  bool live = false;          ///< false: MR_SCAN equals SCAN
  std::string reason;
  std::string pose;               ///< how it was placed: ScanInfo::pose
  std::vector<SeenAgent> agents;  ///< all of them
  std::set<std::string> shown;    ///< those with a replaced beam
};

struct Session {
  LaserDescription laser;
  double max_error = 0.1;  ///< m, the scenario's limit
  std::vector<SeenScan> scans;
  std::map<SensorTime, Pose2> slam;  ///< tracking, by stamp
};

std::vector<SeenAgent> agents_of(const WorldSnapshot& world) {
  std::map<std::string, std::pair<Eigen::Vector2d, int>> sums;
  for_each_body(world, [&](const BodyDefinition& body, const BodyState& at) {
    if (body.owner != BodyOwner::agent) return;
    auto& sum = sums.try_emplace(body.entity, Eigen::Vector2d(0, 0), 0).first->second;
    sum.first += at.T_map_body.translation().head<2>();
    ++sum.second;
  });
  std::vector<SeenAgent> agents;
  for (const auto& [name, sum] : sums) agents.push_back({name, sum.first / sum.second});
  return agents;
}

void capture_scan(const tick::RobotState& robot, Session& session) {
  SeenScan seen;
  seen.scan = robot.scan.real;
  if (const auto pose = tick::robot_pose(robot.pose, seen.scan.stamp)) seen.used = planar(pose->T_map_base);
  const ScanInfo& info = robot.scan.info;
  seen.live = info.live;
  seen.reason = info.reason;
  seen.pose = info.pose;
  seen.agents = agents_of(robot.scan.world_end);
  for (const std::int16_t agent : info.beam_agent) {
    if (info.live && agent >= 0) seen.shown.insert(info.agents[static_cast<std::size_t>(agent)]);
  }
  session.scans.push_back(std::move(seen));
}

/// What is replayed: a session log, or a log with SLAM's estimates and the scenario for it.
struct Recorded {
  std::string log;
  std::optional<std::string> scenario;
};

Result<Session> read_session(const Recorded& recorded) {
  Session session;
  runtime::ReplayOptions options;
  options.log = recorded.log;
  options.scenario = recorded.scenario;
  options.watch = [&](const tick::Configuration& configuration, const Message& input,
                      const tick::RobotState& robot) {
    session.laser = *configuration.robot.laser;
    session.max_error = configuration.scenario.injection.max_error;
    PoseEstimate estimate;
    const tick::InputKind kind = configuration.channels.kind(input.channel);
    if (kind == tick::InputKind::scan) capture_scan(robot, session);
    if (kind == tick::InputKind::pose_cov && decode(input.channel, input.payload, estimate) &&
        estimate.state == SlamState::tracking)
      session.slam[estimate.stamp] = planar(estimate.T_map_base);
  };
  const auto report = runtime::replay(options);
  if (!report) return report.error();
  return session;
}

/// T_map_base at each scan's stamp; none: not known.
using Reference = std::map<SensorTime, Pose2>;

Result<Reference> read_truth(const std::string& path) {
  auto log = LogReader::open(path);
  if (!log) return log.error();
  Reference truth;
  for (;;) {
    auto event = log->next();
    if (!event) return event.error();
    if (!*event) return truth;
    PoseStamped pose;
    if ((*event)->channel == channel::kReferencePose && decode((*event)->channel, (*event)->payload, pose))
      truth[pose.stamp] = planar(pose.T_map_base);
  }
}

/// `icp`: the matcher's own poses, not smoothed.
Result<Reference> match_with_mrpt(const Session& session, const std::string& map, Reference* icp = nullptr) {
  std::vector<bench::ReferenceScan> scans;
  for (const SeenScan& seen : session.scans) {
    const auto slam = session.slam.find(seen.scan.stamp);
    if (slam != session.slam.end()) {
      scans.push_back({seen.scan, slam->second});
    } else if (seen.used) {
      scans.push_back({seen.scan, *seen.used});
    }
  }
  const auto trajectory = bench::reference_trajectory(scans, session.laser, map);
  if (!trajectory) return trajectory.error();
  Reference reference;
  std::size_t bridged = 0;
  for (const bench::ReferencePose& pose : trajectory->poses) {
    if (pose.goodness < 0.5) {
      ++bridged;
      continue;
    }
    reference[pose.stamp] = pose.T_map_base;
    if (icp != nullptr) (*icp)[pose.stamp] = pose.T_map_base_icp;
  }
  std::printf("reference: MRPT's ICP, %zu scans, %zu of them left out; stamps jitter by %.1f ms\n",
              trajectory->poses.size(), bridged, 1e3 * trajectory->stamp_sigma);
  return reference;
}

/// m: how far from its place the robot sees what stands at p_map.
double error_at(const Pose2& used, const Pose2& truth, const Eigen::Vector2d& p_map) {
  return (used.inverse() * p_map - truth.inverse() * p_map).norm();
}

/// In all directions of the field of view.
void add_phantom_errors(const LaserDescription& laser, const SeenScan& seen, const Pose2& truth,
                        std::vector<double>& errors) {
  const double span =
      static_cast<double>(seen.scan.ranges.size() - 1) * static_cast<double>(seen.scan.angle_increment);
  for (int i = 0; i < kDirections; ++i) {
    const double angle = static_cast<double>(seen.scan.angle_min) + span * (i + 0.5) / kDirections;
    const Eigen::Vector2d p_laser = kPhantomDistance * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    errors.push_back(error_at(*seen.used, truth, truth * planar(laser.T_base_laser) * p_laser));
  }
}

/// Whether the laser has free sight of the agent's core and behind it.
bool is_in_view(const LaserDescription& laser, const Scan& scan, const Pose2& T_map_base,
                const Eigen::Vector2d& p_map) {
  const Eigen::Vector2d p = (T_map_base * planar(laser.T_base_laser)).inverse() * p_map;
  const double distance = p.norm(), half = std::atan2(kCore, distance);
  if (distance + kClear > static_cast<double>(laser.convention.range_max)) return false;
  const double step = scan.angle_increment;
  const double from_start =
      wrap_angle(std::atan2(p.y(), p.x()) - static_cast<double>(scan.angle_min) - std::numbers::pi) +
      std::numbers::pi;
  const double beam = from_start / step, margin = std::max(1.0, half / std::abs(step));
  if (beam - margin < 0 || beam + margin > static_cast<double>(scan.ranges.size() - 1)) return false;
  for (double b = std::ceil(beam - margin); b <= beam + margin; ++b) {
    const float range = scan.ranges[static_cast<std::size_t>(b)];
    const BeamKind kind = laser.convention.classify(range);
    if (kind == BeamKind::hit ? static_cast<double>(range) < distance + kClear : kind != BeamKind::no_return)
      return false;
  }
  return true;
}

double quantile(std::vector<double> values, double fraction) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto at =
      std::min(values.size() - 1, static_cast<std::size_t>(fraction * static_cast<double>(values.size())));
  std::nth_element(values.begin(), values.begin() + static_cast<long>(at), values.end());
  return values[at];
}

void print_errors(const char* what, const std::vector<double>& errors) {
  std::printf("phantom at %.0f m, %s: median %.1f mm, p95 %.1f mm, p99 %.1f mm (%zu)\n", kPhantomDistance,
              what, 1e3 * quantile(errors, 0.5), 1e3 * quantile(errors, 0.95), 1e3 * quantile(errors, 0.99),
              errors.size());
}

/// Counts over a session: scans that were held back, and whether rightly so.
struct GateCounts {
  std::size_t with_agent = 0, unchanged = 0;  ///< scans with an agent in view
  std::size_t injected = 0, beyond = 0;  ///< of them; the nearest agent stands wrong by more than the limit
  std::size_t withheld = 0, within = 0;  ///< of them with a pose; the nearest agent would stand right
};

void count_gate(double limit, const SeenScan& seen, const Pose2& truth, const Eigen::Vector2d& nearest,
                GateCounts& counts) {
  ++counts.with_agent;
  if (!seen.live) ++counts.unchanged;
  if (!seen.used) return;
  const bool right = error_at(*seen.used, truth, nearest) <= limit;
  ++(seen.live ? counts.injected : counts.withheld);
  if (seen.live && !right) ++counts.beyond;
  if (!seen.live && right) ++counts.within;
}

/// How often an agent in view vanishes from the scans.
class Flicker {
 public:
  void add(const SeenAgent& agent, bool shown, SensorTime stamp) {
    OfAgent& of = agents_[agent.name];
    const bool recent = of.stamp && stamp - *of.stamp < seconds(1.0);
    if (recent && of.shown && !shown) {
      of.vanished.push_back(stamp);
      ++total_;
    }
    of.shown = shown;
    of.stamp = stamp;
    while (!of.vanished.empty() && stamp - of.vanished.front() > seconds(60.0)) of.vanished.pop_front();
    max_ = std::max(max_, of.vanished.size());
  }
  std::size_t total() const { return total_; }
  std::size_t max_in_a_minute() const { return max_; }

 private:
  struct OfAgent {
    std::optional<SensorTime> stamp;
    bool shown = false;
    std::deque<SensorTime> vanished;
  };
  std::map<std::string, OfAgent> agents_;
  std::size_t total_ = 0, max_ = 0;
};

double percent(std::size_t part, std::size_t whole) {
  return whole == 0 ? 0 : 100 * static_cast<double>(part) / static_cast<double>(whole);
}

void print_scans(const Session& session) {
  const auto localized = std::find_if(session.scans.begin(), session.scans.end(),
                                      [](const SeenScan& seen) { return seen.used.has_value(); });
  std::map<std::string, std::size_t> reasons, poses;
  std::size_t unchanged = 0;
  for (auto seen = localized; seen != session.scans.end(); ++seen) {
    ++poses[seen->pose];
    if (seen->live) continue;
    ++unchanged;
    ++reasons[seen->reason];
  }
  const auto all = static_cast<std::size_t>(session.scans.end() - localized);
  std::printf("scans %zu, since the first pose %zu, of them unchanged %zu (%.1f %%)\n", session.scans.size(),
              all, unchanged, percent(unchanged, all));
  for (const auto& [reason, count] : reasons) std::printf("  %5zu %s\n", count, reason.c_str());
  for (const auto& [pose, count] : poses) std::printf("  %5zu pose: %s\n", count, pose.c_str());
}

void print_gate(const Session& session, const GateCounts& counts, const Flicker& flicker) {
  std::printf("scans with an agent in view %zu, unchanged %zu (%.1f %%)\n", counts.with_agent,
              counts.unchanged, percent(counts.unchanged, counts.with_agent));
  std::printf("  injected %zu, nearest agent wrong by more than %.2f m in %zu (%.1f %%)\n", counts.injected,
              session.max_error, counts.beyond, percent(counts.beyond, counts.injected));
  std::printf("  withheld with a pose %zu, needlessly %zu (%.1f %%)\n", counts.withheld, counts.within,
              percent(counts.within, counts.withheld));
  std::printf("agents vanish %zu times, one at most %zu times in a minute\n", flicker.total(),
              flicker.max_in_a_minute());
}

/// The error of the reference itself, which bounds what can be measured with it.
int compare_references(const Recorded& recorded, const std::string& map, const std::string& truth_log) {
  const auto session = read_session(recorded);
  if (!session) return std::fprintf(stderr, "%s\n", session.error().message.c_str()), 1;
  const auto reference = match_with_mrpt(*session, map);
  if (!reference) return std::fprintf(stderr, "%s\n", reference.error().message.c_str()), 1;
  const auto truth = read_truth(truth_log);
  if (!truth) return std::fprintf(stderr, "%s\n", truth.error().message.c_str()), 1;
  std::vector<double> errors;
  for (const SeenScan& seen : session->scans) {
    const auto matched = reference->find(seen.scan.stamp), known = truth->find(seen.scan.stamp);
    if (matched == reference->end() || known == truth->end()) continue;
    const SeenScan placed{seen.scan, matched->second, {}, {}, {}, {}, {}};
    add_phantom_errors(session->laser, placed, known->second, errors);
  }
  print_errors("the reference itself", errors);
  return errors.empty() ? 1 : 0;
}

int measure(const Recorded& recorded, const std::string& kind, const std::string& path) {
  const auto session = read_session(recorded);
  if (!session) return std::fprintf(stderr, "%s\n", session.error().message.c_str()), 1;
  Reference icp;
  const auto reference = kind == "--truth" ? read_truth(path) : match_with_mrpt(*session, path, &icp);
  if (!reference) return std::fprintf(stderr, "%s\n", reference.error().message.c_str()), 1;
  std::vector<double> all, live, by_icp, slam, positions;
  GateCounts counts;
  Flicker flicker;
  std::set<std::string> ever_shown;  // one that is lower than the laser's plane never is
  for (const SeenScan& seen : session->scans) ever_shown.insert(seen.shown.begin(), seen.shown.end());
  for (const SeenScan& seen : session->scans) {
    const auto truth = reference->find(seen.scan.stamp);
    if (truth == reference->end()) continue;
    const Pose2& T_map_base = truth->second;
    if (const auto estimate = session->slam.find(seen.scan.stamp); estimate != session->slam.end()) {
      SeenScan by_slam{seen.scan, estimate->second, {}, {}, {}, {}, {}};
      add_phantom_errors(session->laser, by_slam, T_map_base, slam);
    }
    if (seen.used) {
      add_phantom_errors(session->laser, seen, T_map_base, all);
      if (seen.live) add_phantom_errors(session->laser, seen, T_map_base, live);
      if (const auto own = icp.find(seen.scan.stamp); own != icp.end())
        add_phantom_errors(session->laser, seen, own->second, by_icp);
      positions.push_back((seen.used->position() - T_map_base.position()).norm());
    }
    std::optional<Eigen::Vector2d> nearest;
    for (const SeenAgent& agent : seen.agents) {
      if (!ever_shown.contains(agent.name) || !is_in_view(session->laser, seen.scan, T_map_base, agent.p_map))
        continue;
      flicker.add(agent, seen.shown.contains(agent.name), seen.scan.stamp);
      const auto away = [&](const Eigen::Vector2d& p) { return (p - T_map_base.position()).norm(); };
      if (!nearest || away(agent.p_map) < away(*nearest)) nearest = agent.p_map;
    }
    if (nearest) count_gate(session->max_error, seen, T_map_base, *nearest, counts);
  }
  print_errors("injected scans", live);
  print_errors("all scans with a pose", all);
  if (!by_icp.empty()) print_errors("the same, against the matcher's own poses", by_icp);
  print_errors("SLAM's own estimate, which comes after the scan", slam);
  std::printf("robot's position: median %.1f mm, p95 %.1f mm\n", 1e3 * quantile(positions, 0.5),
              1e3 * quantile(positions, 0.95));
  print_scans(*session);
  print_gate(*session, counts, flicker);
  return all.empty() ? 1 : 0;
}

/// What is to be written, in the order of arrival.
class TrueLog {
 public:
  template <class T>
  void add(const char* channel, SensorTime arrival, const T& item) {
    Message message{channel, ArrivalTime{arrival.ns}, {}};
    encode(item, message.payload);
    messages_.push_back(std::move(message));
  }
  Status write(const std::string& path) {
    std::stable_sort(messages_.begin(), messages_.end(),
                     [](const Message& a, const Message& b) { return a.arrival < b.arrival; });
    auto log = LogWriter::create(path, true);
    if (!log) return log.error();
    for (const Message& message : messages_) {
      if (const Status written = log->write(message.channel, message.arrival, message.payload); !written)
        return written;
    }
    return {};
  }

 private:
  std::vector<Message> messages_;
};

/// Boxes that stand along the corridor of the office.
Scenario scenario_of(const test::TrueBuilding& building) {
  Scenario scenario;
  scenario.name = "true drive";
  scenario.model = "model.yaml";
  scenario.map = "map.simplemap";
  for (const double x : {4.0, 11.0, 18.0, 21.0}) {
    AgentDefinition& agent = scenario.agents.emplace_back();
    agent.name = "box_" + std::to_string(scenario.agents.size());
    agent.T_map_base = Transform<Map, Base>::planar(x, building.route.front().y() + 0.7, 0);
  }
  return scenario;
}

Status write_text(const std::filesystem::path& path, const std::string& text) {
  std::ofstream file(path);
  file << text;
  return file.flush() ? Status{} : Status{Error{path.string() + ": cannot be written"}};
}

Status make(const std::filesystem::path& folder, const test::TrueDriveOptions& options, double moved) {
  std::filesystem::create_directories(folder);
  const test::TrueBuilding building = test::office(options.seed, moved);
  RobotDescription robot = test::robot_with_laser();
  robot.laser->noise_sigma = options.range_sigma;
  robot.footprint = {{-0.2, -0.2}, {0.2, -0.2}, {0.2, 0.2}, {-0.2, 0.2}};
  const test::TrueDrive drive = test::true_drive(building, robot, options);
  TrueLog log;
  log.add(channel::kRobot, SensorTime{test::TrueDrive::kStart},
          RobotMessage{SensorTime{test::TrueDrive::kStart}, to_yaml(robot)});
  for (const Odometry& odometry : drive.odometry) log.add(channel::kOdometry, odometry.stamp, odometry);
  for (const test::TrueScan& at : drive.scans) {
    log.add(channel::kScan, at.scan.stamp + milliseconds(30), at.scan);
    PoseStamped truth;
    truth.stamp = at.scan.stamp;
    truth.T_map_base = transform<Map, Base>(at.T_map_base);
    log.add(channel::kReferencePose, at.scan.stamp + milliseconds(31), truth);
  }
  if (const Status written = log.write(folder / "drive.lcm"); !written) return written;
  const auto mapped = test::true_map(building, robot, options.range_sigma);
  if (const Status saved = pose::write_simplemap(mapped, folder / "map.simplemap"); !saved) return saved;
  const pose::GridMap grid = pose::grid_of(mapped, 0.05);
  if (const Status saved = pose::save_ros_map(grid, folder / "map"); !saved) return saved;
  const auto model = semantic::extrude(grid, {});
  if (!model) return model.error();
  if (const Status saved = write_text(folder / "model.yaml", to_yaml(*model)); !saved) return saved;
  if (const Status saved = write_text(folder / "scenario.yaml", to_yaml(scenario_of(building))); !saved)
    return saved;
  const Pose2 start = drive.path.at(0);
  std::printf("%zu scans, %.0f s; start %.3f,%.3f,%.3frad\n", drive.scans.size(), drive.path.seconds(),
              start.x, start.y, start.yaw);
  return {};
}

}  // namespace
}  // namespace parhelion

namespace parhelion {
namespace {

int make(const std::vector<std::string>& words) {
  test::TrueDriveOptions options;
  if (words.size() > 2) options.seed = static_cast<std::uint32_t>(std::stoul(words[2]));
  if (words.size() > 3) options.people = std::stoi(words[3]);
  if (words.size() > 5) options.scan_jitter = std::stod(words[5]);
  const Status made = make(words[1], options, words.size() > 4 ? std::stod(words[4]) : 0);
  if (!made) std::fprintf(stderr, "%s\n", made.error().message.c_str());
  return made ? 0 : 1;
}

}  // namespace
}  // namespace parhelion

/// bench_server_phantoms LOG [--scenario FILE] and one of these:
///   --truth LOG                   against LOG's REFERENCE_POSE
///   --map SIMPLEMAP               against MRPT's ICP in the map that SLAM localized in
///   --map SIMPLEMAP --truth LOG   how good that reference itself is
/// bench_server_phantoms --make FOLDER [SEED [PEOPLE [MOVED [JITTER]]]]: a drive with known truth, in an
/// office of which the fraction MOVED of the furniture stands elsewhere than when it was mapped; stamps of
/// scans are off by JITTER seconds (1 sigma).
int main(int argc, char** argv) {
  const std::vector<std::string> words(argv + 1, argv + argc);
  if (words.size() >= 2 && words[0] == "--make") return parhelion::make(words);
  std::map<std::string, std::string> options;
  for (std::size_t i = 1; i + 1 < words.size(); i += 2) options[words[i]] = words[i + 1];
  if (options.contains("--truth") || options.contains("--map")) {
    parhelion::Recorded recorded{words[0], {}};
    if (options.contains("--scenario")) recorded.scenario = options["--scenario"];
    if (options.contains("--truth") && options.contains("--map"))
      return parhelion::compare_references(recorded, options["--map"], options["--truth"]);
    const std::string kind = options.contains("--truth") ? "--truth" : "--map";
    return parhelion::measure(recorded, kind, options[kind]);
  }
  std::fprintf(
      stderr,
      "usage: bench_server_phantoms LOG [--scenario FILE] [--map SIMPLEMAP] [--truth LOG], or --make "
      "FOLDER [SEED [PEOPLE [MOVED [JITTER]]]]\n");
  return 2;
}
