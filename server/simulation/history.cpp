#include "server/simulation/history.hpp"

#include <algorithm>

namespace parhelion::simulation {
namespace {

BodyState extrapolate(const BodyState& state, double dt) {
  BodyState next = state;
  Eigen::Quaterniond rotation = state.T_map_body.quaternion();
  const double angle = state.rotation_rate.norm() * dt;
  if (angle > 0) {
    rotation = Eigen::Quaterniond(Eigen::AngleAxisd(angle, state.rotation_rate.normalized())) * rotation;
  }
  next.T_map_body = Transform<Map, Body>(rotation, state.T_map_body.translation() + dt * state.velocity);
  return next;
}

BodyState between(const BodyState& a, const BodyState& b, double s) {
  BodyState state = a;
  // Most bodies are at rest.
  if (a.T_map_body.isometry().matrix() != b.T_map_body.isometry().matrix())
    state.T_map_body = interpolate(a.T_map_body, b.T_map_body, s);
  state.velocity += s * (b.velocity - a.velocity);
  state.rotation_rate += s * (b.rotation_rate - a.rotation_rate);
  return state;
}

}  // namespace

HistoryRecord& History::push() {
  HistoryRecord& record = ring_[next_];
  next_ = (next_ + 1) % ring_.size();
  size_ = std::min(size_ + 1, ring_.size());
  record.bodies.clear();
  return record;
}

const HistoryRecord* History::record_at(SimulationTime t, Duration ahead) const {
  if (size_ == 0 || t > newest().stamp + ahead || t < from_newest(size_ - 1).stamp) return nullptr;
  // Stamps ascend from the oldest to the newest: the smallest `back` whose stamp is at or before t.
  std::size_t low = 0, high = size_ - 1;
  while (low < high) {
    const std::size_t middle = (low + high) / 2;
    if (from_newest(middle).stamp <= t)
      high = middle;
    else
      low = middle + 1;
  }
  return &from_newest(low);
}

const HistoryRecord* History::find(SimulationTime t, Duration ahead, std::vector<BodyState>& bodies) const {
  const HistoryRecord* record = record_at(t, ahead);
  if (!record) return nullptr;
  if (record->stamp == t) {
    bodies.insert(bodies.end(), record->bodies.begin(), record->bodies.end());
    return record;
  }
  if (record == &newest()) {
    const double dt = (t - record->stamp).seconds();
    for (const BodyState& body : record->bodies) bodies.push_back(extrapolate(body, dt));
    return record;
  }
  const auto place = static_cast<std::size_t>(record - ring_.data());
  const HistoryRecord& later = ring_[(place + 1) % ring_.size()];
  const double s = (t - record->stamp).seconds() / (later.stamp - record->stamp).seconds();
  auto other = later.bodies.begin();
  for (const BodyState& body : record->bodies) {
    while (other != later.bodies.end() && other->id < body.id) ++other;
    const bool same = other != later.bodies.end() && other->id == body.id && other->epoch == body.epoch;
    bodies.push_back(same ? between(body, *other, s) : body);
  }
  return record;
}

}  // namespace parhelion::simulation
