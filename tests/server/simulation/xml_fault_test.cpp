// Faults of XML are named with the line where they are, in plain words.
#include "server/simulation/robots/xml_fault.hpp"

#include <gmock/gmock.h>

#include "server/simulation/robots/urdf.hpp"

namespace parhelion::simulation {
namespace {

using testing::HasSubstr;

TEST(XmlFault, IsNamedWithItsLine) {
  struct Case {
    std::string text;
    int line;
    const char* words;
  };
  const Case cases[] = {
      {"", 1, "the file is empty"},
      {" \n", 1, "the file is empty"},
      {std::string("<robot>\n\x01", 9), 2, "this is a binary file"},
      {"solid hull\n", 1, "no XML"},
      {"<robot>\n<link name='a'>\n</robot>\n", 3, "</robot>, but <link> of line 2 is to be closed first"},
      {"<robot>\n<link name='a'>\n</link>\n", 3, "the file ends, but <robot> of line 1 is not closed"},
      {"<robot>\n<link name='a'/>\n</robot>\n</robot>", 4, "</robot> closes nothing"},
      {"<robot>\n<link name='a>\n<box/></link></robot>", 2, "a quote in the tag <link> is not closed"},
      {"<robot>\n<link name='a'\n<box/></link></robot>", 2, "the tag <link> is not closed"},
      {"<robot>\n<!-- a\n</robot>", 2, "expected -->"},
      {"<robot>\n 1 < 2\n</robot>", 2, "&lt;"},
  };
  for (const Case& each : cases) {
    const auto fault = find_xml_fault(each.text);
    ASSERT_TRUE(fault) << each.text;
    EXPECT_EQ(fault->line, each.line) << each.text;
    EXPECT_THAT(fault->words, HasSubstr(each.words)) << each.text;
  }
}

TEST(XmlFault, GoodXmlHasNone) {
  EXPECT_FALSE(
      find_xml_fault("<?xml version='1.0'?>\n<!DOCTYPE robot>\n<!-- <link> -->\n<robot name='a > b'>\n"
                     "<link name=\"x\"/><a><![CDATA[ <b> ]]></a ></robot>\n"));
}

TEST(XmlFault, AUrdfIsRefusedWithoutNamesOfErrors) {
  const auto refusal = [](const std::string& text) { return read_urdf(text, "r.urdf", {}).error().message; };
  EXPECT_EQ(refusal(""), "r.urdf:1: not XML: the file is empty");
  EXPECT_THAT(refusal("<robot>\n<link name='a'>\n</robot>\n"), HasSubstr("r.urdf:3: not XML: </robot>"));
  EXPECT_THAT(refusal("<robot>\n<link name></link></robot>"), HasSubstr("not XML: in the element"));
}

}  // namespace
}  // namespace parhelion::simulation
