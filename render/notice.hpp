// Words across the top of a picture, that nobody takes it for what it is not.
#pragma once

#include <opencv2/core.hpp>
#include <string>

namespace parhelion::render {

/// `picture`: BGR.
void write_notice(const std::string& notice, cv::Mat& picture);

}  // namespace parhelion::render
