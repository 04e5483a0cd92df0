#include "protocols/mesh_file.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <fstream>
#include <numbers>
#include <random>

#include "tests/shape_mesh.hpp"
#include "tests/temporary_folder.hpp"

namespace parhelion {
namespace {

using testing::HasSubstr;

/// Reads a text as the file of that name.
Result<std::vector<MeshPart>> read(const std::string& name, const std::string& text,
                                   const std::string& other_name = "", const std::string& other = "") {
  const test::TemporaryFolder folder;
  std::ofstream(folder / name, std::ios::binary) << text;
  if (!other_name.empty()) std::ofstream(folder / other_name) << other;
  return read_mesh_file(folder / name);
}

Eigen::AlignedBox3f box_of(const MeshPart& part) {
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& vertex : part.vertices) box.extend(vertex);
  return box;
}

std::string sphere_obj(int rings) {
  std::string text;
  for (int i = 0; i <= rings; ++i) {
    for (int k = 0; k < rings; ++k) {
      const double a = std::numbers::pi * i / rings, b = 2 * std::numbers::pi * k / rings;
      text += "v " + std::to_string(std::sin(a) * std::cos(b)) + " " +
              std::to_string(std::sin(a) * std::sin(b)) + " " + std::to_string(std::cos(a)) + "\n";
    }
  }
  const auto index = [rings](int i, int k) { return std::to_string(1 + i * rings + k % rings); };
  for (int i = 0; i < rings; ++i) {
    for (int k = 0; k < rings; ++k)
      text += "f " + index(i, k) + " " + index(i + 1, k) + " " + index(i + 1, k + 1) + " " + index(i, k + 1) +
              "\n";
  }
  return text;
}

TEST(MeshFile, ReadsAnStlAsItIs) {
  const auto parts = read("box.stl", test::box_stl());
  ASSERT_TRUE(parts.ok()) << parts.error().message;
  ASSERT_EQ(parts->size(), 1U);
  EXPECT_EQ((*parts)[0].triangles.size(), 12U);
  EXPECT_EQ((*parts)[0].vertices.size(), 8U);
  EXPECT_FALSE((*parts)[0].albedo);
  EXPECT_TRUE(box_of((*parts)[0]).max().isApprox(Eigen::Vector3f(1, 0.5, 0.25)));
}

TEST(MeshFile, KeepsTheColoursOfAnObjApart) {
  const auto parts =
      read("two.obj",
           "mtllib two.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nusemtl red\nf 1 2 3\nusemtl blue\nf 1 3 4\n",
           "two.mtl", "newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0 0 0.5\n");
  ASSERT_TRUE(parts.ok()) << parts.error().message;
  ASSERT_EQ(parts->size(), 2U);
  EXPECT_EQ((*parts)[0].albedo, Eigen::Vector3f(1, 0, 0));
  ASSERT_TRUE((*parts)[1].albedo);
  EXPECT_NEAR((*parts)[1].albedo->z(), 0.214, 0.001);  // linear
}

TEST(MeshFile, AppliesAColladasUnitAndNotItsAxis) {
  const auto parts = read("centimetres.dae", R"(<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="centimeter" meter="0.01"/><up_axis>Z_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="a" count="9">0 0 0 100 0 0 0 0 200</float_array>
<technique_common><accessor source="#a" count="3" stride="3"><param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node id="n"><instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>)");
  ASSERT_TRUE(parts.ok()) << parts.error().message;
  ASSERT_EQ(parts->size(), 1U);
  EXPECT_TRUE(box_of((*parts)[0]).max().isApprox(Eigen::Vector3f(1, 0, 2), 1e-5F))
      << box_of((*parts)[0]).max().transpose();
}

TEST(MeshFile, SimplifiesAFineMeshWithoutChangingItsSize) {
  const auto parts = read("sphere.obj", sphere_obj(200));
  ASSERT_TRUE(parts.ok()) << parts.error().message;
  ASSERT_EQ(parts->size(), 1U);
  EXPECT_LE((*parts)[0].triangles.size(), kMaxMeshTriangles);
  EXPECT_GT((*parts)[0].triangles.size(), kMaxMeshTriangles / 4);
  for (const Eigen::Vector3f& vertex : (*parts)[0].vertices) EXPECT_NEAR(vertex.norm(), 1, 0.02);
}

TEST(MeshFile, AFileThatCannotBeReadIsReportedWithItsPath) {
  const auto message = [](const Result<std::vector<MeshPart>>& result) {
    return result.ok() ? std::string("was read") : result.error().message;
  };
  EXPECT_THAT(message(read_mesh_file("/no/such/part.stl")), HasSubstr("/no/such/part.stl: no such file"));
  EXPECT_THAT(message(read_mesh_file("/")), HasSubstr("no such file"));
  EXPECT_THAT(message(read("part.dae", "not a mesh")), HasSubstr("part.dae: not a readable mesh"));
  EXPECT_THAT(message(read("part.blend1", "x")), HasSubstr("part.blend1: not a readable mesh"));
  EXPECT_THAT(message(read("empty.obj", "v 0 0 0\n")), HasSubstr("empty.obj: "));
  EXPECT_THAT(message(read("far.obj", "v 0 0 0\nv 1e30 0 0\nv 0 1 0\nf 1 2 3\n")), HasSubstr("far.obj: "));
}

TEST(MeshFile, ManyTrianglesInOnePointAreRefused) {
  std::string text = "v 1 1 1\nv 1 1 1.0000001\nv 1 1.0000001 1\n";
  for (int i = 0; i < 6000; ++i) text += "f 1 2 3\n";
  const auto parts = read("point.obj", text);
  if (parts) {
    EXPECT_LE((*parts)[0].triangles.size(), kMaxMeshTriangles);
  } else {
    EXPECT_THAT(parts.error().message, HasSubstr("point.obj: "));
  }
}

TEST(MeshFile, DamagedFilesNeitherCrashNorPassAsWhole) {
  std::mt19937 random(4);
  for (int i = 0; i < 20; ++i) {
    std::string text = test::box_stl();
    for (int k = 0; k < 30; ++k) text[random() % text.size()] = static_cast<char>(random());
    const auto parts = read("damaged.stl", text);
    if (parts) {
      for (const MeshPart& part : *parts) EXPECT_TRUE(make_shape_mesh(part.vertices, part.triangles).ok());
    }
  }
}

TEST(MeshBytes, AreReadBackTheSame) {
  const std::vector<MeshPart> parts{{{{0, 0, 0}, {1, 2, 3}, {4, 5, 6}}, {{0, 1, 2}, {2, 1, 0}}, std::nullopt},
                                    {{{-1, 0.5F, 0}}, {}, Eigen::Vector3f(0.25F, 0.5F, 1)}};
  const auto back = unpack_mesh(pack_mesh(parts));
  ASSERT_TRUE(back.ok()) << back.error().message;
  ASSERT_EQ(back->size(), 2U);
  EXPECT_EQ((*back)[0].vertices, parts[0].vertices);
  EXPECT_EQ((*back)[0].triangles, parts[0].triangles);
  EXPECT_EQ((*back)[0].albedo, std::nullopt);
  EXPECT_EQ((*back)[1].albedo, parts[1].albedo);
}

TEST(MeshBytes, DamagedBytesAreRefused) {
  const std::vector<std::uint8_t> good =
      pack_mesh({{{{0, 0, 0}, {1, 2, 3}, {4, 5, 6}}, {{0, 1, 2}}, Eigen::Vector3f(0.5F, 0.5F, 0.5F)}});
  for (std::size_t size = 0; size < good.size(); ++size)
    EXPECT_FALSE(unpack_mesh(std::span(good).first(size)).ok()) << size;
  std::vector<std::uint8_t> longer = good;
  longer.push_back(0);
  EXPECT_FALSE(unpack_mesh(longer).ok());
  for (const std::size_t count_at : {std::size_t{4}, std::size_t{24}, std::size_t{28}}) {
    std::vector<std::uint8_t> huge = good;
    for (std::size_t i = 0; i < 4; ++i) huge[count_at + i] = 0xFF;
    EXPECT_FALSE(unpack_mesh(huge).ok()) << count_at;
  }
}

}  // namespace
}  // namespace parhelion
