// A bounded queue in which senders take turns, so that one that floods displaces and delays only itself. The
// turns are those of deficit round robin (Shreedhar and Varghese 1996) with items of equal cost.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <utility>
#include <vector>

namespace parhelion::runtime {

/// Items of one sender stay in order. Senders are numbered as in Message::sender.
template <class Item>
class FairQueue {
 public:
  /// Limits of all senders together.
  FairQueue(std::size_t max_items, std::size_t max_bytes) : max_items_(max_items), max_bytes_(max_bytes) {}

  /// Returns what had no room: the newest items of the sender that has the most, which may be the new one.
  std::vector<Item> push(std::uint64_t sender, Item item, std::size_t bytes) {
    Line& line = lines_[sender];
    line.items.push_back({std::move(item), bytes});
    line.bytes += bytes;
    bytes_ += bytes;
    ++items_;
    std::vector<Item> displaced;
    while (items_ > max_items_) displaced.push_back(take_newest(&Line::size));
    while (bytes_ > max_bytes_) displaced.push_back(take_newest(&Line::weight));
    return displaced;
  }

  /// The oldest item of the sender whose turn it is; nullopt: there is none.
  std::optional<Item> pop() {
    if (lines_.empty()) return std::nullopt;
    auto line = lines_.upper_bound(served_);
    if (line == lines_.end()) line = lines_.begin();
    served_ = line->first;
    return take(line, true);
  }

  /// Takes the oldest items of each sender for which `wanted(item)`, until one of his is not.
  template <class Wanted>
  std::vector<Item> take_oldest(const Wanted& wanted) {
    std::vector<Item> taken;
    for (auto line = lines_.begin(); line != lines_.end();) {
      const auto next = std::next(line);
      for (std::size_t left = line->second.items.size(); left > 0 && wanted(line->second.items.front().first);
           --left)
        taken.push_back(take(line, true));
      line = next;
    }
    return taken;
  }

  bool empty() const { return items_ == 0; }
  std::size_t size() const { return items_; }

 private:
  struct Line {
    std::size_t size() const { return items.size(); }
    std::size_t weight() const { return bytes; }
    std::deque<std::pair<Item, std::size_t>> items;
    std::size_t bytes = 0;
  };
  using Lines = std::map<std::uint64_t, Line>;

  Item take_newest(std::size_t (Line::*amount)() const) {
    auto longest = lines_.begin();
    for (auto line = lines_.begin(); line != lines_.end(); ++line)
      if ((line->second.*amount)() > (longest->second.*amount)()) longest = line;
    return take(longest, false);
  }

  /// Erases the sender that has no more.
  Item take(typename Lines::iterator line, bool oldest) {
    auto& items = line->second.items;
    auto [item, bytes] = std::move(oldest ? items.front() : items.back());
    if (oldest) {
      items.pop_front();
    } else {
      items.pop_back();
    }
    line->second.bytes -= bytes;
    bytes_ -= bytes;
    --items_;
    if (items.empty()) lines_.erase(line);
    return std::move(item);
  }

  const std::size_t max_items_, max_bytes_;
  Lines lines_;
  std::uint64_t served_ = 0;  // the last sender
  std::size_t items_ = 0, bytes_ = 0;
};

}  // namespace parhelion::runtime
