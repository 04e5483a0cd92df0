// The texture of a site with objects that can be pushed shows what stays.
#include "server/runtime/fixed_texture.hpp"

#include <gtest/gtest.h>

#include "tests/site_objects.hpp"

namespace parhelion::runtime {
namespace {

/// A level quad of 10 cm about (x, 0, z).
void add_quad(SiteTexture& texture, float x, float z) {
  const auto first = static_cast<std::uint32_t>(texture.vertices.size());
  for (const auto& [dx, dy] : {std::pair{-0.05F, -0.05F}, {0.05F, -0.05F}, {0.05F, 0.05F}, {-0.05F, 0.05F}})
    texture.vertices.emplace_back(x + dx, dy, z);
  texture.quads.push_back({first, first + 1, first + 2, first + 3});
  texture.looks.push_back(QuadLook::recorded);
}

TEST(FixedTexture, ShowsNoSurfaceOfAnObjectThatCanBePushed) {
  SiteTexture recorded;
  add_quad(recorded, 0, 0.42F);    // its top, a little too high
  add_quad(recorded, 0, 0);        // the floor under it
  add_quad(recorded, 0.5F, 0.4F);  // another thing
  const auto texture = std::make_shared<const SiteTexture>(recorded);
  const std::vector<ModelObject> objects{test::site_object("box 1", ObjectKind::box, 0, 0, {0.4, 0.4, 0.4})};
  const auto fixed = without_objects(texture, objects);
  ASSERT_EQ(fixed->quads.size(), 3U);
  EXPECT_EQ(fixed->quads[0], (SiteTexture::Quad{0, 0, 0, 0}));
  EXPECT_EQ(fixed->quads[1], recorded.quads[1]);
  EXPECT_EQ(fixed->quads[2], recorded.quads[2]);
  EXPECT_EQ(without_objects(texture, {}), texture);
  EXPECT_EQ(without_objects(nullptr, objects), nullptr);
}

}  // namespace
}  // namespace parhelion::runtime
