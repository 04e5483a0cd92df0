// The file of a site's texture.
#include "protocols/site_texture.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <random>

#include "tests/temporary_folder.hpp"

namespace parhelion {
namespace {

SiteTexture sample() {
  SiteTexture texture;
  texture.map_id = "kitchen-1";
  texture.source = "drive.lcm, 12 images";
  texture.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {2, 0, 0}, {2, 1, 0.5F}};
  texture.quads = {{0, 1, 2, 3}, {1, 4, 5, 2}};
  texture.looks = {QuadLook::recorded, QuadLook::unseen};
  texture.patch = 8, texture.patches_per_row = 2;
  texture.exposure = {{0.1F, -0.2F, 0.05F}, 0.8F, 4.6F};
  texture.jpeg = {0xFF, 0xD8, 1, 2, 3};
  return texture;
}

TEST(SiteTexture, ComesBackFromItsBytes) {
  const SiteTexture texture = sample();
  const auto back = unpack_site_texture(pack_site_texture(texture));
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(back->map_id, texture.map_id);
  EXPECT_EQ(back->source, texture.source);
  EXPECT_EQ(back->vertices, texture.vertices);
  EXPECT_EQ(back->quads, texture.quads);
  EXPECT_EQ(back->looks, texture.looks);
  EXPECT_EQ(back->patch, 8);
  EXPECT_EQ(back->patches_per_row, 2);
  EXPECT_EQ(back->exposure.gain, texture.exposure.gain);
  EXPECT_EQ(back->exposure.slope, texture.exposure.slope);
  EXPECT_EQ(back->jpeg, texture.jpeg);
}

TEST(SiteTexture, IsRefusedWhereverItIsCutOff) {
  const std::vector<std::uint8_t> bytes = pack_site_texture(sample());
  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_FALSE(unpack_site_texture(std::span(bytes).first(size)).ok()) << size;
}

TEST(SiteTexture, DamagedBytesNeverGiveAnInvalidTexture) {
  const std::vector<std::uint8_t> bytes = pack_site_texture(sample());
  std::mt19937 random(7);
  for (int round = 0; round < 20'000; ++round) {
    std::vector<std::uint8_t> damaged = bytes;
    for (int i = 0; i < 3; ++i) damaged[random() % damaged.size()] = static_cast<std::uint8_t>(random());
    const auto texture = unpack_site_texture(damaged);
    if (!texture) continue;
    ASSERT_EQ(texture->looks.size(), texture->quads.size());
    for (const SiteTexture::Quad& quad : texture->quads)
      for (const std::uint32_t corner : quad) ASSERT_LT(corner, texture->vertices.size());
    for (const Eigen::Vector3f& vertex : texture->vertices) ASSERT_TRUE(vertex.allFinite());
    ASSERT_LE(texture->patches_per_row * texture->patch, kMaxTextureSide);
    ASSERT_LE(texture->rows() * texture->patch, kMaxTextureSide);
  }
}

TEST(SiteTexture, LiesBesideItsModelAndIsOfItsMap) {
  const test::TemporaryFolder folder;
  const std::string model = folder / "site.yaml";
  EXPECT_EQ(texture_beside(model), folder / "site.texture");
  const auto none = load_texture_of(model, "kitchen-1");
  ASSERT_TRUE(none.ok());
  EXPECT_EQ(*none, nullptr);
  ASSERT_TRUE(write_site_texture(texture_beside(model), sample()).ok());
  const auto there = load_texture_of(model, "kitchen-1");
  ASSERT_TRUE(there.ok()) << there.error().message;
  EXPECT_EQ((*there)->quads.size(), 2U);
  const auto other = load_texture_of(model, "garage");
  ASSERT_FALSE(other.ok());
  EXPECT_NE(other.error().message.find("kitchen-1"), std::string::npos) << other.error().message;
  std::ofstream(texture_beside(model)) << "nonsense";
  const auto damaged = load_texture_of(model, "kitchen-1");
  ASSERT_FALSE(damaged.ok());
  EXPECT_NE(damaged.error().message.find("site.texture"), std::string::npos) << damaged.error().message;
}

}  // namespace
}  // namespace parhelion
