#include "server/station/people_json.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace parhelion::station {
namespace {

using Json = nlohmann::json;

double rounded(double value) { return std::round(value * 1e3) / 1e3; }

Json ellipse_json(const Eigen::Matrix2d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(covariance);
  const auto sigma = [&](int i) { return rounded(std::sqrt(std::max(0.0, axes.eigenvalues()(i)))); };
  const Eigen::Vector2d major = axes.eigenvectors().col(1);
  return {sigma(1), sigma(0), rounded(std::atan2(major.y(), major.x()))};
}

}  // namespace

std::string people_json(const WorldMessage& world) {
  Json list = Json::array();
  for (const WorldMessage::Person& person : world.persons) {
    const auto body =
        std::find_if(world.bodies.begin(), world.bodies.end(),
                     [&](const WorldMessage::Entry& each) { return each.entity == person.entity; });
    if (body == world.bodies.end()) continue;
    list.push_back({{"name", person.entity},
                    {"velocity", {rounded(body->velocity.x()), rounded(body->velocity.y())}},
                    {"radius", rounded(person.radius)},
                    {"ellipse", ellipse_json(person.covariance)}});
  }
  return Json{{"type", "people"}, {"list", std::move(list)}}.dump(-1, ' ', false,
                                                                  Json::error_handler_t::replace);
}

}  // namespace parhelion::station
