// A session exported as MCAP and read by Foxglove's own reader (tests/browser/mcap.mjs) equals the session.
#include "tools/export/export_mcap.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "tests/server/review/written_session.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/tools/process.hpp"

namespace parhelion::tools {
namespace {

using nlohmann::json;

const std::string kBrowserFolder = std::string(PARHELION_SOURCE_DIR) + "/tests/browser";

class ExportMcapTest : public ::testing::Test {
 protected:
  void SetUp() override {
    session_.seconds = 4.2;
    session_.picture_width = 64;
    session_.write(log_);
    options_.log = log_;
    options_.output = folder_ / "session.mcap";
  }
  ExportReport exported() {
    auto report = export_mcap(options_);
    EXPECT_TRUE(report.ok()) << (report ? "" : report.error().message);
    return report ? std::move(*report) : ExportReport{};
  }
  std::string refusal() {
    const auto report = export_mcap(options_);
    EXPECT_FALSE(report.ok());
    return report ? "" : report.error().message;
  }
  /// The result of Foxglove's reader.
  json read_back() {
    const auto ran = test::run({kBrowserFolder + "/mcap.mjs", options_.output, folder_ / "summary.json"},
                               folder_ / "node.txt", "/usr/bin/node");
    EXPECT_EQ(ran.exit, 0) << ran.output;
    return json::parse(test::bytes_of(folder_ / "summary.json"), nullptr, false);
  }
  /// False, with a message, if the reader's packages are not installed.
  static bool can_read_back() {
    if (std::filesystem::exists(kBrowserFolder + "/node_modules/@mcap/core")) return true;
    // tools/test has installed it, so its absence is a failure there.
    EXPECT_EQ(std::getenv("PARHELION_BROWSER"), nullptr) << "no packages in " << kBrowserFolder;
    return false;
  }

  const test::TemporaryFolder folder_;
  const std::string log_ = folder_ / "session.lcm";
  test::WrittenSession session_;
  ExportOptions options_;
};

TEST_F(ExportMcapTest, TheFoxgloveReaderFindsMessagesByIndexAndSchema) {
  if (!can_read_back()) GTEST_SKIP() << "needs `npm ci` in " << kBrowserFolder;
  const ExportReport report = exported();
  const json found = read_back();
  ASSERT_TRUE(found.is_object());
  for (const auto& [topic, count] : report.messages) EXPECT_EQ(found[topic]["count"], count) << topic;
  const std::map<std::string, std::string> expected{{"/scan", "foxglove.LaserScan"},
                                                    {"/mr_scan", "foxglove.LaserScan"},
                                                    {"/virtual_returns", "foxglove.LaserScan"},
                                                    {"/mr_camera/image", "foxglove.CompressedImage"},
                                                    {"/scene", "foxglove.SceneUpdate"},
                                                    {"/names", "foxglove.SceneUpdate"},
                                                    {"/building", "foxglove.SceneUpdate"},
                                                    {"/events", "foxglove.Log"},
                                                    {"/teleop", "parhelion.Twist"},
                                                    {"/mr_cmd", "parhelion.Twist"},
                                                    {"/injection", "parhelion.Injection"}};
  for (const auto& [topic, schema] : expected) EXPECT_EQ(found[topic]["schema"], schema) << topic;
  EXPECT_EQ(report.unreadable, 0U) << report.first_unreadable;
}

TEST_F(ExportMcapTest, TheFoxgloveLayoutShowsTheExportedTopics) {
  const ExportReport report = exported();
  const json layout =
      json::parse(test::bytes_of(std::string(PARHELION_SOURCE_DIR) + "/server/station/foxglove/layout.json"),
                  nullptr, false);
  ASSERT_TRUE(layout.is_object());
  const json& panels = layout["configById"];
  const std::string picture = panels["Image!camera"]["imageMode"]["imageTopic"];
  EXPECT_EQ(panels["Image!camera"]["imageMode"]["calibrationTopic"],
            picture.substr(0, picture.rfind('/')) + "/calibration");
  std::vector<std::string> shown = {picture, panels["RosOut!events"]["topicToRender"]};
  for (const auto& [topic, settings] : panels["3D!site"]["topics"].items()) shown.push_back(topic);
  for (const json& path : panels["Plot!injection"]["paths"]) {
    const std::string value = path["value"];
    shown.push_back(value.substr(0, value.find('.')));
  }
  for (const std::string& topic : shown) EXPECT_TRUE(report.messages.contains(topic)) << topic;
  const json arrangement = layout["layout"].flatten();
  for (const auto& [where, panel] : arrangement.items()) {
    const std::string name = panel.is_string() ? panel.get<std::string>() : "";
    EXPECT_EQ(name.find('!') != std::string::npos, panels.contains(name)) << where;
  }
}

TEST_F(ExportMcapTest, ScansBodiesAndContactsMatchTheLog) {
  if (!can_read_back()) GTEST_SKIP() << "needs `npm ci` in " << kBrowserFolder;
  exported();
  const json found = read_back();
  ASSERT_TRUE(found.is_object());
  const json& scan = found["/mr_scan"]["first"];
  const json& injected = found["/virtual_returns"]["first"];
  ASSERT_EQ(scan["ranges"].size(), injected["ranges"].size());
  const std::size_t middle = scan["ranges"].size() / 2;
  for (std::size_t i = 0; i < scan["ranges"].size(); ++i) {
    EXPECT_EQ(injected["ranges"][i].is_null(), i != middle) << i;  // an infinity becomes null when written
                                                                   // again
    EXPECT_EQ(injected["intensities"][i], i == middle ? 1 : 0);
  }
  EXPECT_EQ(injected["ranges"][middle], scan["ranges"][middle]);
  const json& scene = found["/scene"]["first"];
  ASSERT_EQ(scene["entities"].size(), 3U);
  EXPECT_EQ(scene["entities"][0]["id"], session_.configuration().robot.name);
  EXPECT_EQ(scene["entities"][1]["metadata"][1]["value"], "barrel");
  const std::string touch = found["/events"]["last"]["message"];
  EXPECT_NE(touch.find("contact started"), std::string::npos) << touch;
  EXPECT_NE(touch.find("barrel_1"), std::string::npos) << touch;
  EXPECT_EQ(found["/events"]["last"]["level"], 4);
  const std::size_t walls = session_.configuration().model.entities.size();
  EXPECT_GE(walls, found["/building"]["first"]["entities"].size());
  EXPECT_GT(found["/building"]["first"]["entities"].size(), 3U);
}

TEST_F(ExportMcapTest, EachCompressionHasTheSameContent) {
  if (!can_read_back()) GTEST_SKIP() << "needs `npm ci` in " << kBrowserFolder;
  const std::uint64_t zstd = exported().bytes_out;
  const json expected = read_back();
  options_.overwrite = true;
  for (const McapCompression other : {McapCompression::lz4, McapCompression::none}) {
    options_.compression = other;
    EXPECT_GT(exported().bytes_out, zstd);
    EXPECT_EQ(read_back(), expected);
  }
}

TEST_F(ExportMcapTest, RawMessagesOfAnyLogAreExportedUnchanged) {
  if (!can_read_back()) GTEST_SKIP() << "needs `npm ci` in " << kBrowserFolder;
  options_.raw = true;
  exported();
  const json found = read_back();
  EXPECT_EQ(found["lcm/MR_SCAN"]["type"], "planar_lidar_t");
  EXPECT_EQ(found["lcm/MR_SCAN"]["encoding"], "lcm");
  EXPECT_EQ(found["lcm/MR_SCAN"]["count"], found["/mr_scan"]["count"]);
  std::uint64_t bytes = 0;
  auto log = LogReader::open(log_);
  ASSERT_TRUE(log.ok());
  for (auto next = log->next(); next.ok() && next->has_value(); next = log->next())
    if ((*next)->channel == channel::kMrScan) bytes += (*next)->payload.size();
  EXPECT_EQ(found["lcm/MR_SCAN"]["bytes"], bytes);
}

TEST_F(ExportMcapTest, AFileThatIsNoSessionLeavesNoOutput) {
  options_.log = folder_ / "nothing.lcm";
  EXPECT_NE(refusal().find("nothing.lcm"), std::string::npos);
  {
    auto log = LogWriter::create(options_.log, true);
    const std::uint8_t byte = 1;
    ASSERT_TRUE(log.ok() && log->write("SCAN", ArrivalTime{1'000'000'000}, {&byte, 1}).ok());
  }
  EXPECT_NE(refusal().find("no MR_SESSION"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(options_.output));
  std::ofstream(options_.output) << "mine";
  options_.log = log_;
  EXPECT_NE(refusal().find("--force"), std::string::npos);
  EXPECT_EQ(test::bytes_of(options_.output), "mine");
}

TEST_F(ExportMcapTest, ADamagedLogIsExportedAndItsErrorsCounted) {
  const std::uint64_t whole = exported().messages.at("/scene");
  std::filesystem::resize_file(log_, std::filesystem::file_size(log_) * 2 / 3);
  options_.overwrite = true;
  const ExportReport report = exported();
  EXPECT_GT(report.skipped_bytes, 0U);
  EXPECT_LT(report.messages.at("/scene"), whole);
  EXPECT_GT(report.messages.at("/scene"), whole / 2);
}

TEST_F(ExportMcapTest, ATruncatedScanIsOmittedAndReported) {
  const std::uint64_t whole = exported().messages.at("/scan");
  session_.broken_scan = 2;
  session_.write(log_);
  options_.overwrite = true;
  const ExportReport report = exported();
  EXPECT_GE(report.unreadable, 2U);  // on SCAN and on MR_SCAN
  EXPECT_EQ(report.messages.at("/scan"), whole);
  EXPECT_NE(report.first_unreadable.find("SCAN"), std::string::npos);
}

}  // namespace
}  // namespace parhelion::tools
