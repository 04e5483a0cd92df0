// The images between projection and Hough transform, each against a reference implementation.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <opencv2/imgproc.hpp>
#include <opencv2/ximgproc.hpp>

#include "fusion/semantic/segmentation/hough.hpp"
#include "fusion/semantic/segmentation/pixel_set.hpp"

namespace parhelion::semantic {
namespace {

constexpr int kPictureWidth = 60, kPictureHeight = 40;

/// A random picture of some lines, blobs and single pixels; its border is empty.
cv::Mat random_picture() {
  cv::Mat picture = cv::Mat::zeros(kPictureHeight, kPictureWidth, CV_8U);
  const auto x = [] { return *rc::gen::inRange(2, kPictureWidth - 2); };
  const auto y = [] { return *rc::gen::inRange(2, kPictureHeight - 2); };
  for (int i = *rc::gen::inRange(0, 5); i > 0; --i)
    cv::line(picture, {x(), y()}, {x(), y()}, 255, *rc::gen::inRange(1, 6));
  for (int i = *rc::gen::inRange(0, 4); i > 0; --i)
    cv::circle(picture, {x(), y()}, *rc::gen::inRange(1, 7), 255, cv::FILLED);
  for (int i = *rc::gen::inRange(0, 60); i > 0; --i) picture.at<std::uint8_t>(y(), x()) = 255;
  cv::rectangle(picture, {0, 0}, {kPictureWidth - 1, kPictureHeight - 1}, 0);
  return picture;
}

PixelSet pixels_of(const cv::Mat& picture) {
  PixelSet set;
  set.reset(picture.cols, picture.rows);
  for (int y = 0; y < picture.rows; ++y) {
    for (int x = 0; x < picture.cols; ++x) {
      if (picture.at<std::uint8_t>(y, x)) set.add(set.index(x, y));
    }
  }
  return set;
}

void expect_same(const PixelSet& set, const cv::Mat& picture) {
  for (int y = 0; y < picture.rows; ++y) {
    for (int x = 0; x < picture.cols; ++x) RC_ASSERT(set.at(x, y) == (picture.at<std::uint8_t>(y, x) != 0));
  }
}

RC_GTEST_PROP(ImagePipeline, FilterIsEquation3, ()) {
  const cv::Mat p = random_picture();
  const int strel[3][3] = {{1, 1, 1}, {1, 0, 1}, {1, 1, 1}};
  cv::Mat out = cv::Mat::zeros(kPictureHeight, kPictureWidth, CV_8U);
  for (int k = 1; k + 1 < kPictureHeight; ++k) {
    for (int l = 1; l + 1 < kPictureWidth; ++l) {
      int sum = 0;
      for (int i = -1; i <= 1; ++i) {
        for (int j = -1; j <= 1; ++j)
          sum +=
              strel[i + 1][j + 1] * (p.at<std::uint8_t>(k + i, l + j) ? 1 : 0) * (std::abs(i) + std::abs(j));
      }
      if (sum > 0 && p.at<std::uint8_t>(k, l)) out.at<std::uint8_t>(k, l) = 255;
    }
  }
  PixelSet filtered;
  filter_isolated(pixels_of(p), filtered);
  expect_same(filtered, out);
}

RC_GTEST_PROP(ImagePipeline, DilationEqualsOpenCv, ()) {
  const cv::Mat picture = random_picture();
  cv::Mat out;
  cv::dilate(picture, out, cv::getStructuringElement(cv::MORPH_RECT, {3, 3}));
  cv::rectangle(out, {0, 0}, {kPictureWidth - 1, kPictureHeight - 1}, 0);
  PixelSet dilated;
  dilate(pixels_of(picture), dilated);
  expect_same(dilated, out);
}

RC_GTEST_PROP(ImagePipeline, ThinningEqualsOpenCv, ()) {
  const cv::Mat picture = random_picture();
  cv::Mat out;
  cv::ximgproc::thinning(picture, out, cv::ximgproc::THINNING_GUOHALL);
  PixelSet thinned = pixels_of(picture);
  thin(thinned);
  expect_same(thinned, out);
}

/// Whether both ends of the line lie within `off` pixels of one segment, and vice versa.
bool is_found(const std::vector<PixelSegment>& segments, cv::Point a, cv::Point b, int off) {
  const auto near = [&](int x, int y, cv::Point p) { return std::hypot(x - p.x, y - p.y) <= off; };
  return std::any_of(segments.begin(), segments.end(), [&](const PixelSegment& s) {
    return (near(s.x0, s.y0, a) && near(s.x1, s.y1, b)) || (near(s.x0, s.y0, b) && near(s.x1, s.y1, a));
  });
}

RC_GTEST_PROP(ImagePipeline, HoughFindsALineAmongNoiseForAnySeed, (std::uint64_t seed)) {
  constexpr int side = 400;
  cv::Mat picture = cv::Mat::zeros(side, side, CV_8U);
  const cv::Point a(*rc::gen::inRange(20, 120), *rc::gen::inRange(20, 380));
  const cv::Point b(*rc::gen::inRange(250, 380), *rc::gen::inRange(20, 380));
  cv::line(picture, a, b, 255);
  for (int i = 0; i < 300; ++i)
    picture.at<std::uint8_t>(*rc::gen::inRange(1, side - 1), *rc::gen::inRange(1, side - 1)) = 255;
  const PixelSet pixels = pixels_of(picture);
  const HoughOptions options{.votes = 25, .min_length = 60, .max_gap = 6, .seed = seed};
  const auto segments = hough_segments(pixels, options);
  RC_ASSERT(segments == hough_segments(pixels, options));
  // An angle error of one degree lets a long line leave its pixels; the rest is found as another line.
  double longest = 0;
  for (const PixelSegment& s : segments) longest = std::max(longest, std::hypot(s.x1 - s.x0, s.y1 - s.y0));
  RC_ASSERT(longest >= 0.4 * std::hypot(b.x - a.x, b.y - a.y));
}

TEST(ImagePipeline, HoughEqualsOpenCv) {
  cv::Mat picture = cv::Mat::zeros(300, 300, CV_8U);
  const std::vector<std::pair<cv::Point, cv::Point>> lines = {
      {{20, 30}, {280, 30}}, {{40, 60}, {40, 280}}, {{80, 80}, {260, 260}}, {{250, 60}, {120, 60}}};
  for (const auto& [a, b] : lines) cv::line(picture, a, b, 255);
  std::vector<cv::Vec4i> theirs;
  cv::HoughLinesP(picture, theirs, 1, CV_PI / 180, 30, 40, 5);
  const auto ours = hough_segments(pixels_of(picture), {.votes = 30, .min_length = 40, .max_gap = 5});
  EXPECT_EQ(theirs.size(), lines.size());
  EXPECT_EQ(ours.size(), lines.size());
  for (const auto& [a, b] : lines) EXPECT_TRUE(is_found(ours, a, b, 3)) << a << b;
}

TEST(ImagePipeline, HoughSearchesOnlyTheGivenRows) {
  cv::Mat picture = cv::Mat::zeros(300, 300, CV_8U);
  cv::line(picture, {20, 30}, {280, 36}, 255);
  cv::line(picture, {20, 60}, {280, 160}, 255);
  cv::line(picture, {50, 100}, {50, 280}, 255);
  const auto found =
      hough_segments(pixels_of(picture), {.votes = 30, .min_length = 60, .max_gap = 5, .max_rise = 3});
  ASSERT_FALSE(found.empty());
  for (const PixelSegment& s : found) EXPECT_TRUE(s.y0 <= 40 && s.y1 <= 40);
}

TEST(ImagePipeline, RidgesStandOutFromSpreadResponses) {
  LayerImage image;
  image.reset(100, 60);
  for (int x = 10; x < 90; ++x) {
    for (int layer = 0; layer < 20; ++layer) image.add(x, 30, layer);  // a table top
    for (int y = 5; y < 55; ++y) image.add(x, y, x / 30);              // a wall behind it
  }
  PixelSet ridges;
  threshold_ridges(image, 3, 6, 0.6, ridges);
  ASSERT_GE(ridges.set().size(), 80U);
  for (const std::uint32_t i : ridges.set()) EXPECT_EQ(i / 100, 30U);
}

}  // namespace
}  // namespace parhelion::semantic
