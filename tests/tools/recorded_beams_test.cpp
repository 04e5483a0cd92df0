// Imported recordings whose source states the wrong order of a laser's beams.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/fusion/pose/swept_drive.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/tools/imported_log.hpp"
#include "tools/import/recording_writer.hpp"

namespace parhelion::tools {
namespace {

using testing::Contains;
using testing::HasSubstr;

constexpr double kInterval = 0.09 / 361;  // s between two beams

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

}  // namespace
}  // namespace parhelion::tools
