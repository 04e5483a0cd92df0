// A thread that advances a player by the wall clock.
#pragma once

#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

#include "server/runtime/play/player.hpp"

namespace parhelion::tools {

class PlayThread {
 public:
  /// The player must outlive it.
  explicit PlayThread(runtime::Player& player) : player_(player) {}
  ~PlayThread();
  PlayThread(const PlayThread&) = delete;
  PlayThread& operator=(const PlayThread&) = delete;

  /// Call once, after all receivers have subscribed.
  void start();
  /// Advances it now, after a control was used.
  void wake();
  std::string fault() const;  ///< the reason why it has ended, or empty

 private:
  void run(const std::stop_token& stop);

  runtime::Player& player_;
  mutable std::mutex mutex_;
  std::condition_variable_any woken_;
  bool awake_ = false;
  std::string fault_;
  std::jthread thread_;
};

}  // namespace parhelion::tools
