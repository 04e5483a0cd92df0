// The thread that owns EGL for its lifetime and renders images, one at a time.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "protocols/model.hpp"
#include "protocols/site_texture.hpp"
#include "server/runtime/wall_clock.hpp"
#include "server/tick/frame_path.hpp"
#include "server/tick/outputs.hpp"

namespace parhelion::runtime {

class FrameRenderer;

class RenderThread {
 public:
  /// `building` is that of the session's start, and must outlive this; a frame can name another one.
  /// `simulates`: all frames are of a simulated camera, otherwise none. `nice`: the thread's niceness
  /// relative to the tick. `finished`: called on the thread when a result can be taken; may be empty.
  /// `texture`: how simulated cameras show the site; may be null.
  RenderThread(const SemanticModel& building, bool simulates, int nice, std::function<void()> finished = {},
               std::shared_ptr<const SiteTexture> texture = nullptr);
  ~RenderThread();

  /// Live: keeps the newest waiting job of each camera and serves the cameras in turn; returns the sequence
  /// of the replaced job, if any.
  std::optional<std::uint64_t> submit_newest(tick::Outputs::Frame frame);
  /// Replay: waits until the thread is idle, then submits the job.
  void submit(tick::Outputs::Frame frame);
  /// Waits until no job is in progress.
  void wait();
  /// The oldest result not yet taken; `wait`: blocks while a job is in progress.
  std::optional<tick::FrameAnswer> take(bool wait);
  /// Why nothing can be rendered, or empty.
  std::string fault() const;

 private:
  struct Waiting {
    tick::Outputs::Frame frame;
    WallTime since;
  };
  void run(const SemanticModel& building, bool simulates, int nice);
  void note_fault(const FrameRenderer& renderer);

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Waiting> waiting_;
  bool busy_ = false;
  bool stop_ = false;
  std::deque<tick::FrameAnswer> answers_;
  std::string fault_;
  const std::function<void()> finished_;
  const std::shared_ptr<const SiteTexture> texture_;
  std::thread thread_;
};

}  // namespace parhelion::runtime
