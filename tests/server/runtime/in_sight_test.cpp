// What is in sight of a laser, against the definition.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "server/runtime/sight.hpp"
#include "server/simulation/bodies/movable_objects.hpp"
#include "tests/server/tick/synthetic.hpp"
#include "tests/site_objects.hpp"

namespace parhelion::runtime {
namespace {

constexpr double kRange = 12;  // m

struct Seen {
  std::string entity;
  BodyDefinition definition;
  Transform<Map, Body> T_map_body;
};

/// In the order and with the sample points of Sight, every surface against every ray: see
/// cast_bodies_exact().
Sight::Entities reference(const std::vector<Seen>& bodies, const Eigen::Vector3d& eye) {
  std::vector<scan::BodyMotion> motions;
  for (const Seen& body : bodies) motions.push_back({&body.definition, body.T_map_body, body.T_map_body});
  Sight::Entities entities;
  for (const Seen& body : bodies) {
    for (int k = 0; k < 7; ++k) {
      Eigen::Vector3d offset = Eigen::Vector3d::Zero();
      const Eigen::Vector3d half = 0.9 * body.definition.shapes[0].size / 2;
      if (k > 0) offset[(k - 1) / 2] = (k % 2 == 1 ? 1 : -1) * half[(k - 1) / 2];
      Eigen::Vector3d p = body.T_map_body * body.definition.shapes[0].T_body_shape * offset;
      p.z() = eye.z();
      if ((p - eye).norm() >= kRange) continue;
      const Transform<Map, Laser> aimed(Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitX(), p - eye),
                                        eye);
      constexpr std::array<float, 1> now{0};
      std::array<scan::RangeHit, 1> hit{};
      scan::cast_bodies_exact({aimed, aimed}, {0, 0, now}, motions, (p - eye).norm() + 1e-3, hit);
      if (hit[0].body >= 0 && bodies[static_cast<std::size_t>(hit[0].body)].entity == body.entity)
        entities.insert(body.entity);
    }
  }
  return entities;
}

TEST(Sight, FindsInARoomFullOfMeshesWhatTheReferenceFinds) {
  tick::Configuration configuration = test::configuration({});
  std::mt19937 random(7);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random() % 10'000) / 10'000;
  };
  std::size_t in_sight = 0, hidden = 0;
  for (int round = 0; round < 20; ++round) {
    std::vector<ModelObject> objects;
    for (int i = 0; i < 75; ++i) {
      objects.push_back(test::site_object("box " + std::to_string(i), ObjectKind::box, 0, 0,
                                          {uniform(0.1, 1), uniform(0.1, 1), uniform(0.2, 1)}));
      if (i % 3 != 0) objects.back().mesh = test::mesh_of(objects.back());
    }
    simulation::EntityShapes shapes(configuration.scenario, configuration.robot, configuration.model,
                                    configuration.robot_models);
    shapes.add(objects);
    WorldMessage world;
    std::vector<Seen> bodies;
    for (const ModelObject& object : objects) {
      WorldMessage::Entry& entry = world.bodies.emplace_back();
      const double angle = uniform(0, 6.28), away = uniform(1.5, 9);
      entry.entity = object.name;
      entry.part = simulation::object_body(object, 1).part;
      entry.owner = BodyOwner::agent;
      entry.T_map_body =
          Transform<Map, Body>::planar(away * std::cos(angle), away * std::sin(angle), uniform(0, 6.28));
      bodies.push_back({object.name, simulation::object_body(object, 1), entry.T_map_body});
    }
    const Eigen::Vector3d eye(0, 0, 0.3);
    Sight sight(SemanticModel{});
    sight.set_bodies(world, shapes);
    const Sight::Entities found =
        sight.in_laser(Transform<Map, Laser>(Eigen::Quaterniond::Identity(), eye), kRange, "rover");
    EXPECT_EQ(found, reference(bodies, eye)) << round;
    in_sight += found.size();
    hidden += objects.size() - found.size();
  }
  EXPECT_GT(in_sight, 300U);
  EXPECT_GT(hidden, 300U);
}

}  // namespace
}  // namespace parhelion::runtime
