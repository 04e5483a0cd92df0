#include "server/station/http/http_message.hpp"

#include <gtest/gtest.h>

namespace parhelion::station {
namespace {

TEST(HttpQuery, HasDecodedValuesAndReportsMissingKeys) {
  const std::string query = "robot=big%20rover&codec=h264&empty=&flag";
  EXPECT_EQ(query_value(query, "robot"), "big rover");
  EXPECT_EQ(query_value(query, "codec"), "h264");
  EXPECT_EQ(query_value(query, "empty"), "");
  EXPECT_EQ(query_value(query, "flag"), "");
  EXPECT_EQ(query_value(query, "code"), std::nullopt);
  EXPECT_EQ(query_value("", "robot"), std::nullopt);
}

TEST(HttpQuery, RefusesIncompletePercentEncoding) {
  for (const char* bad : {"a=%", "a=%2", "a=%zz", "a=x%4"})
    EXPECT_EQ(query_value(bad, "a"), std::nullopt) << bad;
  EXPECT_EQ(query_value("a=%41", "a"), "A");
}

TEST(Cookie, IsFoundByItsWholeNameOnly) {
  EXPECT_EQ(cookie_value("a=1; parhelion-8443=abc; b=2", "parhelion-8443"), "abc");
  EXPECT_EQ(cookie_value("xparhelion-8443=abc", "parhelion-8443"), "");
  EXPECT_EQ(cookie_value("parhelion-8443x=abc", "parhelion-8443"), "");
  EXPECT_EQ(cookie_value("parhelion-8443", "parhelion-8443"), "");
  EXPECT_EQ(cookie_value("k=first;k=second", "k"), "first");
  EXPECT_EQ(cookie_value(";;=;", "k"), "");
}

TEST(JsonText, EscapesUntrustedText) {
  EXPECT_EQ(json_text("a\"b\\\n"), R"("a\"b\\\n")");
  EXPECT_EQ(json_text("\xff"), "\"\xef\xbf\xbd\"");
  EXPECT_EQ(refusal(404, "no \"x\"").body, R"({"error":"no \"x\""})");
}

TEST(HttpAccess, DependsOnTheRole) {
  const Identity trainee{"anna", Role::trainee}, admin{"root", Role::admin};
  const Access instructors = Access::only({Role::instructor, Role::admin});
  EXPECT_FALSE(instructors.allows(&trainee, true));
  EXPECT_TRUE(instructors.allows(&admin, false));
  EXPECT_FALSE(instructors.allows(nullptr, true));
  EXPECT_TRUE(Access::logged_in().allows(&trainee, false));
  EXPECT_FALSE(Access::logged_in().allows(nullptr, true));
  EXPECT_TRUE(Access::logged_in().or_local().allows(nullptr, true));
  EXPECT_FALSE(Access::logged_in().or_local().allows(nullptr, false));
  EXPECT_TRUE(Access::everyone().allows(nullptr, false));
  for (const Role role : {Role::observer, Role::trainee, Role::instructor, Role::admin}) {
    EXPECT_EQ(role_of(role_name(role)), role);
  }
  EXPECT_EQ(role_of("root"), std::nullopt);
}

}  // namespace
}  // namespace parhelion::station
