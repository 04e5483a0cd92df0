// A shipped scenario of a real site, with the model built from the site's scans by the documented commands.
#pragma once

#include <string>
#include <vector>

#include "tests/server/runtime/scripted_drive.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/tools/process.hpp"

namespace parhelion::test {

class SiteDrive : public ScriptedDrive {
 protected:
  void TearDown() override {
    if (HasFailure()) std::fputs(event_log().c_str(), stderr);
  }
  static std::string shipped(const std::string& name) {
    return std::string(PARHELION_SOURCE_DIR) + "/server/scenarios/" + name;
  }
  /// Copies the scenario to a temporary folder, beside the model built from `cloud`.
  void make_site(const std::string& site, const std::string& cloud, std::vector<std::string> more = {}) {
    std::vector<std::string> arguments{"map",
                                       "model",
                                       cloud,
                                       "-o",
                                       folder_ / (site + "_model.yaml"),
                                       "--keep",
                                       shipped(site + "_corrections.yaml")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const auto made = run(arguments, folder_ / "model.txt");
    ASSERT_EQ(made.exit, 0) << made.output;
    std::filesystem::copy_file(shipped(site + ".yaml"), folder_ / (site + ".yaml"));
    const auto valid = run({"validate", folder_ / (site + ".yaml")}, folder_ / "validate.txt");
    EXPECT_EQ(valid.exit, 0) << valid.output;
    load(folder_ / (site + ".yaml"));
  }

  TemporaryFolder folder_;
};

}  // namespace parhelion::test
