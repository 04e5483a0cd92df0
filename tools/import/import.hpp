// `parhelion import`: converts recordings of other systems to an LCM log.
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
  std::filesystem::path input;   ///< rawlog, CARMEN log, ROS bag, or a folder of RGB-D frames
  std::filesystem::path output;  ///< LCM log; written to a temporary file and renamed when complete
  bool overwrite = false;
  /// Channel to topic of the source (ROS topic, rawlog sensor label); "none" leaves the channel out.
  std::map<std::string, std::string> topics;
  std::filesystem::path urdf;         ///< to write the URDF to that a ROS bag has; empty: it is left out
  std::string robot_name;             ///< empty: from the file's name
  std::string laser_preset = "auto";  ///< "auto": recognized by its beams; "none"; or a preset's name
  double laser_height = 0.3;          ///< m above the floor, if the source does not contain it
  double scan_low = 0.2;              ///< m above the floor: band of the depth image that becomes a scan
  double scan_high = 0.5;
  double frame_rate = 30;  ///< Hz, of numbered RGB-D frames, which have no stamps
};

enum class ImportFormat { rawlog, carmen, rosbag, rgbd };

/// Content and anomalies of one channel. Places are "file:line" or the like.
struct ChannelReport {
  std::string channel;
  std::uint64_t kept = 0;
  std::uint64_t backward = 0;  ///< stamps earlier than the previous one
  Duration backward_max;
  std::string backward_first;  ///< place of the first one
  std::uint64_t gaps = 0;      ///< more than 1 s and more than ten times the median interval
  Duration gap_max;
  std::string gap_max_place;
  std::map<std::size_t, std::uint64_t> beams;  ///< scans by number of beams
};

struct Refusal {
  std::string place;
  std::string why;
  std::uint64_t more = 0;  ///< for the same reason, not listed
};

struct ImportReport {
  std::string input, output;
  std::uint64_t read = 0;
  std::string read_unit;                          ///< "lines", "objects", "messages", "frames"
  std::vector<ChannelReport> channels;            ///< in order of first appearance
  std::map<std::string, std::uint64_t> left_out;  ///< readable, but of a kind or topic that is not imported
  std::uint64_t refused = 0;
  std::vector<Refusal> refusals;   ///< at most twenty, and five for one reason
  std::uint64_t damaged = 0;       ///< of the refused: places where the source is cut off or damaged
  std::vector<std::string> notes;  ///< assumptions that were made
  /// Implausibly late stamps; their events get the arrival time right after the previous one.
  std::uint64_t ahead = 0;
  Duration ahead_first_by;
  std::string ahead_first;         ///< place
  std::vector<std::string> leaps;  ///< places of accepted forward jumps, each confirmed by five stamps
  std::uint64_t kept() const;
  const ChannelReport* find(const std::string& channel) const;
};

/// The last line: what was read, kept and refused.
std::string summary_line(const ImportReport& report);
/// All anomalies, one per line.
std::vector<std::string> findings(const ImportReport& report);

/// Detects the format by content, not by name. The error lists what was looked for.
Result<ImportFormat> recognise_recording(const std::filesystem::path& path);

/// Bytes done and bytes in total, of the source.
using ImportProgress = std::function<void(double done, double total)>;

/// Writes options.output: first ROBOT, then the recording in file order. The event time is the source's
/// receive time (via ArrivalOrder) or, if it has none, the event's own stamp. Damaged parts are refused and
/// counted. Error: nothing usable was found or writing failed; then there is no output.
Result<ImportReport> import_recording(const ImportOptions& options, const ImportProgress& progress);

}  // namespace parhelion::tools
