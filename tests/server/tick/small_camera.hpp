// A shipped robot model whose camera has small images: quick to render.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "server/simulation/robots/robot_model.hpp"

namespace parhelion::test {

/// With the same field of view. Its source texts are changed too, for sessions that embed them.
inline std::shared_ptr<const simulation::RobotModel> small_camera(const std::string& name, int width,
                                                                  int height) {
  auto model = simulation::load_robot_model(name);
  EXPECT_TRUE(model) << model.error().message;
  const CameraIntrinsics& old = model->description.camera->intrinsics;
  std::string yaml = model->yaml;
  const auto replace = [&yaml](const std::string& key, const std::string& value) {
    const std::size_t at = yaml.find("\n    " + key + ": ");
    EXPECT_NE(at, std::string::npos) << key;
    const std::size_t begin = at + key.size() + 7;
    yaml.replace(begin, yaml.find('\n', begin) - begin, value);
  };
  replace("width", std::to_string(width));
  replace("height", std::to_string(height));
  replace("fx", std::to_string(old.fx * width / old.width) + " px");
  replace("fy", std::to_string(old.fy * height / old.height) + " px");
  replace("cx", std::to_string((width - 1) / 2.0) + " px");
  replace("cy", std::to_string((height - 1) / 2.0) + " px");
  auto small = simulation::parse_robot_model(model->urdf, yaml, name + " with a small camera");
  EXPECT_TRUE(small) << small.error().message;
  return std::make_shared<const simulation::RobotModel>(std::move(*small));
}

}  // namespace parhelion::test
