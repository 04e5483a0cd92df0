// The carrier of a scanner appears in one scan only; furniture beside a scanner is kept.
#include "fusion/semantic/carrier_points.hpp"

#include <gtest/gtest.h>

#include "protocols/model.hpp"

namespace parhelion::semantic {
namespace {

constexpr auto kUnlabelled = static_cast<std::uint8_t>(EntityLabel::unknown);
constexpr double kEye = 0.6;  // m, of both scanners over the floor

/// Two scans of a passage along x: a railing at y = 1 that both saw, a wall at x = 6 that the first scan sees
/// through the position of the second, and what a test adds.
class Passage {
 public:
  Passage() {
    cloud_.viewpoints = {{0, 0, kEye}, {2, 0, kEye}};
    for (double x = 1; x < 4; x += 0.03) {
      for (double z = 0.1; z < 1; z += 0.03) {
        add({x, 1.05, z}, 0);
        add({x, 1.05, z}, 1);
      }
    }
  }
  /// Points of the second scan over [from, to] of a strip across the passage, 0.1 m ahead of its scanner.
  void strip(double from, double to) {
    first_ = cloud_.size();
    for (double y = from; y < to; y += 0.02) {
      for (double z = kEye - 0.16; z < kEye - 0.02; z += 0.02) add({2.14, y, z}, 1);
    }
    last_ = cloud_.size();
  }
  /// Rays of the first scan that reach the wall behind.
  void look_through() {
    for (double y = -3; y < 3; y += 0.02) {
      for (double z = -0.4; z < kEye; z += 0.02) add({6, y, z}, 0, EntityLabel::wall);
    }
  }
  void drop() { drop_carriers(cloud_, cloud_.labels); }

  double remaining_fraction(std::size_t from, std::size_t to) const {
    std::size_t left = 0;
    for (std::size_t i = from; i < to; ++i) left += cloud_.labels[i] == kUnlabelled;
    return static_cast<double>(left) / static_cast<double>(to - from);
  }
  double strip_left() const { return remaining_fraction(first_, last_); }
  double railing_left() const { return remaining_fraction(0, first_); }

 private:
  void add(const Eigen::Vector3d& p, std::uint16_t scan, EntityLabel label = EntityLabel::unknown) {
    cloud_.points.push_back(p.cast<float>());
    cloud_.scans.push_back(scan);
    cloud_.labels.push_back(static_cast<std::uint8_t>(label));
  }
  cloud::PointCloud<Map> cloud_;
  std::size_t first_ = 0, last_ = 0;
};

TEST(CarrierPoints, AreRemovedOnlyWhereAnotherScanLookedThrough) {
  Passage passage;
  passage.strip(-0.6, 0.6);
  passage.look_through();
  passage.drop();
  EXPECT_EQ(passage.strip_left(), 0);
  EXPECT_EQ(passage.railing_left(), 1);
}

TEST(CarrierPoints, AreRemovedEvenWhereTheyTouchTheRailing) {
  Passage passage;
  passage.strip(-0.6, 0.98);
  passage.look_through();
  passage.drop();
  EXPECT_LT(passage.strip_left(), 0.15) << "but for what shares a cube with the railing";
  EXPECT_EQ(passage.railing_left(), 1);
}

TEST(CarrierPoints, StayWhereNoScanLookedThrough) {
  Passage passage;
  passage.strip(-0.6, 0.98);
  passage.drop();
  EXPECT_EQ(passage.strip_left(), 1);
}

TEST(CarrierPoints, AreRemovedNearTheScannerUnlessConnected) {
  Passage passage;
  passage.strip(-0.15, 0.15);
  passage.drop();
  EXPECT_EQ(passage.strip_left(), 0) << "no scanner measures so near";
  EXPECT_EQ(passage.railing_left(), 1);
}

}  // namespace
}  // namespace parhelion::semantic
