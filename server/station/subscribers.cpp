#include "server/station/subscribers.hpp"

#include <algorithm>

namespace parhelion::station {

void Subscribers::open(std::shared_ptr<WebClient> client) {
  subscribers_.emplace_back();
  subscribers_.back().client = std::move(client);
}

void Subscribers::close(std::uint64_t id) {
  std::erase_if(subscribers_, [&](const Subscriber& subscriber) { return subscriber.client->id() == id; });
}

Subscriber* Subscribers::find(std::uint64_t id) {
  const auto found =
      std::find_if(subscribers_.begin(), subscribers_.end(),
                   [&](const Subscriber& subscriber) { return subscriber.client->id() == id; });
  return found == subscribers_.end() ? nullptr : &*found;
}

void Subscribers::send_to_all(std::string text, int slot) const {
  if (subscribers_.empty()) return;
  const SharedText shared = shared_text(std::move(text));
  for (const Subscriber& subscriber : subscribers_) subscriber.client->send(shared, false, slot);
}

void Subscribers::send_to_robot(std::size_t robot, std::string text, int slot) const {
  const SharedText shared = shared_text(std::move(text));
  for (const Subscriber& subscriber : subscribers_)
    if (subscriber.robot == robot) subscriber.client->send(shared, false, slot);
}

}  // namespace parhelion::station
