#include "tools/robot/footprint_text.hpp"

#include <sstream>

#include "protocols/convex_hull.hpp"
#include "tools/robot/dialogue.hpp"

namespace parhelion::tools {

std::vector<Eigen::Vector2d> read_footprint(const std::string& text) {
  std::istringstream words(text);
  std::vector<Eigen::Vector2d> corners;
  bool good = true;
  for (std::string word; words >> word;) {
    const auto numbers = comma_separated(word);
    good = good && numbers && numbers->size() == 2;
    if (good) corners.emplace_back((*numbers)[0], (*numbers)[1]);
  }
  if (good && corners.size() == 1 && corners[0].minCoeff() > 0) {
    const double x = corners[0].x() / 2, y = corners[0].y() / 2;
    return {{-x, -y}, {x, -y}, {x, y}, {-x, y}};
  }
  if (good && corners.size() >= 3) corners = convex_hull(std::move(corners));
  if (!good || corners.size() < 3) {
    throw WrongAnswer{"footprint: expected length,width or at least three corners x,y x,y x,y in m, found '" +
                      text + "'"};
  }
  return corners;
}

std::string missing_parts(const UrdfOutline& urdf) {
  constexpr std::size_t kNamed = 5;
  std::string names;
  for (std::size_t i = 0; i < urdf.left_out.size() && i < kNamed; ++i)
    names += (i == 0 ? "" : ", ") + urdf.left_out[i];
  if (urdf.left_out.size() > kNamed)
    names += " and " + std::to_string(urdf.left_out.size() - kNamed) + " more";
  return names + " (meshes that were not read)";
}

}  // namespace parhelion::tools
