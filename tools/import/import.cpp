#include "tools/import/import.hpp"

#include <algorithm>
#include <cstdio>

#include "protocols/channel_map.hpp"
#include "protocols/channels.hpp"
#include "tools/import/bag_source.hpp"
#include "tools/import/importers.hpp"
#include "tools/import/text_lines.hpp"

namespace parhelion::tools {
namespace {

std::string grouped(std::uint64_t n) {
  std::string digits = std::to_string(n);
  for (auto at = static_cast<std::ptrdiff_t>(digits.size()) - 3; at > 0; at -= 3) {
    digits.insert(static_cast<std::size_t>(at), ",");
  }
  return digits;
}

std::string seconds_text(Duration duration) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f s", duration.seconds());
  return text;
}

bool is_text(const std::string& head) {
  return std::all_of(head.begin(), head.end(), [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return byte >= 0x20 || byte == '\n' || byte == '\r' || byte == '\t';
  });
}

/// Rawlogs start with an object: 0x80 | length of its class name, and the name.
bool starts_with_object(const std::string& head) {
  if (head.size() < 8) return false;
  const auto length = static_cast<std::size_t>(static_cast<unsigned char>(head[0]) & 0x7F);
  const std::string name = head.substr(1, length);
  return (head[0] & 0x80) != 0 && (name.starts_with("C") || name.starts_with("mrpt::"));
}

}  // namespace

std::uint64_t ImportReport::kept() const {
  std::uint64_t sum = 0;
  for (const ChannelReport& channel : channels) sum += channel.kept;
  return sum;
}

const ChannelReport* ImportReport::find(const std::string& channel) const {
  const auto known = std::find_if(channels.begin(), channels.end(),
                                  [&](const ChannelReport& report) { return report.channel == channel; });
  return known == channels.end() ? nullptr : &*known;
}

std::string summary_line(const ImportReport& report) {
  std::string line =
      "read " + grouped(report.read) + " " + report.read_unit + " of " + report.input + ": kept";
  const char* separator = " ";
  for (const ChannelReport& channel : report.channels) {
    line += separator + grouped(channel.kept) + " " + channel.channel;
    separator = ", ";
  }
  std::uint64_t left_out = 0;
  for (const auto& [kind, count] : report.left_out) left_out += count;
  line += "; left out " + grouped(left_out) + ", refused " + grouped(report.refused) + " -> " + report.output;
  return line;
}

std::vector<std::string> findings(const ImportReport& report) {
  std::vector<std::string> lines;
  std::uint64_t unlisted = report.refused;
  for (const Refusal& refusal : report.refusals) {
    const std::string more = refusal.more > 0 ? " and " + grouped(refusal.more) + " more" : "";
    lines.push_back("refused " + refusal.place + more + ": " + refusal.why);
    unlisted -= 1 + refusal.more;
  }
  if (unlisted > 0) lines.push_back("refused " + grouped(unlisted) + " more, for other reasons");
  if (report.damaged > 0) {
    lines.push_back(report.input + " is cut off or damaged at " + grouped(report.damaged) +
                    (report.damaged == 1 ? " place: " : " places: ") + report.output +
                    " has only what could be read");
  }
  for (const ChannelReport& channel : report.channels) {
    if (channel.backward > 0) {
      lines.push_back(
          channel.channel + ": " + grouped(channel.backward) +
          (channel.backward == 1 ? " stamp goes backwards, by " : " stamps go backwards, by up to ") +
          seconds_text(channel.backward_max) + ", first at " + channel.backward_first +
          "; kept in file order");
    }
    if (channel.gaps > 0) {
      lines.push_back(channel.channel + ": " + grouped(channel.gaps) +
                      (channel.gaps == 1 ? " gap, of " : " gaps, the longest ") +
                      seconds_text(channel.gap_max) + " before " + channel.gap_max_place);
    }
    if (channel.beams.size() > 1) {
      std::string line = channel.channel + ": numbers of beams differ:";
      for (const auto& [beams, count] : channel.beams) {
        line += " " + grouped(count) + " x " + std::to_string(beams);
      }
      lines.push_back(line);
    }
  }
  if (report.ahead > 0) {
    lines.push_back(grouped(report.ahead) + " stamps far ahead of the previous ones, first at " +
                    report.ahead_first + " by " + seconds_text(report.ahead_first_by) +
                    "; these events get the arrival time of the previous ones");
  }
  for (const std::string& place : report.leaps)
    lines.push_back("time jumps ahead before " + place + " and stays there");
  for (const auto& [kind, count] : report.left_out)
    lines.push_back("left out " + grouped(count) + " x " + kind);
  for (const std::string& note : report.notes) lines.push_back("note: " + note);
  return lines;
}

Result<std::optional<std::string>> choose_topic(const ImportOptions& options, const std::string& channel,
                                                const std::vector<std::string>& candidates,
                                                const std::string& what) {
  const auto list = [&] {
    std::string text;
    for (const std::string& name : candidates) text += "\n  --topics '" + channel + "=" + name + "'";
    return text;
  };
  const auto asked = options.topics.find(channel);
  if (asked != options.topics.end()) {
    if (asked->second == "none") return std::optional<std::string>();
    if (std::find(candidates.begin(), candidates.end(), asked->second) != candidates.end()) {
      return std::optional<std::string>(asked->second);
    }
    return Error{options.input.string() + ": " + channel + "=" + asked->second + ": no " + what +
                 " of that name; there " + (candidates.empty() ? "is none" : "are:" + list())};
  }
  if (candidates.empty()) return std::optional<std::string>();
  if (candidates.size() == 1) return std::optional<std::string>(candidates[0]);
  return Error{options.input.string() + ": several sources for " + channel + " (" + what +
               "); choose one, or " + channel + "=none:" + list()};
}

bool is_further_scan(const std::string& channel) {
  const std::string start = std::string(channel::kScan) + "_";
  return channel.starts_with(start) && sensor_name_fault(channel.substr(start.size())).empty();
}

Result<LaserTopics> choose_lasers(const ImportOptions& options, std::vector<std::string> candidates,
                                  const std::string& what) {
  LaserTopics chosen;
  if (options.topics.count(channel::kLines) > 0) {
    const auto lines = choose_topic(options, channel::kLines, candidates, what);
    if (!lines) return lines.error();
    chosen.lines = *lines;
    if (*lines) std::erase(candidates, **lines);
  }
  const auto scan = choose_topic(options, channel::kScan, candidates, what);
  if (!scan) return scan.error();
  chosen.scan = *scan;
  return chosen;
}

namespace {

/// pcap in either byte order, with stamps of us or ns, and pcapng.
bool is_packet_capture(std::string_view head) {
  for (const std::string_view magic :
       {"\xD4\xC3\xB2\xA1", "\xA1\xB2\xC3\xD4", "\x4D\x3C\xB2\xA1", "\xA1\xB2\x3C\x4D", "\x0A\x0D\x0D\x0A"}) {
    if (head.starts_with(magic)) return true;
  }
  return false;
}

}  // namespace

Result<ImportFormat> recognise_recording(const std::filesystem::path& path) {
  std::error_code failed;
  if (std::filesystem::is_directory(path, failed))
    return is_bag(path) ? ImportFormat::rosbag : ImportFormat::rgbd;
  if (!std::filesystem::exists(path, failed)) return Error{path.string() + ": no such file or folder"};
  if (is_bag(path)) return ImportFormat::rosbag;
  auto lines = TextLines::open(path);
  if (!lines) return lines.error();
  const auto head = lines->peek(512);
  if (!head) return head.error();
  if (head->starts_with("#ROSBAG")) return Error{path.string() + ": a ROS bag of another version than 2.0"};
  if (starts_with_object(*head)) return ImportFormat::rawlog;
  if (!head->empty() && is_text(*head)) return ImportFormat::carmen;
  if (head->starts_with("\xED\xA1\xDA\x01"))
    return Error{path.string() +
                 ": this is an LCM log already: use it as it is. `parhelion topic list --log FILE` shows its "
                 "channels; `slam --scan-channel` and `channels` of a scenario take other names"};
  if (is_packet_capture(*head))
    return Error{
        path.string() +
        ": a packet capture (pcap) is not imported. Its driver in ROS, such as velodyne_driver, makes "
        "messages of it: for SCAN record a sensor_msgs/LaserScan of them (velodyne_laserscan)"};
  return Error{
      path.string() +
      ": not a known kind of recording; expected an MRPT rawlog, a CARMEN log (also .gz, .bz2), a ROS "
      "bag (.bag, .db3, .mcap, or the folder of ROS 2) or a folder of RGB-D frames"};
}

namespace {

/// What --topics can choose in a recording of this format.
std::vector<std::string> channels_of(ImportFormat format) {
  switch (format) {
    case ImportFormat::rawlog:
      return {"SCAN", "LINES", "ODOMETRY"};
    case ImportFormat::carmen:
      return {"SCAN", "ODOMETRY", "REFERENCE_POSE"};
    case ImportFormat::rgbd:
      return {"SCAN", "CAMERA", "DEPTH", "REFERENCE_POSE"};
    case ImportFormat::rosbag:
      break;
  }
  return {"SCAN",       "LINES",          "ODOMETRY", "CAMERA", "CAMERA_INFO", "DEPTH",
          "DEPTH_INFO", "REFERENCE_POSE", "TELEOP",   "IMU",    "JOINT_STATE"};
}

Status check_channels(const ImportOptions& options, ImportFormat format) {
  const auto has = [](const std::vector<std::string>& channels, const std::string& channel) {
    return std::find(channels.begin(), channels.end(), channel) != channels.end();
  };
  const std::vector<std::string> known = channels_of(format);
  for (const auto& [channel, topic] : options.topics) {
    // What a format never has can be left out of it.
    if (format == ImportFormat::rosbag && is_further_scan(channel)) continue;
    if (has(known, channel) || (topic == "none" && has(channels_of(ImportFormat::rosbag), channel))) continue;
    const std::string further = std::string(channel::kScan) + "_";
    if (format == ImportFormat::rosbag && channel.starts_with(further))
      return Error{options.input.string() + ": --topics " + channel + "=" + topic +
                   ": name of the laser: " + sensor_name_fault(channel.substr(further.size()))};
    std::string list;
    for (const std::string& name : known) list += (list.empty() ? "" : ", ") + name;
    if (format == ImportFormat::rosbag) list += ", SCAN_<name>";
    return Error{options.input.string() + ": --topics " + channel + "=" + topic +
                 ": no channel that a recording of this format has; expected one of " + list};
  }
  return {};
}

}  // namespace

Result<ImportReport> import_recording(const ImportOptions& given, const ImportProgress& progress) {
  ImportOptions options = given;
  // Names are made of the folder's: "drive/" has none at its end.
  if (!options.input.has_filename()) options.input = options.input.parent_path();
  const auto format = recognise_recording(options.input);
  if (!format) return format.error();
  if (const Status channels = check_channels(options, *format); !channels) return channels.error();
  switch (*format) {
    case ImportFormat::rawlog:
      return import_rawlog(options, progress);
    case ImportFormat::carmen:
      return import_carmen(options, progress);
    case ImportFormat::rosbag:
      return import_rosbag(options, progress);
    case ImportFormat::rgbd:
      return import_rgbd(options, progress);
  }
  return Error{options.input.string() + ": not a recording that is known"};
}

}  // namespace parhelion::tools
