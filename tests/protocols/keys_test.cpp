// Files of keys: read back as written, and refused with a reason that shows no secret.
#include "protocols/authentication/keys.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <set>

#include "tests/temporary_folder.hpp"

namespace parhelion {
namespace {

Keys some_keys() {
  return {"server",
          new_secret(),
          milliseconds(300),
          {{"rover", new_secret(), {"robot", "localization"}, {}},
           {"ann", new_secret(), {}, {"TELEOP", "A_.*"}}}};
}

class KeysTest : public ::testing::Test {
 protected:
  std::string write(const std::string& text, mode_t mode = 0600) {
    const std::string path = folder_ / "test.keys";
    std::ofstream(path) << text;
    chmod(path.c_str(), mode);
    return path;
  }
  test::TemporaryFolder folder_;
};

TEST_F(KeysTest, AreReadBackAsWritten) {
  const Keys keys = some_keys();
  const auto read = load_keys(write(to_yaml(keys)));
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->name, keys.name);
  EXPECT_EQ(read->secret, keys.secret);
  EXPECT_EQ(read->clock, keys.clock);
  ASSERT_EQ(read->senders.size(), keys.senders.size());
  for (std::size_t i = 0; i < keys.senders.size(); ++i) {
    EXPECT_EQ(read->senders[i].name, keys.senders[i].name);
    EXPECT_EQ(read->senders[i].secret, keys.senders[i].secret);
    EXPECT_EQ(read->senders[i].roles, keys.senders[i].roles);
    EXPECT_EQ(read->senders[i].channels, keys.senders[i].channels);
  }
}

TEST_F(KeysTest, OfOthersAreRefused) {
  const auto open_to_all = load_keys(write(to_yaml(some_keys()), 0640));
  ASSERT_FALSE(open_to_all);
  EXPECT_NE(open_to_all.error().message.find("chmod 600"), std::string::npos) << open_to_all.error().message;
}

TEST_F(KeysTest, BehindALinkInAFolderOrAbsentAreRefused) {
  const std::string path = write(to_yaml(some_keys())), link = folder_ / "link.keys", pipe = folder_ / "pipe";
  ASSERT_EQ(symlink(path.c_str(), link.c_str()), 0);
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  for (const std::string& bad : {link, pipe, folder_ / "absent", folder_ / "."})
    EXPECT_FALSE(load_keys(bad)) << bad;
}

TEST_F(KeysTest, ErrorsShowNoSecret) {
  const std::string good = to_yaml(some_keys());
  const std::string secret = good.substr(good.find("secret: ") + 9, 44);
  const auto replaced = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    return text.replace(text.find(from), from.size(), to);
  };
  for (const std::string& bad :
       {replaced(secret, secret.substr(0, 43)), replaced(secret, secret.substr(0, 40)),
        replaced("rover", "server"), replaced("ann", "rover"), replaced("rover", "a b"),
        replaced("robot", "rabbit"), replaced("A_.*", "A_("), replaced("secret:", "secrte:"),
        std::string("{}"), std::string()}) {
    const auto read = parse_keys(bad, "test.keys");
    ASSERT_FALSE(read) << bad;
    EXPECT_EQ(read.error().message.find(secret.substr(0, 40)), std::string::npos) << read.error().message;
  }
}

TEST_F(KeysTest, ABadNameIsRefusedWithWhatIsExpected) {
  std::string text = to_yaml(some_keys());
  text.replace(text.find("rover"), 5, "a b");
  const auto read = parse_keys(text, "test.keys");
  ASSERT_FALSE(read);
  EXPECT_NE(
      read.error().message.find("'name': expected 1 to 63 letters, digits, '_', '.' and '-', found 'a b'"),
      std::string::npos)
      << read.error().message;
}

TEST_F(KeysTest, EachRoleHasChannelsAndNoSenderButTheServerMayCommandTheRobot) {
  for (const std::string& role : sender_roles()) {
    const auto channels = channels_of_role(role);
    ASSERT_TRUE(channels && !channels->empty()) << role;
    const std::set<std::string> set(channels->begin(), channels->end());
    EXPECT_EQ(set.contains("MR_CMD"), role == "server") << role;
    EXPECT_EQ(set.contains("MR_JOINT_CMD"), role == "server") << role;
    EXPECT_EQ(set.contains("TELEOP"), role == "trainee") << role;
  }
  EXPECT_FALSE(channels_of_role("guest"));
}

TEST_F(KeysTest, SecretsDiffer) { EXPECT_NE(new_secret(), new_secret()); }

}  // namespace
}  // namespace parhelion
