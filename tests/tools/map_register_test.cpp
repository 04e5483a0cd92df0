// `parhelion map register` in normal use.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "fusion/cloud/read_cloud.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/tools/imported_log.hpp"
#include "tests/tools/process.hpp"

namespace parhelion::tools {
namespace {

using test::TemporaryFolder;

nlohmann::json json_of(const std::filesystem::path& path) {
  std::ifstream file(path);
  return nlohmann::json::parse(file);
}

TEST(MapRegister, RegistersTheRoomScansAndReportsTheResult) {
  const auto room1 = test::recording("3d-room-scan/room_scan1.pcd");
  const auto room2 = test::recording("3d-room-scan/room_scan2.pcd");
  PARHELION_NEEDS_RECORDING(room1);
  const TemporaryFolder folder;
  const std::string cloud = folder / "room.ply", summary = folder / "s.json";
  const std::vector<std::string> arguments = {
      "map", "register", room1,       room2,  "--guess", "1.79387,0.720047,0,39.7117",
      "-o",  cloud,      "--summary", summary};
  const auto ran = test::run(arguments, folder / "log");
  ASSERT_EQ(ran.exit, 0) << ran.output;
  const auto scan = cloud::read_scan(cloud);
  ASSERT_TRUE(scan) << scan.error().message;
  EXPECT_EQ(scan->cloud.viewpoints.size(), 2U);
  const auto summary_json = json_of(summary);
  ASSERT_EQ(summary_json["scans"].size(), 2U);
  EXPECT_EQ(summary_json["points"], scan->cloud.size());
  const auto& second = summary_json["scans"][1];
  EXPECT_TRUE(second["converged"]);
  EXPECT_GT(second["overlap"], 0.4);
  const auto T = second["T_map_scan"].get<std::vector<std::vector<double>>>();
  ASSERT_EQ(T.size(), 4U);
  // The result of point-to-plane ICP in the attribution file.
  EXPECT_NEAR(std::atan2(T[1][0], T[0][0]), 0.712, 0.3 * std::numbers::pi / 180);
  EXPECT_NEAR(std::hypot(T[0][3] - 1.971, T[1][3] - 0.057, T[2][3] - 0.029), 0, 0.03);
  EXPECT_EQ(test::run(arguments, folder / "log").exit, 1) << "nothing is overwritten unasked";
}

TEST(MapRegister, AnUnregisteredScanIsNotInTheCloud) {
  const auto corridor = test::recording("3d-3dtk-corridor/scan000.3d");
  const auto stairs = test::recording("3d-ori-stairs/06.pcd");
  PARHELION_NEEDS_RECORDING(corridor);
  PARHELION_NEEDS_RECORDING(stairs);
  const TemporaryFolder folder;
  const std::string cloud = folder / "c.ply", summary = folder / "s.json";
  std::vector<std::string> arguments = {"map",      "register", corridor, stairs,      "--guess",
                                        "30,0,0,0", "-o",       cloud,    "--summary", summary};
  const auto ran = test::run(arguments, folder / "log");
  EXPECT_EQ(ran.exit, 1) << ran.output;
  EXPECT_FALSE(std::filesystem::exists(cloud));
  const auto summary_json = json_of(summary);
  EXPECT_FALSE(summary_json["scans"][1]["converged"]);
  EXPECT_TRUE(summary_json["scans"][1]["T_map_scan"].is_null());
  EXPECT_NE(summary_json["scans"][1]["why"], "");
  arguments.insert(arguments.end(), {"--keep-going", "--force"});
  EXPECT_EQ(test::run(arguments, folder / "log").exit, 0);
  const auto scan = cloud::read_scan(cloud);
  ASSERT_TRUE(scan);
  EXPECT_LE(scan->cloud.size(), 81'359U);
}

TEST(MapRegister, TheMethodOptionSelectsThePapersIcp) {
  const auto room = test::recording("3d-room-scan/room_scan1.pcd");
  PARHELION_NEEDS_RECORDING(room);
  const TemporaryFolder folder;
  const auto with = [&](std::vector<std::string> more) {
    const std::vector<std::string> itself = {"map", "register", room, room, "--guess", "0.05,0.02,0,1"};
    more.insert(more.begin(), itself.begin(), itself.end());
    more.insert(more.end(), {"-o", folder / "room.ply", "--summary", folder / "s.json", "--force"});
    return test::run(more, folder / "log");
  };
  const auto cut_off = with({"--method", "paper", "--iterations", "2"});
  EXPECT_EQ(cut_off.exit, 1) << cut_off.output;
  EXPECT_EQ(json_of(folder / "s.json")["scans"][1]["why"], "still moving after 2 iterations");
  const auto settled = with({"--method", "paper", "--iterations", "200"});
  ASSERT_EQ(settled.exit, 0) << settled.output;
  const auto T = json_of(folder / "s.json")["scans"][1]["T_map_scan"].get<std::vector<std::vector<double>>>();
  EXPECT_NEAR(std::hypot(T[0][3], T[1][3], T[2][3]), 0, 1e-6) << "each point meets itself";
  EXPECT_EQ(with({"--method", "papers"}).exit, 2);
}

TEST(MapRegister, TrustedPosesAreUsedUnchangedAndMustExist) {
  const auto stairs = test::recording("rgbd-7scenes-stairs/seq-01");
  const auto room = test::recording("3d-room-scan/room_scan1.pcd");
  PARHELION_NEEDS_RECORDING(stairs);
  PARHELION_NEEDS_RECORDING(room);
  const TemporaryFolder folder;
  const std::string cloud = folder / "stairs.ply";
  const auto ran = test::run({"map", "register", stairs, "--trust-poses", "-o", cloud}, folder / "log");
  ASSERT_EQ(ran.exit, 0) << ran.output;
  EXPECT_GT(cloud::read_scan(cloud)->cloud.size(), 10'000U);
  EXPECT_EQ(
      test::run({"map", "register", room, "--trust-poses", "-o", folder / "r.ply"}, folder / "log").exit, 1);
}

}  // namespace
}  // namespace parhelion::tools
