// Reads a session's messages into a review. Private to this module. Its parts: gathering.cpp (from the header
// to the result), gathering_messages.cpp (each kind of message).
#pragma once

#include <cmath>
#include <map>
#include <optional>
#include <string>

#include "server/review/nearest_return.hpp"
#include "server/review/review.hpp"
#include "server/runtime/trainee_view.hpp"

namespace parhelion::review {

/// Call take() with every message, in the log's order.
class Gathering {
 public:
  Gathering(const std::string& path, const ReviewLimits& limits, Reader reader, std::string robot);

  Status take(Message& message);
  Result<SessionReview> result(std::uint64_t skipped_bytes);

 private:
  using Handler = Status (Gathering::*)(Message&);

  Status begin(const Message& message);
  Status choose_robot();
  void listen(const std::string& canonical, Handler handler) {
    handlers_[configuration_->channels.bus(canonical, robot_.value_or(0))] = handler;
  }
  void listen_to_robot(std::size_t robot);
  Status grade(const Message& message);
  Status event(Message& message);
  Status world(Message& message);
  Status scan(Message& message);
  Status scan_info(Message& message);
  Status further_scan_info(Message& message);
  Status asked(Message& message);
  Status given(Message& message);
  Status picture(Message& message);
  Status loop(Message& message);
  Status spawn(Message& message);
  Status real_scan(Message& message) { return delay("delay_scan", message); }
  Status real_picture(Message& message) { return delay("delay_camera", message); }

  Status delay(const char* name, const Message& message);
  bool for_trainee() const { return reader_ == Reader::trainee; }
  void begin_knowledge();
  bool senses(const std::string& entity) const;
  void leave_out_what_was_not_sensed();
  void measure_nearest();
  void follow(const WorldMessage::Entry& body, double t);
  void attitude(const WorldMessage::Entry& body, double t, bool known);
  void list(Event&& event);
  void add(const std::string& name, double t, double value) {
    if (!std::isfinite(value)) return;  // skips missing values
    review_.series.try_emplace(name, limits_.windows).first->second.add(t, value);
  }
  double at(ArrivalTime arrival) { return seen(simulation_time(arrival)); }
  double seen(SimulationTime stamp) {
    const double t = (stamp - review_.begin).seconds();
    review_.duration = std::max(review_.duration, t);
    return t;
  }

  ReviewLimits limits_;
  Reader reader_;
  std::string path_;
  runtime::SessionGrading grading_;
  bool graded_ = true, ended_ = false;
  const tick::Configuration* configuration_ = nullptr;
  std::optional<std::size_t> robot_;  // none: an agent is graded
  std::map<std::string, Handler, std::less<>> handlers_;
  SessionReview review_;
  std::optional<NearestReturn> nearest_;
  PictureChoice pictures_;
  std::size_t handled_deductions_ = 0;
  WorldMessage world_;
  Scan scan_;
  ScanInfo info_;
  bool have_scan_ = false, have_info_ = false;
  std::map<std::string, Trail, std::less<>> trails_;
  std::map<std::string, std::uint32_t, std::less<>> epochs_;
  std::map<EventKind, std::size_t> listed_;
  // Of a trainee's review.
  std::optional<simulation::EntityShapes> shapes_;
  std::optional<runtime::Knowledge> knowledge_;
  std::optional<runtime::TraineeView> view_;
};

}  // namespace parhelion::review
