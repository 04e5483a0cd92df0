#include "tools/robot/new_lasers.hpp"

#include <algorithm>
#include <cmath>

#include "fusion/scan/laser_learning.hpp"
#include "protocols/channel_map.hpp"
#include "protocols/channels.hpp"
#include "protocols/robot.hpp"
#include "tools/robot/laser_links.hpp"

namespace parhelion::tools {
namespace {

/// A laser after the first.
struct FurtherPlace {
  std::string name;
  LaserPlace place;
};

class LaserWriter {
 public:
  LaserWriter(const LaserSources& sources, DescriptionText& text, std::vector<std::string>& notes)
      : urdf_(sources.urdf),
        log_(sources.log),
        given_(sources.given),
        dialogue_(sources.dialogue),
        text_(text),
        notes_(notes) {}

  bool write() {
    const auto first = first_place();
    if (!first) return false;
    taken_.push_back(*first);
    for (const std::string& each : given_) take_given(each);
    text_.line("laser:");
    text_.line("  pose: " + pose_text(first->T_base_laser, false), first->source());
    values(log_ ? log_->laser : std::nullopt, "  ", true);
    if (log_) {
      take_further_of_log();
      write_further();
      note_unseen();
    } else {
      take_likely_further(*first);
      write_further();
    }
    return true;
  }

 private:
  std::optional<LaserPlace> first_place() const {
    const auto given = std::find_if(given_.begin(), given_.end(), [](const std::string& each) {
      return each.find('=') == std::string::npos;
    });
    if (given != given_.end()) return read_laser_place(urdf_, *given);
    const bool needed = log_ && log_->laser;
    const auto likely = likely_lasers(urdf_, {});
    return dialogue_.answer(
        "Link of the laser on SCAN, or its position x,y,z,yaw in m and degrees (- for none)",
        likely.empty() ? "-" : likely.front().link, [&](const std::string& answer) {
          const auto place = read_laser_place(urdf_, answer);
          if (!place && needed) {
            throw WrongAnswer{
                "the log has scans, and no link of the URDF is named like a laser: give the link of the "
                "laser, "
                "or its position x,y,z,yaw in m and degrees (--laser LINK or --laser X,Y,Z,YAW)"};
          }
          return place;
        });
  }

  /// "NAME=PLACE".
  void take_given(const std::string& text) {
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos) return;
    const auto place = read_laser_place(urdf_, text.substr(equals + 1));
    if (place) add_further(text.substr(0, equals), *place);
  }

  void add_further(const std::string& name, const LaserPlace& place) {
    if (const std::string fault = sensor_name_fault(name); !fault.empty())
      throw WrongAnswer{"name of a further laser '" + name + "': " + fault};
    if (has_further(name)) throw WrongAnswer{"two lasers are called '" + name + "'"};
    further_.push_back({name, place});
    taken_.push_back(place);
  }

  bool has_further(const std::string& name) const {
    return std::any_of(further_.begin(), further_.end(),
                       [&](const FurtherPlace& each) { return each.name == name; });
  }

  /// Lasers whose scans the log has.
  void take_further_of_log() {
    for (const auto& [channel, survey] : log_->further_lasers) {
      const std::string name(parse_sensor_channel(channel).sensor);
      if (has_further(name)) continue;
      const auto likely = likely_lasers(urdf_, taken_);
      auto link = std::find_if(likely.begin(), likely.end(), [&](const LaserPlace& each) {
        return laser_name(each.link, 0) == name || each.link.find(name) != std::string::npos;
      });
      if (link == likely.end() && likely.size() == 1) link = likely.begin();
      const auto place =
          dialogue_.answer("Link of the laser on " + channel + ", or its position x,y,z,yaw (- for none)",
                           link == likely.end() ? "-" : link->link,
                           [&](const std::string& answer) { return read_laser_place(urdf_, answer); });
      if (place) {
        add_further(name, *place);
      } else {
        notes_.push_back("the log has messages on " + channel +
                         ", but no link of the URDF is known for their laser: add it to 'lasers', or give it "
                         "with --laser " +
                         name + "=LINK or --laser " + name + "=X,Y,Z,YAW");
      }
    }
  }

  /// Without a log each link that may be a laser is taken for one.
  void take_likely_further(const LaserPlace& first) {
    for (const LaserPlace& each : likely_lasers(urdf_, taken_)) {
      const std::string likely = laser_name(each.link, further_.size() + 2);
      const bool taken = dialogue_.answer(
          "'" + each.link + "' looks like a further laser: its name, as in SCAN_<name> (- if it is none)",
          has_further(likely) ? "laser" + std::to_string(further_.size() + 2) : likely,
          [&](const std::string& answer) {
            if (answer != "-") add_further(answer, each);
            return answer != "-";
          });
      if (!taken) continue;
      notes_.push_back((first.link.empty() ? "the given position" : "'" + first.link + "'") +
                       " is taken for the laser on SCAN, '" + each.link + "' for the one on " +
                       sensor_channel(channel::kScan, further_.back().name) +
                       ": if they are the other way round, or one is none, name them with --laser LINK and "
                       "--laser NAME=LINK");
    }
  }

  /// Links that look like lasers whose scans the log does not have: what to write is in the file.
  void note_unseen() {
    for (const LaserPlace& each : likely_lasers(urdf_, taken_)) {
      const std::string name = laser_name(each.link, further_.size() + 2);
      const std::string channel = sensor_channel(channel::kScan, name);
      text_.line("# '" + each.link + "' looks like a further laser, but the log has no messages on " +
                 channel + ". If it is one, publish them, and write:");
      text_.line("# lasers:");
      text_.line("#   - name: " + name);
      text_.line("#     pose: " + pose_text(each.T_base_laser, false));
      text_.line("#     # and the other values of 'laser'");
      notes_.push_back("'" + each.link + "' looks like a further laser, but the log has no messages on " +
                       channel + ": it is left out; what to write is in the file, as a comment");
    }
  }

  void write_further() {
    if (further_.empty()) return;
    text_.line("lasers:");
    for (const FurtherPlace& each : further_) {
      text_.line("  - name: " + each.name);
      text_.line("    pose: " + pose_text(each.place.T_base_laser, false), each.place.source());
      const auto seen = log_ ? log_->further_lasers.find(sensor_channel(channel::kScan, each.name))
                             : std::map<std::string, LaserSurvey>::const_iterator();
      values(log_ && seen != log_->further_lasers.end() ? std::optional(seen->second) : std::nullopt, "    ",
             false);
    }
  }

  /// A value that only a person knows; of a further laser it is that of the first.
  void asked(const std::string& key, const std::string& question, std::string& value, const char* unit,
             const std::string& indent, bool first) {
    const std::string likely = value;
    if (first) value = dialogue_.number(question, likely);
    text_.line(indent + key + ": " + value + unit, !first            ? "[guess] as of the first laser"
                                                   : value == likely ? "[guess]"
                                                                     : "[answer]");
  }

  void values(const std::optional<LaserSurvey>& seen, const std::string& indent, bool first) {
    if (seen) {
      from_log(*seen, indent, first);
    } else {
      asked("range_max", "Greatest range of the laser, m", range_max_, " m", indent, first);
      asked("scan_period", "Time of one scan, s", scan_period_, " s", indent, first);
    }
    if (first) {
      stamp_beam_ = dialogue_.answer(
          "Beam that a scan's stamp means: first, middle or last", "first", [](const std::string& stamp) {
            if (stamp != "first" && stamp != "middle" && stamp != "last")
              throw WrongAnswer{"beam of the stamp: expected first, middle or last, found '" + stamp + "'"};
            return stamp;
          });
    }
    text_.line(indent + "stamp_beam: " + stamp_beam_, "[guess] read the driver");
  }

  /// The limits in the log's own description, such as of a laser preset, where no range in the log is outside
  /// them: the robot need not have met its sensor's limits.
  bool take_described_ranges(const LaserSurvey& survey, RangeConvention& ranges) const {
    if (log_->robot_yaml.empty()) return false;
    const auto robot = parse_robot_description(log_->robot_yaml, log_->path + ", ROBOT");
    if (!robot || !robot->laser) return false;
    const RangeConvention& known = robot->laser->convention;
    if (known.range_min > survey.min_range || known.range_max < survey.max_range) return false;
    if (survey.repeated && known.range_max > *survey.repeated) return false;
    ranges.range_min = known.range_min;
    ranges.range_max = known.range_max;
    return true;
  }

  void from_log(const LaserSurvey& survey, const std::string& indent, bool first) {
    LaserDescription laser = laser_seen(survey);
    const RangeConvention& ranges = laser.convention;
    using Sentinel = RangeConvention::Sentinel;
    const auto line = [&](const std::string& content, const std::string& source) {
      text_.line(indent + content, source);
    };
    const bool described = first && take_described_ranges(survey, laser.convention);
    const char* source = "[log] ROBOT";
    line("range_min: " + metres_text(std::floor(double{ranges.range_min} * 1e4 + 1e-3) / 1e4),
         described ? source : "[log] least range seen; the data sheet's is better");
    line("range_max: " + metres_text(std::ceil(double{ranges.range_max} * 1e4 - 1e-3) / 1e4),
         described         ? source
         : survey.repeated ? "[log] the value without a return"
                           : "[log] greatest range seen; the data sheet's is better");
    const std::string no_return = ranges.no_return == Sentinel::infinity ? "infinity"
                                  : ranges.no_return == Sentinel::nan
                                      ? "nan"
                                      : metres_text(double{ranges.no_return_value});
    line("no_return: " + no_return, "[log] " + no_return_fraction(survey));
    if (ranges.too_close == Sentinel::nan) {
      line("too_close: nan", "[guess] 0 is no return");
    } else if (survey.zero > 0) {
      line("too_close: 0 m", "[log] zeros occur");
    }
    line("scan_period: " + formatted("%.4g s", laser.scan_period), "[log] median of the stamps");
    line("beam_interval: " + formatted("%.4g s", laser.beam_interval),
         laser.beam_interval == 0 ? "[log] turns show that the beams are measured at once"
         : laser.beam_interval < 0
             ? "[log] [guess] of a mirror that turns once a scan; turns show that the last beam is the first"
             : "[log] [guess] of a mirror that turns once a scan; calibrate can find its sign");
    line("beams: " + std::to_string(laser.beams), "[log]");
    line("angle_min: " + degrees_text(laser.angle_min), "[log]");
    line("angle_increment: " + degrees_text(laser.angle_increment), "[log]");
    if (laser.intensities) line("intensities: true", "[log]");
    const auto learned = scan::learn_laser(survey.scans, laser);
    if (!learned) return line("noise_sigma: 0.01 m", "[guess] " + learned.error().message);
    line("noise_sigma: " + metres_text(learned->sigma), "[log] from returns on walls");
    if (learned->quantization > 0) line("quantization: " + metres_text(learned->quantization), "[log]");
  }

  static std::string no_return_fraction(const LaserSurvey& survey) {
    const double fraction =
        survey.repeated ? survey.repeated_fraction : std::max({survey.infinite, survey.nan, survey.zero});
    return fraction > 0 ? formatted("%.1f %% of the beams", 100 * fraction)
                        : "[guess] no beam without a return";
  }

  const UrdfOutline& urdf_;
  const std::optional<LogSurvey>& log_;
  const std::vector<std::string>& given_;
  const Dialogue& dialogue_;
  DescriptionText& text_;
  std::vector<std::string>& notes_;
  std::vector<LaserPlace> taken_;  ///< of all lasers so far
  std::vector<FurtherPlace> further_;
  std::string range_max_ = "10", scan_period_ = "0.1", stamp_beam_;  ///< of the first laser, m and s
};

}  // namespace

bool write_lasers(const LaserSources& sources, DescriptionText& text, std::vector<std::string>& notes) {
  return LaserWriter(sources, text, notes).write();
}

}  // namespace parhelion::tools
