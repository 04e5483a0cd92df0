#include "fusion/semantic/texture/grey_image.hpp"

#include <algorithm>
#include <cmath>

namespace parhelion::semantic {
namespace {

std::vector<float> kernel_of(double sigma) {
  const int radius = static_cast<int>(std::ceil(2.5 * sigma));
  std::vector<float> kernel;
  float sum = 0;
  for (int i = -radius; i <= radius; ++i) {
    kernel.push_back(static_cast<float>(std::exp(-0.5 * i * i / (sigma * sigma))));
    sum += kernel.back();
  }
  for (float& each : kernel) each /= sum;
  return kernel;
}

}  // namespace

GreyImage::GreyImage(const ColourView& view, const Eigen::Vector3f& gain, double blur)
    : camera_(view.camera), grey_(view.camera.pixels()) {
  const Eigen::Vector3f weight = gain.cwiseProduct(Eigen::Vector3f(0.299F, 0.587F, 0.114F));
  for (std::size_t i = 0; i < grey_.size(); ++i) {
    const std::uint8_t* p = &view.rgb[3 * i];
    grey_[i] = weight.dot(Eigen::Vector3f(p[0], p[1], p[2]));
  }
  if (blur > 0) this->blur(blur);
}

void GreyImage::blur(double sigma) {
  const std::vector<float> kernel = kernel_of(sigma);
  const int radius = static_cast<int>(kernel.size() / 2), w = camera_.width, h = camera_.height;
  std::vector<float> rows(grey_.size(), 0.F);
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x)
      for (int i = -radius; i <= radius; ++i)
        rows[camera_.at(x, y)] +=
            kernel[static_cast<std::size_t>(i + radius)] * pixel(std::clamp(x + i, 0, w - 1), y);
  std::fill(grey_.begin(), grey_.end(), 0.F);
  for (int y = 0; y < h; ++y)
    for (int i = -radius; i <= radius; ++i)
      for (int x = 0; x < w; ++x)
        grey_[camera_.at(x, y)] +=
            kernel[static_cast<std::size_t>(i + radius)] * rows[camera_.at(x, std::clamp(y + i, 0, h - 1))];
}

GreyImage::Value GreyImage::at(const Eigen::Vector2d& where) const {
  const int x = std::clamp(static_cast<int>(where.x()), 0, camera_.width - 2);
  const int y = std::clamp(static_cast<int>(where.y()), 0, camera_.height - 2);
  const auto s = static_cast<float>(where.x() - x), t = static_cast<float>(where.y() - y);
  const float a = pixel(x, y), b = pixel(x + 1, y), c = pixel(x, y + 1), d = pixel(x + 1, y + 1);
  const float top = a + s * (b - a), bottom = c + s * (d - c);
  const Eigen::Vector2f gradient((b - a) + t * ((d - c) - (b - a)), bottom - top);
  return {top + t * (bottom - top), gradient};
}

}  // namespace parhelion::semantic
