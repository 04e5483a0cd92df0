#include "tests/loop/log_checks.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <optional>

#include "protocols/bus/log_file.hpp"
#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "protocols/nearest_on_segment.hpp"
#include "protocols/pose2.hpp"

namespace parhelion::test {
namespace {

constexpr double kRounding = 1e-5;  // relative, of floats on the wire

std::vector<Message> read(const std::string& path, std::vector<std::string>& problems) {
  std::vector<Message> messages;
  auto reader = LogReader::open(path);
  if (!reader) problems.push_back(reader.error().message);
  while (reader) {
    auto next = reader->next();
    if (!next) {
      problems.push_back(next.error().message);
      break;
    }
    if (!*next) break;
    messages.push_back(std::move(**next));
  }
  return messages;
}

std::uint32_t bits(float value) { return std::bit_cast<std::uint32_t>(value); }

/// m from the outline to a point of base_link outside; 0 inside.
double gap(const std::vector<Eigen::Vector2d>& outline, const Eigen::Vector2d& p) {
  double nearest = 1e9;
  bool inside = true;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Eigen::Vector2d &a = outline[i], &b = outline[(i + 1) % outline.size()];
    const Eigen::Vector2d along = b - a;
    inside = inside && along.x() * (p - a).y() - along.y() * (p - a).x() >= 0;
    nearest = std::min(nearest, (nearest_on_segment(p, a, b) - p).norm());
  }
  return inside ? 0 : nearest;
}

class Checker {
 public:
  Checker(const RobotDescription& robot, double silence) : robot_(robot), silence_(silence) {}

  void take(const Message& message) {
    if (message.channel == channel::kScan) {
      handle_scan(message);
    } else if (message.channel == channel::kMrScan) {
      handle_augmented(message);
    } else if (message.channel == channel::kMrScanInfo) {
      handle_info(message);
    } else if (message.channel == channel::kTeleop) {
      handle_teleop(message);
    } else if (message.channel == channel::kMrCmd) {
      handle_command(message);
    } else if (message.channel == channel::kMrEvents) {
      handle_event(message);
    } else if (message.channel == channel::kJointCmd || message.channel == channel::kMrJointCmd) {
      handle_joints(message);
    } else if (message.channel == channel::kJointState) {
      handle_encoders(message);
    } else if (message.channel == channel::kCamera) {
      images_.push_back(*leading_stamp(message.payload));
    } else if (message.channel == channel::kMrCamera) {
      handle_image(message);
    }
    end_ = message.arrival;
  }

  LogFindings result() {
    for (const auto& [stamp, scan] : scans_) {
      expect(scan.answers == 1, "promise 2: a scan has " + std::to_string(scan.answers) + " MR_SCAN");
      expect(scan.infos == 1, "promise 2: a scan has " + std::to_string(scan.infos) + " MR_SCAN_INFO");
    }
    check_silence(end_);
    return findings_;
  }

 private:
  struct Answered {
    Scan real, augmented;
    int answers = 0, infos = 0;
  };

  void expect(bool holds, const std::string& otherwise) {
    if (!holds && ++reported_[otherwise] <= 3) findings_.violations.push_back(otherwise);
  }
  template <class Type>
  bool decoded(const Message& message, Type& value) {
    const Status read = decode(message.channel, message.payload, value);
    expect(read.ok(), read.ok() ? "" : read.error().message);
    return read.ok();
  }

  void handle_scan(const Message& message) {
    Scan scan;
    if (!decoded(message, scan)) return;
    ++findings_.scans;
    expect(!scans_.contains(scan.stamp.ns), "two scans have one stamp");
    scans_[scan.stamp.ns].real = scan;
  }
  void handle_augmented(const Message& message) {
    Scan scan;
    if (!decoded(message, scan)) return;
    const auto asked = scans_.find(scan.stamp.ns);
    expect(asked != scans_.end(), "promise 2: an MR_SCAN without a scan");
    if (asked == scans_.end()) return;
    ++asked->second.answers;
    asked->second.augmented = std::move(scan);
  }
  void handle_info(const Message& message) {
    ScanInfo info;
    if (!decoded(message, info)) return;
    const auto asked = scans_.find(info.stamp.ns);
    expect(asked != scans_.end() && asked->second.answers > 0, "an MR_SCAN_INFO without an MR_SCAN");
    if (asked == scans_.end() || asked->second.answers == 0) return;
    ++asked->second.infos;
    expect(info.live || !info.reason.empty(), "promise 2: an unchanged scan without a reason");
    if (!info.live) ++findings_.reasons[info.reason];
    check_beams(asked->second, info);
  }
  void check_beams(const Answered& scan, const ScanInfo& info) {
    const std::size_t beams = scan.real.ranges.size();
    expect(scan.augmented.ranges.size() == beams, "promise 1: another number of beams");
    expect(scan.augmented.intensities.size() == scan.real.intensities.size(),
           "promise 1: another number of intensities");
    expect(!info.live || info.beam_agent.size() == beams, "MR_SCAN_INFO has another number of beams");
    if (scan.augmented.ranges.size() != beams) return;
    bool shown = false;
    for (std::size_t i = 0; i < beams; ++i) {
      const bool replaced = i < info.beam_agent.size() && info.beam_agent[i] >= 0;
      check_beam(scan.real.ranges[i], scan.augmented.ranges[i], replaced);
      if (!replaced) continue;
      shown = true;
      ++findings_.beams_replaced;
      note_distance(scan.augmented, i);
    }
    findings_.scans_shown += shown;
    expect(info.live || !shown, "promise 2: a scan that is not live was changed");
  }
  void check_beam(float real, float out, bool replaced) {
    const RangeConvention& convention = robot_.laser->convention;
    if (!replaced)
      return expect(bits(real) == bits(out), "promise 1: a beam that is not replaced has changed");
    const BeamKind kind = convention.classify(real);
    expect(kind == BeamKind::hit || kind == BeamKind::no_return,
           "promise 1: an invalid or too close beam was replaced");
    const BeamKind written = convention.classify(out);
    expect(written == BeamKind::hit || written == BeamKind::too_close, "promise 1: replaced by no return");
    if (kind == BeamKind::hit && written == BeamKind::hit)
      expect(out < real, "promise 1: a real return was lengthened");
  }
  void note_distance(const Scan& scan, std::size_t beam) {
    const double range = scan.ranges[beam];
    const double angle = scan.angle_min + static_cast<double>(beam) * scan.angle_increment;
    const Eigen::Vector3d p =
        robot_.laser->T_base_laser * Eigen::Vector3d(range * std::cos(angle), range * std::sin(angle), 0);
    findings_.nearest_shown = std::min(findings_.nearest_shown, gap(robot_.footprint, p.head<2>()));
  }

  void handle_teleop(const Message& message) {
    check_silence(message.arrival);
    TwistCommand command;
    if (!decoded(message, command)) return;
    teleops_[command.stamp.ns] = command.twist;
    if (command.twist.vx != 0 || command.twist.wz != 0) findings_.limited_by = limited_by_;
    received_ = message.arrival;
    stopped_since_ = false;
  }
  void handle_command(const Message& message) {
    TwistCommand command;
    if (!decoded(message, command)) return;
    ++findings_.commands;
    const Twist2& twist = command.twist;
    const bool moves = twist.vx != 0 || twist.vy != 0 || twist.wz != 0;
    if (!moves) stopped_since_ = true;
    if (!moves) return;
    const auto asked = teleops_.find(command.stamp.ns);
    expect(asked != teleops_.end(), "promise 3: a motion that no TELEOP asked for");
    expect(received_ && (message.arrival - *received_).seconds() < silence_ + 0.01,
           "promise 3: a motion although TELEOP is silent");
    expect(std::abs(twist.vx) <= robot_.limits.speed * (1 + kRounding) &&
               std::abs(twist.wz) <= robot_.limits.yaw_rate * (1 + kRounding),
           "promise 3: faster than the robot's limits");
    if (asked != teleops_.end()) check_scale(asked->second, twist);
  }
  void check_scale(const Twist2& asked, const Twist2& given) {
    const double dot = asked.vx * given.vx + asked.vy * given.vy + asked.wz * given.wz;
    const double scale = dot / (asked.vx * asked.vx + asked.vy * asked.vy + asked.wz * asked.wz);
    const auto is_scaled = [&](double a, double g) { return std::abs(g - scale * a) <= kRounding; };
    expect(scale >= 0 && scale <= 1 + kRounding, "promise 3: a command that is not reduced but changed");
    expect(is_scaled(asked.vx, given.vx) && is_scaled(asked.vy, given.vy) && is_scaled(asked.wz, given.wz),
           "promise 3: not one factor for all components");
    findings_.commands_reduced += scale < 1 - kRounding;
  }
  /// A stop has followed the silence before `now`.
  void check_silence(ArrivalTime now) {
    constexpr double kStopPeriod = 0.1, kStep = 0.02;  // s
    if (!received_ || (now - *received_).seconds() < silence_ + kStopPeriod + kStep) return;
    expect(stopped_since_, "promise 3: no stop although TELEOP is silent");
  }

  /// A motion of the arm has been asked for, with that stamp and to that place.
  void handle_joints(const Message& message) {
    Joints joints;
    if (!decoded(message, joints)) return;
    if (message.channel == channel::kJointCmd) {
      asked_joints_[joints.stamp.ns] = joints;
      return;
    }
    const bool moves = std::any_of(joints.velocities.begin(), joints.velocities.end(),
                                   [](double velocity) { return velocity != 0; }) ||
                       (joints.velocities.empty() && !joints.positions.empty());
    if (!moves) return;
    ++findings_.joint_commands;
    const auto asked = asked_joints_.find(joints.stamp.ns);
    expect(asked != asked_joints_.end() && asked->second.names == joints.names,
           "promise 3: a motion of joints that no JOINT_CMD asked for");
  }
  void handle_encoders(const Message& message) {
    Joints joints;
    if (!decoded(message, joints)) return;
    for (std::size_t i = 0; i < joints.names.size(); ++i)
      findings_.joints[joints.names[i]] = joints.positions[i];
  }

  void handle_event(const Message& message) {
    Event event;
    if (!decoded(message, event)) return;
    if (event.kind == EventKind::speed_limited) limited_by_ = event.text;
    if (event.kind == EventKind::speed_limit_lifted) limited_by_.clear();
    if (event.kind != EventKind::contact_started) return;
    const bool is_robots = event.subject == robot_.name || event.object == robot_.name;
    if (!is_robots || event.pair != PairKind::real_virtual) return;
    ++(event.undetectable ? findings_.unsensed_contacts : findings_.contacts);
  }
  /// Each image at most once, and none that the camera did not send.
  void handle_image(const Message& message) {
    const auto found = std::find(images_.begin(), images_.end(), *leading_stamp(message.payload));
    expect(found != images_.end(), "promise 2: an MR_CAMERA without an image, or a second one");
    if (found != images_.end()) images_.erase(images_.begin(), found + 1);
  }

  const RobotDescription& robot_;
  double silence_;
  LogFindings findings_;
  std::map<std::string, int> reported_;
  std::map<std::int64_t, Answered> scans_;
  std::map<std::int64_t, Twist2> teleops_;
  std::map<std::int64_t, Joints> asked_joints_;
  std::vector<SensorTime> images_;
  std::string limited_by_;  ///< now
  std::optional<ArrivalTime> received_;
  bool stopped_since_ = true;
  ArrivalTime end_;
};

bool is_output(const std::string& channel) {
  return (channel.starts_with("MR_") && channel != channel::kMrStatus && !channel.ends_with("_TELEOP") &&
          !(channel.starts_with("MR_AGENT_") && channel.ends_with("_JOINT_CMD"))) ||
         channel == channel::kHazard;
}

}  // namespace

LogFindings check_log(const std::string& path, const RobotDescription& robot, double teleop_silence) {
  Checker checker(robot, teleop_silence);
  std::vector<std::string> problems;
  for (const Message& message : read(path, problems)) checker.take(message);
  LogFindings findings = checker.result();
  findings.violations.insert(findings.violations.end(), problems.begin(), problems.end());
  return findings;
}

std::string output_difference(const std::string& log, const std::string& replayed) {
  std::map<std::string, std::vector<std::vector<std::uint8_t>>> outputs[2];
  std::vector<std::string> problems;
  for (const int i : {0, 1}) {
    for (Message& message : read(i == 0 ? log : replayed, problems)) {
      if (is_output(message.channel)) outputs[i][message.channel].push_back(std::move(message.payload));
    }
  }
  for (const std::string& problem : problems) return problem;
  if (outputs[0].empty()) return log + " has no outputs";
  for (const auto& [channel, messages] : outputs[0]) {
    const auto& others = outputs[1][channel];
    if (messages.size() != others.size())
      return channel + ": " + std::to_string(messages.size()) + " messages, " +
             std::to_string(others.size()) + " replayed";
    const auto differs = std::mismatch(messages.begin(), messages.end(), others.begin()).first;
    if (differs != messages.end())
      return channel + ": message " + std::to_string(differs - messages.begin()) + " differs";
  }
  return outputs[0].size() == outputs[1].size() ? "" : "replay has other channels";
}

}  // namespace parhelion::test
