// Prints one line for each MR_SCAN: how many beams hit a virtual agent, and the nearest of these returns.
//
//   listen_mr_scan      until it is stopped with ^C
//
// MR_SCAN is SCAN with the virtual agents in it: the same beams with the same utime. The MR_SCAN_INFO with
// that utime follows it and gives for each beam the agent that it hits.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <lcm/lcm-cpp.hpp>
#include <string>

#include "parhelion/planar_lidar_t.hpp"
#include "parhelion/scan_info_t.hpp"

namespace {

constexpr double kDegrees = 180 / 3.14159265358979323846;

std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

void print(const parhelion::planar_lidar_t& scan, const parhelion::scan_info_t& info) {
  std::printf("%lld: ", static_cast<long long>(scan.utime));
  if (info.live == 0) {
    // The pose is too uncertain for injection: MR_SCAN equals SCAN.
    std::printf("unchanged: %s\n", info.reason.c_str());
    return;
  }
  int replaced = 0;
  std::size_t nearest = 0;
  for (std::size_t i = 0; i < scan.ranges.size() && i < info.beam_agent.size(); ++i) {
    if (info.beam_agent[i] < 0) continue;  // a real return, or none
    if (replaced == 0 || scan.ranges[i] < scan.ranges[nearest]) nearest = i;
    ++replaced;
  }
  std::printf("%d of %d beams replaced", replaced, scan.nranges);
  if (replaced > 0) {
    // Counter-clockwise from the laser's own x axis, which need not be the robot's.
    const double angle = scan.rad0 + static_cast<double>(nearest) * scan.radstep;
    std::printf(" by %s, nearest %.2f m at %.0f deg", joined(info.agents).c_str(), scan.ranges[nearest],
                angle * kDegrees);
  }
  std::printf("\n");
}

class Listener {
 public:
  void handle_scan(const lcm::ReceiveBuffer*, const std::string&, const parhelion::planar_lidar_t* scan) {
    scan_ = *scan;
  }
  void handle_info(const lcm::ReceiveBuffer*, const std::string&, const parhelion::scan_info_t* info) {
    if (info->utime != scan_.utime) return;  // one of the two was lost
    print(scan_, *info);
    std::fflush(stdout);
  }

 private:
  parhelion::planar_lidar_t scan_{};
};

}  // namespace

int main() {
  lcm::LCM lcm;  // at LCM_DEFAULT_URL, else on this machine only
  if (!lcm.good()) {
    std::fprintf(stderr, "listen_mr_scan: cannot open LCM; is there a multicast route?\n");
    return 1;
  }
  Listener listener;
  lcm.subscribe("MR_SCAN", &Listener::handle_scan, &listener);
  lcm.subscribe("MR_SCAN_INFO", &Listener::handle_info, &listener);
  while (lcm.handle() == 0) {
  }
  return 1;
}
