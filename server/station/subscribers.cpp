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

}  // namespace parhelion::station
