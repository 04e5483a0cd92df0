// CARMEN logs: FLASER, RLASER, ROBOTLASER1, ODOM, TRUEPOS.
#include "protocols/channels.hpp"
#include "tools/import/carmen_line.hpp"
#include "tools/import/first_stamp.hpp"
#include "tools/import/importers.hpp"
#include "tools/import/laser_evidence.hpp"
#include "tools/import/recording_writer.hpp"
#include "tools/import/text_lines.hpp"

namespace parhelion::tools {
namespace {

struct LaserSeen {
  LaserEvidence evidence;
  Transform<Base, Laser> T_base_laser;
  std::uint64_t scans = 0, elsewhere = 0;
};

/// Content of the file, collected before the first event is written.
struct Survey {
  std::map<std::string, LaserSeen> lasers;
  std::map<std::string, std::string> parameters;
  std::uint64_t odometry = 0, true_poses = 0;
  FirstStamp first_stamp;

  void see(SensorTime stamp) { first_stamp.add(stamp); }
  void take(const CarmenLaser& line) {
    see(line.scan.stamp);
    LaserSeen& laser = lasers[line.kind];
    const Transform<Base, Laser> T_base_laser = line.T_odom_base.inverse() * line.T_odom_laser;
    if (laser.scans++ == 0) {
      laser.T_base_laser = T_base_laser;
      laser.evidence.T_base_laser = T_base_laser;
      // The driver sends a scan when it is complete.
      laser.evidence.stamp_beam = LaserDescription::StampBeam::last;
      laser.evidence.range_max = line.range_max;
      laser.evidence.source = line.statement;
    } else if ((T_base_laser.translation() - laser.T_base_laser.translation()).norm() > 0.01) {
      ++laser.elsewhere;
    }
    laser.evidence.add(line.scan);
  }
  void take(const CarmenOdometry& line) {
    ++odometry;
    see(line.odometry.stamp);
  }
  void take(const CarmenTruePose&) { ++true_poses; }
  void take(const CarmenParameter& line) {
    if (line.name.starts_with("robot_")) parameters[line.name] = line.value;
  }
  void take(const CarmenOther&) {}
};

/// Calls take(line, number) for each valid line, damage(number, why) where the file cannot be read or a line
/// is not complete, and refuse(number, why) for other lines; an error stops it.
template <class Take, class Refuse, class Damage>
Status each_line(const ImportOptions& options, const ImportProgress& progress, double half, Take take,
                 Refuse refuse, Damage damage) {
  auto lines = TextLines::open(options.input);
  if (!lines) return lines.error();
  std::string text;
  for (;;) {
    const auto more = lines->next(text);
    if (!more) {
      damage(lines->number() + 1, more.error().message);
      continue;
    }
    if (!*more) return {};
    const Place place = lines->number();
    bool damaged = false;
    const auto line = parse_carmen_line(text, damaged);
    if (!line && damaged) {
      damage(place, line.error().message);
    } else if (!line) {
      refuse(place, line.error().message);
    } else if (!lines->ended_by_break() && is_cut_carmen_kind(text)) {
      damage(place, "the file ends inside this line, after '" + text + "'");
    } else if (Status taken = std::visit([&](const auto& kind) { return take(kind, place); }, *line);
               !taken) {
      return taken;
    }
    if (progress && place % 256 == 0)
      progress(half * lines->bytes_total() + lines->bytes_read() / 2, lines->bytes_total());
  }
}

class Copy {
 public:
  Copy(RecordingWriter& writer, std::string laser, bool truth, bool odometry)
      : writer_(writer), laser_(std::move(laser)), truth_(truth), odometry_(odometry) {}

  /// A laser line contains the odometry at the scan. It is written first, so that the scan can use it.
  Status operator()(const CarmenLaser& line, Place place) {
    writer_.count_read();
    if (line.kind != laser_) return leave_out(line.kind);
    if (odometry_) {
      if (Status done = writer_.put(channel::kOdometry, Odometry{line.scan.stamp, line.T_odom_base}, place);
          !done) {
        return done;
      }
    }
    return writer_.put(channel::kScan, line.scan, place);
  }
  Status operator()(const CarmenOdometry& line, Place place) {
    writer_.count_read();
    return odometry_ ? writer_.put(channel::kOdometry, line.odometry, place) : leave_out("ODOM");
  }
  Status operator()(const CarmenTruePose& line, Place place) {
    writer_.count_read();
    return truth_ ? writer_.put(channel::kReferencePose, line.pose, place) : leave_out("TRUEPOS");
  }
  Status operator()(const CarmenParameter&, Place) {
    writer_.count_read();
    return leave_out("PARAM");
  }
  Status operator()(const CarmenOther& line, Place) {
    writer_.count_read();
    return leave_out(line.kind == "#" ? "comment or empty line" : line.kind);
  }

 private:
  Status leave_out(const std::string& kind) {
    writer_.leave_out(kind);
    return {};
  }

  RecordingWriter& writer_;
  std::string laser_;
  bool truth_, odometry_;
};

Result<RobotDescription> describe(const ImportOptions& options, const Survey& survey, const LaserSeen& seen,
                                  std::vector<std::string>& notes) {
  auto laser = seen.evidence.describe(options, notes);
  if (!laser) return laser.error();
  if (seen.elsewhere > 0) {
    notes.push_back(std::to_string(seen.elsewhere) +
                    " scans have another laser pose than the first; the description has that of the first");
  }
  RobotDescription robot = describe_robot(options, std::move(*laser), notes);
  robot.source += "; " + joined(notes);
  for (const auto& [name, value] : survey.parameters) robot.source += "; " + name + " " + value;
  return robot;
}

}  // namespace

Result<ImportReport> import_carmen(const ImportOptions& options, const ImportProgress& progress) {
  Survey survey;
  const auto look = [&](const auto& line, Place) { return survey.take(line), Status{}; };
  const auto skip = [](Place, const std::string&) {};
  if (const Status read = each_line(options, progress, 0, look, skip, skip); !read) return read.error();
  std::vector<std::string> kinds;
  for (const auto& [kind, seen] : survey.lasers) kinds.push_back(kind);
  const auto laser = choose_topic(options, channel::kScan, kinds, "kind of laser line");
  if (!laser) return laser.error();
  if (!*laser) {
    return Error{options.input.string() +
                 ": no line that can be read as a laser scan: FLASER, RLASER or ROBOTLASER1 is "
                 "expected"};
  }
  const auto truth = choose_topic(
      options, channel::kReferencePose,
      survey.true_poses > 0 ? std::vector<std::string>{"TRUEPOS"} : std::vector<std::string>{}, "true pose");
  if (!truth) return truth.error();
  const auto odometry = choose_topic(options, channel::kOdometry, {"ODOM"}, "odometry");
  if (!odometry) return odometry.error();

  std::vector<std::string> notes;
  const auto robot = describe(options, survey, survey.lasers.at(**laser), notes);
  if (!robot) return robot.error();
  auto writer = RecordingWriter::create(options, options.input.filename().string() + ":", "lines");
  if (!writer) return writer.error();
  for (std::string& note : notes) writer->note(std::move(note));
  if (const Status written = writer->describe(*robot, *survey.first_stamp.get()); !written)
    return written.error();
  const Status read = each_line(
      options, progress, 0.5, Copy(*writer, **laser, truth->has_value(), odometry->has_value()),
      [&](Place place, const std::string& why) {
        writer->count_read();
        writer->refuse(place, why);
      },
      [&](Place place, const std::string& why) {
        writer->count_read();
        writer->refuse_damage(place, why);
      });
  if (!read) return read.error();
  return writer->finish();
}

}  // namespace parhelion::tools
