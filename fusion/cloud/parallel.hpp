// Loops over chunks whose bounds depend only on the size, so that any number of threads gives the same bits:
// each chunk writes only its own output, and partial results are added in the order of the chunks.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

namespace parhelion::cloud {

/// Calls body(chunk, begin, end) for [0, size) cut into pieces of `chunk_size`, on up to `threads` threads
/// (0: all; 1: in order on the caller's).
void for_each_chunk(std::size_t size, std::size_t chunk_size, int threads,
                    const std::function<void(std::size_t, std::size_t, std::size_t)>& body);

/// Runs `work` with a pool of `threads` threads for all loops within it, so that the threads are started
/// once.
void with_threads(int threads, const std::function<void()>& work);

/// Runs both, in parallel where there is more than one thread.
void run_both(int threads, const std::function<void()>& a, const std::function<void()>& b);

/// The sum of part(begin, end) over all chunks, added in their order. Sum: default is zero, has +=.
template <class Sum, class Part>
Sum sum_over_chunks(std::size_t size, std::size_t chunk_size, int threads, Part&& part) {
  std::vector<Sum> sums((size + chunk_size - 1) / chunk_size);
  for_each_chunk(size, chunk_size, threads, [&](std::size_t chunk, std::size_t begin, std::size_t end) {
    sums[chunk] = part(begin, end);
  });
  Sum total{};
  for (const Sum& sum : sums) total += sum;
  return total;
}

}  // namespace parhelion::cloud
