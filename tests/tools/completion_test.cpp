// Shell completion offers what --help lists, for all commands.
#include "tools/completion.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "tests/server/tick/synthetic.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/tools/process.hpp"

namespace parhelion::tools {
namespace {

using ::testing::Contains;
using ::testing::IsEmpty;
using ::testing::IsSupersetOf;
using ::testing::UnorderedElementsAre;

using Words = std::set<std::string>;

class CompletionTest : public testing::Test {
 protected:
  void load(const std::string& script) { std::ofstream(folder_ / "script") << script; }
  /// Bash's completions of the last of these words.
  Words offers(const std::vector<std::string>& words) {
    std::string line = "source '" + (folder_ / "script") + "'; COMP_WORDS=(";
    for (const std::string& word : words) line += "'" + word + "' ";
    line += "); COMP_CWORD=" + std::to_string(words.size() - 1) + "; _" + words[0] +
            "; printf '%s\\n' \"${COMPREPLY[@]}\"";
    test::Process bash({"--norc", "-c", line}, folder_ / "offers", "/bin/bash");
    EXPECT_EQ(bash.wait(), 0);
    std::istringstream text(test::bytes_of(folder_ / "offers"));
    Words all;
    for (std::string word; text >> word;) all.insert(word);
    return all;
  }
  test::TemporaryFolder folder_;
};

TEST_F(CompletionTest, OffersSubcommandsOptionsAndTheValuesOfAnOption) {
  CLI::App app("A program", "prog");
  CLI::App* serve = app.add_subcommand("serve", "Serves");
  std::string word;
  int unit = 0;
  serve->add_option_group("units")
      ->add_option("--unit", unit)
      ->transform(CLI::CheckedTransformer(std::map<std::string, int>{{"mm", 0}, {"m", 39}}));
  serve->add_option("scenario", word);
  serve->add_option("--real-time", word)->check(CLI::IsMember({"auto", "on", "off"}));
  serve->add_option("-o,--output", word);
  serve->add_flag("--force");
  app.add_subcommand("map", "Maps")->add_subcommand("view", "Views");
  load(bash_completion(app));
  EXPECT_THAT(offers({"prog", ""}), UnorderedElementsAre("serve", "map"));
  EXPECT_THAT(offers({"prog", "s"}), UnorderedElementsAre("serve"));
  EXPECT_THAT(offers({"prog", "map", ""}), UnorderedElementsAre("view"));
  EXPECT_THAT(offers({"prog", "serve", "--real-time", ""}), UnorderedElementsAre("auto", "on", "off"));
  EXPECT_THAT(offers({"prog", "serve", "--real-time", "o"}), UnorderedElementsAre("on", "off"));
  EXPECT_THAT(offers({"prog", "serve", "--unit", ""}), UnorderedElementsAre("mm", "m"));
  EXPECT_THAT(offers({"prog", "serve", "-"}),
              UnorderedElementsAre("--real-time", "--unit", "--output", "-o", "--force", "--help", "-h"));
  EXPECT_THAT(offers({"prog", "serve", "--force", "--f"}), UnorderedElementsAre("--force"));
  EXPECT_THAT(offers({"prog", "serve", ""}), IsEmpty()) << "a scenario: bash offers files";
  EXPECT_THAT(offers({"prog", "serve", "-o", ""}), IsEmpty());
  EXPECT_THAT(offers({"prog", "map", "view", ""}), UnorderedElementsAre("--help", "-h"));
}

TEST_F(CompletionTest, CompletionOfTheProgramMatchesItsHelp) {
  const auto script = test::run({"completion", "bash"}, folder_ / "out");
  ASSERT_EQ(script.exit, 0) << script.output;
  load(script.output);
  const Words commands = offers({"parhelion", ""});
  EXPECT_THAT(commands, IsSupersetOf({"demo", "serve", "replay", "map", "doctor", "completion"}));
  const std::string all = test::run({"--help"}, folder_ / "out").output;
  for (const std::string& command : commands) {
    EXPECT_TRUE(std::regex_search(all, std::regex("\n  " + command + " "))) << command;
    const std::string help = test::run({command, "--help"}, folder_ / "out").output;
    Words documented;
    for (const auto& part : {std::regex("\n  (-\\w),"), std::regex("\n  (?:-\\w,)?(--[a-z][-a-z0-9]*)")}) {
      for (auto found = std::sregex_iterator(help.begin(), help.end(), part); found != std::sregex_iterator();
           ++found)
        documented.insert((*found)[1]);
    }
    EXPECT_EQ(offers({"parhelion", command, "-"}), documented) << command;
  }
  EXPECT_THAT(offers({"parhelion", "map", ""}), Contains("register"));
}

}  // namespace
}  // namespace parhelion::tools
