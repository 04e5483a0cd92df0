// Fills on a part of the canvas give the same pixels as on all of it.
#include "fusion/semantic/pictures/plan_canvas.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>
#include <random>

namespace parhelion::semantic {
namespace {

using Polygon = std::vector<Eigen::Vector2d>;

constexpr int kFineness = 2, kFractionBits = 4;  // as PlanCanvas draws

/// Reference implementation: each layer is drawn on a copy of the whole picture.
void fill_all(const PlanCanvas& canvas, const std::vector<Polygon>& polygons, const cv::Scalar& bgr,
              double opacity, cv::Mat& fine) {
  cv::Mat layer = fine.clone();
  for (const Polygon& polygon : polygons) {
    std::vector<cv::Point> corners;
    for (const Eigen::Vector2d& p : polygon) {
      const Eigen::Vector2d at = canvas.pixel(p) * kFineness * (1 << kFractionBits);
      corners.emplace_back(static_cast<int>(std::lround(at.x())), static_cast<int>(std::lround(at.y())));
    }
    cv::fillPoly(layer, std::vector<std::vector<cv::Point>>{corners}, bgr, cv::LINE_AA, kFractionBits);
  }
  cv::addWeighted(layer, opacity, fine, 1 - opacity, 0, fine);
}

TEST(PlanCanvas, FillsAPartAsItWouldFillAll) {
  std::mt19937_64 random(7);
  // Some polygons reach beyond the canvas, some lie outside of it.
  std::uniform_real_distribution<double> place(-3, 13), size(0.01, 4), part(0.05, 1);
  std::uniform_int_distribution<int> byte(0, 255);
  PlanCanvas canvas(400, {Eigen::Vector2d(0, 0), Eigen::Vector2d(10, 8)}, 20, 30);
  const cv::Mat blank = canvas.picture();
  const auto grey = blank.at<cv::Vec3b>(0, 0);
  cv::Mat fine(kFineness * blank.rows, kFineness * blank.cols, CV_8UC3,
               cv::Scalar(grey[0], grey[1], grey[2]));
  for (int layer = 0; layer < 60; ++layer) {
    std::vector<Polygon> polygons(static_cast<std::size_t>(layer % 3) + 1);
    for (Polygon& polygon : polygons) {
      const Eigen::Vector2d middle(place(random), place(random));
      for (int k = 0; k < 3 + layer % 4; ++k)
        polygon.emplace_back(middle + size(random) * Eigen::Vector2d(std::cos(k), std::sin(k)));
    }
    const Colour colour{static_cast<std::uint8_t>(byte(random)), static_cast<std::uint8_t>(byte(random)),
                        static_cast<std::uint8_t>(byte(random))};
    const double opacity = layer % 2 == 0 ? 1 : part(random);
    canvas.fill(polygons, colour, opacity);
    fill_all(canvas, polygons, {double(colour.blue), double(colour.green), double(colour.red)}, opacity,
             fine);
    cv::Mat expected;
    cv::resize(fine, expected, blank.size(), 0, 0, cv::INTER_AREA);
    ASSERT_EQ(cv::norm(canvas.picture(), expected, cv::NORM_INF), 0) << "layer " << layer;
  }
  EXPECT_GT(cv::norm(canvas.picture(), blank, cv::NORM_L1), 0);
}

TEST(PlanCanvas, LeavesOutWhatIsNoArea) {
  PlanCanvas canvas(400, {Eigen::Vector2d(0, 0), Eigen::Vector2d(10, 8)}, 20, 30);
  const cv::Mat blank = canvas.picture();
  canvas.fill({}, {1, 2, 3}, 0.5);
  canvas.fill({{{1, 1}, {2, 2}}}, {1, 2, 3}, 1);
  canvas.fill({{{50, 50}, {51, 50}, {50, 51}}}, {1, 2, 3}, 0.5);
  EXPECT_EQ(cv::norm(canvas.picture(), blank, cv::NORM_INF), 0);
}

}  // namespace
}  // namespace parhelion::semantic
