// Runs independent jobs. The tick starts no thread itself: whoever makes its state hands it what runs its
// jobs.
#pragma once

#include <functional>

namespace parhelion::tick {

class Executor {
 public:
  virtual ~Executor() = default;
  /// How many jobs run at once, at least 1.
  virtual int size() const = 0;
  /// Calls job(i, worker) for each i of [0, jobs), in any order, `worker` of [0, size()) being the same for
  /// no two at once, and returns when all are done. The first exception that one threw is thrown here.
  virtual void run(int jobs, const std::function<void(int job, int worker)>& job) = 0;
};

/// One after another, on the caller's thread.
class SerialExecutor : public Executor {
 public:
  int size() const override { return 1; }
  void run(int jobs, const std::function<void(int job, int worker)>& job) override {
    for (int i = 0; i < jobs; ++i) job(i, 0);
  }
};

}  // namespace parhelion::tick
