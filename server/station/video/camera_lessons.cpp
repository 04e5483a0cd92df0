#include "server/station/video/camera_lessons.hpp"

#include <algorithm>

#include "protocols/lesson.hpp"

namespace parhelion::station {
namespace {

const std::string late = to_string(Lesson::Kind::camera_delay), lost = to_string(Lesson::Kind::camera_loss);

}  // namespace

bool CameraLessons::hear(const Event& event) {
  if (event.object != late && event.object != lost) return false;
  const std::pair<std::string, double> lesson{event.object, event.value};
  if (event.kind == EventKind::lesson_started) {
    held_.push_back(lesson);
    return true;
  }
  if (event.kind != EventKind::lesson_ended) return false;
  const auto ended = std::find(held_.begin(), held_.end(), lesson);
  if (ended != held_.end()) held_.erase(ended);
  return true;
}

double CameraLessons::delay() const {
  double longest = 0;
  for (const auto& [kind, amount] : held_) {
    if (kind == late) longest = std::max(longest, amount);
  }
  return longest;
}

double CameraLessons::loss() const {
  double kept = 1;
  for (const auto& [kind, amount] : held_) {
    if (kind == lost) kept *= 1 - amount;
  }
  return 1 - kept;
}

}  // namespace parhelion::station
