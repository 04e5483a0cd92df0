// Connections of peers that have not shown a log-in yet. They may hold only a part of the server's
// connections, and give way to newer ones: whoever is logged in always gets in.
#pragma once

#include <list>
#include <map>
#include <string>
#include <tuple>

namespace parhelion::station::net {

class Stranger {
 public:
  virtual ~Stranger() = default;
  /// No request of it is being answered.
  virtual bool idle() const = 0;
  /// Closes it; it no longer counts.
  virtual void dismiss() = 0;
};

/// Used on the server's thread.
class Strangers {
 public:
  void add(Stranger& stranger, const std::string& network) {
    all_.push_back({&stranger, network});
    ++by_network_[network];
  }
  /// Nothing happens if it was removed before.
  void remove(const Stranger& stranger) {
    for (auto entry = all_.begin(); entry != all_.end(); ++entry) {
      if (entry->stranger != &stranger) continue;
      const auto count = by_network_.find(entry->network);
      if (--count->second == 0) by_network_.erase(count);
      all_.erase(entry);
      return;
    }
  }
  std::size_t count() const { return all_.size(); }

  /// The one that gives way: of the network that has the most, an idle one before a busy one, and the oldest
  /// of those. `network`: only of this one; empty: of all. Null: there is none.
  Stranger* first_to_go(const std::string& network = {}) const {
    Stranger* chosen = nullptr;
    std::tuple<std::size_t, bool> reason;
    for (const Entry& entry : all_) {
      if (!network.empty() && entry.network != network) continue;
      const std::tuple<std::size_t, bool> own{by_network_.at(entry.network), entry.stranger->idle()};
      if (chosen != nullptr && own <= reason) continue;
      chosen = entry.stranger;
      reason = own;
    }
    return chosen;
  }

 private:
  struct Entry {
    Stranger* stranger;
    std::string network;
  };
  std::list<Entry> all_;  ///< the oldest first
  std::map<std::string, std::size_t> by_network_;
};

}  // namespace parhelion::station::net
