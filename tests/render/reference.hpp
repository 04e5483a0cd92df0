// Reference implementation of drawing and occlusion: one ray per pixel against the shapes themselves, in
// double precision, and the depth rule of render/depth_occlusion.hpp without optimisation.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "render/camera_model.hpp"
#include "render/compositor.hpp"
#include "render/depth_image.hpp"
#include "render/depth_occlusion.hpp"
#include "render/draw_list.hpp"

namespace parhelion::test {

inline constexpr double kMiss = std::numeric_limits<double>::infinity();

/// Distance at which a ray enters a convex set of half spaces n.p <= d; miss where it starts inside.
class Clip {
 public:
  void plane(double along, double start, double offset) {  // n.direction, n.origin, d
    if (std::abs(along) < 1e-15) {
      if (start > offset) missed_ = true;
      return;
    }
    const double t = (offset - start) / along;
    if (along < 0)
      enter_ = std::max(enter_, t);
    else
      leave_ = std::min(leave_, t);
  }
  double enter() const { return !missed_ && enter_ < leave_ && enter_ > 0 ? enter_ : kMiss; }

 private:
  double enter_ = -kMiss, leave_ = kMiss;
  bool missed_ = false;
};

/// A box with its chamfers: 6 faces, 12 edges, 8 corners.
inline double enter_box(const Eigen::Vector3d& o, const Eigen::Vector3d& d, const Eigen::Vector3d& half,
                        double bevel) {
  Clip clip;
  for (int x = -1; x <= 1; ++x) {
    for (int y = -1; y <= 1; ++y) {
      for (int z = -1; z <= 1; ++z) {
        const Eigen::Vector3d n(x, y, z);
        const int axes = std::abs(x) + std::abs(y) + std::abs(z);
        if (axes == 0 || (axes > 1 && bevel == 0)) continue;
        // A face is at half; the chamfer of an edge or a corner goes through points that are nearer by a
        // bevel on all axes but one.
        clip.plane(n.dot(d), n.dot(o), n.cwiseAbs().dot(half) - (axes - 1) * bevel);
      }
    }
  }
  return clip.enter();
}

inline double enter_quadratic(double a, double b, double c) {  // a t^2 + 2 b t + c = 0, smaller root
  const double root = b * b - a * c;
  if (a <= 0 || root < 0) return kMiss;
  const double t = (-b - std::sqrt(root)) / a;
  return t > 0 ? t : kMiss;
}

inline double enter_sphere(const Eigen::Vector3d& o, const Eigen::Vector3d& d, double r) {
  return enter_quadratic(d.dot(d), o.dot(d), o.dot(o) - r * r);
}

inline double enter_cylinder(const Eigen::Vector3d& o, const Eigen::Vector3d& d, double r, double half) {
  double best = kMiss;
  const double side = enter_quadratic(d.head<2>().squaredNorm(), o.head<2>().dot(d.head<2>()),
                                      o.head<2>().squaredNorm() - r * r);
  if (side < kMiss && std::abs(o.z() + side * d.z()) <= half) best = side;
  if (std::abs(d.z()) > 1e-15) {
    const double t = ((d.z() < 0 ? half : -half) - o.z()) / d.z();
    if (t > 0 && (o + t * d).head<2>().norm() <= r) best = std::min(best, t);
  }
  return best;
}

/// The nearest triangle's plane where the ray meets it inside all three edges.
inline double enter_mesh(const ShapeMesh& mesh, const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
  double nearest = kMiss;
  for (const MeshTriangle& corners : mesh.triangles) {
    std::array<Eigen::Vector3d, 3> p;
    for (std::size_t i = 0; i < 3; ++i) p[i] = mesh.vertices[corners[i]].cast<double>();
    const Eigen::Vector3d normal = (p[1] - p[0]).cross(p[2] - p[0]);
    if (normal.dot(d) == 0) continue;
    const double t = normal.dot(p[0] - o) / normal.dot(d);
    bool inside = t > 0;
    for (std::size_t i = 0; i < 3; ++i)
      inside = inside && normal.dot((p[(i + 1) % 3] - p[i]).cross(o + t * d - p[i])) >= 0;
    if (inside) nearest = std::min(nearest, t);
  }
  return nearest;
}

inline double enter_shape(const Shape& shape, const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
  const double r = shape.size.x();
  switch (shape.kind) {
    case ShapeKind::box:
      return enter_box(o, d, 0.5 * shape.size, render::edge_bevel(shape));
    case ShapeKind::cylinder:
      return enter_cylinder(o, d, r, 0.5 * shape.size.z());
    case ShapeKind::sphere:
      return enter_sphere(o, d, r);
    case ShapeKind::capsule: {
      const Eigen::Vector3d up(0, 0, 0.5 * shape.size.z());
      double t = std::min(enter_sphere(o - up, d, r), enter_sphere(o + up, d, r));
      const double side = enter_quadratic(d.head<2>().squaredNorm(), o.head<2>().dot(d.head<2>()),
                                          o.head<2>().squaredNorm() - r * r);
      if (side < kMiss && std::abs(o.z() + side * d.z()) <= up.z()) t = std::min(t, side);
      return t;
    }
    case ShapeKind::mesh:
      return enter_mesh(*shape.mesh, o, d);
  }
  return kMiss;
}

/// Depths of the bodies and of the model over a whole image.
struct ReferenceRendering {
  int width = 0, height = 0;
  std::vector<double> body_z;   ///< m along the optical axis; kMiss: none
  std::vector<double> model_z;  ///< nearest modelled box, likewise
  std::vector<std::uint8_t> visible;

  std::size_t at(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
  }
};

/// One ray per pixel; occluded where the model is nearer by more than the bias.
inline ReferenceRendering cast(const render::RenderJob& job, const SemanticModel& model,
                               const CameraIntrinsics& intrinsics,
                               const Transform<Map, CameraOptical>& T_map_optical) {
  ReferenceRendering reference;
  reference.width = intrinsics.width, reference.height = intrinsics.height;
  const std::size_t count =
      static_cast<std::size_t>(reference.width) * static_cast<std::size_t>(reference.height);
  reference.body_z.assign(count, kMiss), reference.model_z.assign(count, kMiss),
      reference.visible.assign(count, 0);
  struct Placed {
    Shape shape;
    Transform<ShapeFrame, CameraOptical> T_shape_optical;
    bool body;
    double radius;
  };
  std::vector<Placed> placed;
  for_each_body(job.world, [&](const BodyDefinition& body, const BodyState& state) {
    for (const Shape& s : body.shapes)
      placed.push_back(
          {s, (state.T_map_body * s.T_body_shape).inverse() * T_map_optical, true, bounding_radius(s)});
  });
  for (const ModelEntity& entity : model.entities) {
    Shape box;
    box.size = entity.size;
    placed.push_back({box, T_map_box(entity).inverse() * T_map_optical, false, bounding_radius(box)});
  }
  const render::Lens lens(intrinsics);
  for (int y = 0; y < reference.height; ++y) {
    for (int x = 0; x < reference.width; ++x) {
      const auto ray = lens.unproject({x, y});
      if (!ray) continue;
      double body = kMiss, real = kMiss;
      for (const Placed& p : placed) {
        const Eigen::Vector3d o = p.T_shape_optical.translation(), d = p.T_shape_optical.rotation() * *ray;
        if (std::isinf(enter_sphere(o, d, p.radius)) && o.norm() > p.radius) continue;
        if (p.body)
          body = std::min(body, enter_shape(p.shape, o, d));
        else
          real = std::min(real, enter_box(o, d, 0.5 * p.shape.size, 0));
      }
      const std::size_t i = reference.at(x, y);
      if (body < kMiss) reference.body_z[i] = body * ray->z();
      if (real < kMiss) reference.model_z[i] = real * ray->z();
      reference.visible[i] = body < kMiss && !(real < body - render::kOcclusionBias);
    }
  }
  return reference;
}

/// The depth image in the colour camera: the nearest of the squares that the depth pixels cover; kNothing
/// where there is none.
inline std::vector<double> register_depth(const render::RenderJob& job, const render::DepthPixels& depth) {
  const CameraIntrinsics &c = job.camera.intrinsics, &d = job.depth_camera.intrinsics;
  std::vector<double> z(static_cast<std::size_t>(c.width) * static_cast<std::size_t>(c.height),
                        render::DepthRule::kNothing);
  const render::Lens colour_lens(c), depth_lens(d);
  const auto T_optical_depth = job.T_map_optical.inverse() * job.T_map_depth;
  for (int v = 0; v < depth.height; ++v) {
    for (int u = 0; u < depth.width; ++u) {
      const double range = 0.001 * depth.millimetres[static_cast<std::size_t>(v * depth.width + u)];
      if (range < job.depth_camera.range_min || range > job.depth_camera.range_max) continue;
      Eigen::Vector3d ray = *depth_lens.unproject({u, v});
      const Eigen::Vector3d p = T_optical_depth * Eigen::Vector3d(range / ray.z() * ray);
      const auto pixel = colour_lens.project(p);
      if (!pixel) continue;
      const double half = std::min(4.0, std::max(0.5, 0.5 * c.fx / d.fx * range / p.z()) + 0.05);
      for (int y = std::max(0, static_cast<int>(std::ceil(pixel->y() - half)));
           y <= std::min(c.height - 1.0, std::floor(pixel->y() + half)); ++y)
        for (int x = std::max(0, static_cast<int>(std::ceil(pixel->x() - half)));
             x <= std::min(c.width - 1.0, std::floor(pixel->x() + half)); ++x) {
          double& nearest = z[static_cast<std::size_t>(y * c.width + x)];
          nearest = std::min(nearest, p.z());
        }
    }
  }
  return z;
}

/// The rule's steps 2 to 5 at every pixel that a body covers.
inline void hide_by_depth(ReferenceRendering& reference, const render::RenderJob& job,
                          const std::vector<std::uint8_t>& bgr) {
  using Rule = render::DepthRule;
  const auto depth = render::decode_depth(*job.depth);
  std::vector<double> z = register_depth(job, *depth);
  const std::vector<double> measured = z;
  std::vector<double> confidence(z.size(), 0);
  for (int y = 0; y < reference.height; ++y) {
    for (int x = 0; x < reference.width; ++x) {
      const std::size_t i = reference.at(x, y);
      if (measured[i] >= Rule::kNothing) {
        if (reference.model_z[i] < kMiss) z[i] = reference.model_z[i], confidence[i] = Rule::kModelled;
        continue;
      }
      double nearest = measured[i], farthest = measured[i];
      for (int dy = -Rule::kEdgeRadius; dy <= Rule::kEdgeRadius; ++dy)
        for (int dx = -Rule::kEdgeRadius; dx <= Rule::kEdgeRadius; ++dx) {
          if (x + dx < 0 || y + dy < 0 || x + dx >= reference.width || y + dy >= reference.height) continue;
          const double other = measured[reference.at(x + dx, y + dy)];
          if (other >= Rule::kNothing) continue;
          nearest = std::min(nearest, other), farthest = std::max(farthest, other);
        }
      confidence[i] = farthest - nearest <= Rule::jump(measured[i]) ? Rule::kMeasured
                      : measured[i] < 0.5 * (nearest + farthest)    ? Rule::kNearEdge
                                                                    : Rule::kFarEdge;
    }
  }
  for (int y = 0; y < reference.height; ++y) {
    for (int x = 0; x < reference.width; ++x) {
      const std::size_t i = reference.at(x, y);
      reference.visible[i] = reference.body_z[i] < kMiss;
      if (!reference.visible[i]) continue;
      const double threshold = reference.body_z[i] - Rule::tolerance(std::min(reference.body_z[i], 20.0));
      double behind = 0, all = 0;
      const auto ask = [&](int dx, int dy, double near) {
        if (x + dx < 0 || y + dy < 0 || x + dx >= reference.width || y + dy >= reference.height) return;
        const std::size_t q = reference.at(x + dx, y + dy);
        double squared = 0;
        for (std::size_t k = 0; k < 3; ++k) squared += std::pow(bgr[3 * q + k] - bgr[3 * i + k], 2);
        const double weight =
            near * confidence[q] *
            (std::exp(-squared / (2 * Rule::kColourSigma * Rule::kColourSigma)) + Rule::kUnlike);
        all += weight;
        if (z[q] >= threshold) behind += weight;
      };
      for (int dy = -Rule::kRadius; dy <= Rule::kRadius; dy += 2)
        for (int dx = -Rule::kRadius; dx <= Rule::kRadius; dx += 2)
          ask(dx, dy, std::exp(-(dx * dx + dy * dy) / (2 * Rule::kSpatialSigma * Rule::kSpatialSigma)));
      if (confidence[i] < Rule::kMeasured)
        for (const int step : Rule::kAskedSteps)
          for (int dy = -1; dy <= 1; ++dy)
            for (int dx = -1; dx <= 1; ++dx)
              if (dx || dy) ask(dx * step, dy * step, Rule::kAsked * std::exp(-step / Rule::kAskedRange));
      reference.visible[i] = all == 0 || behind / all >= 0.5;
    }
  }
}

/// Intersection over union of "more than half covered" and the reference's.
inline double overlap(const std::vector<std::uint8_t>& coverage, const std::vector<std::uint8_t>& reference) {
  std::size_t both = 0, either = 0;
  for (std::size_t i = 0; i < reference.size(); ++i) {
    const bool a = coverage[i] >= 128, b = reference[i] != 0;
    both += a && b, either += a || b;
  }
  return either ? static_cast<double>(both) / static_cast<double>(either) : 1;
}

}  // namespace parhelion::test
