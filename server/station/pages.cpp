#include "server/station/pages.hpp"

#include <algorithm>

namespace parhelion::station {

void Pages::open(std::shared_ptr<WebClient> client) {
  pages_.emplace_back();
  pages_.back().client = std::move(client);
}

void Pages::close(std::uint64_t id) {
  std::erase_if(pages_, [&](const Page& page) { return page.client->id() == id; });
}

Page* Pages::find(std::uint64_t id) {
  const auto found =
      std::find_if(pages_.begin(), pages_.end(), [&](const Page& page) { return page.client->id() == id; });
  return found == pages_.end() ? nullptr : &*found;
}

void Pages::tell(std::string text, int slot) const {
  if (pages_.empty()) return;
  const PageText shared = page_text(std::move(text));
  for (const Page& page : pages_) page.client->send(shared, false, slot);
}

}  // namespace parhelion::station
