// Results of `parhelion doctor` for deficient services.
#include "tools/service/service_checks.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <fstream>

#include "tests/temporary_folder.hpp"

namespace parhelion::tools {
namespace {

namespace fs = std::filesystem;
using Verdict = MachineCheck::Verdict;

class ServiceChecks : public testing::Test {
 protected:
  void install(const std::string& unit) {
    fs::create_directories(root_ / "usr/lib/systemd/system");
    std::ofstream(root_ / "usr/lib/systemd/system/parhelion.service") << unit;
  }
  MachineCheck result(const std::string& name) {
    const auto checks = check_service(root_ / "");
    const auto found = std::ranges::find(checks, name, &MachineCheck::name);
    if (found == checks.end()) {
      ADD_FAILURE() << name;
      return {};
    }
    return *found;
  }
  test::TemporaryFolder root_;
};

TEST_F(ServiceChecks, AMachineWithoutTheServiceLacksNothing) {
  const auto checks = check_service(root_ / "");
  ASSERT_EQ(checks.size(), 1U);
  EXPECT_EQ(checks[0].verdict, Verdict::ok);
}

TEST_F(ServiceChecks, AUnitThatDoesNotPermitRealTimePriorityIsReported) {
  install("[Service]\nLimitRTPRIO=10\n");
  EXPECT_EQ(result("service's priority").verdict, Verdict::ok);
  for (const char* unit : {"[Service]\n", "[Service]\nLimitRTPRIO=0\n", "[Service]\n#LimitRTPRIO=10\n"}) {
    install(unit);
    EXPECT_EQ(result("service's priority").verdict, Verdict::warn) << unit;
    EXPECT_NE(result("service's priority").remedy.find("LimitRTPRIO=10"), std::string::npos);
  }
  fs::create_directories(root_ / "etc/systemd/system/parhelion.service.d");
  std::ofstream(root_ / "etc/systemd/system/parhelion.service.d/override.conf")
      << "[Service]\nLimitRTPRIO=20\n";
  EXPECT_EQ(result("service's priority").verdict, Verdict::ok) << "the remedy";
}

TEST_F(ServiceChecks, AStateFolderThatOthersCanReadIsReported) {
  install("");
  EXPECT_EQ(result("service's folder").verdict, Verdict::ok) << "systemd makes it";
  fs::create_directories(root_ / "var/lib/parhelion");
  const bool user =
      result("service's user").verdict == Verdict::ok;  // the folder is this test's, then not the service's
  ASSERT_EQ(chmod((root_ / "var/lib/parhelion").c_str(), 0750), 0);
  EXPECT_EQ(result("service's folder").verdict, user ? Verdict::fail : Verdict::warn);
  ASSERT_EQ(chmod((root_ / "var/lib/parhelion").c_str(), 0700), 0);
  EXPECT_EQ(result("service's folder").verdict, user ? Verdict::fail : Verdict::ok);
}

TEST_F(ServiceChecks, StatesWhetherTheBusLeavesTheMachine) {
  EXPECT_NE(check_bus_reach("udpm://239.255.76.67:7667?ttl=0").finding.find("this machine only"),
            std::string::npos);
  const MachineCheck network = check_bus_reach("udpm://239.255.76.67:7667?ttl=1");
  EXPECT_EQ(network.finding.find("this machine only"), std::string::npos);
  EXPECT_EQ(network.remedy.empty(), network.verdict == Verdict::ok);
  EXPECT_EQ(check_bus_reach("udpm://rubbish").verdict, Verdict::fail);
}

TEST_F(ServiceChecks, ChecksTheBusThatTheServiceUses) {
  EXPECT_EQ(service_url(root_ / ""), "");
  fs::create_directories(root_ / "etc/parhelion");
  std::ofstream(root_ / "etc/parhelion/parhelion.env")
      << "# LCM_DEFAULT_URL=udpm://239.1.1.1:1\nLCM_DEFAULT_URL=udpm://239.2.2.2:2?ttl=1\n";
  EXPECT_EQ(service_url(root_ / ""), "udpm://239.2.2.2:2?ttl=1");
}

}  // namespace
}  // namespace parhelion::tools
