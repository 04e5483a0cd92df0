// Meshes in a URDF: found, embedded, and used for drawing and collision.
#include "server/simulation/robots/urdf_meshes.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "server/simulation/robots/robot_model.hpp"
#include "server/simulation/robots/urdf.hpp"
#include "tests/file_bytes.hpp"
#include "tests/shape_mesh.hpp"
#include "tests/temporary_folder.hpp"

namespace parhelion::simulation {
namespace {

using test::TemporaryFolder;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

constexpr const char* kInertial =
    "<inertial><mass value='2'/><inertia ixx='0.1' ixy='0' ixz='0' iyy='0.1' iyz='0' izz='0.1'/></inertial>";

std::string robot(const std::string& elements) {
  return std::string("<robot name='cart'>\n<link name='base'>") + kInertial + "\n" + elements +
         "</link></robot>\n";
}
std::string visual(const std::string& mesh) {
  return "<visual><origin xyz='0 0 1'/><geometry>" + mesh + "</geometry></visual>\n";
}

/// A folder with cart/meshes/box.stl, and the URDF at cart/urdf/cart.urdf.
struct Package {
  TemporaryFolder folder;
  std::string urdf = folder / "cart/urdf/cart.urdf";

  Package() {
    std::filesystem::create_directories(folder / "cart/urdf");
    std::filesystem::create_directories(folder / "cart/meshes");
    std::ofstream(folder / "cart/meshes/box.stl") << test::box_stl();
  }
  Result<UrdfRobot> read(const std::string& text) const {
    return read_urdf(embed_meshes(text, urdf).urdf, urdf, {});
  }
};

TEST(UrdfMeshes, AreFoundByPackageRelativePathAndFileUri) {
  const Package package;
  for (const std::string& name :
       {std::string("package://cart/meshes/box.stl"), std::string("../meshes/box.stl"),
        "file://" + package.folder / "cart/meshes/box.stl", package.folder / "cart/meshes/box.stl"}) {
    const auto embedded = embed_meshes(robot(visual("<mesh filename='" + name + "'/>")), package.urdf);
    EXPECT_THAT(embedded.warnings, IsEmpty()) << name;
    const auto urdf = read_urdf(embedded.urdf, package.urdf, {});
    ASSERT_TRUE(urdf.ok()) << urdf.error().message;
    ASSERT_THAT(urdf->links[0].visible, SizeIs(1)) << name;
    EXPECT_EQ(urdf->links[0].visible[0].kind, ShapeKind::mesh);
  }
}

TEST(UrdfMeshes, AreAtTheirOriginInTheirScale) {
  const Package package;
  const auto urdf =
      package.read(robot(visual("<mesh filename='package://cart/meshes/box.stl' scale='2 2 -2'/>")));
  ASSERT_TRUE(urdf.ok()) << urdf.error().message;
  const Shape& shape = urdf->links[0].visible[0];
  EXPECT_TRUE(shape.size.isApprox(Eigen::Vector3d(2, 1, 0.5), 1e-6));
  EXPECT_TRUE(shape.T_body_shape.translation().isApprox(Eigen::Vector3d(1, 0.5, 1 - 0.25), 1e-6));
}

TEST(UrdfMeshes, AMissingFileIsAWarningWithThePathsTriedAndItsPartIsLeftOut) {
  const Package package;
  const auto embedded = embed_meshes(
      robot(visual("<mesh filename='package://cart/meshes/arm.dae'/>") + visual("<box size='1 1 1'/>")),
      package.urdf);
  ASSERT_THAT(embedded.warnings, SizeIs(1));
  EXPECT_THAT(embedded.warnings[0], HasSubstr("cart.urdf:3: "));
  EXPECT_THAT(embedded.warnings[0], HasSubstr("cart/urdf/cart/meshes/arm.dae"));
  EXPECT_THAT(embedded.warnings[0], HasSubstr("left out"));
  const auto urdf = read_urdf(embedded.urdf, package.urdf, {});
  ASSERT_TRUE(urdf.ok()) << urdf.error().message;
  EXPECT_THAT(urdf->links[0].visible, SizeIs(1));
  EXPECT_THAT(urdf->warnings, ElementsAre(HasSubstr("cart.urdf:2: link 'base': its visual is left out")));
}

TEST(UrdfMeshes, ADamagedFileIsAWarning) {
  const Package package;
  std::ofstream(package.folder / "cart/meshes/box.stl") << "<html>not found</html>";
  const auto embedded = embed_meshes(robot(visual("<mesh filename='../meshes/box.stl'/>")), package.urdf);
  EXPECT_THAT(embedded.warnings, ElementsAre(HasSubstr("box.stl: ")));
}

TEST(UrdfMeshes, WithoutACollisionElementTheConvexHullCollidesAndThisIsReported) {
  const Package package;
  const std::string mesh = visual("<mesh filename='package://cart/meshes/box.stl'/>");
  const auto bare = package.read(robot(mesh));
  ASSERT_TRUE(bare.ok());
  EXPECT_THAT(bare->links[0].solid, SizeIs(1));
  EXPECT_THAT(bare->warnings, ElementsAre(HasSubstr("convex hull")));
  const auto given =
      package.read(robot(mesh + "<collision><geometry><sphere radius='0.1'/></geometry></collision>"));
  ASSERT_TRUE(given.ok());
  ASSERT_THAT(given->links[0].solid, SizeIs(1));
  EXPECT_EQ(given->links[0].solid[0].kind, ShapeKind::sphere);
  EXPECT_THAT(given->warnings, IsEmpty());
}

TEST(UrdfMeshes, CommentsAndOtherTextAreKeptAsTheyAre) {
  const Package package;
  const std::string text = robot("<!-- <mesh filename='package://cart/meshes/box.stl'/> -->\n" +
                                 visual("<box size='1 2 3'/>") + "<meshing filename='x'/>");
  const auto embedded = embed_meshes(text, package.urdf);
  EXPECT_EQ(embedded.urdf, text);
  EXPECT_THAT(embedded.warnings, IsEmpty());
}

TEST(UrdfMeshes, DamagedEmbeddedTrianglesAreRefusedWithTheirLine) {
  for (const char* data : {"", "AAAA", "!!!!", "UEhNMQEAAAA="}) {
    const auto urdf =
        read_urdf(robot(visual(std::string("<mesh filename='data:application/x-parhelion-mesh;base64,") +
                               data + "'/>")),
                  "cart.urdf", {});
    ASSERT_FALSE(urdf.ok()) << data;
    EXPECT_THAT(urdf.error().message, HasSubstr("cart.urdf:3: link 'base': "));
  }
}

TEST(Urdf, XacroIsRefusedWithTheCommandThatExpandsIt) {
  const auto urdf = read_urdf("<robot name='a'>\n<xacro:macro name='wheel'/></robot>", "a.urdf", {});
  ASSERT_FALSE(urdf.ok());
  EXPECT_THAT(urdf.error().message, HasSubstr("a.urdf:2: <xacro:macro>"));
  EXPECT_THAT(urdf.error().message, HasSubstr("xacro FILE.xacro > FILE.urdf"));
}

/// A model of the TurtleBot 4 whose URDF is in the recordings.
TEST(UrdfMeshes, ATurtleBot4IsReadWithItsMeshesAndWithoutTheMissingOnes) {
  const std::string path =
      std::string(PARHELION_SOURCE_DIR) + "/../shared/data/urdf-turtlebot4/turtlebot4_from_bag.urdf";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no " << path;
  const auto embedded = embed_meshes(test::bytes_of(path), path);
  for (const std::string& warning : embedded.warnings) EXPECT_THAT(warning, HasSubstr("oakd_lite"));
  const auto urdf = read_urdf(embedded.urdf, path, {});
  ASSERT_TRUE(urdf.ok()) << urdf.error().message;
  std::size_t meshes = 0;
  for (const RobotLink& link : urdf->links)
    meshes += static_cast<std::size_t>(std::ranges::count(link.visible, ShapeKind::mesh, &Shape::kind));
  EXPECT_GE(meshes, 4U);
}

}  // namespace
}  // namespace parhelion::simulation
