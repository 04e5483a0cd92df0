// Malicious YAML: each reader returns an Error within a short time, without a crash.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "protocols/model.hpp"
#include "protocols/robot.hpp"
#include "protocols/scenario.hpp"
#include "tests/protocols/damaged_text.hpp"
#include "tests/temporary_folder.hpp"

namespace parhelion {
namespace {

std::string repeat(const std::string& text, int times) {
  std::string out;
  for (int i = 0; i < times; ++i) out += text;
  return out;
}

std::string error_of_any(const std::string& yaml) {
  const auto scenario = parse_scenario(yaml, "s.yaml");
  const auto model = parse_model(yaml, "s.yaml");
  const auto robot = parse_robot_description(yaml, "s.yaml");
  EXPECT_FALSE(model) << "nothing here is a model";
  return scenario ? robot ? "" : robot.error().message : scenario.error().message;
}

TEST(HostileYaml, DeepNestingIsRefused) {
  for (const char* opening : {"[", "{", "{a: ", "- ", "[[{", "? ", "a: {b: ["}) {
    EXPECT_NE(error_of_any(repeat(opening, 100'000)), "") << opening;
  }
  std::string indented = "agents:\n";
  for (int depth = 1; depth < 1'000; ++depth)
    indented += std::string(static_cast<std::size_t>(depth), ' ') + "a:\n";
  EXPECT_THAT(error_of_any(indented), ::testing::HasSubstr("nested too deeply"));
}

TEST(HostileYaml, AliasBombIsRefusedAtItsFirstAnchor) {
  std::string bomb = "agents: &a [x, x, x, x, x, x, x, x, x, x]\n";
  for (char name = 'b'; name <= 'z'; ++name) {
    const std::string last(1, static_cast<char>(name - 1));
    bomb += std::string(1, name) + ": &" + name + " [" + repeat("*" + last + ", ", 9) + "*" + last + "]\n";
  }
  EXPECT_THAT(error_of_any(bomb), ::testing::HasSubstr("s.yaml:1: anchors and aliases"));
  EXPECT_NE(error_of_any("a: *a"), "");
}

TEST(HostileYaml, InvalidUtf8IsRefusedWithItsPlace) {
  const char* broken[] = {"\xff",     "\xc0\x80", "\xed\xa0\x80",        "\xf4\x90\x80\x80",
                          "\xe2\x82", "\x80",     "\xf8\x88\x80\x80\x80"};
  for (const std::string bytes : broken) {
    EXPECT_THAT(error_of_any("level: 3\nname: a" + bytes + "\n"),
                ::testing::HasSubstr("s.yaml:2: not UTF-8 text (byte 16"));
  }
  EXPECT_THAT(error_of_any(std::string("name: a\0b", 9)), ::testing::HasSubstr("s.yaml: a binary file"));
  EXPECT_THAT(error_of_any(std::string("\xED\xA1\xDA\x01\0\0\0\0", 8)),
              ::testing::HasSubstr("s.yaml: an LCM log, expected a YAML file"));
  EXPECT_NE(error_of_any("name: a\x04\nlevel: 9"), "") << "yaml-cpp takes 0x04 for the end of the file";
}

TEST(HostileYaml, HugeTextsAndListsAreRefused) {
  EXPECT_NE(error_of_any("physics_rate: " + repeat("9", 1'000'000) + " Hz"), "");
  EXPECT_NE(error_of_any("agents: [" + repeat("x,", 200'000) + "]"), "");
  const auto endless = parse_scenario("agents: [" + repeat("x,", 15'000'000) + "]", "s.yaml");
  ASSERT_FALSE(endless);
  EXPECT_THAT(endless.error().message, testing::HasSubstr("more than 500000 values"));
  EXPECT_NE(error_of_any(repeat("k: 1\n", 100'000)), "");
  std::string keys;
  for (int i = 0; i < 20'000; ++i) keys += "key" + std::to_string(i) + ": 1\n";
  EXPECT_NE(error_of_any(keys), "");
  EXPECT_NE(error_of_any(repeat("\"", 100'001)), "");
  EXPECT_NE(error_of_any(repeat("!", 100'000)), "");
  EXPECT_NE(error_of_any(repeat("-", 100'000)), "");
}

TEST(HostileYaml, AFileOfAnotherKindIsRefusedWithoutItsContents) {
  for (const char* text : {"root:$6$rounds$sECRETsECRET:19000:0:99999:7:::\ndaemon:*:19000:0:99999:7:::\n",
                           "apiVersion: v1\nkind: Secret\npassword: sECRET\n", "{\"password\": \"sECRET\"}",
                           "sECRET", "- sECRET\n", "password: sECRET\npassword: sECRET\n",
                           "password: &sECRET x\n", "[sECRET", "password: \"sECRET"}) {
    for (const std::string& message :
         {parse_scenario(text, "f").error().message, parse_model(text, "f").error().message,
          parse_robot_description(text, "f").error().message}) {
      EXPECT_EQ(message.find("sECRET"), std::string::npos) << message;
      EXPECT_EQ(message.find("password"), std::string::npos) << message;
      EXPECT_NE(message.find("expected keys such as"), std::string::npos) << message;
    }
  }
}

TEST(HostileYaml, PipesAndDevicesAreRefusedAtOnce) {
  const test::TemporaryFolder folder;
  ASSERT_EQ(mkfifo((folder / "pipe").c_str(), 0600), 0);
  for (const std::string& path : {folder / "pipe", std::string("/dev/zero")}) {
    const auto read = load_scenario(path);
    ASSERT_FALSE(read) << path;
    EXPECT_NE(read.error().message.find("expected a file"), std::string::npos) << read.error().message;
  }
}

TEST(HostileYaml, FlippedBytesAndTruncationsNeverCrash) {
  Scenario scenario;
  scenario.agents.resize(2);
  scenario.agents[0].name = "a";
  scenario.agents[1].name = "b";
  scenario.agents[1].behaviour = {BehaviourKind::patrol, 0.5, {{1, 2}, {3, 4}}, "", 2, true, true};
  const auto parse = [](const std::string& text, const std::string& name) {
    return parse_scenario(text, name);
  };
  test::expect_damaged_text_is_refused(parse, to_yaml(scenario), "s.yaml");
}

}  // namespace
}  // namespace parhelion
