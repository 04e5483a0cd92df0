// The pages that are open on /ws/state, and messages to them.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "protocols/time.hpp"
#include "server/station/client_messages.hpp"
#include "server/station/http/web_client.hpp"

namespace parhelion::station {

/// Encoded once, for all pages.
using SharedText = std::shared_ptr<const std::string>;
inline SharedText shared_text(std::string text) {
  return std::make_shared<const std::string>(std::move(text));
}

/// Slots of WebClient::send for messages with a complete state, of which only the newest matters.
namespace send_slot {
inline constexpr int kWorld = 0, kRealScan = 1, kAugmentedScan = 2, kPoints = 3, kStatus = 4, kInjection = 5,
                     kPose = 6, kScore = 7, kOperators = 8, kControl = 9, kPlans = 10, kHazard = 11,
                     kJoints = 12, kRobots = 13, kPeople = 14, kKnown = 15;
inline constexpr int kAgentScan = 64;  ///< first of a range: one slot for each agent scan that a page
                                       ///< subscribes to
}  // namespace send_slot

struct Subscriber {
  std::shared_ptr<WebClient> client;
  Subscription wants;
  std::size_t robot = 0;   ///< index of wants.robot
  std::string view;        ///< what it is shown; see Audience
  WallTime world_due;      ///< steady clock: time of the next world message
  double allowance = 100;  ///< tokens of the rate limiter: messages that it may send at once; refilled over
                           ///< time
  WallTime allowance_at;   ///< time of the last refill
};

/// Not thread-safe.
class Subscribers {
 public:
  void open(std::shared_ptr<WebClient> client);
  void close(std::uint64_t id);
  /// nullptr: closed.
  Subscriber* find(std::uint64_t id);
  std::vector<Subscriber>& all() { return subscribers_; }
  const std::vector<Subscriber>& all() const { return subscribers_; }
  bool empty() const { return subscribers_.empty(); }

 private:
  std::vector<Subscriber> subscribers_;
};

}  // namespace parhelion::station
