// How alike the models of a real set and of its degraded copies are; not a benchmark of time.
//   semantic_consistency [SET [FOLDER]]   FOLDER receives plans and top views
#include <gtest/gtest.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <random>
#include <stdexcept>

#include "fusion/cloud/read_cloud.hpp"
#include "fusion/cloud/registration.hpp"
#include "fusion/semantic/build_model.hpp"
#include "fusion/semantic/pictures/model_plan.hpp"
#include "tests/fusion/semantic/depth_frames.hpp"

namespace {

using namespace parhelion;
namespace fs = std::filesystem;
using Points = cloud::PointCloud<Cloud>;

struct Set {
  std::string name;
  Points cloud;
  std::optional<Eigen::Vector3d> up;
};

Points registered(const std::vector<std::string>& names) {
  std::vector<cloud::ScanToRegister> scans;
  for (const std::string& name : names) {
    auto file = cloud::read_scan(test::recording(name));
    if (!file) throw std::runtime_error(file.error().message);
    if (file->cloud.viewpoints.empty()) file->cloud.viewpoints = {Eigen::Vector3d::Zero()};
    const bool known = file->guess.has_value();
    scans.push_back({name, std::move(file->cloud), file->guess.value_or(Transform<Cloud, Scanner>()), known});
  }
  auto sequence = cloud::register_sequence(scans);
  if (!sequence) throw std::runtime_error(sequence.error().message);
  return std::move(sequence->cloud);
}

Points single(const std::string& name, bool at_origin) {
  auto file = cloud::read_scan(test::recording(name));
  if (!file) throw std::runtime_error(file.error().message);
  Points cloud = cloud::renamed<Cloud>(std::move(file->cloud));
  cloud.labels.clear();
  if (at_origin && cloud.viewpoints.empty()) cloud.viewpoints = {Eigen::Vector3d::Zero()};
  return cloud;
}

std::vector<Set> sets(const std::string& only) {
  std::vector<Set> all;
  const auto add = [&](const char* name, const std::function<Points()>& cloud,
                       std::optional<Eigen::Vector3d> up = {}) {
    if (only.empty() || only == name) all.push_back({name, cloud(), up});
  };
  add("room", [] { return registered({"3d-room-scan/room_scan1.pcd", "3d-room-scan/room_scan2.pcd"}); });
  add("corridor", [] {
    return registered(
        {"3d-3dtk-corridor/scan000.3d", "3d-3dtk-corridor/scan001.3d", "3d-3dtk-corridor/scan002.3d"});
  });
  add("crop", [] { return single("3d-s3dis-labelled-crop/s3dis_crop.ply", false); });
  add(
      "kitchen", [] { return test::fused(test::kitchen_frames()); }, test::kitchen_up());
  add("stairs", [] { return single("3d-ori-stairs/06.pcd", false); });
  const Eigen::Vector3d down_y(0, -1, 0);
  add(
      "depth stairs", [] { return test::fused(test::stairs_frames()); }, down_y);
  return all;
}

// --- degraded copies; `keep`: which part of the plan is left

Points kept(const Points& cloud, const std::function<bool(std::size_t)>& keep) {
  Points result;
  result.viewpoints = cloud.viewpoints;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (!keep(i)) continue;
    result.points.push_back(cloud.points[i]);
    if (!cloud.scans.empty()) result.scans.push_back(cloud.scans[i]);
  }
  return result;
}
Points without_views(Points cloud) {
  cloud.viewpoints.clear(), cloud.scans.clear();
  return cloud;
}
Points noisy(Points cloud, double sigma) {
  std::mt19937 random(5);
  std::normal_distribution<float> noise(0, static_cast<float>(sigma));
  for (Eigen::Vector3f& p : cloud.points) p += Eigen::Vector3f(noise(random), noise(random), noise(random));
  return cloud;
}
Points voxels(const Points& cloud, double side) {
  std::map<std::tuple<int, int, int>, int> cubes;
  for (const Eigen::Vector3f& p : cloud.points) {
    const Eigen::Vector3i c = (p / static_cast<float>(side)).array().floor().cast<int>();
    ++cubes[{c.x(), c.y(), c.z()}];
  }
  Points result;
  for (const auto& [c, n] : cubes) {
    const auto [x, y, z] = c;
    result.points.push_back((side * (Eigen::Vector3d(x, y, z).array() + 0.5)).matrix().cast<float>());
  }
  return result;
}
double middle(const Points& cloud) {
  std::vector<float> x;
  for (const Eigen::Vector3f& p : cloud.points) x.push_back(p.x());
  std::nth_element(x.begin(), x.begin() + static_cast<std::ptrdiff_t>(x.size() / 2), x.end());
  return static_cast<double>(x[x.size() / 2]);
}

// --- comparison

struct Walls {
  std::vector<ModelEntity> boxes;  // in the cloud's frame
  static double distance(const ModelEntity& box, const Eigen::Vector3d& p) {
    const Eigen::Vector3d local = box.T_map_body.inverse() * p;
    return (local.head<2>().cwiseAbs() - 0.5 * box.size.head<2>()).cwiseMax(0).norm();
  }
};

Walls walls_of(const semantic::BuiltModel& built) {
  const auto T_cloud_map = built.model.T_map_cloud.inverse();
  Walls walls;
  for (ModelEntity e : built.model.entities) {
    if (e.label != EntityLabel::wall) continue;
    const Eigen::Isometry3d T = T_cloud_map.isometry() * e.T_map_body.isometry();
    e.T_map_body = Transform<Map, Body>(T);
    walls.boxes.push_back(e);
  }
  return walls;
}

/// Length of `a` in pieces of 0.1 m, and how much of it is within 10 cm of `b`; left of `x_max` only.
std::pair<double, double> shared(const Walls& a, const Walls& b, double x_max) {
  double all = 0, both = 0;
  for (const ModelEntity& box : a.boxes) {
    for (double s = -box.size.x() / 2 + 0.05; s < box.size.x() / 2; s += 0.1) {
      const Eigen::Vector3d p = box.T_map_body * Eigen::Vector3d(s, 0, 0);
      if (p.x() > x_max) continue;
      all += 0.1;
      for (const ModelEntity& other : b.boxes) {
        if (Walls::distance(other, p) > 0.1) continue;
        both += 0.1;
        break;
      }
    }
  }
  return {all, both};
}

std::string counts(const semantic::BuiltModel& built) {
  std::map<EntityLabel, int> n;
  for (const ModelEntity& e : built.model.entities) ++n[e.label];
  double unknown = 0;
  for (std::size_t i = 0; i < built.cloud.size(); ++i) {
    unknown += built.cloud.labels[i] == static_cast<std::uint8_t>(EntityLabel::unknown) &&
               built.object_of[i] == semantic::kNoObject;
  }
  char words[200];
  std::snprintf(words, sizeof(words),
                "walls %2d doors %d windows %d pillars %d steps %2d floors %2d objects %2zu unknown %4.1f %%",
                n[EntityLabel::wall], n[EntityLabel::door], n[EntityLabel::window], n[EntityLabel::pillar],
                n[EntityLabel::stairs], n[EntityLabel::floor], built.objects.size(),
                100 * unknown / static_cast<double>(built.cloud.size()));
  return words;
}

/// Points below 2 m over the floor from above, brighter where there are more.
void draw_top(const semantic::BuiltModel& built, const std::string& path) {
  constexpr double kPixel = 0.02;
  Eigen::AlignedBox2d box;
  for (const ModelEntity& e : built.model.entities) box.extend(e.T_map_body.translation().head<2>());
  box = {box.min().array() - 2, box.max().array() + 2};
  const Eigen::Vector2i size = (box.sizes() / kPixel).cast<int>().cwiseMin(3000);
  cv::Mat image(size.y(), size.x(), CV_8UC3, cv::Scalar(0, 0, 0));
  static const cv::Vec3b colours[] = {{255, 160, 90}, {60, 60, 60},  {40, 40, 40},   {0, 140, 255},
                                      {255, 60, 255}, {255, 255, 0}, {140, 60, 140}, {90, 200, 240},
                                      {0, 90, 160},   {0, 80, 0}};
  for (std::size_t i = 0; i < built.cloud.size(); ++i) {
    const Eigen::Vector3d p = built.cloud.points[i].cast<double>();
    if (p.z() < built.floor + 0.1 || p.z() > built.floor + 2.0) continue;
    const Eigen::Vector2i at = ((p.head<2>() - box.min()) / kPixel).cast<int>();
    if (at.x() < 0 || at.y() < 0 || at.x() >= size.x() || at.y() >= size.y()) continue;
    cv::Vec3b colour = colours[built.cloud.labels[i] % 10];
    if (built.object_of[i] != semantic::kNoObject) {
      const auto o = built.object_of[i];
      colour = {static_cast<std::uint8_t>(60 + o * 67 % 190), static_cast<std::uint8_t>(80 + o * 131 % 170),
                static_cast<std::uint8_t>(60 + o * 29 % 190)};
    }
    image.at<cv::Vec3b>(size.y() - 1 - at.y(), at.x()) = colour;
  }
  for (const ModelObject& object : built.objects) {
    const Eigen::Vector2d p = object.T_map_body.translation().head<2>();
    const Eigen::Vector2i at = ((p - box.min()) / kPixel).cast<int>();
    cv::putText(image, object.name, {at.x(), size.y() - at.y()}, cv::FONT_HERSHEY_SIMPLEX, 0.35,
                {255, 255, 255});
  }
  cv::imwrite(path, image);
}

void compare(const Set& set, const fs::path& folder) {
  const auto build = [&](Points cloud, const char* name) {
    semantic::ModelOptions options;
    options.up = set.up;
    const auto start = std::chrono::steady_clock::now();
    const std::size_t points = cloud.size();
    auto built = semantic::build_model(std::move(cloud), options);
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (!built) {
      std::printf("  %-12s refused: %s\n", name, built.error().message.c_str());
      return built;
    }
    std::printf("  %-12s %7zu points %5.2f s/M  %s\n", name, points, 1e6 * seconds / double(points),
                counts(*built).c_str());
    if (!folder.empty()) {
      const std::string base = (folder / (set.name + " " + name)).string();
      (void)semantic::draw_model_plan(built->model, {set.name + " " + name, "", 1200}, base + ".png");
      draw_top(*built, base + " top.png");
    }
    return built;
  };
  std::printf("%s\n", set.name.c_str());
  const auto original = build(set.cloud, "as it is");
  if (!original) return;
  const Walls truth = walls_of(*original);
  const double x = middle(set.cloud), everywhere = 1e9;
  const std::string wanted = std::getenv("COPY") != nullptr ? std::getenv("COPY") : "";
  const auto check = [&](const char* name, Points cloud, double x_max) {
    if (!wanted.empty() && wanted != name) return;
    if (getenv("SPC")) setenv("SP", getenv("SPC"), 1);
    const auto built = build(std::move(cloud), name);
    if (!built) return;
    const Walls found = walls_of(*built);
    const auto [there, hit] = shared(truth, found, x_max);
    const auto [drawn, right] = shared(found, truth, x_max);
    const double p = drawn > 0 ? right / drawn : 1, r = there > 0 ? hit / there : 1;
    std::printf("    walls: F1 %.2f (%.2f of %.1f m drawn, %.2f of %.1f m there)\n",
                p + r > 0 ? 2 * p * r / (p + r) : 0, p, drawn, r, there);
  };
  check("voxels 5 cm", voxels(set.cloud, 0.05), everywhere);
  check("one in ten", kept(set.cloud, [](std::size_t i) { return i % 10 == 0; }), everywhere);
  check("noise 2 cm", noisy(set.cloud, 0.02), everywhere);
  check("no views", without_views(set.cloud), everywhere);
  check("half", kept(set.cloud, [&](std::size_t i) { return set.cloud.points[i].x() < x; }), x - 0.2);
}

}  // namespace

int main(int argc, char** argv) {
  const fs::path folder = argc > 2 ? argv[2] : "";
  if (!folder.empty()) fs::create_directories(folder);
  for (const Set& set : sets(argc > 1 ? argv[1] : "")) compare(set, folder);
}
