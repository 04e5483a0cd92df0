#include "server/render_thread.hpp"

#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <utility>

#include "server/wall_clock.hpp"

namespace parhelion {
namespace {

RenderAnswer original(Image image, const std::string& reason) {
  RenderAnswer answer;
  image.metadata.push_back({"parhelion.reason", {reason.begin(), reason.end()}});
  answer.image = std::move(image);
  answer.reason = reason;
  return answer;
}

RenderAnswer compose(Compositor* compositor, Outputs::Frame& frame, const std::string& fault) {
  if (!frame.reason.empty()) return original(std::move(frame.job.image), frame.reason);
  if (compositor == nullptr) return original(std::move(frame.job.image), fault);
  RenderAnswer answer = compositor->compose(frame.job);
  if (!answer.reason.empty()) answer.image = original(std::move(answer.image), answer.reason).image;
  return answer;
}

}  // namespace

RenderThread::RenderThread(SemanticModel building, int nice)
    : thread_([this, building = std::move(building), nice] { run(building, nice); }) {}

RenderThread::~RenderThread() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

std::optional<std::uint64_t> RenderThread::submit_newest(Outputs::Frame frame) {
  const std::lock_guard lock(mutex_);
  std::optional<std::uint64_t> dropped;
  if (waiting_) dropped = waiting_->sequence;
  waiting_ = std::move(frame);
  waiting_since_ = steady_now();
  changed_.notify_all();
  return dropped;
}

void RenderThread::submit(Outputs::Frame frame) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return !waiting_ && !busy_; });
  waiting_ = std::move(frame);
  waiting_since_ = steady_now();
  changed_.notify_all();
}

void RenderThread::wait() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return !waiting_ && !busy_; });
}

std::optional<FrameAnswer> RenderThread::take(bool wait) {
  std::unique_lock lock(mutex_);
  if (wait) changed_.wait(lock, [this] { return !answers_.empty() || (!waiting_ && !busy_); });
  if (answers_.empty()) return std::nullopt;
  FrameAnswer answer = std::move(answers_.front());
  answers_.pop_front();
  return answer;
}

std::string RenderThread::fault() const {
  const std::lock_guard lock(mutex_);
  return fault_;
}

std::unique_ptr<Compositor> RenderThread::compositor_of(const SemanticModel& building) {
  auto made = Compositor::create(building);
  const std::lock_guard lock(mutex_);
  fault_ = made ? "" : made.error().message;
  return made ? std::move(*made) : nullptr;
}

void RenderThread::run(const SemanticModel& building, int nice) {
  setpriority(PRIO_PROCESS, static_cast<id_t>(syscall(SYS_gettid)), nice);
  std::unique_ptr<Compositor> compositor = compositor_of(building);
  std::shared_ptr<const SemanticModel> model;
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return stop_ || waiting_.has_value(); });
    if (!waiting_) return;  // what was submitted is answered before the end
    Outputs::Frame frame = std::move(*waiting_);
    waiting_.reset();
    const WallTime since = waiting_since_;
    busy_ = true;
    lock.unlock();
    if (frame.model != nullptr && frame.model != model) {
      model = frame.model;
      compositor.reset();  // its context goes before another one is made
      compositor = compositor_of(*model);
    }
    const std::string fault = this->fault();
    FrameAnswer done{frame.sequence, compose(compositor.get(), frame, fault), {}};
    done.latency = steady_now() - since;
    lock.lock();
    busy_ = false;
    answers_.push_back(std::move(done));
    changed_.notify_all();
  }
}

}  // namespace parhelion
