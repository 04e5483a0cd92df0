#include "server/runtime/render_thread.hpp"

#include <algorithm>
#include <utility>

#include "render/textured_camera.hpp"
#include "render/virtual_depth.hpp"
#include "server/runtime/thread_priority.hpp"
#include "server/runtime/wall_clock.hpp"

namespace parhelion::runtime {
namespace {

constexpr std::size_t kMaxWaiting = 24;  // each holds a snapshot of the world

void explain(Image& image, const std::string& reason) {
  image.metadata.push_back({"parhelion.reason", {reason.begin(), reason.end()}});
}

/// Publishes what came, with the reason.
render::RenderAnswer original(render::RenderJob job, const std::string& reason) {
  render::RenderAnswer answer;
  answer.image = std::move(job.image);
  if (!job.depth_answered) answer.depth = std::move(job.depth);
  answer.reason = reason;
  explain(answer.image.width == 0 && answer.depth ? *answer.depth : answer.image, reason);
  return answer;
}

}  // namespace

/// Renders a building's frames: a compositor, or a simulated robot's cameras. The building must outlive it.
class FrameRenderer {
 public:
  FrameRenderer(const SemanticModel& building, bool simulates, const SiteTexture* texture)
      : building_(building) {
    if (simulates) {
      take(render::create_virtual_camera(building, texture), camera_);
    } else {
      take(render::Compositor::create(building), compositor_);
    }
  }
  const std::string& fault() const { return fault_; }

  render::RenderAnswer answer(tick::Outputs::Frame& frame) {
    if (frame.exposure) return picture(frame);
    if (!frame.reason.empty()) return original(std::move(frame.job), frame.reason);
    if (!compositor_) return original(std::move(frame.job), fault_);
    render::RenderAnswer answer = compositor_->compose(frame.job);
    if (!answer.reason.empty())
      explain(answer.image.width == 0 && answer.depth ? *answer.depth : answer.image, answer.reason);
    return answer;
  }

 private:
  template <class T>
  void take(Result<std::unique_ptr<T>> made, std::unique_ptr<T>& kept) {
    if (made) {
      kept = std::move(*made);
    } else {
      fault_ = made.error().message;
    }
  }
  render::RenderAnswer picture(const tick::Outputs::Frame& frame) {
    render::RenderAnswer answer;
    answer.reason = fault_;
    const render::RenderJob& job = frame.job;
    if (camera_ && job.camera.intrinsics.width > 0) {
      answer.image =
          camera_->render(job.camera, job.T_map_optical, job.world, job.image.stamp, "", *frame.exposure);
      if (answer.image.bytes.empty()) answer.reason = "the camera's image could not be rendered";
    }
    if (job.depth_camera.intrinsics.width > 0) measure(job, *frame.exposure, answer);
    return answer;
  }
  void measure(const render::RenderJob& job, const render::Exposure& exposure, render::RenderAnswer& answer) {
    if (!depth_ && fault_.empty()) take(render::VirtualDepthCamera::create(building_), depth_);
    if (!depth_) {
      answer.reason = fault_;
      return;
    }
    Image depth = depth_->measure(job.depth_camera, job.T_map_depth, job.world, job.image.stamp,
                                  exposure.seed, exposure.sequence);
    if (depth.bytes.empty()) {
      answer.reason = "the depth camera's image could not be rendered";
    } else {
      answer.depth = std::move(depth);
    }
  }

  std::unique_ptr<render::Compositor> compositor_;
  std::unique_ptr<render::VirtualCamera> camera_;
  std::unique_ptr<render::VirtualDepthCamera> depth_;  // created at the first frame that needs it
  const SemanticModel& building_;
  std::string fault_;
};

RenderThread::RenderThread(const SemanticModel& building, bool simulates, int nice,
                           std::function<void()> finished, std::shared_ptr<const SiteTexture> texture)
    : finished_(std::move(finished)),
      texture_(std::move(texture)),
      thread_([this, &building, simulates, nice] { run(building, simulates, nice); }) {}

RenderThread::~RenderThread() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

std::optional<std::uint64_t> RenderThread::submit_newest(tick::Outputs::Frame frame) {
  const std::lock_guard lock(mutex_);
  std::optional<std::uint64_t> dropped;
  auto place = std::find_if(waiting_.begin(), waiting_.end(), [&](const Waiting& each) {
    return each.frame.agent == frame.agent && each.frame.robot == frame.robot &&
           each.frame.camera == frame.camera;
  });
  if (place == waiting_.end() && waiting_.size() == kMaxWaiting) {
    dropped = waiting_.front().frame.sequence;
    waiting_.pop_front();
    place = waiting_.end();
  }
  if (place == waiting_.end()) {
    waiting_.push_back({std::move(frame), steady_now()});
  } else {
    dropped = place->frame.sequence;
    *place = {std::move(frame), steady_now()};
  }
  changed_.notify_all();
  return dropped;
}

void RenderThread::submit(tick::Outputs::Frame frame) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return waiting_.empty() && !busy_; });
  waiting_.push_back({std::move(frame), steady_now()});
  changed_.notify_all();
}

void RenderThread::wait() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return waiting_.empty() && !busy_; });
}

std::optional<tick::FrameAnswer> RenderThread::take(bool wait) {
  std::unique_lock lock(mutex_);
  if (wait) changed_.wait(lock, [this] { return !answers_.empty() || (waiting_.empty() && !busy_); });
  if (answers_.empty()) return std::nullopt;
  tick::FrameAnswer answer = std::move(answers_.front());
  answers_.pop_front();
  return answer;
}

std::string RenderThread::fault() const {
  const std::lock_guard lock(mutex_);
  return fault_;
}

void RenderThread::note_fault(const FrameRenderer& renderer) {
  const std::lock_guard lock(mutex_);
  fault_ = renderer.fault();
}

void RenderThread::run(const SemanticModel& building, bool simulates, int nice) {
  lower_priority(nice);
  auto renderer = std::make_unique<FrameRenderer>(building, simulates, texture_.get());
  note_fault(*renderer);
  std::shared_ptr<const SemanticModel> model;
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return stop_ || !waiting_.empty(); });
    if (waiting_.empty()) return;  // all submitted jobs are finished before the end
    auto [frame, since] = std::move(waiting_.front());
    waiting_.pop_front();
    busy_ = true;
    lock.unlock();
    if (frame.model != nullptr && frame.model != model) {
      model = frame.model;
      renderer.reset();  // destroy its EGL context before creating another one
      renderer = std::make_unique<FrameRenderer>(*model, simulates, texture_.get());
      note_fault(*renderer);
    }
    tick::FrameAnswer done{frame.agent,
                           frame.robot,
                           frame.camera,
                           frame.sequence,
                           frame.exposure.has_value(),
                           renderer->answer(frame),
                           {}};
    done.latency = steady_now() - since;
    lock.lock();
    busy_ = false;
    answers_.push_back(std::move(done));
    changed_.notify_all();
    if (!finished_) continue;
    lock.unlock();
    finished_();
    lock.lock();
  }
}

}  // namespace parhelion::runtime
