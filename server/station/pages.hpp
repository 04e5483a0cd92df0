// The pages that are open on /ws/state, and messages to them.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "protocols/time.hpp"
#include "server/station/http/web_client.hpp"
#include "server/station/page_messages.hpp"

namespace parhelion::station {

/// Encoded once, for all pages.
using PageText = std::shared_ptr<const std::string>;
inline PageText page_text(std::string text) { return std::make_shared<const std::string>(std::move(text)); }

/// Slots of WebClient::send for messages with a complete state, of which only the newest matters.
namespace page_slot {
inline constexpr int world = 0, real_scan = 1, mixed_scan = 2, points = 3, status = 4, injection = 5,
                     pose = 6, score = 7, operators = 8, control = 9, plans = 10, hazard = 11, joints = 12;
inline constexpr int agent_scan = 64;  ///< first of a range: one slot for each agent scan that a page
                                       ///< subscribes to
}  // namespace page_slot

struct Page {
  std::shared_ptr<WebClient> client;
  Subscription wants;
  WallTime world_due;      ///< steady clock: time of the next world message
  double allowance = 100;  ///< tokens of the rate limiter: messages that it may send at once; refilled over
                           ///< time
  WallTime allowance_at;   ///< time of the last refill
};

/// Not thread-safe.
class Pages {
 public:
  void open(std::shared_ptr<WebClient> client);
  void close(std::uint64_t id);
  /// nullptr: closed.
  Page* find(std::uint64_t id);
  std::vector<Page>& all() { return pages_; }
  const std::vector<Page>& all() const { return pages_; }
  bool empty() const { return pages_.empty(); }

  /// Sends text to all pages.
  void tell(std::string text, int slot = WebClient::in_order) const;

 private:
  std::vector<Page> pages_;
};

}  // namespace parhelion::station
