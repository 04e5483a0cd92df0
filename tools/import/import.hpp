// Recordings of other systems to an LCM log: what `parhelion import` does.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "protocols/status.hpp"
#include "protocols/time.hpp"

namespace parhelion::tools {

struct ImportOptions {
  std::filesystem::path input;   ///< rawlog, CARMEN log, ROS 1 bag, or a folder of RGB-D frames
  std::filesystem::path output;  ///< LCM log; written beside itself and renamed when whole
  bool overwrite = false;
  /// Channel to topic of the source (ROS topic, rawlog sensor label); "none" leaves the channel out.
  std::map<std::string, std::string> topics;
  std::string robot_name;             ///< empty: from the file's name
  std::string laser_preset = "auto";  ///< "auto": recognised by its beams; "none"; or a preset's name
  double laser_height = 0.3;          ///< m over the floor, where the source does not say
  double scan_low = 0.2;              ///< m over the floor: band that a scan is cut out of depth from
  double scan_high = 0.5;
  double frame_rate = 30;  ///< Hz, of numbered RGB-D frames, which carry no stamps
};

enum class ImportFormat { rawlog, carmen, rosbag, rgbd };

/// What one channel got, and what was odd about it. Places are "file:line" or the like.
struct ChannelReport {
  std::string channel;
  std::uint64_t kept = 0;
  std::uint64_t backward = 0;  ///< stamps earlier than the one before
  Duration backward_most;
  std::string backward_first;  ///< place of the first
  std::uint64_t gaps = 0;      ///< more than 1 s and more than ten times the median interval
  Duration gap_most;
  std::string gap_most_place;
  std::map<std::size_t, std::uint64_t> beams;  ///< scans by number of beams
};

struct Refusal {
  std::string place;
  std::string why;
};

struct ImportReport {
  std::string input, output;
  std::uint64_t read = 0;
  std::string read_unit;                ///< "lines", "objects", "messages", "frames"
  std::vector<ChannelReport> channels;  ///< in order of first appearance
  std::map<std::string, std::uint64_t>
      left_out;  ///< read and well, but of a kind or topic that is not imported
  std::uint64_t refused = 0;
  std::vector<Refusal> refusals;   ///< the first twenty
  std::vector<std::string> notes;  ///< assumptions that were made
  /// Stamps too far ahead to be believed; their events arrive right after the ones before them.
  std::uint64_t ahead = 0;
  Duration ahead_first_by;
  std::string ahead_first;         ///< place
  std::vector<std::string> leaps;  ///< places from which on a leap ahead was followed, five having agreed
  std::uint64_t kept() const;
  const ChannelReport* find(const std::string& channel) const;
};

/// The last line: what was read, kept and refused.
std::string summary_line(const ImportReport& report);
/// Everything odd, one thing a line.
std::vector<std::string> findings(const ImportReport& report);

/// By content, not by name. An error says what was looked for.
Result<ImportFormat> recognise_recording(const std::filesystem::path& path);

/// Bytes done and in all, of the source.
using ImportProgress = std::function<void(double done, double total)>;

/// Writes options.output: first ROBOT, then the recording in file order, each event where ArrivalOrder places
/// the instant at which the source received it or, where it does not say, the event's own stamp. Damaged
/// parts are refused and counted; an error means that nothing usable was found or that writing failed, and
/// then there is no output.
Result<ImportReport> import_recording(const ImportOptions& options, const ImportProgress& progress);

}  // namespace parhelion::tools
