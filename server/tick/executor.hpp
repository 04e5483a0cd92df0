// Runs independent jobs. The tick starts no thread itself: the caller of make_state() passes the executor.
#pragma once

#include <functional>

namespace parhelion::tick {

class Executor {
 public:
  virtual ~Executor() = default;
  /// Number of concurrent jobs, at least 1.
  virtual int size() const = 0;
  /// Calls job(i, worker) for each i of [0, jobs), in any order, and returns when all are done; `worker` of
  /// [0, size()) is unique among concurrent jobs. Rethrows the first exception of a job.
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
