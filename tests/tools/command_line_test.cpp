// Error messages for invalid command lines.
#include "tools/command_line.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "protocols/bus/log_file.hpp"
#include "tests/server/tick/synthetic.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/tools/process.hpp"
#include "tools/place_argument.hpp"

namespace parhelion::tools {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

test::Ran run_command(const std::vector<std::string>& arguments) {
  const test::TemporaryFolder folder;
  return test::run(arguments, folder / "said.txt");
}

TEST(CommandLine, AnUnknownSubcommandIsNamedWithTheNearestOne) {
  const auto ran = run_command({"replya", "x.lcm"});
  EXPECT_EQ(ran.exit, 2);
  EXPECT_THAT(ran.output, HasSubstr("parhelion: unknown subcommand 'replya', did you mean 'replay'?"));
  const auto strange = run_command({"frobnicate"});
  EXPECT_EQ(strange.exit, 2);
  EXPECT_THAT(strange.output, AllOf(HasSubstr("unknown subcommand 'frobnicate'; there are "),
                                    HasSubstr("demo, import, slam")));
  EXPECT_THAT(run_command({"map", "extrud"}).output,
              HasSubstr("parhelion map: unknown subcommand 'extrud', did you mean 'extrude'?"));
}

TEST(CommandLine, HelpCommandAndHelpOptionPrintTheSame) {
  EXPECT_EQ(run_command({"help"}).output, run_command({"--help"}).output);
  const auto ran = run_command({"help", "map", "extrude"});
  EXPECT_EQ(ran.exit, 0);
  EXPECT_EQ(ran.output, run_command({"map", "extrude", "--help"}).output);
  EXPECT_EQ(run_command({"help", "frobnicate"}).exit, 2);
}

TEST(CommandLine, FullHelpContainsTheHelpOfEachCommand) {
  const auto all = run_command({"help", "--all"});
  EXPECT_EQ(all.exit, 0);
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{}, {"serve"}, {"map"}, {"map", "extrude"}, {"records", "add"}}) {
    std::string name = "parhelion";
    for (const std::string& word : words) name += " " + word;
    std::vector<std::string> asked = words;
    asked.emplace_back("--help");
    EXPECT_THAT(all.output, HasSubstr("== " + name + " ==\n" + run_command(asked).output));
  }
}

TEST(CommandLine, RobotNewPrintsWhatItWroteAndHowManyValuesAreGuesses) {
  const test::TemporaryFolder folder;
  const std::string urdf = std::string(PARHELION_SOURCE_DIR) + "/server/robots/rover.urdf";
  const auto ran =
      test::run({"robot", "new", "--urdf", urdf, "-o", folder / "robot.yaml"}, folder / "said.txt");
  EXPECT_EQ(ran.exit, 0) << ran.output;
  std::ifstream file(folder / "robot.yaml");
  int guesses = -1;  // the first line explains the mark
  for (std::string line; std::getline(file, line);) guesses += line.find("[guess]") != std::string::npos;
  EXPECT_GT(guesses, 3);
  EXPECT_THAT(ran.output, HasSubstr("robot.yaml: robot description 'rover'; lines with a [guess]: " +
                                    std::to_string(guesses) + ". Measure"));
}

TEST(CommandLine, ParseOnlyChecksTheArgumentsAndRunsNothing) {
  const test::TemporaryFolder folder;
  const std::string log = folder / "session.lcm";
  const auto right = run_command({"--parse-only", "import", "missing.bag", "-o", log});
  EXPECT_EQ(right.exit, 0);
  EXPECT_EQ(right.output, "");
  EXPECT_FALSE(std::filesystem::exists(log));
  EXPECT_EQ(run_command({"--parse-only", "records", "list"}).output, "");
  const auto wrong = run_command({"--parse-only", "replay", "x.lcm", "--scenari", "lab.yaml"});
  EXPECT_EQ(wrong.exit, 2);
  EXPECT_THAT(wrong.output, HasSubstr("unknown option '--scenari', did you mean '--scenario'?"));
}

TEST(CommandLine, AnInvalidOptionValueListsTheValidOnes) {
  const auto ran = run_command({"export", "s.lcm", "--mcap", "s.mcap", "--compression", "zip"});
  EXPECT_EQ(ran.exit, 2);
  EXPECT_THAT(ran.output, HasSubstr("expected one of lz4,none,zstd, found 'zip'"));
}

TEST(CommandLine, AnOperatorsNameThatTheServerWouldRefuseIsRefusedAtTheConsole) {
  for (const std::string console : {"drive", "joystick"}) {
    const auto ran = run_command({console, "--name", "Ann Miller"});
    EXPECT_EQ(ran.exit, 2);
    EXPECT_THAT(ran.output,
                HasSubstr("an operator's name has 1 to 40 letters, digits, '_' and '-', found 'Ann Miller'"));
  }
}

TEST(CommandLine, AMissingSubcommandIsReported) {
  const auto ran = run_command({"topic"});
  EXPECT_EQ(ran.exit, 2);
  EXPECT_THAT(ran.output, HasSubstr("parhelion topic: which of list, echo, hz?"));
}

TEST(CommandLine, AChannelWithoutMessagesIsNamedWithTheNearestOne) {
  const std::string path = ::testing::TempDir() + "parhelion_topic.lcm";
  auto writer = LogWriter::create(path, true);
  ASSERT_TRUE(writer);
  ASSERT_TRUE(writer->write(test::drive(1)));
  const auto ran = run_command({"topic", "echo", "SCNA", "--log", path});
  EXPECT_EQ(ran.exit, 1);
  EXPECT_THAT(ran.output, HasSubstr("parhelion topic echo: no message on 'SCNA', did you mean 'SCAN'?"));
  EXPECT_EQ(run_command({"topic", "echo", "SCAN", "--count", "1", "--log", path}).exit, 0);
}

TEST(CommandLine, AnUnknownOptionIsNamedWithTheNearestOne) {
  const auto ran = run_command({"slam", "--savemap=site", "--log", "x"});
  EXPECT_EQ(ran.exit, 2);
  EXPECT_THAT(ran.output,
              HasSubstr("parhelion slam: unknown option '--savemap', did you mean '--save-map'?"));
  EXPECT_THAT(run_command({"--verison"}).output,
              HasSubstr("unknown option '--verison', did you mean '--version'?"));
  EXPECT_THAT(run_command({"doctor", "now"}).output, HasSubstr("'now' is an unexpected argument"));
}

TEST(CommandLine, PlacesTakeUnitsAndRefuseAYawWithoutOne) {
  const double right_angle = std::numbers::pi / 2;
  EXPECT_EQ(*parse_place("2.5,1,90deg", true), Eigen::Vector3d(2.5, 1, right_angle));
  EXPECT_EQ(*parse_place("250cm,1m,1.5rad", true), Eigen::Vector3d(2.5, 1, 1.5));
  EXPECT_EQ(*parse_place("-2,1", false), Eigen::Vector3d(-2, 1, 0));
  EXPECT_EQ(*parse_place("0,0,0", true), Eigen::Vector3d::Zero());
  EXPECT_THAT(parse_place("2.5,1,90", true).error().message, HasSubstr("90deg or 90rad?"));
  for (const char* wrong : {"", "1", "1,2,3deg,4", "1,two", "1,nan", "1,2,3m", "1s,2", ",", "1,2,"})
    EXPECT_FALSE(parse_place(wrong, false)) << wrong;
  EXPECT_FALSE(parse_place("1,2", true));
}

TEST(CommandLine, BothCommandsParsePlacesIdentically) {
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{"slam", "--log", "x", "-o", "y", "--map", "m", "--start", "1,2,90"},
        std::vector<std::string>{"inject", "spawn", "--name", "a", "--at", "1,2,90"}}) {
    const auto ran = run_command(arguments);
    EXPECT_EQ(ran.exit, 2);
    EXPECT_THAT(ran.output, HasSubstr("90deg or 90rad?"));
  }
}

}  // namespace
}  // namespace parhelion::tools
