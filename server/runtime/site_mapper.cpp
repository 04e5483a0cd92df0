#include "server/runtime/site_mapper.hpp"

#include <exception>
#include <utility>

#include "server/runtime/thread_priority.hpp"
#include "server/runtime/wall_clock.hpp"

namespace parhelion::runtime {

SensorTime stamp_of(const SiteView& view) {
  if (const auto* depth = std::get_if<PlacedDepth>(&view)) return depth->depth.stamp;
  return std::get<LineView>(view).lines.back().line.stamp;
}

SiteMapper::SiteMapper(UpdateSite update, const tick::Configuration& configuration, int nice)
    : update_(std::move(update)), configuration_(configuration), thread_([this, nice] { run(nice); }) {}

SiteMapper::~SiteMapper() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void SiteMapper::submit(SiteView view) {
  {
    const std::lock_guard lock(mutex_);
    ++counts_.views;
    if (waiting_.size() == kCapacity) {
      waiting_.pop_front();
      ++counts_.dropped;
    }
    waiting_.push_back({std::move(view), steady_now()});
  }
  changed_.notify_all();
}

std::optional<SiteMapper::Ready> SiteMapper::take() {
  const std::lock_guard lock(mutex_);
  if (ready_.empty()) return std::nullopt;
  Ready ready = std::move(ready_.front());
  ready_.pop_front();
  return ready;
}

SiteMapper::Counts SiteMapper::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

/// Reads the model back from its YAML, so that the live session and its replay use the same one.
Result<std::optional<SiteMapper::Ready>> SiteMapper::make(const SiteView& view, std::uint64_t version) const {
  auto model = update_(view);
  if (!model) return model.error();
  if (!*model) return std::optional<Ready>();
  Ready ready;
  ready.message = {stamp_of(view), version, to_yaml(**model)};
  auto prepared = tick::prepare_model(ready.message, configuration_);
  if (!prepared) return prepared.error();
  ready.prepared = std::move(*prepared);
  return std::optional(std::move(ready));
}

std::string to_text(const SiteMapper::Counts& counts) {
  return std::to_string(counts.views) + " views, " + std::to_string(counts.models) + " models, " +
         std::to_string(counts.dropped) + " dropped, " + std::to_string(counts.refused) + " refused" +
         (counts.last_refusal.empty() ? "" : " (" + counts.last_refusal + ")");
}

void SiteMapper::run(int nice) {
  lower_priority(nice);
  std::uint64_t version = 1;
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return stop_ || !waiting_.empty(); });
    if (stop_) return;
    const Waiting next = std::move(waiting_.back());
    waiting_.pop_back();
    lock.unlock();
    Result<std::optional<Ready>> made = std::optional<Ready>();
    try {
      made = make(next.view, version);
    } catch (const std::exception& fault) {
      made = Error{fault.what()};
    }
    lock.lock();
    if (!made) {
      ++counts_.refused;
      counts_.last_refusal = made.error().message;
    } else if (*made) {
      (*made)->latency = steady_now() - next.since;
      ready_.push_back(std::move(**made));
      ++counts_.models;
      ++version;
    }
  }
}

}  // namespace parhelion::runtime
