#include "fusion/cloud/parallel.hpp"

#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>
#include <tbb/task_arena.h>

#include <algorithm>

namespace parhelion::cloud {
namespace {

bool pool_running(int threads) {
  const int wanted = threads > 0 ? threads : tbb::this_task_arena::max_concurrency();
  return tbb::this_task_arena::current_thread_index() != tbb::task_arena::not_initialized &&
         tbb::this_task_arena::max_concurrency() == wanted;
}

}  // namespace

void with_threads(int threads, const std::function<void()>& work) {
  if (pool_running(threads)) {
    work();
  } else {
    tbb::task_arena(threads > 0 ? threads : tbb::task_arena::automatic).execute(work);
  }
}

void for_each_chunk(std::size_t size, std::size_t chunk_size, int threads,
                    const std::function<void(std::size_t, std::size_t, std::size_t)>& body) {
  const std::size_t chunks = (size + chunk_size - 1) / chunk_size;
  const auto one = [&](std::size_t chunk) {
    body(chunk, chunk * chunk_size, std::min(size, (chunk + 1) * chunk_size));
  };
  if (threads == 1 || chunks < 2) {
    for (std::size_t chunk = 0; chunk < chunks; ++chunk) one(chunk);
    return;
  }
  with_threads(threads, [&] { tbb::parallel_for(std::size_t{0}, chunks, one); });
}

void run_both(int threads, const std::function<void()>& a, const std::function<void()>& b) {
  if (threads == 1) {
    a();
    b();
    return;
  }
  with_threads(threads, [&] { tbb::parallel_invoke(a, b); });
}

}  // namespace parhelion::cloud
