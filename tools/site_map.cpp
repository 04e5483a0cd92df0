#include "tools/site_map.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "server/review/plan.hpp"

namespace parhelion::tools {
namespace {

constexpr double kPixel = 0.05;   // m
constexpr int kMaxPixels = 4096;  // of a side
constexpr double kMargin = 0.5;   // m
constexpr int kSubBits = 4;       // corners lie between pixels

using Box = Eigen::AlignedBox2d;

const cv::Scalar kFloorColour(228, 228, 228, 255), kStairsColour(190, 190, 190, 255),
    kDoorColour(96, 150, 200, 255), kWindowColour(220, 190, 140, 255), kSolidColour(60, 60, 60, 255);

const cv::Scalar& colour_of(EntityLabel label) {
  switch (label) {
    case EntityLabel::floor:
      return kFloorColour;
    case EntityLabel::stairs:
    case EntityLabel::ramp:
      return kStairsColour;
    case EntityLabel::door:
      return kDoorColour;
    case EntityLabel::window:
      return kWindowColour;
    default:
      return kSolidColour;
  }
}

Box bounds_of(const review::Plan& plan) {
  Box box;
  for (const review::PlanPart& part : plan.parts) {
    for (const Eigen::Vector2d& corner : part.corners) box.extend(corner);
  }
  for (const review::PlanRow& row : plan.rows) {
    box.extend(Eigen::Vector2d(row.left, row.y - review::kPlanCell / 2));
    box.extend(Eigen::Vector2d(row.right, row.y + review::kPlanCell / 2));
  }
  return box;
}

}  // namespace

std::optional<station::StationMap> draw_site_map(const SemanticModel& model) {
  const review::Plan plan = review::plan_of(model);
  Box box = bounds_of(plan);
  if (box.isEmpty() || !box.sizes().allFinite()) return std::nullopt;
  box = Box(box.min().array() - kMargin, box.max().array() + kMargin);
  station::StationMap map;
  map.resolution = std::max(kPixel, box.sizes().maxCoeff() / kMaxPixels);
  map.origin = box.min();
  const Eigen::Vector2i size =
      (box.sizes() / map.resolution).array().ceil().cast<int>().max(1).min(kMaxPixels);
  cv::Mat picture(size.y(), size.x(), CV_8UC4, cv::Scalar(0, 0, 0, 0));
  // Row 0 is the northern edge: the lower left corner of the picture is the origin.
  const auto place = [&](const Eigen::Vector2d& p) {
    const Eigen::Vector2d at = (p - map.origin) / map.resolution;
    const double scale = 1 << kSubBits;
    return cv::Point(static_cast<int>(std::lround((at.x() - 0.5) * scale)),
                     static_cast<int>(std::lround((size.y() - at.y() - 0.5) * scale)));
  };
  const auto fill = [&](const std::array<Eigen::Vector2d, 4>& corners, const cv::Scalar& colour) {
    std::array<cv::Point, 4> points;
    std::transform(corners.begin(), corners.end(), points.begin(), place);
    cv::fillConvexPoly(picture, points.data(), 4, colour, cv::LINE_8, kSubBits);
  };
  for (const review::PlanPart& part : plan.parts) fill(part.corners, colour_of(part.label));
  for (const review::PlanRow& row : plan.rows) {
    const double low = row.y - review::kPlanCell / 2, high = row.y + review::kPlanCell / 2;
    fill({{{row.left, low}, {row.right, low}, {row.right, high}, {row.left, high}}}, kSolidColour);
  }
  std::vector<std::uint8_t> png;
  if (!cv::imencode(".png", picture, png, {cv::IMWRITE_PNG_COMPRESSION, 9})) return std::nullopt;
  map.png.assign(png.begin(), png.end());
  return map;
}

}  // namespace parhelion::tools
