#include "server/station/video/camera_faults.hpp"

#include <algorithm>

#include "protocols/fault.hpp"

namespace parhelion::station {
namespace {

const std::string kLate = to_string(Fault::Kind::camera_delay), kLost = to_string(Fault::Kind::camera_loss);

}  // namespace

bool CameraFaults::handle(const Event& event) {
  if (event.object != kLate && event.object != kLost) return false;
  const std::pair<std::string, double> fault{event.object, event.value};
  if (event.kind == EventKind::fault_started) {
    held_.push_back(fault);
    return true;
  }
  if (event.kind != EventKind::fault_ended) return false;
  const auto ended = std::find(held_.begin(), held_.end(), fault);
  if (ended != held_.end()) held_.erase(ended);
  return true;
}

double CameraFaults::delay() const {
  double longest = 0;
  for (const auto& [kind, amount] : held_) {
    if (kind == kLate) longest = std::max(longest, amount);
  }
  return longest;
}

double CameraFaults::loss() const {
  double kept = 1;
  for (const auto& [kind, amount] : held_) {
    if (kind == kLost) kept *= 1 - amount;
  }
  return 1 - kept;
}

}  // namespace parhelion::station
