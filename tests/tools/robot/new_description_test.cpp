// `parhelion robot new` where the URDF alone is not enough: further lasers, parts whose meshes are missing,
// other units, and wrong answers.
#include "tools/robot/new_description.hpp"

#include <gmock/gmock.h>

#include <fstream>
#include <map>
#include <numbers>

#include "protocols/robot.hpp"
#include "tests/temporary_folder.hpp"
#include "tools/robot/laser_links.hpp"
#include "tools/robot/plausible_size.hpp"

namespace parhelion::tools {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

const Dialogue kNobody{[](const std::string&, const std::string&) { return std::nullopt; }, {}};

std::string box(const std::string& size) {
  return "<collision><geometry><box size=\"" + size + "\"/></geometry></collision>";
}
const std::string kMissing = "<collision><geometry><mesh filename=\"absent.stl\"/></geometry></collision>";

std::string inertial(const std::string& mass) {
  return "<inertial><mass value=\"" + mass +
         "\"/><inertia ixx=\"1\" ixy=\"0\" ixz=\"0\" iyy=\"1\" iyz=\"0\" izz=\"1\"/></inertial>";
}

/// A link that hangs from `parent` by a fixed joint.
std::string part(const std::string& name, const std::string& parent, const std::string& xyz,
                 const std::string& rpy = "0 0 0", const std::string& content = "") {
  return "<link name=\"" + name + "\">" + content + "</link><joint name=\"to_" + name +
         "\" type=\"fixed\"><origin xyz=\"" + xyz + "\" rpy=\"" + rpy + "\"/><parent link=\"" + parent +
         "\"/><child link=\"" + name + "\"/></joint>";
}

UrdfOutline outline_of(const std::string& links) {
  const test::TemporaryFolder folder;
  std::ofstream(folder / "rover.urdf") << "<robot name=\"rover\">" << links << "</robot>";
  auto outline = read_urdf_outline(folder / "rover.urdf");
  EXPECT_TRUE(outline.ok()) << outline.error().message;
  return *outline;
}

const std::string kTwoLasers = "<link name=\"base_link\">" + box("0.6 0.4 0.2") + "</link>" +
                               part("front_laser_mount", "base_link", "0.3 0.2 0.18") +
                               part("front_laser", "base_link", "0.3 0.2 0.2") +
                               part("rear_laser", "base_link", "-0.3 -0.2 0.2", "0 0 3.14159265");

RobotDescription parsed(const NewDescription& made) {
  const auto robot = parse_robot_description(made.text, "new");
  EXPECT_TRUE(robot.ok()) << robot.error().message << "\n" << made.text;
  return *robot;
}

/// Of a laser with 100 beams and a wall at 3 m.
LaserSurvey survey_of_a_wall() {
  LaserSurvey survey;
  survey.beams = 100;
  survey.angle_increment = 0.01F;
  survey.period = 0.05;
  survey.min_range = 2;
  survey.max_range = 3;
  Scan scan;
  scan.angle_increment = 0.01F;
  scan.ranges.assign(100, 3.F);
  survey.scans.assign(3, scan);
  return survey;
}

TEST(RobotNewLasers, WithoutALogEachLaserOfTheUrdfIsWritten) {
  const auto made = new_description(outline_of(kTwoLasers), std::nullopt, kNobody);
  ASSERT_TRUE(made.ok()) << made.error().message;
  const RobotDescription robot = parsed(*made);
  ASSERT_TRUE(robot.laser);
  EXPECT_NEAR(robot.laser->T_base_laser.translation().x(), 0.3, 1e-6);
  ASSERT_EQ(robot.further_lasers.size(), 1U) << "a mount and its frame are one laser";
  EXPECT_EQ(robot.further_lasers[0].name, "rear");
  EXPECT_NEAR(robot.further_lasers[0].laser.T_base_laser.translation().x(), -0.3, 1e-6);
  EXPECT_NEAR(robot.further_lasers[0].laser.T_base_laser.rotation()(0, 0), -1, 1e-6);
  EXPECT_THAT(made->notes, Contains(AllOf(HasSubstr("rear_laser"), HasSubstr("SCAN_rear"))));
}

TEST(RobotNewLasers, ScansOfAFurtherLaserInTheLogDecideItsValues) {
  LogSurvey log;
  log.laser = survey_of_a_wall();
  log.further_lasers["SCAN_rear"] = survey_of_a_wall();
  log.further_lasers["SCAN_rear"].beams = 50;
  const auto made = new_description(outline_of(kTwoLasers), log, kNobody);
  ASSERT_TRUE(made.ok()) << made.error().message;
  const RobotDescription robot = parsed(*made);
  EXPECT_EQ(robot.laser->beams, 100);
  ASSERT_EQ(robot.further_lasers.size(), 1U);
  EXPECT_EQ(robot.further_lasers[0].laser.beams, 50);
  EXPECT_NEAR(robot.further_lasers[0].laser.T_base_laser.translation().x(), -0.3, 1e-6);
}

TEST(RobotNewLasers, ALaserWhoseScansTheLogDoesNotHaveIsAComment) {
  LogSurvey log;
  log.laser = survey_of_a_wall();
  const auto made = new_description(outline_of(kTwoLasers), log, kNobody);
  ASSERT_TRUE(made.ok()) << made.error().message;
  EXPECT_TRUE(parsed(*made).further_lasers.empty());
  EXPECT_THAT(made->text, HasSubstr("#   - name: rear"));
  EXPECT_THAT(made->notes, Contains(AllOf(HasSubstr("rear_laser"), HasSubstr("left out"))));
}

TEST(RobotNewLasers, TheDialogueNamesAFurtherLaserAndMayLeaveItOut) {
  const auto with = [](const std::string& name) {
    return new_description(outline_of(kTwoLasers), std::nullopt,
                           {[&](const std::string& question, const std::string& likely) {
                              return question.starts_with("'rear_laser'") ? name : likely;
                            },
                            {}});
  };
  EXPECT_EQ(parsed(with("back").value()).further_lasers.at(0).name, "back");
  EXPECT_TRUE(parsed(with("-").value()).further_lasers.empty());
  EXPECT_THAT(with("back laser").error().message, HasSubstr("'back laser'"));
}

TEST(RobotNewLasers, LinksAndPositionsCanBeGiven) {
  GivenParts given;
  given.lasers = {"0.1,-0.05,0.4,180", "rear=rear_laser"};
  const RobotDescription robot =
      parsed(new_description(outline_of(kTwoLasers), std::nullopt, kNobody, given).value());
  EXPECT_TRUE(robot.laser->T_base_laser.translation().isApprox(Eigen::Vector3d(0.1, -0.05, 0.4), 1e-6));
  EXPECT_NEAR(robot.laser->T_base_laser.rotation()(0, 0), -1, 1e-6);
  EXPECT_EQ(robot.further_lasers.at(0).name, "rear");
  given.lasers = {"font_laser"};
  EXPECT_THAT(new_description(outline_of(kTwoLasers), std::nullopt, kNobody, given).error().message,
              AllOf(HasSubstr("front_laser"), HasSubstr("x,y,z,yaw")));
}

TEST(RobotNewLasers, ScansWithoutALinkNeedThePositionOfTheLaser) {
  const UrdfOutline outline = outline_of("<link name=\"base_link\">" + box("0.6 0.4 0.2") + "</link>");
  LogSurvey log;
  log.laser = survey_of_a_wall();
  EXPECT_THAT(new_description(outline, log, kNobody).error().message, HasSubstr("--laser X,Y,Z,YAW"));
  GivenParts given;
  given.lasers = {"0.1,0,0.3"};
  EXPECT_TRUE(parsed(new_description(outline, log, kNobody, given).value()).laser);
}

TEST(RobotNewLasers, WithoutAnyLaserANoteNamesWhatIsMissing) {
  const auto made = new_description(outline_of("<link name=\"base_link\">" + box("0.6 0.4 0.2") + "</link>"),
                                    std::nullopt, kNobody);
  ASSERT_TRUE(made.ok());
  EXPECT_FALSE(parsed(*made).laser);
  EXPECT_THAT(made->notes, ElementsAre(AllOf(HasSubstr("serve"), HasSubstr("--laser"))));
}

TEST(RobotNewLasers, NamesAreWhatIsLeftOfTheLinks) {
  EXPECT_EQ(laser_name("rear_laser_link", 2), "rear");
  EXPECT_EQ(laser_name("Base_Scan_Left", 2), "left");
  EXPECT_EQ(laser_name("laser_frame", 3), "laser3");
  EXPECT_EQ(laser_name("a_very_long_name_of_a_laser", 2).size(), 16U);
}

// A typing error must not lose the answers before it.
TEST(RobotNewAnswers, AWrongAnswerIsAskedAgain) {
  std::map<std::string, int> asked;
  std::vector<std::string> complaints;
  const Dialogue person{[&](const std::string& question, const std::string& likely) {
                          const int times = asked[question]++;
                          if (question.starts_with("Greatest speed"))
                            return std::string(times == 0 ? "abc" : "1.5");
                          if (question.starts_with("Link of the laser on SCAN"))
                            return std::string(times == 0 ? "nonsense" : "front_laser");
                          return likely;
                        },
                        [&](const std::string& words) { complaints.push_back(words); }};
  const auto made = new_description(outline_of(kTwoLasers), std::nullopt, person);
  ASSERT_TRUE(made.ok()) << made.error().message;
  EXPECT_NEAR(parsed(*made).limits.speed, 1.5, 1e-9);
  EXPECT_THAT(complaints, ElementsAre(HasSubstr("'nonsense'"), HasSubstr("found 'abc'")));
}

TEST(RobotNewAnswers, TheEndOfTheInputTakesWhatIsLikelyOrEnds) {
  Dialogue closed = kNobody;
  closed.complain = [](const std::string&) {};
  EXPECT_TRUE(new_description(outline_of(kTwoLasers), std::nullopt, closed).ok());
  EXPECT_FALSE(new_description(outline_of("<link name=\"base_link\"/>"), std::nullopt, closed).ok());
}

const std::string kTracked =
    "<link name=\"base_footprint\"/>" +
    part("base_link", "base_footprint", "0 0 0.15", "0 0 0", inertial("30") + kMissing) +
    part("laser", "base_link", "0.3 0 0.2");
const std::string kArm = "<link name=\"arm\">" + inertial("2") + box("0.05 0.05 0.2") +
                         "</link><joint name=\"j\" type=\"continuous\"><origin xyz=\"0.1 0 0.3\"/>"
                         "<parent link=\"base_link\"/><child link=\"arm\"/><axis xyz=\"0 0 1\"/></joint>";

TEST(RobotNewOutline, TheFloorIsThatOfBaseFootprint) {
  const UrdfOutline outline = outline_of(kTracked + kArm);
  EXPECT_NEAR(outline.T_base_link.at("laser").translation().z(), 0.35, 1e-6);
  EXPECT_NEAR(outline.height, 0.55, 1e-6);
}

TEST(RobotNewOutline, WithoutTheBaseTheFootprintHasToBeGiven) {
  const UrdfOutline outline = outline_of(kTracked + kArm);
  EXPECT_THAT(outline.left_out, ElementsAre("base_link"));
  EXPECT_TRUE(outline.lacks_base);
  EXPECT_THAT(new_description(outline, std::nullopt, kNobody).error().message,
              AllOf(HasSubstr("base_link"), HasSubstr("--footprint")));
  GivenParts given;
  given.footprint = "0.7,0.5";
  const RobotDescription robot = parsed(new_description(outline, std::nullopt, kNobody, given).value());
  ASSERT_EQ(robot.footprint.size(), 4U);
  EXPECT_TRUE(robot.footprint[2].isApprox(Eigen::Vector2d(0.35, 0.25)));
  const auto asked =
      new_description(outline, std::nullopt,
                      {[](const std::string& question, const std::string& likely) {
                         return question.starts_with("Outline") ? "0.3,0 0,0.3 -0.3,0" : likely;
                       },
                       {}});
  EXPECT_EQ(parsed(asked.value()).footprint.size(), 3U);
}

TEST(RobotNewOutline, AWrongFootprintIsRefused) {
  GivenParts given;
  for (const char* wrong : {"0.7", "a,b", "0.7,-0.5", "1,0 0,1", "1,0 2,0 3,0", "1,2,3"}) {
    given.footprint = wrong;
    EXPECT_THAT(new_description(outline_of(kTwoLasers), std::nullopt, kNobody, given).error().message,
                HasSubstr("length,width"))
        << wrong;
  }
}

TEST(RobotNewOutline, APartThatIsLeftOutIsNamed) {
  const UrdfOutline outline =
      outline_of(kTwoLasers + part("bumper", "base_link", "0.4 0 0", "0 0 0", kMissing));
  EXPECT_FALSE(outline.lacks_base);
  const auto made = new_description(outline, std::nullopt, kNobody);
  ASSERT_TRUE(made.ok()) << made.error().message;
  EXPECT_THAT(made->text, HasSubstr("outline without bumper"));
  EXPECT_THAT(made->notes, Contains(AllOf(HasSubstr("outline lacks bumper"), HasSubstr("--footprint"))));
}

TEST(RobotNewUnits, MillimetresAndDegreesAreReported) {
  const UrdfOutline outline = outline_of("<link name=\"base_link\">" + box("600 400 200") + "</link>" +
                                         part("laser", "base_link", "300 0 200", "0 0 90"));
  EXPECT_THAT(outline.warnings,
              ElementsAre(AllOf(HasSubstr("rover.urdf:1"), HasSubstr("are these degrees?"))));
  const RobotDescription robot = parsed(new_description(outline, std::nullopt, kNobody).value());
  EXPECT_THAT(implausible_values(robot),
              ElementsAre(HasSubstr("footprint: 600.00 m x 400.00 m"), HasSubstr("height: 200.00 m"),
                          AllOf(HasSubstr("laser pose"), HasSubstr("were these millimetres?"))));
  EXPECT_THAT(
      implausible_values(parsed(new_description(outline_of(kTwoLasers), std::nullopt, kNobody).value())),
      IsEmpty());
}

TEST(RobotNewUnits, DegreesTakenForRadiansAreReported) {
  RobotDescription robot;
  robot.laser.emplace();
  robot.laser->beams = 720;
  robot.laser->angle_increment = 0.5;
  EXPECT_THAT(implausible_values(robot), ElementsAre(HasSubstr("720 beams make 57.3 turns")));
  robot.laser->angle_increment = 2 * std::numbers::pi / 720;
  EXPECT_THAT(implausible_values(robot), IsEmpty());
}

TEST(RobotNewUnits, MetresTakenForMillimetresAreReported) {
  RobotDescription robot;
  robot.footprint = {{0, 0}, {6e-4, 0}, {6e-4, 4e-4}};
  EXPECT_THAT(implausible_values(robot), ElementsAre(HasSubstr("smaller than mobile robots are")));
}

}  // namespace
}  // namespace parhelion::tools
