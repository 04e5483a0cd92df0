// Distributes independent jobs over threads, including the caller's.
#pragma once

#include <functional>
#include <memory>

#include "server/tick/executor.hpp"

namespace parhelion::runtime {

/// `size` threads including the caller's; the others sleep between calls.
class ThreadPool : public tick::Executor {
 public:
  explicit ThreadPool(int size);
  ~ThreadPool() override;
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  int size() const override;
  void run(int jobs, const std::function<void(int job, int worker)>& job) override;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace parhelion::runtime
