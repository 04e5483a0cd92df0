#include "tools/cloud_layer.hpp"

#include <array>

#include "fusion/cloud/read_cloud.hpp"
#include "server/station/byte_writer.hpp"

namespace parhelion::tools {
namespace {

constexpr std::size_t kHeaderBytes = 16, kPointBytes = 16;
constexpr std::array<std::uint8_t, 3> kNone{};

}  // namespace

Result<std::string> cloud_layer(const std::filesystem::path& path, const Transform<Map, Cloud>& T_map_cloud,
                                std::size_t max_points) {
  const auto file = cloud::read_scan(path);
  if (!file) return file.error();
  const auto& cloud = file->cloud;
  const std::size_t every = (cloud.size() + max_points - 1) / max_points;
  const std::size_t count = (cloud.size() + every - 1) / every;
  station::ByteWriter bytes(kHeaderBytes + kPointBytes * count);
  bytes.put(std::uint8_t{3});
  bytes.put(std::uint8_t{1});  // a registered cloud
  bytes.put(static_cast<std::uint16_t>(cloud.colours.empty() ? 0 : 1));
  bytes.put(static_cast<std::uint32_t>(count));
  bytes.put(0.0);  // s of the session: from its start
  for (std::size_t i = 0; i < cloud.size(); i += every) {
    const Eigen::Vector3d p = T_map_cloud * cloud.points[i].cast<double>().eval();
    for (const double coordinate : {p.x(), p.y(), p.z()}) bytes.put(static_cast<float>(coordinate));
    for (const std::uint8_t part : cloud.colours.empty() ? kNone : cloud.colours[i]) bytes.put(part);
    bytes.put(std::uint8_t{0});
  }
  return bytes.take();
}

}  // namespace parhelion::tools
