// The thread that owns EGL for life and answers images, one at a time.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "protocols/model.hpp"
#include "server/runtime/wall_clock.hpp"
#include "server/tick/frame_path.hpp"
#include "server/tick/outputs.hpp"

namespace parhelion::runtime {

class Painter;

class RenderThread {
 public:
  /// `building` is what the session began with, and outlives this; a frame that names another one is drawn
  /// with that.
  /// `simulates`: all frames are of a simulated camera; else none is. `nice`: how much lower than the tick's
  /// the thread's priority is. `finished`: called on the thread when an answer can be taken; may be empty.
  RenderThread(const SemanticModel& building, bool simulates, int nice, std::function<void()> finished = {});
  ~RenderThread();

  /// Live: of each camera the newest waiting job wins, the cameras in turn; the sequence of the one that it
  /// replaced is returned, if any.
  std::optional<std::uint64_t> submit_newest(tick::Outputs::Frame frame);
  /// Replay: waits until the thread is idle, then hands the job over.
  void submit(tick::Outputs::Frame frame);
  /// Until nothing is under way.
  void wait();
  /// The oldest answer not yet taken; `wait`: until there is none under way.
  std::optional<tick::FrameAnswer> take(bool wait);
  /// Why nothing can be drawn, or empty.
  std::string fault() const;

 private:
  struct Waiting {
    tick::Outputs::Frame frame;
    WallTime since;
  };
  void run(const SemanticModel& building, bool simulates, int nice);
  void note_fault(const Painter& painter);

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Waiting> waiting_;
  bool busy_ = false;
  bool stop_ = false;
  std::deque<tick::FrameAnswer> answers_;
  std::string fault_;
  const std::function<void()> finished_;
  std::thread thread_;
};

}  // namespace parhelion::runtime
