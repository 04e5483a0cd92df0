#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "tests/temporary_folder.hpp"
#include "tests/tools/imported_log.hpp"
#include "tests/tools/process.hpp"
#include "tools/import/carmen_line.hpp"

namespace parhelion::tools {
namespace {

using test::ImportedLog;
using test::TemporaryFolder;

std::filesystem::path intel() { return test::recording("slam2d-intel/intel.clf.bz2"); }
std::filesystem::path clinic() { return test::recording("slam2d-fr-clinic/fr-clinic_robotlaser.clf.bz2"); }

constexpr const char* kOdomLine = "ODOM 1.0 2.0 0.5 0 0 0 100.25 host 0.1\n";
constexpr const char* kFlaserLine = "FLASER 4 1.5 2.5 3.5 81.83 1.3 2.0 0.0 1.0 2.0 0.0 100.5 host 0.3\n";

struct Imported {
  ImportReport report;
  ImportedLog log;
};

/// The Intel log, imported once for all tests.
const Imported& intel_import() {
  static const Imported imported = [] {
    TemporaryFolder folder;
    auto report = import_recording(test::import_options(intel(), folder / "intel.lcm"), {});
    EXPECT_TRUE(report.ok()) << (report.ok() ? "" : report.error().message);
    return Imported{report ? *report : ImportReport{}, ImportedLog(folder / "intel.lcm")};
  }();
  return imported;
}

TEST(ImportCarmen, AByteOrderMarkIsNoPartOfTheFirstLine) {
  const TemporaryFolder folder;
  test::write_text(folder / "marked.log", "\xEF\xBB\xBF" + std::string(kFlaserLine) + kOdomLine);
  const auto report = import_recording(test::import_options(folder / "marked.log", folder / "out.lcm"), {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  ASSERT_NE(report->find("SCAN"), nullptr);
  EXPECT_TRUE(report->left_out.empty());
}

TEST(ImportCarmen, IntelKeepsFileOrderAndCountsBackwardStamps) {
  PARHELION_NEEDS_RECORDING(intel());
  const ImportReport& report = intel_import().report;
  EXPECT_EQ(report.refused, 0U);
  ASSERT_NE(report.find(channel::kScan), nullptr);
  const ChannelReport& scans = *report.find(channel::kScan);
  EXPECT_EQ(scans.kept, 13631U);
  EXPECT_EQ(scans.beams.at(180), 13631U);
  EXPECT_EQ(scans.backward, 631U);
  EXPECT_NEAR(scans.backward_max.seconds(), 0.90, 0.01);
  EXPECT_THAT(scans.backward_first, ::testing::StartsWith("intel.clf.bz2:"));
  const ImportedLog& log = intel_import().log;
  log.expect_arrivals_increase();
  // The odometry of a scan's line precedes it, with its stamp.
  std::int64_t utime = -1;
  Transform<Odom, Base> last;
  double path = 0, longest = 0;
  for (std::size_t i = 1, n = 0; i < log.events.size(); ++i) {
    if (log.events[i].channel != channel::kScan) continue;
    Scan scan;
    Odometry odometry;
    ASSERT_TRUE(decode(channel::kScan, log.events[i].payload, scan).ok());
    ASSERT_EQ(log.events[i - 1].channel, channel::kOdometry);
    ASSERT_TRUE(decode(channel::kOdometry, log.events[i - 1].payload, odometry).ok());
    ASSERT_EQ(scan.stamp, odometry.stamp);
    if (n++ > 0) {
      const double step = (odometry.T_odom_base.translation() - last.translation()).norm();
      path += step;
      longest = std::max(longest, step);
    }
    last = odometry.T_odom_base;
    utime = scan.stamp.utime();
  }
  EXPECT_GT(utime, 0);
  EXPECT_NEAR(path, 508, 5);
  EXPECT_LT(longest, 0.23) << "file order: odometry never jumps";
}

TEST(ImportCarmen, IntelNoReturnReadingsAreRecognized) {
  PARHELION_NEEDS_RECORDING(intel());
  const ImportedLog& log = intel_import().log;
  const LaserDescription laser = *log.robot().laser;
  EXPECT_NEAR(laser.angle_min, -M_PI / 2, 1e-6);
  EXPECT_NEAR(laser.angle_increment, M_PI / 180, 1e-6);
  EXPECT_EQ(laser.passes, 1) << "one degree is one pass";
  std::size_t none = 0, all = 0;
  for (const Scan& scan : log.all<Scan>(channel::kScan)) {
    for (const float range : scan.ranges) none += laser.convention.classify(range) == BeamKind::no_return;
    all += scan.ranges.size();
  }
  EXPECT_NEAR(100.0 * static_cast<double>(none) / static_cast<double>(all), 2.8, 0.05);
}

TEST(ImportCarmen, ClinicLogKeepsBothBeamCountsWithTheirAngles) {
  PARHELION_NEEDS_RECORDING(clinic());
  TemporaryFolder folder;
  const auto report = import_recording(test::import_options(clinic(), folder / "clinic.lcm"), {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  const ChannelReport& scans = *report->find(channel::kScan);
  EXPECT_EQ(scans.kept, 6917U);
  EXPECT_EQ(scans.beams.at(180), 5169U);
  EXPECT_EQ(scans.beams.at(181), 1748U);
  EXPECT_EQ(scans.backward, 0U);
  EXPECT_NEAR(scans.gap_max.seconds(), 198, 1);
  const ImportedLog log(folder / "clinic.lcm");
  for (const Scan& scan : log.all<Scan>(channel::kScan)) {
    if (scan.ranges.size() == 181) {
      ASSERT_NEAR(scan.angle_min, -1.570796, 1e-6);
    } else {
      ASSERT_GT(scan.angle_min, -1.5707);
    }
  }
  const LaserDescription laser = *log.robot().laser;
  EXPECT_NEAR(laser.T_base_laser.translation().x(), 0.22, 0.01);
  EXPECT_EQ(laser.convention.classify(81.91F), BeamKind::no_return);
}

TEST(ImportCarmen, TruncatedBzip2KeepsWholeBlocksAndReportsTheLine) {
  PARHELION_NEEDS_RECORDING(intel());
  TemporaryFolder folder;
  auto bytes = test::file_bytes(intel());
  bytes.resize(bytes.size() / 2);
  test::write_bytes(folder / "half.clf.bz2", bytes);
  const auto report =
      import_recording(test::import_options(folder / "half.clf.bz2", folder / "half.lcm"), {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_GT(report->find(channel::kScan)->kept, 5000U);
  EXPECT_LT(report->find(channel::kScan)->kept, 8000U);
  ASSERT_EQ(report->refused, 1U);
  EXPECT_EQ(report->damaged, 1U);
  EXPECT_THAT(report->refusals[0].why, ::testing::HasSubstr("truncated"));
}

TEST(ImportCarmen, BadLinesAreReportedByNumberAndOthersKept) {
  TemporaryFolder folder;
  const std::string text = std::string("# a comment\n") + kOdomLine + kFlaserLine +
                           "FLASER 4 1.5 2.5 x 81.83 1.3 2.0 0.0 1.0 2.0 0.0 100.6 host 0.3\n"
                           "FLASER 999999 1 2\n"
                           "FLASER 400000000 1 2\n"
                           "ODOM 1 2\n"
                           "FLASER 4 1.5 nan 3.5 81.83 1.3 2.0 0.0 1.0 2.0 0.0 100.7 host 0.3\n"
                           "NMEAGGA 1 2 3\n" +
                           kFlaserLine;
  test::write_text(folder / "bad.log", text);
  const auto report = import_recording(test::import_options(folder / "bad.log", folder / "bad.lcm"), {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(report->read, 10U);
  EXPECT_EQ(report->find(channel::kScan)->kept, 2U);
  ASSERT_EQ(report->refused, 5U);
  EXPECT_EQ(report->damaged, 1U) << "the line that is not complete";
  EXPECT_EQ(report->refusals[0].place, "bad.log:4");
  EXPECT_THAT(report->refusals[0].why, ::testing::HasSubstr("word 5 (range) is 'x'"));
  EXPECT_EQ(report->refusals[4].place, "bad.log:8");
  EXPECT_EQ(report->left_out.at("NMEAGGA"), 1U);
  const ImportedLog log(folder / "bad.lcm");
  log.expect_arrivals_increase();
  EXPECT_NEAR(log.robot().laser->T_base_laser.translation().x(), 0.3, 1e-6);
  EXPECT_THAT(log.robot().source, ::testing::HasSubstr("height is not in the source"));
}

/// Wherever the file ends inside its last line, except in the logger's own stamp, which is not used.
TEST(ImportCarmen, ALogThatEndsInsideALineIsDamagedThere) {
  const std::string robot_laser =
      "ROBOTLASER1 0 -1.57 3.14 1.57 80.0 0.01 0 3 1.5 2.5 3.5 0 1.3 2.0 0.0 1.0 2.0 0.0 "
      "0 0 0 0 0 100.7 host 0.4\n";
  TemporaryFolder folder;
  auto options = test::import_options(folder / "cut.log", folder / "cut.lcm");
  options.overwrite = true;
  options.topics["SCAN"] = "FLASER";
  const std::string before = std::string(kOdomLine) + kFlaserLine;
  for (const std::string& last : {std::string(kOdomLine), std::string(kFlaserLine), robot_laser}) {
    const std::size_t last_space = last.rfind(' ');
    for (std::size_t size = 0; size < last.size(); ++size) {
      test::write_text(folder / "cut.log", before + last.substr(0, size));
      const auto report = import_recording(options, {});
      ASSERT_TRUE(report.ok()) << report.error().message;
      const bool cut = size > 0 && size <= last_space + 1;
      EXPECT_EQ(report->damaged, cut ? 1U : 0U) << "'" << last.substr(0, size) << "'";
      EXPECT_GE(report->find(channel::kScan)->kept, 1U) << "what could be read";
      if (cut) {
        EXPECT_EQ(report->refusals.at(0).place, "cut.log:3");
      }
    }
  }
}

TEST(ImportCarmen, ACutTextLogEndsWithExitCodeOne) {
  TemporaryFolder folder;
  const std::string whole = std::string(kOdomLine) + kFlaserLine + kFlaserLine;
  const auto run = [&](const std::string& text) {
    test::write_text(folder / "in.log", text);
    return test::run({"import", folder / "in.log", "-o", folder / "out.lcm", "--force"}, folder / "said.txt");
  };
  EXPECT_EQ(run(whole).exit, 0);
  std::filesystem::remove(folder / "out.lcm");
  const auto cut = run(whole.substr(0, whole.size() - 30));
  EXPECT_EQ(cut.exit, 1);
  EXPECT_THAT(cut.output, ::testing::HasSubstr("is cut off or damaged at 1 place"));
  EXPECT_THAT(cut.output, ::testing::HasSubstr("in.log:3"));
  EXPECT_TRUE(std::filesystem::exists(folder / "out.lcm")) << "what could be read";
}

/// Scans a tenth of a second apart from 100 s on; `stamp` may override this.
std::string scans(int count, const std::function<double(int)>& stamp) {
  std::string text;
  for (int i = 0; i < count; ++i) {
    text += "FLASER 4 1.5 2.5 3.5 81.83 1.3 2.0 0.0 1.0 2.0 0.0 " + std::to_string(stamp(i)) + " host 0.3\n";
  }
  return text;
}
double tenths(int i) { return 100 + i / 10.0; }

TEST(ImportCarmen, AForwardStampOutlierIsReportedAlone) {
  for (const int wild : {0, 7}) {
    TemporaryFolder folder;
    test::write_text(folder / "wild.log", scans(20, [&](int i) { return i == wild ? 1e9 : tenths(i); }));
    const auto report = import_recording(test::import_options(folder / "wild.log", folder / "wild.lcm"), {});
    ASSERT_TRUE(report.ok()) << report.error().message;
    const ImportedLog log(folder / "wild.lcm");
    log.expect_arrivals_increase();
    // Each line becomes odometry and a scan.
    EXPECT_EQ(report->ahead, 2U);
    EXPECT_EQ(report->ahead_first, "wild.log:" + std::to_string(wild + 1));
    EXPECT_THAT(findings(*report), ::testing::Contains(::testing::HasSubstr("2 stamps far ahead")));
    const auto scans_read = log.all<Scan>(channel::kScan);
    ASSERT_EQ(scans_read.size(), 20U);
    EXPECT_EQ(scans_read[static_cast<std::size_t>(wild)].stamp.utime(), 1'000'000'000'000'000)
        << "as the sensor said";
    for (std::size_t i = 0, n = 0; i < log.events.size(); ++i) {
      if (log.events[i].channel != channel::kScan) continue;
      const auto number = static_cast<int>(n++);
      if (number == wild) continue;
      EXPECT_NEAR((log.events[i].arrival - ArrivalTime{}).seconds(), tenths(number), 1e-4) << number;
    }
  }
}

TEST(ImportCarmen, APauseInARecordingIsKept) {
  TemporaryFolder folder;
  test::write_text(folder / "paused.log", scans(20, [](int i) { return tenths(i) + (i < 10 ? 0 : 3600); }));
  const auto report =
      import_recording(test::import_options(folder / "paused.log", folder / "paused.lcm"), {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(report->ahead, 0U);
  // Two events per line: the fifth of them is in the third line.
  EXPECT_THAT(report->leaps, ::testing::ElementsAre("paused.log:13"));
  const ImportedLog log(folder / "paused.lcm");
  log.expect_arrivals_increase();
  EXPECT_NEAR((log.events.back().arrival - ArrivalTime{}).seconds(), tenths(19) + 3600, 1e-4);
}

TEST(ImportCarmen, FlippedBitsNeverCrash) {
  TemporaryFolder folder;
  std::string whole;
  for (int i = 0; i < 20; ++i) whole += std::string(kOdomLine) + kFlaserLine;
  std::uint64_t state = 3;
  for (int trial = 0; trial < 60; ++trial) {
    std::vector<char> bytes(whole.begin(), whole.end());
    for (int flip = 0; flip < 6; ++flip) {
      state = state * 6364136223846793005ULL + 1442695040888963407ULL;
      bytes[(state >> 20) % bytes.size()] ^= static_cast<char>(1U << ((state >> 60) & 7));
    }
    test::write_bytes(folder / "flipped.log", bytes);
    auto options = test::import_options(folder / "flipped.log", folder / "flipped.lcm");
    options.overwrite = true;
    const auto report = import_recording(options, {});
    if (report) {
      EXPECT_GE(report->kept(), 28U);
    } else {
      EXPECT_FALSE(report.error().message.empty());
    }
  }
}

TEST(ImportCarmen, UnreadableInputLeavesNoOutput) {
  TemporaryFolder folder;
  test::write_text(folder / "notes.txt", "this is\nno recording\n");
  const auto report = import_recording(test::import_options(folder / "notes.txt", folder / "notes.lcm"), {});
  ASSERT_FALSE(report.ok());
  EXPECT_THAT(report.error().message, ::testing::HasSubstr("FLASER"));
  EXPECT_FALSE(std::filesystem::exists(folder / "notes.lcm"));
  EXPECT_FALSE(std::filesystem::exists(folder / "notes.lcm.partial"));
}

TEST(ImportCarmen, UnknownChannelInTopicsIsAnError) {
  TemporaryFolder folder;
  test::write_text(folder / "a.log", std::string(kOdomLine) + kFlaserLine);
  auto options = test::import_options(folder / "a.log", folder / "a.lcm");
  options.topics["SCANS"] = "FLASER";
  const auto report = import_recording(options, {});
  ASSERT_FALSE(report.ok());
  EXPECT_THAT(report.error().message, ::testing::HasSubstr("SCANS"));
}

TEST(CarmenLine, ImpliedAnglesFollowTheNumberOfReadings) {
  for (const auto& [n, step] : {std::pair{180, 1.0}, {181, 1.0}, {360, 0.5}, {361, 0.5}}) {
    std::string line = "FLASER " + std::to_string(n);
    for (int i = 0; i < n; ++i) line += " 1";
    bool damaged = false;
    const auto parsed = parse_carmen_line(line + " 0 0 0 0 0 0 5 host 5", damaged);
    ASSERT_TRUE(parsed.ok()) << parsed.error().message;
    EXPECT_FALSE(damaged);
    const Scan& scan = std::get<CarmenLaser>(*parsed).scan;
    EXPECT_NEAR(scan.angle_increment, step * M_PI / 180, 1e-8) << n;
    EXPECT_NEAR(scan.angle_min, -M_PI / 2, 1e-6);
  }
}

}  // namespace
}  // namespace parhelion::tools
