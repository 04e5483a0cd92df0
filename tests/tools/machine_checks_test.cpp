// Results of `parhelion doctor` for deficient machines.
#include "tools/service/machine_checks.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>

namespace parhelion::tools {
namespace {

namespace fs = std::filesystem;
using Verdict = MachineCheck::Verdict;

class MachineChecks : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "parhelion-doctor-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path file(const std::string& text) const {
    std::ofstream(folder_ / "file") << text;
    return folder_ / "file";
  }
  fs::path folder_;
};

TEST_F(MachineChecks, ASmallReceiveBufferWarningNamesTheShippedFile) {
  const MachineCheck small = check_receive_buffer(file("212992\n"));
  EXPECT_EQ(small.verdict, Verdict::warn);
  EXPECT_NE(small.finding.find("212992"), std::string::npos);
  const std::string shipped = small.remedy.substr(3, small.remedy.find(" /etc") - 3);
  EXPECT_TRUE(fs::exists(shipped)) << shipped;
  EXPECT_EQ(check_receive_buffer(file("4194304\n")).verdict, Verdict::ok);
  EXPECT_EQ(check_receive_buffer(folder_ / "absent").verdict, Verdict::warn);
  EXPECT_EQ(check_receive_buffer(file("many")).verdict, Verdict::warn);
}

TEST_F(MachineChecks, AMissingFolderFails) {
  EXPECT_EQ(check_disk(folder_ / "absent").verdict, Verdict::fail);
  EXPECT_NE(check_disk(folder_).finding.find("GB free"), std::string::npos);
}

TEST_F(MachineChecks, MissingRealTimePriorityIsReportedWithARemedy) {
  const MachineCheck check = check_real_time();
  EXPECT_EQ(check.remedy.empty(), check.verdict == Verdict::ok);
  EXPECT_NE(check.verdict, Verdict::fail) << "nothing essential is missing";
}

TEST_F(MachineChecks, AnAbsentRecordingIsAWarningForDemoOnly) {
  EXPECT_EQ(check_recording(folder_ / "absent.rawlog").verdict, Verdict::warn);
  EXPECT_NE(check_recording(folder_ / "absent.rawlog").remedy.find("mrpt-common"), std::string::npos);
  EXPECT_EQ(check_recording(file("x")).verdict, Verdict::ok);
}

TEST_F(MachineChecks, ABusThatCannotBeOpenedFails) {
  EXPECT_EQ(check_multicast("udpm://rubbish").verdict, Verdict::fail);
  EXPECT_EQ(check_big_messages("udpm://rubbish").verdict, Verdict::fail);
}

TEST_F(MachineChecks, LooksForShippedFilesInTheUsersFolder) {
  EXPECT_EQ(check_shipped_files().verdict, Verdict::ok);
  ASSERT_EQ(setenv("PARHELION_SHARE", folder_.c_str(), 1), 0);
  const MachineCheck missing = check_shipped_files();
  unsetenv("PARHELION_SHARE");
  EXPECT_EQ(missing.verdict, Verdict::fail);
  EXPECT_NE(missing.finding.find(folder_.string()), std::string::npos);
}

}  // namespace
}  // namespace parhelion::tools
