// Floors seen by a nodding laser: bent more the farther away, differently in each scan, and with parts of the
// robot that carried the laser. The model must have one floor without objects on it.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <set>

#include "fusion/semantic/build_model.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kLength = 9, kHalf = 1.2, kHeight = 2.5;  // m, of the corridor

struct Bow {
  double at_6_m;  ///< m, height error of the floor there
  double sigma;   ///< m, of a range
};
void PrintTo(const Bow& bow, std::ostream* out) { *out << bow.at_6_m << " m, noise " << bow.sigma << " m"; }

/// On the floor, away from walls and scanner positions.
Eigen::AlignedBox3d crate() { return {Eigen::Vector3d(5.6, 0.2, 0), Eigen::Vector3d(6.0, 0.7, 0.3)}; }

class NoddingScans {
 public:
  explicit NoddingScans(const Bow& bow) : bow_(bow) {
    for (const Eigen::Vector3d& eye : {Eigen::Vector3d(1, 0, 0.6), {2.7, 0.1, 0.6}, {4.4, -0.1, 0.6}})
      scan(eye);
  }
  cloud::PointCloud<Cloud> cloud;

 private:
  double uniform() { return static_cast<double>(random_() >> 11) * 0x1.0p-53; }
  double gaussian() {
    double sum = -6;
    for (int i = 0; i < 12; ++i) sum += uniform();
    return sum;
  }
  void add(const Eigen::Vector3d& p) {
    cloud.points.push_back(p.cast<float>());
    cloud.scans.push_back(static_cast<std::uint16_t>(cloud.viewpoints.size() - 1));
  }
  void scan(const Eigen::Vector3d& eye) {
    cloud.viewpoints.push_back(eye);
    for (double nod = -0.95; nod < 0.8; nod += 0.012) {
      for (double beam = -1.57; beam < 1.57; beam += 0.012) {
        const Eigen::Vector3d ray(std::cos(beam) * std::cos(nod), std::sin(beam),
                                  std::cos(beam) * std::sin(nod));
        const double range = to_corridor(eye, ray) + bow_.sigma * gaussian();
        const double level = range * std::hypot(ray.x(), ray.y());
        add(eye + range * ray - Eigen::Vector3d(0, 0, bow_.at_6_m * level * level / 36));
      }
    }
    // The robot's own body, as seen by its scanner.
    for (int i = 0; i < 600; ++i) {
      const double side = i % 2 == 0 ? 1 : -1;
      add(eye + Eigen::Vector3d(0.05 * uniform(), side * (0.3 + 0.4 * uniform()), -0.1 - 0.1 * uniform()));
      add(eye + Eigen::Vector3d(0.02 * uniform(), 0.12 * side + 0.02 * uniform(), -0.02 * uniform()));
    }
  }
  /// m, distance inside of its walls, or to the crate.
  static double to_corridor(const Eigen::Vector3d& eye, const Eigen::Vector3d& ray) {
    const Eigen::Array3d low(0, -kHalf, 0), high(kLength, kHalf, kHeight);
    const Eigen::Array3d end = (ray.array() > 0).select(high, low);
    const double wall = ((end - eye.array()) / ray.array()).minCoeff();
    const Eigen::Array3d a = (crate().min().array() - eye.array()) / ray.array();
    const Eigen::Array3d b = (crate().max().array() - eye.array()) / ray.array();
    const double enter = a.min(b).maxCoeff(), leave = a.max(b).minCoeff();
    return enter <= leave && enter > 0 ? std::min(enter, wall) : wall;
  }

  Bow bow_;
  std::mt19937_64 random_{7};
};

class BowedFloor : public testing::TestWithParam<Bow> {};

TEST_P(BowedFloor, IsOneFloorWithoutObjectsOnIt) {
  const auto built = build_model(NoddingScans(GetParam()).cloud, {});
  ASSERT_TRUE(built.ok()) << built.error().message;
  const SemanticModel& model = built->model;
  std::set<std::string> floors;
  double top = 0;
  for (const ModelEntity& entity : model.entities) {
    if (entity.label != EntityLabel::floor) continue;
    floors.insert(entity.part_of.empty() ? entity.name : entity.part_of);
    top = entity.T_map_body.translation().z() + entity.size.z() / 2;
  }
  EXPECT_EQ(floors.size(), 1U);
  const auto T_cloud_map = model.T_map_cloud.inverse();
  // The passable part; near the last wall no scan sees the floor well.
  const Eigen::AlignedBox2d driven(Eigen::Vector2d(1.2, -0.9), Eigen::Vector2d(6.5, 0.9));
  Eigen::AlignedBox3d of_crate = crate();
  of_crate.min().array() -= 0.2, of_crate.max().array() += 0.2;
  std::size_t false_ones = 0, crates = 0;
  double highest = 0;
  for (const ModelMesh& mesh : model.meshes) {
    for (const Eigen::Vector3f& vertex : mesh.vertices) {
      const Eigen::Vector3d p = T_cloud_map * vertex.cast<double>();
      const double over = static_cast<double>(vertex.z()) - top;
      const bool is_crate = of_crate.contains(Eigen::Vector3d(p.x(), p.y(), 0.1));
      crates += is_crate && over > 0.1;
      if (is_crate || !driven.contains(p.head<2>()) || over < 0.03 || over > 1) continue;
      ++false_ones;
      highest = std::max(highest, over);
    }
  }
  EXPECT_EQ(false_ones, 0U) << "vertices of what is unknown, up to " << highest << " m over the floor";
  EXPECT_GT(crates, 20U) << "the crate is real";
}

INSTANTIATE_TEST_SUITE_P(Amplitudes, BowedFloor,
                         testing::Values(Bow{0, 0.003}, Bow{0.05, 0.01}, Bow{0.1, 0.003}, Bow{0.1, 0.015},
                                         Bow{0.2, 0.01}, Bow{0.3, 0.005}, Bow{-0.1, 0.01}));

}  // namespace
}  // namespace parhelion::semantic
