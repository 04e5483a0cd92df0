// Threads that share independent jobs with the caller's own.
#pragma once

#include <functional>
#include <memory>

namespace parhelion {

/// `size` threads, the caller's among them; the others sleep between calls.
class Crew {
 public:
  explicit Crew(int size);
  ~Crew();
  Crew(const Crew&) = delete;
  Crew& operator=(const Crew&) = delete;

  int size() const;
  /// Calls job(i, worker) for each i of [0, jobs), in any order, `worker` of [0, size()) being the same for
  /// no two at once, and returns when all are done. The first exception that one threw is thrown here.
  void run(int jobs, const std::function<void(int job, int worker)>& job);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace parhelion
