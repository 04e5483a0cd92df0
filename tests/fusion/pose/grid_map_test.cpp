#include "fusion/pose/maps/grid_map.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <random>

namespace parhelion::pose {
namespace {

class GridMapFile : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("parhelion_grid_map_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(path(name), std::ios::binary) << text;
  }
  std::string error_of(const std::string& yaml) const {
    write("bad.yaml", yaml);
    const auto map = load_ros_map(path("bad.yaml"));
    EXPECT_FALSE(map.ok());
    return map.ok() ? "" : map.error().message;
  }
  std::filesystem::path folder_;
};

GridMap random_map(std::mt19937& random) {
  std::uniform_int_distribution<int> side(1, 40), kind(0, 2);
  std::uniform_real_distribution<double> place(-100, 100), resolution(0.01, 0.2);
  GridMap map;
  map.width = side(random), map.height = side(random);
  map.resolution = resolution(random);
  map.x_min = place(random), map.y_min = place(random);
  for (int i = 0; i < map.width * map.height; ++i) {
    constexpr float values[] = {0.0F, 0.5F, 1.0F};
    map.occupied.push_back(values[kind(random)]);
  }
  map.id = grid_map_id(map);
  return map;
}

TEST_F(GridMapFile, RoundTripsAnyTrinaryMapAndItsId) {
  std::mt19937 random(11);
  for (int i = 0; i < 100; ++i) {
    const GridMap map = random_map(random);
    ASSERT_TRUE(save_ros_map(map, path("map")).ok());
    const auto loaded = load_ros_map(path("map.yaml"));
    ASSERT_TRUE(loaded.ok()) << loaded.error().message;
    EXPECT_EQ(loaded->occupied, map.occupied);
    EXPECT_EQ(loaded->width, map.width);
    EXPECT_EQ(loaded->resolution, map.resolution);
    EXPECT_EQ(loaded->x_min, map.x_min);
    EXPECT_EQ(loaded->y_min, map.y_min);
    EXPECT_EQ(loaded->id, map.id);
  }
}

TEST_F(GridMapFile, TheIdChangesWithACellAndWithThePlace) {
  std::mt19937 random(12);
  GridMap map = random_map(random);
  const std::string id = grid_map_id(map);
  GridMap moved = map;
  moved.x_min += 0.01;
  EXPECT_NE(grid_map_id(moved), id);
  map.occupied[0] = map.occupied[0] > 0.7F ? 0.0F : 1.0F;
  EXPECT_NE(grid_map_id(map), id);
  EXPECT_EQ(id.size(), 64U);
}

TEST_F(GridMapFile, ReadsAForeignMapThatIsNegatedAndCommented) {
  write("m.pgm", std::string("P5\n# made by hand\n2 1\n# deep\n255\n") + '\xff' + '\x00');
  write("m.yaml",
        "image: m.pgm\nresolution: 0.1\norigin: [1, 2, 0]\nnegate: 1\noccupied_thresh: 0.65\nfree_thresh: "
        "0.25\n");
  const auto map = load_ros_map(path("m.yaml"));
  ASSERT_TRUE(map.ok()) << map.error().message;
  EXPECT_EQ(map->occupied, (std::vector<float>{1, 0}));
  EXPECT_EQ(map->y_min, 2);
}

TEST_F(GridMapFile, ErrorsNameTheLineAndWhatWasExpected) {
  write("m.pgm", "P5\n2 2\n255\n\x01\x02\x03\x04");
  const std::string good = "image: m.pgm\nresolution: 0.1\norigin: [0, 0, 0]\n";
  EXPECT_NE(error_of("image: m.pgm\nresolution: -1\norigin: [0, 0, 0]\n")
                .find("bad.yaml:2: 'resolution': expected m per cell, above 0 and below 10, found '-1'"),
            std::string::npos);
  EXPECT_NE(error_of("image: m.pgm\nresolution: fine\norigin: [0, 0, 0]\n").find("bad.yaml:2"),
            std::string::npos);
  EXPECT_NE(error_of("image: m.pgm\nresolution: 0.1\norigin: 5\n").find("bad.yaml:3"), std::string::npos);
  EXPECT_NE(error_of("image: m.pgm\nresolution: 0.1\norigin: [0, 0, 1.5]\n").find("yaw"), std::string::npos);
  EXPECT_NE(error_of("image: m.pgm\nresolution: 0.1\norigin: [1e300, 0, 0]\n").find("1000 km"),
            std::string::npos);
  EXPECT_NE(error_of("image: m.pgm\nresolution: 0.1\n").find("origin"), std::string::npos);
  EXPECT_NE(error_of(good + "mode: raw\n").find("bad.yaml:4"), std::string::npos);
  EXPECT_NE(error_of(good + "free_thresh: 0.9\n").find("free_thresh"), std::string::npos);
  for (const char* value : {"resolution: fine", "origin: [0, nan, 0]", "negate: maybe", "free_thresh: []"}) {
    const std::string named = value;
    std::string text = "image: m.pgm\n";
    for (const char* each : {"resolution: 0.1", "origin: [0, 0, 0]"})
      if (named.substr(0, named.find(':')) != std::string(each).substr(0, named.find(':')))
        text += std::string(each) + "\n";
    const std::string error = error_of(text + named + "\n");
    EXPECT_NE(error.find("expected text for image and mode, 0 or 1 for negate, and numbers"),
              std::string::npos)
        << value << ": " << error;
  }
  EXPECT_NE(error_of("[1, 2\n").find("bad.yaml:"), std::string::npos);
  EXPECT_NE(error_of("image: none.pgm\nresolution: 0.1\norigin: [0, 0, 0]\n").find("bad.yaml:1: 'image': "),
            std::string::npos);
  EXPECT_FALSE(load_ros_map(path("absent.yaml")).ok());
}

TEST_F(GridMapFile, DamagedPicturesAreReportedWithTheOffset) {
  write("m.yaml", "image: m.pgm\nresolution: 0.1\norigin: [0, 0, 0]\n");
  for (const std::string& pgm : {std::string("P5\n4 4\n255\nshort"), std::string("P6\n1 1\n255\nabc"),
                                 std::string("P5\n0 4\n255\n"), std::string("P5\n99999 99999\n255\n"),
                                 std::string("P5\n2 2\n70000\n...."), std::string("P5"), std::string()}) {
    write("m.pgm", pgm);
    const auto map = load_ros_map(path("m.yaml"));
    ASSERT_FALSE(map.ok()) << pgm;
    EXPECT_NE(map.error().message.find("offset"), std::string::npos) << map.error().message;
  }
}

TEST_F(GridMapFile, AnEmptyMapAndAMissingPathAreErrors) {
  EXPECT_FALSE(save_ros_map({}, path("empty")).ok());
  std::mt19937 random(13);
  EXPECT_FALSE(save_ros_map(random_map(random), path("no/such/folder/map")).ok());
}

}  // namespace
}  // namespace parhelion::pose
