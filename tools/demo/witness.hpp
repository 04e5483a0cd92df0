// Observes the replay of a log and keeps the content of the demo's two pictures.
#pragma once

#include <Eigen/Core>
#include <deque>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "protocols/bus/bus.hpp"
#include "protocols/image.hpp"
#include "protocols/scan.hpp"
#include "protocols/world.hpp"
#include "render/jpeg.hpp"
#include "server/tick/state.hpp"

namespace parhelion::tools {

/// One augmented scan in the map, and the world at its time.
struct WitnessedScan {
  std::vector<Eigen::Vector2d> real_returns, virtual_returns;  ///< m, map
  Transform<Map, Laser> T_map_laser;
  Transform<Map, Base> T_map_base;
  WorldSnapshot world;
  std::size_t replaced = 0;
  double nearest = std::numeric_limits<double>::infinity();  ///< m, of the virtual returns
};

class Witness {
 public:
  /// Call after each input.
  void see(const tick::Configuration& configuration, const Message& input, const tick::RobotState& robot);
  /// Call for each MR_CAMERA: keeps the one that differs most from its CAMERA.
  void see_answer(const Image& answer);

  const std::vector<Eigen::Vector2d>& driven() const { return driven_; }
  const std::optional<WitnessedScan>& best_scan() const { return best_scan_; }
  const std::optional<Image>& best_image() const { return best_image_; }
  /// Path of each agent, by name.
  const std::map<std::string, std::vector<Eigen::Vector2d>>& agent_paths() const { return agent_paths_; }

 private:
  void remember(const Message& camera);

  std::vector<Eigen::Vector2d> driven_;
  std::map<std::string, std::vector<Eigen::Vector2d>> agent_paths_;
  std::optional<WitnessedScan> best_scan_;
  std::optional<Image> best_image_;
  std::size_t best_pixels_ = 0;
  std::deque<Image> cameras_;
  render::JpegCodec codec_;
  std::vector<std::uint8_t> before_, after_;  // BGR
};

}  // namespace parhelion::tools
