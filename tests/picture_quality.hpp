// How alike two pictures are.
#pragma once

#include <cmath>
#include <opencv2/imgproc.hpp>

namespace parhelion::test {

/// dB, over all channels (8 bits) of the pixels in `mask`; infinite for equal ones.
inline double psnr(const cv::Mat& a, const cv::Mat& b, const cv::Mat& mask) {
  cv::Mat difference;
  cv::Mat first, second;
  a.convertTo(first, CV_32F);
  b.convertTo(second, CV_32F);
  cv::subtract(first, second, difference);
  const cv::Scalar squares = cv::mean(difference.mul(difference), mask);
  double sum = 0;
  for (int c = 0; c < a.channels(); ++c) sum += squares[c] / a.channels();
  return 10 * std::log10(255.0 * 255.0 / sum);
}

/// Wang et al. 2004: of the grey pictures, windows of 11 x 11 with a Gaussian of 1.5 pixels; the mean over
/// the pixels in `mask`.
inline double ssim(const cv::Mat& a, const cv::Mat& b, const cv::Mat& mask) {
  const auto smooth = [](const cv::Mat& picture) {
    cv::Mat result;
    cv::GaussianBlur(picture, result, {11, 11}, 1.5);
    return result;
  };
  const auto grey = [](const cv::Mat& picture) {
    cv::Mat result = picture;
    if (picture.channels() == 3) cv::cvtColor(picture, result, cv::COLOR_BGR2GRAY);
    cv::Mat numbers;
    result.convertTo(numbers, CV_32F);
    return numbers;
  };
  constexpr double c1 = 0.01 * 255 * 0.01 * 255, c2 = 0.03 * 255 * 0.03 * 255;
  const cv::Mat x = grey(a), y = grey(b), mx = smooth(x), my = smooth(y);
  const cv::Mat vx = smooth(x.mul(x)) - mx.mul(mx), vy = smooth(y.mul(y)) - my.mul(my);
  const cv::Mat vxy = smooth(x.mul(y)) - mx.mul(my);
  cv::Mat like = cv::Mat(2 * mx.mul(my) + c1).mul(2 * vxy + c2);
  cv::divide(like, cv::Mat(mx.mul(mx) + my.mul(my) + c1).mul(vx + vy + c2), like);
  return cv::mean(like, mask)[0];
}

}  // namespace parhelion::test
