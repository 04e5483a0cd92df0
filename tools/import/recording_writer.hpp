// Output of the importers: checks events, keeps file order, counts anomalies.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "protocols/image.hpp"
#include "protocols/joints.hpp"
#include "protocols/pose.hpp"
#include "protocols/robot.hpp"
#include "protocols/scan.hpp"
#include "protocols/twist_command.hpp"
#include "tools/import/import.hpp"

namespace parhelion::tools {

/// Place in the source: a line, an object, a message. Counted from 1.
using Place = std::uint64_t;

class RecordingWriter {
 public:
  /// `place_prefix` precedes a place's number in reports ("intel.clf:", "x.rawlog, object ").
  static Result<RecordingWriter> create(const ImportOptions& options, std::string place_prefix,
                                        std::string read_unit);
  RecordingWriter(RecordingWriter&&) noexcept;
  RecordingWriter& operator=(RecordingWriter&&) noexcept;
  /// Removes an unfinished file.
  ~RecordingWriter();
  /// The same for one of a process that has died.
  static void remove_unfinished(const ImportOptions& options);

  /// Writes the first event; `first` is the stamp of the next one.
  Status describe(const RobotDescription& robot, SensorTime first);

  /// Writes an event if the wire format accepts it, else counts it as refused. Error: the log cannot be
  /// written.
  /// T: Scan, Odometry, Image, PoseStamped, PoseEstimate, TwistCommand, ImuSample or Joints.
  template <class T>
  Status put(std::string_view channel, const T& item, Place place, std::optional<ArrivalTime> received = {});

  void refuse(Place place, std::string why);
  void refuse_at(Refusal refusal);
  /// The source is cut off or damaged there.
  void refuse_damage(Place place, std::string why);
  void refuse_damage_at(Refusal refusal);
  void leave_out(const std::string& kind);
  void note(std::string text);
  void count_read(std::uint64_t n = 1);
  std::string place_text(Place place) const;

  /// Renames the log to its final name. Error: nothing was kept, or the rename failed.
  Result<ImportReport> finish();

 private:
  struct State;
  explicit RecordingWriter(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace parhelion::tools
