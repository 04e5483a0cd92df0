// Damaged robot descriptions, URDFs and meshes; see mutated_files.hpp.
#include "protocols/mesh_file.hpp"
#include "tests/server/tick/graded_log.hpp"
#include "tests/shape_mesh.hpp"
#include "tests/tools/imported_log.hpp"
#include "tests/tools/mutated_files.hpp"
#include "tools/robot/check_description.hpp"
#include "tools/robot/new_description.hpp"

namespace parhelion::tools {
namespace {

using test::MutationSample;
using test::status_of;
using test::TemporaryFolder;

MutationSample robot_sample(const TemporaryFolder& folder) {
  test::write_text(folder / "robot.yaml", to_yaml(test::robot()));
  return validated({folder / "robot.yaml"});
}

// ---- Meshes
// ------------------------------------------------------------------------------------------------

MutationSample mesh_sample(const TemporaryFolder& folder, const std::string& name, const std::string& bytes) {
  const std::string path = folder / name;
  test::replace_file(path, bytes);
  return {{path}, [path] { return status_of(read_mesh_file(path)); }};
}

/// A value as it lies in a little-endian file.
template <class T>
void append(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// Two triangles.
std::string binary_stl() {
  std::string bytes(80, ' ');
  append(bytes, std::uint32_t{2});
  for (const float z : {0.0F, 1.0F}) {
    for (const float value : {0.0F, 0.0F, 1.0F, 0.0F, 0.0F, z, 1.0F, 0.0F, z, 0.0F, 1.0F, z})
      append(bytes, value);
    append(bytes, std::uint16_t{0});
  }
  return bytes;
}

/// Two materials: the OBJ or its library is damaged.
MutationSample obj_sample(const TemporaryFolder& folder) {
  MutationSample sample =
      mesh_sample(folder, "part.obj",
                  "mtllib part.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nusemtl red\nf 1 2 3\n"
                  "usemtl blue\nf 1/1/1 3 4\nf -1 -2 -3\n");
  test::write_text(folder / "part.mtl", "newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0 0 0.5\n");
  sample.files.emplace_back(folder / "part.mtl");
  return sample;
}

constexpr const char* kCollada = R"(<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="centimeter" meter="0.01"/><up_axis>Z_UP</up_axis></asset>
<library_effects><effect id="e"><profile_COMMON><technique sid="t"><lambert><diffuse><color>1 0 0 1</color></diffuse></lambert></technique></profile_COMMON></effect></library_effects>
<library_materials><material id="m"><instance_effect url="#e"/></material></library_materials>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="a" count="9">0 0 0 100 0 0 0 0 200</float_array>
<technique_common><accessor source="#a" count="3" stride="3"><param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="1" material="m"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node id="n"><matrix>1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1</matrix><instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>)";

/// Three corners, then three indices.
std::string gltf_buffer() {
  std::string bytes;
  for (const float value : {0.0F, 0.0F, 0.0F, 1.0F, 0.0F, 0.0F, 0.0F, 1.0F, 0.5F}) append(bytes, value);
  for (const std::uint16_t index : {0, 1, 2, 0}) append(bytes, index);
  return bytes;
}

std::string gltf_json(const std::string& uri) {
  return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0,"translation":[0,0,1]}],)"
         R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0}]}],)"
         R"("materials":[{"pbrMetallicRoughness":{"baseColorFactor":[1,0,0,1]}}],)"
         R"("accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0.5]},)"
         R"({"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}],)"
         R"("bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":6}],)"
         R"("buffers":[{)" +
         uri + R"("byteLength":44}]})";
}

MutationSample gltf_sample(const TemporaryFolder& folder) {
  MutationSample sample = mesh_sample(folder, "part.gltf", gltf_json(R"("uri":"part.bin",)"));
  test::replace_file(folder / "part.bin", gltf_buffer());
  sample.files.emplace_back(folder / "part.bin");
  return sample;
}

std::string glb() {
  std::string json = gltf_json("");
  json.resize((json.size() + 3) / 4 * 4, ' ');
  const std::string buffer = gltf_buffer();
  std::string bytes = "glTF";
  append(bytes, std::uint32_t{2});
  append(bytes, static_cast<std::uint32_t>(12 + 8 + json.size() + 8 + buffer.size()));
  append(bytes, static_cast<std::uint32_t>(json.size()));
  bytes += "JSON" + json;
  append(bytes, static_cast<std::uint32_t>(buffer.size()));
  return bytes + std::string("BIN\0", 4) + buffer;
}

/// What a session log embeds.
MutationSample packed_mesh_sample(const TemporaryFolder& folder) {
  const std::string path = folder / "mesh";
  const auto packed =
      pack_mesh({{{{0, 0, 0}, {1, 2, 3}, {4, 5, 6}}, {{0, 1, 2}}, Eigen::Vector3f(0.5F, 0.5F, 0.5F)},
                 {{{-1, 0.5F, 0}, {0, 0, 1}, {0, 1, 0}}, {{2, 1, 0}}, std::nullopt}});
  test::replace_file(path, {packed.begin(), packed.end()});
  return {{path}, [path] {
            const std::string bytes = test::bytes_of(path);
            return status_of(unpack_mesh(std::vector<std::uint8_t>(bytes.begin(), bytes.end())));
          }};
}

// ---- parhelion robot
// ---------------------------------------------------------------------------------------

std::string log_of_drive(const TemporaryFolder& folder) {
  const std::string path = folder / "drive.lcm";
  test::write_log(path, test::drive(1));
  return path;
}

/// A URDF with a mesh and a laser.
MutationSample new_robot_sample(const TemporaryFolder& folder, bool damaged_log) {
  const std::string urdf = folder / "rover.urdf", log = log_of_drive(folder);
  test::write_text(
      urdf,
      R"(<robot name="rover"><link name="chassis"><inertial><mass value="20"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
<collision><geometry><box size="0.6 0.4 0.2"/></geometry></collision><visual><geometry><mesh filename="part.stl" scale="1 1 1"/></geometry></visual></link>
<joint name="a" type="fixed"><origin xyz="0.2 0 0.15" rpy="0 0 1.57"/><parent link="chassis"/><child link="front_laser"/></joint><link name="front_laser"/></robot>)");
  test::replace_file(folder / "part.stl", test::box_stl());
  std::vector<std::filesystem::path> damaged{urdf, std::filesystem::path(folder / "part.stl")};
  if (damaged_log) damaged = {log};
  return {damaged, [=]() -> Status {
            const auto outline = read_urdf_outline(urdf);
            if (!outline) return outline.error();
            const auto survey = survey_log(log);
            if (!survey) return survey.error();
            const Dialogue nobody{[](const std::string&, const std::string&) { return std::nullopt; }, {}};
            return status_of(new_description(*outline, *survey, nobody));
          }};
}

MutationSample check_robot_sample(const TemporaryFolder& folder) {
  const std::string description = folder / "robot.yaml", log = log_of_drive(folder);
  test::write_text(description, to_yaml(test::robot()));
  return {{description, log}, [=]() -> Status {
            const auto robot = load_robot_description(description);
            if (!robot) return robot.error();
            const auto survey = survey_log(log);
            if (!survey) return survey.error();
            (void)check_description(*robot, *survey);
            return {};
          }};
}

// ---- All of them
// -------------------------------------------------------------------------------------------

using F = const TemporaryFolder&;
const MutatedReader kRobotReaders[] = {
    {"robot description", robot_sample},
    {"robot model and URDF",
     [](F f) {
       return copied(f, {"server/robots/rover.yaml", "server/robots/rover.urdf"});
     }},
    {"mesh, STL", [](F f) { return mesh_sample(f, "part.stl", test::box_stl()); }},
    {"mesh, binary STL", [](F f) { return mesh_sample(f, "part.stl", binary_stl()); }},
    {"mesh, OBJ and MTL", obj_sample},
    {"mesh, COLLADA", [](F f) { return mesh_sample(f, "part.dae", kCollada); }},
    {"mesh, glTF", gltf_sample},
    {"mesh, GLB", [](F f) { return mesh_sample(f, "part.glb", glb()); }},
    {"mesh in a session log", packed_mesh_sample},
    {"robot new, URDF and mesh", [](F f) { return new_robot_sample(f, false); }},
    {"robot new, log", [](F f) { return new_robot_sample(f, true); }},
    {"robot check, description and log", check_robot_sample},
};

INSTANTIATE_TEST_SUITE_P(Robots, MutatedFiles, testing::ValuesIn(kRobotReaders), reader_name);

}  // namespace
}  // namespace parhelion::tools
