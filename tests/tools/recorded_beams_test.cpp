// Imported recordings whose source states the wrong order of a laser's beams, or the wrong beam of the stamp.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <utility>
#include <vector>

#include "tests/fusion/pose/swept_drive.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/tools/imported_log.hpp"
#include "tools/import/recording_writer.hpp"

namespace parhelion::tools {
namespace {

using testing::Contains;
using testing::HasSubstr;

constexpr double kSweep = 0.09;             // s, of a scan
constexpr double kInterval = kSweep / 361;  // s between two beams

Result<ImportReport> written(const test::SweptDrive& drive, const ImportOptions& options) {
  auto writer = RecordingWriter::create(options, "drive, message ", "messages");
  if (!writer) return writer.error();
  if (const Status described = writer->describe(drive.robot, SensorTime{} + seconds(1000)); !described)
    return described.error();
  Place place = 0;
  for (const test::DriveInput& input : drive.inputs) {
    ++place;
    const Status put = input.scan ? writer->put(channel::kScan, *input.scan, place)
                                  : writer->put(channel::kOdometry, input.odometry, place);
    if (!put) return put.error();
  }
  return writer->finish();
}

TEST(RecordedBeams, AreDescribedInTheOrderThatTurnsShow) {
  const test::TemporaryFolder folder;
  const test::SweptDrive drive = test::swept_drive(31, kInterval, -kInterval);
  const auto report = written(drive, test::import_options(folder / "in", folder / "out.lcm"));
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_THAT(report->notes, Contains(HasSubstr("in the reverse of the described order")));
  const test::ImportedLog log(folder / "out.lcm");
  EXPECT_EQ(log.robot().laser->beam_interval, -kInterval);
  EXPECT_EQ(log.events.size(), drive.inputs.size() + 1) << "the rest of the log is as it was";
  EXPECT_EQ(log.all<Scan>(channel::kScan).size(), drive.truth.size());
  log.expect_arrivals_increase();
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder / "."), {}), 1)
      << "nothing is left over";
}

TEST(RecordedBeams, StayAsTheSourceStatesThemWhereThatIsRight) {
  const test::TemporaryFolder folder;
  const auto report = written(test::swept_drive(32, kInterval, kInterval),
                              test::import_options(folder / "in", folder / "out.lcm"));
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_TRUE(report->notes.empty());
  EXPECT_EQ(test::ImportedLog(folder / "out.lcm").robot().laser->beam_interval, kInterval);
}

/// When and at which stamps messages of a drive arrive, s.
struct Timing {
  double scan_stamp = 0;      ///< after the instant of the first beam
  double odometry_delay = 0;  ///< from its measurement to its arrival
  double log_clock = 0;       ///< behind the robot's
};

/// Writes a drive whose scans arrive 2 ms after their last beam.
Result<ImportReport> written_as_received(const test::SweptDrive& drive, const Timing& timing,
                                         const ImportOptions& options) {
  struct Received {
    ArrivalTime at;
    test::DriveInput input;
  };
  std::vector<Received> all;
  for (test::DriveInput input : drive.inputs) {
    const SensorTime measured = input.scan ? input.scan->stamp : input.odometry.stamp;
    const double delay = input.scan ? kSweep + 0.002 : timing.odometry_delay;
    if (input.scan) input.scan->stamp = input.scan->stamp + seconds(timing.scan_stamp);
    all.push_back({ArrivalTime{measured.ns} + seconds(delay - timing.log_clock), std::move(input)});
  }
  std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.at < b.at; });
  auto writer = RecordingWriter::create(options, "drive, message ", "messages");
  if (!writer) return writer.error();
  if (const Status described = writer->describe(drive.robot, SensorTime{} + seconds(1000)); !described)
    return described.error();
  Place place = 0;
  for (const auto& [at, input] : all) {
    ++place;
    const Status put = input.scan ? writer->put(channel::kScan, *input.scan, place, at)
                                  : writer->put(channel::kOdometry, input.odometry, place, at);
    if (!put) return put.error();
  }
  return writer->finish();
}

TEST(RecordedBeams, HaveTheStampAtTheBeamThatArrivalShows) {
  const test::TemporaryFolder folder;
  const auto options = test::import_options(folder / "in", folder / "out.lcm");
  const test::SweptDrive drive = test::swept_drive(33, kInterval, kInterval);
  using StampBeam = LaserDescription::StampBeam;
  const auto imported = [&](const Timing& timing) {
    std::filesystem::remove(options.output);
    const auto report = written_as_received(drive, timing, options);
    EXPECT_TRUE(report.ok()) << report.error().message;
    const StampBeam beam = test::ImportedLog(options.output).robot().laser->stamp_beam;
    const auto noted = testing::Matches(Contains(HasSubstr("stamp_beam is last")));
    EXPECT_EQ(noted(report->notes), beam == StampBeam::last);
    return beam;
  };
  EXPECT_EQ(imported({kSweep, 0.005, 0}), StampBeam::last);
  EXPECT_EQ(imported({kSweep, 0.04, 0.02}), StampBeam::last);
  for (const double clock : {0.0, 0.06, 0.15, 3.0}) {
    for (const double odometry_delay : {0.005, 0.04, 0.06, 0.085})
      EXPECT_EQ(imported({0, odometry_delay, clock}), StampBeam::first) << odometry_delay << ' ' << clock;
  }
}

TEST(RecordedBeams, KeepTheBeamOfTheStampWhereAnotherClockReceived) {
  const test::TemporaryFolder folder;
  const auto report = written_as_received(test::swept_drive(35, kInterval, kInterval), {kSweep, 0.005, 3},
                                          test::import_options(folder / "in", folder / "out.lcm"));
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_THAT(report->notes, Contains(HasSubstr("set stamp_beam: last"))) << "said, not done";
  EXPECT_EQ(test::ImportedLog(folder / "out.lcm").robot().laser->stamp_beam,
            LaserDescription::StampBeam::first);
}

// A scan and an odometry message have the instant of another event, and are moved behind it.
TEST(RecordedBeams, KeepTheBeamOfTheStampWhereNoArrivalIsRecorded) {
  const test::TemporaryFolder folder;
  test::SweptDrive drive = test::swept_drive(34, kInterval, kInterval);
  const auto scan = std::find_if(drive.inputs.begin() + 100, drive.inputs.end(),
                                 [](const test::DriveInput& each) { return each.scan.has_value(); });
  scan->scan->stamp = std::next(scan)->odometry.stamp = std::prev(scan)->odometry.stamp;
  const auto report = written(drive, test::import_options(folder / "in", folder / "out.lcm"));
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_TRUE(report->notes.empty());
  EXPECT_EQ(test::ImportedLog(folder / "out.lcm").robot().laser->stamp_beam,
            LaserDescription::StampBeam::first);
}

}  // namespace
}  // namespace parhelion::tools
