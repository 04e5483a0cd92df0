// Restarts a server that dies, for as long as nobody stops it, and stops its robot in between.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "server/runtime/loop.hpp"
#include "tools/command.hpp"

namespace parhelion::tools {

/// Shared by the supervisor and the server processes, one after the other: what a server leaves to the next.
/// A server may die at any instruction, so each text is marked as valid only while it is whole.
class ServerMemory {
 public:
  std::atomic<bool> begun = false;  ///< a session has begun
  std::atomic<bool> ended = false;  ///< a session has ended as it should
  /// A bit for each robot, by its index, whose emergency stop is active. Used if the state folder is not
  /// writable.
  std::atomic<std::uint32_t> robots_stopped = 0;

  void set_robot_stops(const std::vector<runtime::RobotStop>& stops);
  /// Of the robots that were commanded.
  std::vector<runtime::RobotStop> robot_stops() const;
  void set_robot(const std::string& yaml) { robot_.set(yaml); }
  /// The last descriptions that a server used, as tick::to_yaml_documents(); empty: none.
  std::string robot() const { return robot_.get(); }

 private:
  template <std::size_t Size>
  class Text {
   public:
    /// A longer text is not kept.
    void set(const std::string& text) {
      size_.store(0, std::memory_order_release);
      if (text.size() > Size) return;
      std::copy(text.begin(), text.end(), bytes_.begin());
      size_.store(text.size(), std::memory_order_release);
    }
    std::string get() const { return {bytes_.data(), size_.load(std::memory_order_acquire)}; }

   private:
    std::atomic<std::size_t> size_ = 0;
    std::array<char, Size> bytes_{};
  };

  Text<32768> stops_;  // for each robot a line each: both channels, then the joints; then an empty line
  Text<std::size_t{1} << 20> robot_;
};

struct Supervision {
  /// Runs one server in the new process. `attempt`: 0 for the first.
  std::function<Exit(int attempt, ServerMemory& memory)> serve;
  /// Sends the stop of a robot, in the supervisor's process; called when a server has died.
  std::function<void(const runtime::RobotStop&)> stop_robot;
  /// Messages for people.
  std::function<void(const std::string&)> notify;
};

/// The server is forked, so call it before any thread is started. Five deaths in a row are answered at once,
/// later ones after 0.1 s and twice as long each time, 1 s at most; ten seconds of service count as a new
/// start. The supervision ends with a session that ends as it should, and where the first one cannot begin.
/// Whatever else ends a server may be gone a second later: a full disk, a network that is down.
Exit supervise(const Supervision& supervision);

/// The log of the restarted server: "<stem>-2.lcm", "<stem>-3.lcm", ... beside the one that is kept; the
/// first that does not exist.
std::string session_after(const std::string& session);

}  // namespace parhelion::tools
