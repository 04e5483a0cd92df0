// The fast caster against its exact reference, over random scenes and over scenes made of edges.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "fusion/scan/ray_caster.hpp"
#include "tests/box_mesh.hpp"
#include "tests/fusion/scan/hits_agree.hpp"
#include "tests/fusion/scan/random_scene.hpp"

namespace parhelion::scan {
namespace {

using test::Draw;
using test::random_scene;
using test::RandomScene;

struct Comparison {
  std::size_t beams = 0, hits = 0, inside = 0, apart = 0, other_body = 0;
};

void compare(std::span<const RangeHit> fast, std::span<const RangeHit> reference, Comparison& sum) {
  for (std::size_t i = 0; i < reference.size(); ++i) {
    ++sum.beams;
    sum.hits += std::isfinite(reference[i].range);
    sum.inside += reference[i].range == 0;
    if (!test::hits_agree(fast[i], reference[i])) ++sum.apart;
    if (fast[i].body != reference[i].body || fast[i].reflectivity != reference[i].reflectivity)
      ++sum.other_body;
  }
}

/// `fast` and `reference` are the buffers of the two casters.
void compare_on_building(RayCaster& caster, const RandomScene& scene, std::span<RangeHit> fast,
                         std::span<RangeHit> reference, Comparison& sum) {
  caster.set_building(scene.building);
  caster.cast_building(scene.laser, scene.beams, scene.max_range, fast);
  cast_building_exact(scene.laser, scene.beams, scene.building, scene.max_range, reference);
  compare(fast, reference, sum);
}

/// A mesh of random triangles.
Shape random_mesh(Draw& draw, int triangles) {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<MeshTriangle> corners;
  for (int i = 0; i < triangles; ++i) {
    const Eigen::Vector3d middle = draw.vector(0.6);
    const auto first = static_cast<std::uint32_t>(vertices.size());
    for (int k = 0; k < 3; ++k) vertices.push_back((middle + draw.vector(0.2)).cast<float>());
    corners.push_back({first, first + 1, first + 2});
  }
  const auto centered = make_shape_mesh(std::move(vertices), std::move(corners)).value();
  Shape shape = test::random_shape(draw);
  shape.kind = ShapeKind::mesh;
  shape.size = centered.size;
  shape.mesh = centered.mesh;
  return shape;
}

TEST(RayCasterReference, agrees_with_the_reference_on_beams_that_are_not_evenly_spaced) {
  constexpr int kBeams = 361;
  RayCaster caster;
  Comparison sum;
  std::vector<RangeHit> fast(kBeams), reference(kBeams);
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    RandomScene scene = random_scene(seed, kBeams, 10, 20);
    Draw draw(seed + 2000);
    test::make_uneven(draw, scene);
    caster.cast_bodies(scene.laser, scene.beams, scene.bodies, scene.max_range, fast);
    cast_bodies_exact(scene.laser, scene.beams, scene.bodies, scene.max_range, reference);
    compare(fast, reference, sum);
    compare_on_building(caster, scene, fast, reference, sum);
    ASSERT_EQ(sum.apart, 0U) << "scene " << seed;
  }
  EXPECT_GT(sum.hits, 1000U);
}

TEST(RayCasterReference, agrees_with_the_reference_on_bodies_that_are_meshes) {
  constexpr int kBeams = 361;
  RayCaster caster;
  Comparison sum;
  std::vector<RangeHit> fast(kBeams), reference(kBeams);
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    RandomScene scene = random_scene(seed, kBeams, 10, 0);
    Draw draw(seed + 1000);
    for (BodyDefinition& body : scene.definitions) {
      for (Shape& shape : body.shapes) shape = random_mesh(draw, draw.integer(1, 60));
    }
    caster.cast_bodies(scene.laser, scene.beams, scene.bodies, scene.max_range, fast);
    cast_bodies_exact(scene.laser, scene.beams, scene.bodies, scene.max_range, reference);
    compare(fast, reference, sum);
    ASSERT_EQ(sum.apart, 0U) << "scene " << seed;
  }
  EXPECT_GT(sum.hits, 500U);
}

// Both casters work in doubles, so even at grazing edges they part only within about 1e-12 rad: over random
// scenes that does not happen, and no disagreement is allowed.
TEST(RayCasterReference, agrees_with_the_reference_on_bodies_over_a_million_beams) {
  constexpr int kBeams = 361, kScenes = 2800;
  RayCaster caster;
  Comparison sum;
  std::vector<RangeHit> fast(kBeams), reference(kBeams);
  for (std::uint64_t seed = 1; seed <= kScenes; ++seed) {
    const RandomScene scene = random_scene(seed, kBeams, 10, 0);
    caster.cast_bodies(scene.laser, scene.beams, scene.bodies, scene.max_range, fast);
    cast_bodies_exact(scene.laser, scene.beams, scene.bodies, scene.max_range, reference);
    compare(fast, reference, sum);
    ASSERT_EQ(sum.apart, 0U) << "scene " << seed;
  }
  EXPECT_GE(sum.beams, 1'000'000U);
  EXPECT_GT(sum.hits, sum.beams / 4) << "the scenes must not be empty";
  EXPECT_GT(sum.inside, 1000U) << "some beams must start inside a body";
  // Only where the surfaces of two bodies intersect on a beam to within rounding.
  EXPECT_LE(sum.other_body, 5U);
}

/// Groups of up to three bodies, each in a sphere around its bounding box.
std::vector<BodyGroup> groups_of(std::span<const BodyMotion> bodies, std::uint64_t seed) {
  Draw draw(seed);
  std::vector<BodyGroup> groups;
  for (std::uint32_t first = 0; first < bodies.size();) {
    const auto left = static_cast<int>(bodies.size() - first);
    const auto last = first + static_cast<std::uint32_t>(draw.integer(1, std::min(left, 3)));
    Eigen::AlignedBox3d box;
    for (std::uint32_t b = first; b < last; ++b) {
      double reach = 0;
      for (const Shape& shape : bodies[b].body->shapes)
        reach = std::max(reach, shape.T_body_shape.translation().norm() + 2 * shape.size.norm());
      for (const auto& T : {bodies[b].T_map_body_start, bodies[b].T_map_body_end}) {
        const Eigen::Vector3d p = T.translation(), r = Eigen::Vector3d::Constant(reach);
        box.extend(Eigen::AlignedBox3d(p - r, p + r));
      }
    }
    groups.push_back({first, last, box.center(), box.diagonal().norm() / 2});
    first = last;
  }
  return groups;
}

TEST(RayCasterReference, groups_give_the_same_hits_as_single_bodies) {
  constexpr int kBeams = 361, kScenes = 400;
  RayCaster caster;
  std::vector<RangeHit> of_bodies(kBeams), of_groups(kBeams);
  std::size_t hits = 0;
  for (std::uint64_t seed = 1; seed <= kScenes; ++seed) {
    const RandomScene scene = random_scene(seed, kBeams, 40, 0);
    caster.cast_bodies(scene.laser, scene.beams, scene.bodies, scene.max_range, of_bodies);
    caster.cast_groups(scene.laser, scene.beams, scene.bodies, groups_of(scene.bodies, seed), scene.max_range,
                       of_groups);
    for (std::size_t i = 0; i < kBeams; ++i) {
      ASSERT_EQ(of_groups[i].range, of_bodies[i].range) << "scene " << seed << ", beam " << i;
      ASSERT_EQ(of_groups[i].body, of_bodies[i].body) << "scene " << seed << ", beam " << i;
      hits += of_groups[i].body >= 0;
    }
  }
  EXPECT_GT(hits, kScenes * kBeams / 4);
}

TEST(RayCasterReference, agrees_with_the_reference_on_buildings) {
  constexpr int kBeams = 361, kScenes = 300;
  RayCaster caster;
  Comparison sum;
  std::vector<RangeHit> fast(kBeams), reference(kBeams);
  for (std::uint64_t seed = 1; seed <= kScenes; ++seed) {
    const RandomScene scene =
        random_scene(seed, kBeams, 0, seed % 50 == 0 ? 1000 : static_cast<int>(seed % 60));
    compare_on_building(caster, scene, fast, reference, sum);
    ASSERT_EQ(sum.apart, 0U) << "scene " << seed;
  }
  EXPECT_GT(sum.hits, sum.beams / 6);
  EXPECT_LE(sum.other_body, 5U);
}

TEST(RayCasterReference, hits_the_building_only_in_front_of_the_bodies) {
  constexpr int kBeams = 361, kScenes = 200;
  RayCaster caster;
  std::vector<RangeHit> bodies(kBeams), all(kBeams), before(kBeams);
  std::size_t hidden = 0, seen = 0;
  for (std::uint64_t seed = 1; seed <= kScenes; ++seed) {
    const RandomScene scene = random_scene(seed, kBeams, 10, 30);
    caster.set_building(scene.building);
    caster.cast_bodies(scene.laser, scene.beams, scene.bodies, scene.max_range, bodies);
    caster.cast_building(scene.laser, scene.beams, scene.max_range, all);
    caster.cast_nearer_building(bodies, scene.laser, scene.beams, scene.max_range, before);
    for (std::size_t i = 0; i < kBeams; ++i) {
      if (!(all[i].range < bodies[i].range)) {
        ++hidden;
        ASSERT_GE(before[i].range, bodies[i].range) << "scene " << seed << ", beam " << i;
        continue;
      }
      ++seen;
      ASSERT_EQ(before[i].range, all[i].range) << "scene " << seed << ", beam " << i;
      ASSERT_EQ(before[i].reflectivity, all[i].reflectivity) << "scene " << seed << ", beam " << i;
    }
  }
  EXPECT_GT(hidden, kScenes * kBeams / 10U);
  EXPECT_GT(seen, kScenes * kBeams / 20U);
}

TEST(RayCasterReference, agrees_with_the_reference_on_meshes) {
  constexpr int kBeams = 361, kScenes = 100;
  RayCaster caster;
  Comparison sum;
  std::vector<RangeHit> fast(kBeams), reference(kBeams);
  for (std::uint64_t seed = 1; seed <= kScenes; ++seed) {
    RandomScene scene = random_scene(seed, kBeams, 0, static_cast<int>(seed % 20));
    Draw draw(seed + 1000);
    const Eigen::Vector3d middle = scene.laser.T_map_laser_start.translation();
    ModelMesh& mesh = scene.building.meshes.emplace_back();
    for (std::uint32_t t = 0; t < 60; ++t) {
      const Eigen::Vector3d at =
          middle + Eigen::Vector3d(draw.real(-9, 9), draw.real(-9, 9), draw.real(-1, 1));
      for (int k = 0; k < 3; ++k) mesh.vertices.push_back((at + draw.vector(2)).cast<float>());
      mesh.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
    }
    mesh.triangles.push_back({0, 0, 1});  // has no area
    compare_on_building(caster, scene, fast, reference, sum);
    ASSERT_EQ(sum.apart, 0U) << "scene " << seed;
  }
  EXPECT_GT(sum.hits, sum.beams / 4);
}

TEST(RayCasterReference, a_box_and_its_mesh_agree_from_outside) {
  ModelEntity box;
  box.name = "shelf";
  box.T_map_body = Transform<Map, Body>::planar(3, 0.4, 0.3, 0.1);
  box.size = {0.8, 1.4, 2};
  SemanticModel boxes, meshes;
  boxes.entities.push_back(box);
  meshes.meshes.push_back(test::box_mesh(box));
  const std::vector<float> time(721, 0.F);
  const BeamSet beams{-3.14F, 0.00872F, time};
  std::vector<RangeHit> a(721), b(721);
  RayCaster caster;
  caster.set_building(boxes);
  caster.cast_building({}, beams, 30, a);
  caster.set_building(meshes);
  caster.cast_building({}, beams, 30, b);
  std::size_t hits = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    ASSERT_EQ(std::isinf(a[i].range), std::isinf(b[i].range)) << i;
    if (std::isinf(a[i].range)) continue;
    EXPECT_NEAR(a[i].range, b[i].range, 1e-5F);
    ++hits;
  }
  EXPECT_GT(hits, 30U);
  box.deleted = true;
  boxes.entities = {box};
  box.deleted = false;
  box.label = EntityLabel::free_space;
  boxes.entities.push_back(box);
  caster.set_building(boxes);
  caster.cast_building({}, beams, 30, a);
  cast_building_exact({}, beams, boxes, 30, b);
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_TRUE(std::isinf(a[i].range) && std::isinf(b[i].range));
}

/// Boxes, poses and bearings on a lattice: beams run along faces and through edges, where rounding matters.
RandomScene lattice_scene(std::uint64_t seed) {
  Draw draw(seed);
  RandomScene scene;
  const auto half_metres = [&draw](int reach) { return 0.5 * draw.integer(-reach, reach); };
  const auto quarter_turns = [&draw] {
    return Eigen::Quaterniond(
        Eigen::AngleAxisd(draw.integer(0, 3) * std::numbers::pi / 2, Eigen::Vector3d::UnitZ()));
  };
  scene.laser.T_map_laser_start = {quarter_turns(), {half_metres(4), half_metres(4), half_metres(1)}};
  scene.laser.T_map_laser_end = scene.laser.T_map_laser_start;
  scene.time.assign(361, 0);
  scene.beams = {static_cast<float>(-std::numbers::pi), static_cast<float>(std::numbers::pi / 180),
                 scene.time};
  for (int b = 0; b < 6; ++b) {
    BodyDefinition& body = scene.definitions.emplace_back();
    Shape shape;
    shape.kind = static_cast<ShapeKind>(draw.integer(0, 3));
    shape.size = {0.5 * draw.integer(1, 4), 0.5 * draw.integer(1, 4), 0.5 * draw.integer(1, 4)};
    body.shapes.push_back(shape);
    // Before the turn: the order of evaluation of arguments is unspecified.
    const Eigen::Vector3d place{half_metres(10), half_metres(10), half_metres(2)};
    const Transform<Map, Body> T_map_body(quarter_turns(), place);
    scene.bodies.push_back({&body, T_map_body, T_map_body});
  }
  return scene;
}

/// Whether the reference agrees once the beam is moved by a millimetre or turned by 1e-5 rad: an edge was
/// grazed.
bool grazes(const RandomScene& scene, std::size_t beam, const RangeHit& fast) {
  const float time[1] = {0};
  const double angle =
      double{scene.beams.angle_min} + static_cast<double>(beam) * double{scene.beams.angle_increment};
  for (int axis = 0; axis < 6; ++axis) {
    for (const double sign : {-1.0, 1.0}) {
      const Eigen::Vector3d unit = Eigen::Vector3d::Unit(axis % 3);
      const Eigen::Vector3d shift = axis < 3 ? Eigen::Vector3d(sign * 1e-3 * unit) : Eigen::Vector3d::Zero();
      const Eigen::AngleAxisd turn(axis < 3 ? 0 : sign * 1e-5, unit);
      const Transform<Map, Laser>& from = scene.laser.T_map_laser_start;
      const Transform<Map, Laser> nudged(from.quaternion() * turn, from.translation() + shift);
      const Transform<Map, Laser> along(
          nudged.quaternion() * Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()), nudged.translation());
      RangeHit reference[1];
      cast_bodies_exact({along, along}, {0, 0, time}, scene.bodies, scene.max_range, reference);
      // Moved by a millimetre, the range itself changes by about as much.
      if (std::isinf(reference[0].range) ? reference[0].range == fast.range
                                         : std::abs(reference[0].range - fast.range) < 5e-3F) {
        return true;
      }
    }
  }
  return false;
}

TEST(RayCasterReference, differs_from_the_reference_only_where_a_beam_grazes_an_edge) {
  RayCaster caster;
  std::vector<RangeHit> fast(361), reference(361);
  std::size_t grazing = 0, beams = 0, hits = 0;
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    const RandomScene scene = lattice_scene(seed);
    caster.cast_bodies(scene.laser, scene.beams, scene.bodies, scene.max_range, fast);
    cast_bodies_exact(scene.laser, scene.beams, scene.bodies, scene.max_range, reference);
    for (std::size_t i = 0; i < fast.size(); ++i) {
      ++beams;
      hits += std::isfinite(reference[i].range);
      if (test::hits_agree(fast[i], reference[i])) continue;
      ASSERT_TRUE(grazes(scene, i, fast[i]))
          << "scene " << seed << " beam " << i << ": " << fast[i].range << ", twin " << reference[i].range;
      ++grazing;
    }
  }
  EXPECT_GT(hits, beams / 10);
  EXPECT_LT(grazing, beams / 100)
      << "the beams' plane holds faces of many of these boxes, but few are on the edge";
}

}  // namespace
}  // namespace parhelion::scan
