// Draws a tracked synthetic crowd as SVG, the picture of docs/measurements/people.md:
//   people_picture FILE.svg [seed]
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>

#include "tests/fusion/people/crowd_score.hpp"

namespace parhelion {
namespace {

constexpr double kScale = 60;  // pixels a metre

std::string xy(const Eigen::Vector2d& p) {
  char text[64];
  std::snprintf(text, sizeof text, "%.1f,%.1f ", 40 + kScale * p.x(), 40 + kScale * (12 - p.y()));
  return text;
}

void line(std::ofstream& file, const std::string& points, const char* style) {
  file << "<polyline points=\"" << points << "\" fill=\"none\" " << style << "/>\n";
}

int draw(const char* path, std::uint64_t seed) {
  test::CrowdOptions options;
  options.seed = seed;
  options.duration = 15;
  options.laser.beams = 720;
  options.laser.height = 0.25;
  const test::Crowd crowd = make_crowd(options);
  people::PeopleTracker tracker;
  std::ofstream file(path);
  file << "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"810\" height=\"810\"><rect width=\"810\" "
          "height=\"810\" fill=\"white\"/>\n";
  std::map<int, std::string> truth;
  std::map<std::uint32_t, std::string> tracks;
  std::map<std::uint32_t, people::Mover> newest;
  std::string robot;
  for (std::size_t k = 0; k < crowd.scans.size(); ++k) {
    const test::CrowdScan& scan = crowd.scans[k];
    robot += xy(scan.T_map_laser.position());
    for (const test::TruePerson& person : scan.people) truth[person.id] += xy(person.position);
    for (const people::Mover& mover : tracker.update(test::sweep_of(crowd, scan))) {
      if (mover.kind != people::MoverClass::person) continue;
      tracks[mover.id] += xy(mover.position);
      newest[mover.id] = mover;
    }
    if (k % 10 != 0) continue;
    const Pose2 estimate = planar(scan.estimated.T_map_laser_end);
    for (std::size_t i = 0; i < scan.scan.ranges.size(); ++i) {
      const double range = double{scan.scan.ranges[i]},
                   angle = crowd.laser.angle_min + crowd.laser.angle_increment * i;
      if (!(range < 20)) continue;
      const std::string at = xy(estimate * Eigen::Vector2d(range * std::cos(angle), range * std::sin(angle)));
      file << "<circle cx=\"" << at.substr(0, at.find(',')) << "\" cy=\"" << at.substr(at.find(',') + 1)
           << "\" r=\"1\" fill=\"#aab\"/>\n";
    }
  }
  line(file, robot, "stroke=\"#999\" stroke-width=\"2\" stroke-dasharray=\"6 4\"");
  for (const auto& [id, points] : truth)
    line(file, points, "stroke=\"#2a2\" stroke-width=\"7\" opacity=\"0.35\"");
  constexpr const char* kColours[] = {"#d22", "#22d", "#c6c", "#e80", "#088", "#840"};
  for (const auto& [id, points] : tracks) {
    const std::string colour = kColours[id % 6];
    line(file, points, ("stroke=\"" + colour + "\" stroke-width=\"2\"").c_str());
    const std::string at = xy(newest[id].position);
    file << "<text x=\"" << at.substr(0, at.find(',')) << "\" y=\"" << at.substr(at.find(',') + 1)
         << "\" fill=\"" << colour << "\" font-family=\"sans-serif\" font-size=\"16\">" << id << "</text>\n";
  }
  file << "<text x=\"40\" y=\"24\" font-family=\"sans-serif\" font-size=\"15\">green: true paths; thin: "
          "tracks called "
          "persons, with their numbers; dashed: the robot; dots: returns</text>\n</svg>\n";
  return file ? 0 : 1;
}

}  // namespace
}  // namespace parhelion

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: people_picture FILE.svg [seed]\n");
    return 2;
  }
  return parhelion::draw(argv[1], argc > 2 ? static_cast<std::uint64_t>(std::atoll(argv[2])) : 4);
}
