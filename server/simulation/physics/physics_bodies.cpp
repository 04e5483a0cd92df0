// Adds and removes bodies: Bullet's parameters and collision groups of each kind.
#include <memory>
#include <utility>

#include "server/simulation/physics/physics_world.hpp"

namespace parhelion::simulation {

struct FixedMesh {
  std::unique_ptr<btTriangleMesh> triangles = std::make_unique<btTriangleMesh>();
  std::unique_ptr<btBvhTriangleMeshShape> shape;  // references the triangles
};

std::shared_ptr<FixedMesh> make_fixed_mesh(const ModelMesh& mesh) {
  auto fixed = std::make_shared<FixedMesh>();
  const auto vertex = [&](std::uint32_t i) {
    return to_bullet(Eigen::Vector3d(mesh.vertices[i].cast<double>()));
  };
  for (const auto& triangle : mesh.triangles)
    fixed->triangles->addTriangle(vertex(triangle[0]), vertex(triangle[1]), vertex(triangle[2]));
  fixed->shape = std::make_unique<btBvhTriangleMeshShape>(fixed->triangles.get(), true);
  return fixed;
}

namespace {

std::unique_ptr<btCollisionShape> make_shape(ShapeKind kind, const Eigen::Vector3d& size) {
  const btVector3 half = to_bullet(Eigen::Vector3d(size / 2));
  if (kind == ShapeKind::cylinder) return std::make_unique<btCylinderShapeZ>(half);
  return std::make_unique<btBoxShape>(half);
}

}  // namespace

PhysicsHandle Physics::World::add(std::unique_ptr<btCollisionShape> shape, double mass,
                                  const Eigen::Isometry3d& pose, const Eigen::Vector3d& center,
                                  PhysicsGroup group, int mask, std::unique_ptr<PartSurfaces> part) {
  btVector3 inertia(0, 0, 0);
  if (mass > 0) shape->calculateLocalInertia(mass, inertia);
  btRigidBody::btRigidBodyConstructionInfo construction(mass, nullptr, shape.get(), inertia);
  construction.m_startWorldTransform = to_bullet(pose * Eigen::Translation3d(center));
  construction.m_friction = 0.6;
  construction.m_restitution = 0;
  construction.m_linearSleepingThreshold =
      0.03;  // m/s; Bullet's default of 0.8 stops bodies that still slide
  construction.m_angularSleepingThreshold = 0.05;
  RigidBody rigid;
  rigid.body = std::make_unique<btRigidBody>(construction);
  rigid.shape = std::move(shape);
  rigid.center = center;
  rigid.group = group;
  rigid.mask = mask;
  rigid.part = std::move(part);
  rigid.body->setUserPointer(rigid.part.get());
  rigid.body->setUserIndex(static_cast<int>(bodies.size()));
  world.addRigidBody(rigid.body.get(), group, mask);
  bodies.push_back(std::move(rigid));
  return static_cast<PhysicsHandle>(bodies.size()) - 1;
}

PhysicsHandle Physics::add_fixed_box(const Transform<Map, Body>& T_map_body, const Eigen::Vector3d& size,
                                     bool floor) {
  return world_->add(std::make_unique<btBoxShape>(to_bullet(Eigen::Vector3d(size / 2))), 0,
                     T_map_body.isometry(), Eigen::Vector3d::Zero(), floor ? kFloor : kFixed,
                     floor ? kFree | kRobot : kFree | kUpright | kRobot);
}

PhysicsHandle Physics::add_fixed_mesh(FixedMesh& mesh) {
  const PhysicsHandle handle = world_->add(std::move(mesh.shape), 0, Eigen::Isometry3d::Identity(),
                                           Eigen::Vector3d::Zero(), kFixed, kFree | kUpright | kRobot);
  world_->at(handle).triangles = std::move(mesh.triangles);
  return handle;
}

PhysicsHandle Physics::add_floor(double z) {
  return world_->add(std::make_unique<btStaticPlaneShape>(btVector3(0, 0, 1), z), 0,
                     Eigen::Isometry3d::Identity(), Eigen::Vector3d::Zero(), kFloor, kFree | kRobot);
}

PhysicsHandle Physics::World::add_free(std::unique_ptr<btCollisionShape> shape, double mass,
                                       const Eigen::Vector3d& center,
                                       const Transform<Map, Body>& T_map_body) {
  const PhysicsHandle handle = add(std::move(shape), mass, T_map_body.isometry(), center, kFree,
                                   kFixed | kFloor | kFree | kUpright | kKinematic | kRobot | kLeaf);
  btRigidBody& body = *at(handle).body;
  body.setDamping(0.02, 0.1);
  // Placed at rest: it sleeps exactly there until touched.
  body.forceActivationState(ISLAND_SLEEPING);
  put_down.push_back(handle);
  return handle;
}

PhysicsHandle Physics::add_free(ShapeKind kind, const Eigen::Vector3d& size, double mass,
                                const Transform<Map, Body>& T_map_body) {
  return world_->add_free(make_shape(kind, size), mass, {0, 0, size.z() / 2}, T_map_body);
}

PhysicsHandle Physics::add_free(const std::vector<Shape>& boxes, double mass,
                                const Transform<Map, Body>& T_map_body) {
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  double volume = 0;
  for (const Shape& box : boxes) {
    moment += box.size.prod() * box.T_body_shape.translation();
    volume += box.size.prod();
  }
  const Eigen::Vector3d center = moment / volume;
  auto compound = std::make_unique<btCompoundShape>(false);
  std::vector<std::unique_ptr<btCollisionShape>> children;
  for (const Shape& box : boxes) {
    children.push_back(make_shape(ShapeKind::box, box.size));
    compound->addChildShape(to_bullet(Eigen::Translation3d(-center) * box.T_body_shape.isometry()),
                            children.back().get());
  }
  const PhysicsHandle handle = world_->add_free(std::move(compound), mass, center, T_map_body);
  world_->at(handle).children = std::move(children);
  return handle;
}

PhysicsHandle Physics::add_upright(ShapeKind kind, const Eigen::Vector3d& size, double mass,
                                   const Transform<Map, Body>& T_map_body) {
  const PhysicsHandle handle =
      world_->add(make_shape(kind, size), mass, T_map_body.isometry(), {0, 0, size.z() / 2}, kUpright,
                  kFixed | kFree | kUpright | kKinematic | kRobot | kLeaf);
  btRigidBody& body = *world_->at(handle).body;
  body.setLinearFactor({1, 1, 0});
  body.setAngularFactor({0, 0, 1});
  body.setGravity({0, 0, 0});
  body.setActivationState(DISABLE_DEACTIVATION);
  return handle;
}

PhysicsHandle Physics::add_kinematic(const std::vector<Eigen::Vector2d>& footprint, double height) {
  auto shape = std::make_unique<btConvexHullShape>();
  for (const Eigen::Vector2d& v : footprint) {
    shape->addPoint({v.x(), v.y(), 0}, false);
    shape->addPoint({v.x(), v.y(), height}, false);
  }
  shape->setMargin(kHullMargin);
  shape->recalcLocalAabb();
  const PhysicsHandle handle =
      world_->add(std::move(shape), 0, Eigen::Isometry3d::Identity(), Eigen::Vector3d::Zero(), kKinematic,
                  kFree | kUpright | kRobot | kLeaf);
  world_->make_kinematic(handle);
  suspend(handle, true);
  return handle;
}

PhysicsHandle Physics::add_leaf(const Eigen::Vector3d& size, double mass,
                                const Transform<Map, Body>& T_map_body) {
  const PhysicsHandle handle =
      world_->add(make_shape(ShapeKind::box, size), mass, T_map_body.isometry(), Eigen::Vector3d::Zero(),
                  kLeaf, kFree | kUpright | kKinematic | kRobot);
  btRigidBody& body = *world_->at(handle).body;
  body.setDamping(0.02, 0.1);
  body.forceActivationState(ISLAND_SLEEPING);
  return handle;
}

void Physics::drop_leaf(PhysicsHandle handle) {
  RigidBody& rigid = world_->at(handle);
  world_->world.removeRigidBody(rigid.body.get());
  rigid.group = kFree;
  rigid.mask = kFixed | kFloor | kFree | kUpright | kKinematic | kRobot | kLeaf;
  world_->world.addRigidBody(rigid.body.get(), rigid.group, rigid.mask);
  rigid.body->activate(true);
}

PhysicsHandle Physics::add_anchor(const Transform<Map, Body>& T_map_body) {
  return world_->add(std::make_unique<btBoxShape>(btVector3(0.01, 0.01, 0.01)), 0, T_map_body.isometry(),
                     Eigen::Vector3d::Zero(), kFixed, 0);
}

void Physics::remove(PhysicsHandle handle) {
  RigidBody& rigid = world_->at(handle);
  world_->wake_neighbours(*rigid.body);
  if (!rigid.suspended) world_->world.removeRigidBody(rigid.body.get());
  rigid.body.reset();
  rigid.shape.reset();
}

}  // namespace parhelion::simulation
