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
#include "server/outputs.hpp"

namespace parhelion {

/// One image's answer. Where EGL is not there, the original with the reason; of a simulated camera then an
/// image without bytes.
struct FrameAnswer {
  std::string agent;  ///< whose camera; empty: of the trainee's robot
  std::uint64_t sequence = 0;
  bool simulated = false;  ///< the picture of a simulated camera, bodies and all
  RenderAnswer answer;
  Duration latency;  ///< from submit() to the answer, measured
};

class Painter;

class RenderThread {
 public:
  /// `building` is what the session began with, and outlives this; a frame that names another one is drawn
  /// with that.
  /// `simulates`: all frames are of a simulated camera; else none is. `nice`: how much lower than the tick's
  /// the thread's priority is.
  RenderThread(const SemanticModel& building, bool simulates, int nice);
  ~RenderThread();

  /// Live: of each camera the newest waiting job wins, the cameras in turn; the sequence of the one that it
  /// replaced is returned, if any.
  std::optional<std::uint64_t> submit_newest(Outputs::Frame frame);
  /// Replay: waits until the thread is idle, then hands the job over.
  void submit(Outputs::Frame frame);
  /// Until nothing is under way.
  void wait();
  /// The oldest answer not yet taken; `wait`: until there is none under way.
  std::optional<FrameAnswer> take(bool wait);
  /// Why nothing can be drawn, or empty.
  std::string fault() const;

 private:
  struct Waiting {
    Outputs::Frame frame;
    WallTime since;
  };
  void run(const SemanticModel& building, bool simulates, int nice);
  void note_fault(const Painter& painter);

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Waiting> waiting_;
  bool busy_ = false;
  bool stop_ = false;
  std::deque<FrameAnswer> answers_;
  std::string fault_;
  std::thread thread_;
};

}  // namespace parhelion
