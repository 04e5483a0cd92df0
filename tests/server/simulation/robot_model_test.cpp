// Invalid robot models: each is refused with name and line.
#include "server/simulation/robots/robot_model.hpp"

#include <gmock/gmock.h>

#include "robots_world.hpp"

namespace parhelion::simulation {
namespace {

using namespace test;
using testing::HasSubstr;

std::string wheel(const std::string& name, double y, const std::string& mass = "1") {
  return "<link name='" + name + "'><inertial><mass value='" + mass +
         "'/><inertia ixx='0.01' ixy='0' ixz='0' iyy='0.01' iyz='0' izz='0.01'/></inertial>\n"
         "<collision><origin rpy='1.5708 0 0'/><geometry><cylinder radius='0.1' length='0.05'/></geometry>"
         "</collision></link>\n<joint name='" +
         name + "_joint' type='continuous'><origin xyz='0 " + std::to_string(y) +
         " 0.1'/><axis xyz='0 1 0'/><parent link='base'/><child link='" + name + "'/></joint>\n";
}

std::string urdf(const std::string& geometry, const std::string& mass, const std::string& more) {
  return "<robot name='cart'>\n<link name='base'><inertial><origin xyz='0 0 0.1'/><mass value='" + mass +
         "'/><inertia ixx='0.1' ixy='0' ixz='0' iyy='0.1' iyz='0' izz='0.1'/></inertial>\n<collision>"
         "<origin xyz='0 0 0.2'/><geometry>" +
         geometry + "</geometry></collision></link>\n" + wheel("left", 0.2) + wheel("right", -0.2) + more +
         "</robot>\n";
}

constexpr const char* kBoxGeometry = "<box size='0.4 0.3 0.1'/>";
constexpr const char* kYaml =
    "urdf: cart.urdf\n"
    "drive: {kind: differential, left: [left], right: [right]}\n"
    "robot:\n"
    "  name: cart\n"
    "  footprint: [[-0.2 m, -0.2 m], [0.2 m, -0.2 m], [0.2 m, 0.2 m], [-0.2 m, 0.2 m]]\n";

std::string refusal(const std::string& urdf_text, const std::string& yaml = kYaml) {
  const auto model = parse_robot_model(urdf_text, yaml, "robots/cart.yaml");
  EXPECT_FALSE(model.ok()) << "was taken";
  return model ? "" : model.error().message;
}

TEST(RobotModel, AcceptsTheUnmodifiedModel) {
  const auto model = parse_robot_model(urdf(kBoxGeometry, "5", ""), kYaml, "robots/cart.yaml");
  ASSERT_TRUE(model.ok()) << model.error().message;
  EXPECT_EQ(model->links.size(), 3U);
  EXPECT_NEAR(model->description.mass, 7, 1e-12);
}

TEST(RobotModel, AMaterialThatTheUrdfDoesNotDefineIsRefusedWithItsLine) {
  std::string text = urdf(kBoxGeometry, "5", "");
  text.insert(text.find("<link"), "<material name='paint'><color rgba='1 0 0 1'/></material>");
  const std::string yaml = kYaml;
  EXPECT_TRUE(parse_robot_model(text, yaml + "materials: {paint: {roughness: 0.5}}\n", "robots/cart.yaml"));
  EXPECT_THAT(refusal(text, yaml + "materials:\n  paintt: {roughness: 0.5}\n"),
              HasSubstr("cart.yaml:7: the URDF has no material 'paintt', did you mean 'paint'?"));
}

TEST(RobotModel, AMissingMeshIsAWarningWithItsLine) {
  const auto model = parse_robot_model(urdf("<mesh filename='package://cart/body.stl'/>", "5", ""), kYaml,
                                       "robots/cart.yaml");
  ASSERT_TRUE(model.ok()) << model.error().message;
  EXPECT_THAT(model->warnings,
              testing::ElementsAre(HasSubstr("cart.urdf:2: link 'base': its collision is left out")));
}

TEST(RobotModel, ANonPositiveMassIsRefused) {
  for (const char* mass : {"0", "-3"}) {
    const std::string text = refusal(urdf(kBoxGeometry, mass, ""));
    EXPECT_THAT(text, HasSubstr("'base'"));
    EXPECT_THAT(text, HasSubstr("mass"));
    EXPECT_THAT(text, HasSubstr("cart.urdf:2"));
  }
}

TEST(RobotModel, AJointLoopIsRefused) {
  const std::string loop =
      "<joint name='back' type='fixed'><parent link='left'/><child link='base'/></joint>\n";
  EXPECT_THAT(refusal(urdf(kBoxGeometry, "5", loop)), HasSubstr("loop"));
  const std::string twice =
      "<joint name='second' type='fixed'><parent link='left'/><child link='right'/></joint>\n";
  EXPECT_THAT(refusal(urdf(kBoxGeometry, "5", twice)), HasSubstr("'right'"));
}

TEST(RobotModel, AJointThatMimicsNoneThatExistsIsRefused) {
  std::string text = urdf(kBoxGeometry, "5", "");
  text.insert(text.rfind("</joint>"), "<mimic joint='rudder' multiplier='2'/>");
  const std::string error_text = refusal(text);
  EXPECT_THAT(error_text, HasSubstr("'right_joint': mimics 'rudder'"));
  EXPECT_THAT(error_text, HasSubstr("expected another joint that moves"));
}

TEST(RobotModel, AMisspelledLinkGetsASuggestion) {
  std::string yaml = kYaml;
  yaml.replace(yaml.find("[right]"), 7, "[rigth]");
  const std::string text = refusal(urdf(kBoxGeometry, "5", ""), yaml);
  EXPECT_THAT(text, HasSubstr("robots/cart.yaml:2"));
  EXPECT_THAT(text, HasSubstr("'rigth'"));
  EXPECT_THAT(text, HasSubstr("'right'"));
}

TEST(RobotModel, InvalidUrdfIsRefused) {
  for (const char* text : {"", "<robot", "<robot name='x'/>", "<html></html>"}) refusal(text);
}

TEST(RobotModel, TextInAPlaceOfNumbersIsRefusedWithItsLine) {
  for (const char* size :
       {"%s%s%s%n 1 1", "1 1", "1 1 1 1", "1 1 x", "1 1 nan", "1 1 inf", "1 1 1e999", ""}) {
    const std::string text = refusal(urdf(std::string("<box size='") + size + "'/>", "5", ""));
    EXPECT_THAT(text, HasSubstr("cart.urdf:3: link 'base': box: "));
    EXPECT_THAT(text, HasSubstr("size")) << size;
  }
  EXPECT_THAT(refusal(urdf(kBoxGeometry, "%n%n%s", "")), HasSubstr("value='%n%n%s'; expected 1 number"));
}

TEST(RobotModel, AVisualThatCannotBeDrawnIsRefusedWithItsLink) {
  const auto with_visual = [](const std::string& content) {
    std::string text = urdf(kBoxGeometry, "5", "");
    return text.insert(text.find("</link>"), "\n<visual>" + content + "</visual>");
  };
  EXPECT_THAT(refusal(with_visual("")),
              HasSubstr("cart.urdf:4: link 'base': visual: expected <geometry> in it"));
  EXPECT_THAT(refusal(with_visual("<geometry/>")),
              HasSubstr("expected <box>, <cylinder>, <sphere> or <mesh>"));
  const std::string box = std::string("<geometry>") + kBoxGeometry + "</geometry>";
  EXPECT_THAT(refusal(with_visual(box + "<material name='red'/>")),
              HasSubstr("material 'red': is defined nowhere"));
  EXPECT_THAT(refusal(with_visual(box + "<material name='red'><color rgba='2 0 0 1'/></material>")),
              HasSubstr("from 0 to 1"));
}

TEST(RobotModel, AUrdfThatIsTooDeepOrTooLargeIsRefused) {
  std::string deep;
  for (int i = 0; i < 100'000; ++i) deep += "<a>";
  EXPECT_THAT(refusal("<robot name='x'>" + deep), HasSubstr("not XML"));
  EXPECT_THAT(refusal(std::string(std::size_t{17} << 20, ' ')), HasSubstr("at most 16 MiB"));
  std::string links;
  for (int i = 0; i < 2000; ++i) links += "<link name='l" + std::to_string(i) + "'/>";
  EXPECT_THAT(refusal(urdf(kBoxGeometry, "5", links)), HasSubstr("at most 1000"));
}

TEST(RobotModel, SpawningARobotInAWallReportsTheNearestFreePlace) {
  Simulation simulation = make(room(6), with_robots({"rover"}));
  const Status status = simulation.spawn(articulated("r", "rover", 2.95, 0), std::nullopt);
  ASSERT_FALSE(status.ok());
  EXPECT_THAT(status.error().message, HasSubstr("in 'wall 1' of the building"));
  EXPECT_THAT(status.error().message, HasSubstr("the nearest free place is ("));
  double x = 0, y = 0;
  const std::string& text = status.error().message;
  ASSERT_EQ(std::sscanf(text.c_str() + text.rfind('('), "(%lf, %lf)", &x, &y), 2);
  spawn(simulation, articulated("r", "rover", x, y));
  run(simulation, 1);
  EXPECT_NEAR(motion(simulation, "r").T_map_base.translation().x(), x, 0.01);
  EXPECT_NEAR(motion(simulation, "r").T_map_base.translation().z(), 0, 0.01);
}

}  // namespace
}  // namespace parhelion::simulation
