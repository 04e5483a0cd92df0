#include "fusion/cloud/parallel.hpp"

#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>
#include <tbb/task_arena.h>

#include <algorithm>

namespace parhelion {
namespace {

int arena_size(int threads) { return threads > 0 ? threads : tbb::task_arena::automatic; }

}  // namespace

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
  tbb::task_arena(arena_size(threads)).execute([&] { tbb::parallel_for(std::size_t{0}, chunks, one); });
}

void do_both(int threads, const std::function<void()>& a, const std::function<void()>& b) {
  if (threads == 1) {
    a();
    b();
    return;
  }
  tbb::task_arena(arena_size(threads)).execute([&] { tbb::parallel_invoke(a, b); });
}

}  // namespace parhelion
