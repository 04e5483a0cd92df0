#include "render/notice.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>

namespace parhelion::render {

void write_notice(const std::string& notice, cv::Mat& picture) {
  const double scale = std::max(0.3, picture.cols / 640.0 * 0.55);
  const int thickness = std::max(1, static_cast<int>(scale * 1.8));
  int baseline = 0;
  const cv::Size size = cv::getTextSize(notice, cv::FONT_HERSHEY_DUPLEX, scale, thickness, &baseline);
  const int pad = size.height / 2;
  // At the top: at the bottom, objects on the floor in front of the camera would cover it.
  const cv::Rect band =
      cv::Rect(0, 0, picture.cols, size.height + baseline + pad) & cv::Rect(0, 0, picture.cols, picture.rows);
  if (band.empty()) return;
  cv::Mat strip = picture(band);
  strip.convertTo(strip, -1, 0.45);
  cv::putText(picture, notice, {pad, size.height + pad / 2}, cv::FONT_HERSHEY_DUPLEX, scale, {235, 240, 245},
              thickness, cv::LINE_AA);
}

}  // namespace parhelion::render
